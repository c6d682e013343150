//! From a request to a trajectory, one bounded step at a time.
//!
//! ```text
//! Aim, Locate --> Survey --> Rest --> Compose --> Balance --> Compose --> Jump --> Verify, Load --> Finish
//!   | end, path    | reach,   | jerk   ^            |                   | strokes  | one time scale that keeps
//!   |              | limits,  |        +-- rounds --+                   | over the | every sample inside every
//!   |              | speeds   |        S-curve whose accelerations      | travel   | limit
//!   |              |          |        fill the torque limits
//!   +--------------+-------------------------------------------------> Refusal (reason, axis, value, limit)
//! ```
//!
//! Of an arc, Cruise between Survey and Rest finds the speed at which it can be kept.
//!
//! Constant joint acceleration limits would waste half of the robot: a SCARA is bounded by motor torque, and inertia
//! changes along the way. The planner therefore scales an S-curve to the torques of the model. Its jerk follows from the time in
//! which the motors take up their torque. Torque is affine in the path acceleration, so each round corrects the accelerations (speeding up and braking, next to rest and next to the peak speed) by the ratio of torque
//! left to torque needed there; in the last pass, inverse dynamics is quadratic in the time scale, and the planner solves for
//! the scale at which the worst sample touches its limit (Hollerbach, *Dynamic scaling of manipulator
//! trajectories*, 1984).

mod balance;
mod blend;
mod cost;
mod cruise;
mod jump;
mod survey;
mod verify;

use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::curve::MOST_PARTS;
use super::path::{Path, PathPoint};
use super::profile::{Bounds, HalfBounds, SCurve, Sample};
use super::request::{Request, Target, from_path};
use super::torque_budget::TorqueBudget;
use super::{Reference, Trajectory};
use crate::mechanics::arm::ArmModel;
use crate::mechanics::body::Torques;
use blend::Blend;
use jump::{Chamfer, Jump};
use survey::Apex;
use verify::Pass;

/// Corrections of the accelerations.
const ROUNDS: u8 = 3;
/// Samples of each half of the profile in one round, one next to rest and one next to the peak speed; the last round looks at the
/// middle between them, too.
const ENDS: u8 = 2;
/// Largest factor by which one sample of a round changes an acceleration.
const STEP: f32 = 1.6;
/// Least speed of the tool that can be asked for, m/s: across the work space that takes hours.
const LEAST_TOOL_SPEED: f32 = 1e-4;
/// Moves whose every axis travels less than this (rad or m) end where they begin.
const NO_TRAVEL: f32 = 1e-6;

/// Of a planner that has planned nothing yet. A constant: one that is built lies on the stack on its way.
const NO_PATH: Path = Path::Joint {
    start: Vector4::new(0.0, 0.0, 0.0, 0.0),
    delta: Vector4::new(0.0, 0.0, 0.0, 0.0),
    lift: None,
};

/// Progress of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Idle,
    /// Passage between two planned moves.
    Blend(Blend),
    /// Joint positions of the target.
    Aim {
        target: Target,
    },
    /// Path to them.
    Locate {
        target: Target,
        end: Vector4<f32>,
    },
    Survey {
        point: u8,
        fastest: Vector4<f32>,
        apex: Apex,
    },
    /// Torques at speed, at one place of an arc.
    Cruise {
        place: u8,
    },
    /// Torques at rest, at one of three places.
    Rest {
        place: u8,
    },
    /// Profile from the bounds, after this many corrections.
    Compose {
        round: u8,
    },
    Balance {
        round: u8,
        point: u8,
        /// New accelerations of the half, next to rest and next to the peak speed.
        wanted: [f32; 2],
    },
    /// Its motion is known.
    Weigh {
        here: PathPoint,
        along: Sample,
        round: u8,
        point: u8,
        wanted: [f32; 2],
    },
    /// How much higher than asked for one stroke of a jump should go.
    Raise {
        down: bool,
    },
    /// Its profile.
    Stroke {
        down: bool,
    },
    /// How long the travel waits for it.
    Lead {
        down: bool,
        knot: u8,
        chamfer: Option<Chamfer>,
        lead: f32,
    },
    /// Both strokes over the travel.
    Overlay,
    Verify,
    /// Its motion is known.
    Load {
        /// Time of the sample, s.
        t: f32,
        reference: Reference,
    },
    /// It needs more torque than there is, or a change of it that is too fast.
    Solve {
        /// Its torques, and speeds.
        full: Torques,
        qd: Vector4<f32>,
        /// Change of the torques since the sample before, and the time that they have for it, s.
        change: Torques,
        time: f32,
    },
    /// All samples have been checked.
    Finish,
}

/// Incremental planner; holds one request at a time.
#[derive(Clone, Copy, Debug)]
pub struct Planner {
    stage: Stage,
    draft: Trajectory,
    bounds: Bounds,
    speed: f32,
    /// Where the request is a jump.
    jump: Option<Jump>,
    /// Of an arc: where the arm is most nearly stretched, as a share of the way; in the last pass, when, s. Torques peak there within a
    /// small part of the time.
    apex: f32,
    pass: Pass,
    /// Whether the robot has limits of acceleration and jerk.
    caps: bool,
    /// Whether moves are for manual operation, in which the [tool](super::tool_speed) is slow.
    slow_tool: bool,
}

impl Planner {
    /// Number of calls of [`Planner::work`] after which a plan is complete or refused.
    pub const MAX_STEPS: u32 = {
        let locate = 2;
        let survey = MOST_PARTS as u32 + 2 + cruise::PLACES as u32 + 3;
        let compose = ROUNDS as u32 + 1;
        let balance = 4 * (ROUNDS as u32 * ENDS as u32 + 1);
        // Its ends, its apex, and the borders of the travel's segments; motion, torques and scale. A jump has fewer steps than an arc, and the borders of
        // its strokes.
        let verify = 3 * (2 * MOST_PARTS as u32 + 3 + 12);
        let finish = 1;
        locate + survey + compose + balance + jump::STEPS + verify + finish
    };

    /// An idle planner.
    pub fn new() -> Self {
        Self {
            stage: Stage::Idle,
            draft: Trajectory {
                path: NO_PATH,
                profile: SCurve::default(),
                start: 0.0,
                span: 0.0,
                time_scale: 1.0,
                end: Vector4::zeros(),
                zone: 0.0,
                overlap: 0.0,
                tool_speed: 0.0,
                sequence: 0,
            },
            bounds: Bounds {
                speed: 1.0,
                jerk: 1.0,
                accelerate: HalfBounds::even(1.0, 1.0),
                brake: HalfBounds::even(1.0, 1.0),
            },
            speed: 1.0,
            jump: None,
            apex: 0.0,
            pass: Pass::begin(),
            caps: false,
            slow_tool: false,
        }
    }

    /// Whether no request is being planned.
    pub fn is_idle(&self) -> bool {
        matches!(self.stage, Stage::Idle)
    }

    /// Drops the current request and returns its number.
    pub fn cancel(&mut self) -> Option<u8> {
        let planning = !self.is_idle() && !self.is_blending();
        self.stage = Stage::Idle;
        planning.then_some(self.draft.sequence)
    }

    /// Number of the current request, or of the last one.
    pub fn sequence(&self) -> u8 {
        self.draft.sequence
    }

    /// Whether the moves planned from now on are for manual operation: no point of the tool is faster than
    /// [`PLANNED`](super::tool_speed::PLANNED).
    pub fn keep_tool_slow(&mut self, slow: bool) {
        self.slow_tool = slow;
    }

    /// Takes a request for a move from the joint positions `from`.
    pub fn begin(&mut self, request: &Request, from: &Vector4<f32>) {
        self.speed = request.speed;
        self.draft.tool_speed = request.tool_speed;
        self.draft.zone = request.zone;
        self.draft.sequence = request.sequence;
        self.draft.end = *from;
        self.stage = Stage::Aim {
            target: request.target,
        };
    }

    /// One step of planning: one sample of the move, or one profile. When the plan is complete, `Ok`
    /// means that [`Planner::trajectory`] holds the requested trajectory, and `Err` why there is none.
    pub fn work(&mut self, budget: &TorqueBudget<'_>) -> Option<Result<(), Refusal>> {
        let step = match self.stage {
            Stage::Idle | Stage::Blend(_) => return None,
            Stage::Aim { target } => self.aim(budget.arm, target),
            Stage::Locate { target, end } => self.locate(budget.arm, &target, &end),
            Stage::Survey {
                point,
                fastest,
                apex,
            } => self.survey(budget, point, fastest, apex),
            Stage::Cruise { place } => self.cruise(budget, place),
            Stage::Rest { place } => self.rest(budget, place),
            Stage::Raise { down } => {
                self.raise(budget, down);
                Ok(())
            }
            Stage::Stroke { down } => {
                self.stroke(budget, down);
                Ok(())
            }
            Stage::Lead {
                down,
                knot,
                chamfer,
                lead,
            } => {
                self.lead(budget.arm, down, knot, chamfer, lead);
                Ok(())
            }
            Stage::Overlay => {
                self.overlay();
                Ok(())
            }
            Stage::Compose { round } => {
                self.compose(budget.arm, round);
                Ok(())
            }
            Stage::Balance {
                round,
                point,
                wanted,
            } => self.balance(budget, round, point, wanted),
            Stage::Weigh {
                here,
                along,
                round,
                point,
                wanted,
            } => {
                self.weigh(budget, (&here, &along), round, point, wanted);
                Ok(())
            }
            Stage::Verify => self.verify(budget),
            Stage::Load { t, reference } => {
                self.load(budget, t, &reference);
                Ok(())
            }
            Stage::Solve {
                full,
                qd,
                change,
                time,
            } => {
                self.solve(budget, (&full, &qd), (&change, time));
                Ok(())
            }
            Stage::Finish => self.finish(budget),
        };
        if step.is_err() {
            self.stage = Stage::Idle;
        }
        match step {
            Ok(()) if !self.is_idle() => None,
            done => Some(done),
        }
    }

    /// The last trajectory planned.
    pub fn trajectory(&self) -> &Trajectory {
        &self.draft
    }

    /// The end of the move: inverse kinematics are as much as a step of planning.
    #[inline(never)]
    fn aim(&mut self, arm: &ArmModel, target: Target) -> Result<(), Refusal> {
        if !(self.speed > 0.0 && self.speed <= 1.0) {
            return Err(Refusal::value(RefusalReason::OutOfRange, self.speed, 1.0));
        }
        let tool_speed = self.draft.tool_speed;
        if tool_speed.is_nan() || tool_speed != 0.0 && tool_speed < LEAST_TOOL_SPEED {
            let limit = LEAST_TOOL_SPEED;
            return Err(Refusal::value(RefusalReason::OutOfRange, tool_speed, limit));
        }
        let end = target.end(arm, &self.draft.end)?;
        self.stage = Stage::Locate { target, end };
        Ok(())
    }

    /// The path to the target.
    #[inline(never)]
    fn locate(
        &mut self,
        arm: &ArmModel,
        target: &Target,
        end: &Vector4<f32>,
    ) -> Result<(), Refusal> {
        let (path, gate) = target.path(arm, &self.draft.end, end)?;
        self.jump = gate.map(|gate| Jump::new(gate, self.slow_tool));
        self.draft.path = path;
        self.draft.start = 0.0;
        self.draft.time_scale = 1.0;
        self.caps = arm.limits.caps_acceleration();
        // For a path along which nothing moves.
        self.draft.profile = SCurve::default();
        self.stage = Stage::Survey {
            point: 0,
            fastest: Vector4::zeros(),
            apex: Apex::NONE,
        };
        Ok(())
    }

    fn point(&self, arm: &ArmModel, s: f32) -> Result<PathPoint, Refusal> {
        self.draft.path.at(arm, s).map_err(from_path)
    }
}

impl Default for Planner {
    fn default() -> Self {
        Self::new()
    }
}
