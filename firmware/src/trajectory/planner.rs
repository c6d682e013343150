//! From a request to a trajectory, one bounded step at a time.
//!
//! ```text
//! Survey --> Stroke x 2 --> Compose --> Balance --> Compose --> Verify --> Trajectory
//!   | reach,   (jumps:        ^           |           | one time scale that keeps
//!   | limits,   the lift)     +-- rounds--+           | every sample inside every limit
//!   | speeds                   S-curve whose accelerations fill the torque limits
//!   +--------------------------------------> Refusal (reason, axis, value, limit)
//! ```
//!
//! Constant joint acceleration limits would waste half of the robot: what bounds a SCARA is motor
//! torque, and inertia changes along the way. The planner therefore scales an S-curve to the
//! torques of the model. Torque is affine in the path acceleration, so each round corrects the
//! two accelerations (speeding up, braking) by the worst ratio of torque left to torque needed;
//! the last pass uses that inverse dynamics is quadratic in the time scale and solves for the
//! scale at which the worst sample touches its limit (Hollerbach, *Dynamic scaling of manipulator
//! trajectories*, 1984).

use nalgebra::Vector4;
use protocol::messages::{Refusal, RefusalReason};

use super::capacity::Capacity;
use super::path::{Path, PathPoint, check_limits};
use super::profile::{Bounds, SCurve};
use super::request::{Gate, Request, from_ik, from_path};
use super::{Lift, Trajectory};
use crate::arm::ArmModel;

/// Points of the survey of a line.
const SURVEY_POINTS: u8 = 24;
/// Corrections of the two accelerations.
const ROUNDS: u8 = 4;
/// Samples of each half of the profile in one round.
const BALANCE_POINTS: u8 = 8;
/// Samples of the last pass.
const VERIFY_POINTS: u8 = 80;
/// Share of the limits of speed, acceleration and jerk that the samples of a line may use.
const LINE_SHARE: f32 = 0.9;
/// A correction of an acceleration by more than this factor waits for the next round.
const STEP: f32 = 1.6;
/// Moves whose every axis travels less than this (rad or m) end where they begin.
const NO_TRAVEL: f32 = 1e-6;

/// Progress of the plan.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Stage {
    Idle,
    Survey {
        point: u8,
        fastest: Vector4<f32>,
    },
    /// One vertical stroke of a jump.
    Stroke {
        down: bool,
    },
    /// Profile from the bounds, after this many corrections.
    Compose {
        round: u8,
    },
    Balance {
        round: u8,
        point: u8,
        gain: [f32; 2],
    },
    Verify {
        point: u8,
        rate: f32,
        before: Option<Vector4<f32>>,
    },
}

/// Incremental planner; holds one request at a time.
#[derive(Clone, Copy, Debug)]
pub struct Planner {
    stage: Stage,
    draft: Trajectory,
    bounds: Bounds,
    speed: f32,
    /// Heights of a jump.
    gate: Option<Gate>,
    /// Time from the beginning of the descent until the clearance is reached, s.
    blended: f32,
}

impl Planner {
    /// Calls of [`Planner::work`] after which a plan is complete or refused.
    pub const MAX_STEPS: u32 = {
        let survey = SURVEY_POINTS as u32 + 1;
        let strokes = 2;
        let compose = ROUNDS as u32 + 1;
        let balance = ROUNDS as u32 * 2 * BALANCE_POINTS as u32;
        let verify = VERIFY_POINTS as u32 + 1;
        survey + strokes + compose + balance + verify
    };

    /// An idle planner.
    pub fn new() -> Self {
        Self {
            stage: Stage::Idle,
            draft: Trajectory {
                path: Path::Joint {
                    start: Vector4::zeros(),
                    delta: Vector4::zeros(),
                },
                profile: SCurve::default(),
                start: 0.0,
                lift: None,
                span: 0.0,
                rate: 1.0,
                braking: Vector4::zeros(),
                end: Vector4::zeros(),
                sequence: 0,
            },
            bounds: Bounds {
                speed: 1.0,
                accelerate: 1.0,
                brake: 1.0,
                jerk: 1.0,
            },
            speed: 1.0,
            gate: None,
            blended: 0.0,
        }
    }

    /// Whether no request is being planned.
    pub fn is_idle(&self) -> bool {
        self.stage == Stage::Idle
    }

    /// Forgets the request at hand and returns its number.
    pub fn cancel(&mut self) -> Option<u8> {
        let planning = !self.is_idle();
        self.stage = Stage::Idle;
        planning.then_some(self.draft.sequence)
    }

    /// Number of the request at hand, or of the last one.
    pub fn sequence(&self) -> u8 {
        self.draft.sequence
    }

    /// Takes a request for a move from the joint positions `from`.
    ///
    /// # Errors
    /// A target that is not finite, out of reach or outside a limit is refused at once.
    pub fn begin(
        &mut self,
        arm: &ArmModel,
        request: &Request,
        from: &Vector4<f32>,
    ) -> Result<(), Refusal> {
        self.stage = Stage::Idle;
        if !(request.speed > 0.0 && request.speed <= 1.0) {
            return Err(Refusal::value(
                RefusalReason::OutOfRange,
                request.speed,
                1.0,
            ));
        }
        let (path, gate) = request.target.path(arm, from)?;
        self.gate = gate;
        self.speed = request.speed;
        self.draft = Trajectory {
            path,
            profile: SCurve::default(),
            start: 0.0,
            lift: None,
            span: 0.0,
            rate: 1.0,
            braking: Vector4::zeros(),
            end: *from,
            sequence: request.sequence,
        };
        self.stage = Stage::Survey {
            point: 0,
            fastest: Vector4::zeros(),
        };
        Ok(())
    }

    /// One step of planning: one sample of the move, or one profile. Returns the trajectory or the
    /// refusal when the plan is complete.
    pub fn work(&mut self, capacity: &Capacity<'_>) -> Option<Result<Trajectory, Refusal>> {
        let done = match self.stage {
            Stage::Idle => return None,
            Stage::Survey { point, fastest } => {
                self.survey(capacity, point, fastest).map(|()| None)
            }
            Stage::Stroke { down } => {
                self.stroke(capacity, down);
                Ok(None)
            }
            Stage::Compose { round } => {
                self.compose(round);
                Ok(None)
            }
            Stage::Balance { round, point, gain } => {
                self.balance(capacity, round, point, gain).map(|()| None)
            }
            Stage::Verify {
                point,
                rate,
                before,
            } => self.verify(capacity, point, rate, before),
        };
        let result = done.transpose()?;
        self.stage = Stage::Idle;
        Some(result)
    }

    /// Reach, limits and the largest joint travel per unit of path.
    fn survey(
        &mut self,
        capacity: &Capacity<'_>,
        point: u8,
        fastest: Vector4<f32>,
    ) -> Result<(), Refusal> {
        let s = f32::from(point) / f32::from(SURVEY_POINTS);
        let here = self.point(capacity.arm, s)?;
        check_limits(capacity.arm, &here.q).map_err(from_ik)?;
        let fastest = fastest.sup(&here.dq.abs());
        // A path straight in joint space lies between its ends, which are within the limits.
        let last = matches!(self.draft.path, Path::Joint { .. }) || point >= SURVEY_POINTS;
        if !last {
            self.stage = Stage::Survey {
                point: point + 1,
                fastest,
            };
            return Ok(());
        }
        let limits = &capacity.arm.limits;
        let fill = |limit: &Vector4<f32>| {
            limit
                .iter()
                .zip(fastest.iter())
                .filter(|(_, travel)| **travel > NO_TRAVEL)
                .map(|(limit, travel)| limit / travel)
                .fold(f32::MAX, f32::min)
        };
        let speed = fill(&capacity.speed());
        if speed == f32::MAX {
            // Nothing travels along the path: at most the lift of a jump moves.
            self.bounds.speed = 0.0;
        } else {
            let acceleration = fill(&limits.acceleration);
            self.bounds = Bounds {
                speed,
                accelerate: acceleration,
                brake: acceleration,
                jerk: fill(&limits.jerk),
            };
        }
        self.stage = if self.gate.is_some() {
            Stage::Stroke { down: false }
        } else {
            Stage::Compose { round: 0 }
        };
        Ok(())
    }

    /// One sample of one half; at the end of a round, new accelerations.
    fn balance(
        &mut self,
        capacity: &Capacity<'_>,
        round: u8,
        point: u8,
        gain: [f32; 2],
    ) -> Result<(), Refusal> {
        let profile = &self.draft.profile;
        let braking = point >= BALANCE_POINTS;
        let share = (f32::from(point % BALANCE_POINTS) + 0.5) / f32::from(BALANCE_POINTS);
        let (from, to) = if braking {
            (profile.brake_start(), profile.duration())
        } else {
            (0.0, profile.accelerate_end())
        };
        let along = profile.at(from + share * (to - from));
        let here = self.point(capacity.arm, along.s)?;
        let [mut speeding_gain, mut braking_gain] = gain;
        let room = capacity.acceleration_room(&here, &along);
        if braking {
            braking_gain = braking_gain.min(room);
        } else {
            speeding_gain = speeding_gain.min(room);
        }
        if point + 1 < 2 * BALANCE_POINTS {
            self.stage = Stage::Balance {
                round,
                point: point + 1,
                gain: [speeding_gain, braking_gain],
            };
            return Ok(());
        }
        let (up, down) = profile.peaks();
        let ceiling = self.acceleration_ceiling(capacity.arm);
        let correct = |peak: f32, gain: f32| (peak * gain.max(1.0 / STEP)).min(ceiling);
        self.bounds.accelerate = correct(up, speeding_gain);
        self.bounds.brake = correct(down, braking_gain);
        self.stage = Stage::Compose { round: round + 1 };
        Ok(())
    }

    /// One sample of the whole move; at the end, the trajectory. `before` is the acceleration of
    /// the sample before.
    fn verify(
        &mut self,
        capacity: &Capacity<'_>,
        point: u8,
        rate: f32,
        before: Option<Vector4<f32>>,
    ) -> Result<Option<Trajectory>, Refusal> {
        let interval = self.draft.span / f32::from(VERIFY_POINTS);
        let t = interval * f32::from(point);
        let mut reference = self.draft.at(capacity.arm, t).map_err(from_path)?;
        // Along a line the joint accelerations bend between the samples, and the jerk has a part
        // that only their difference shows. Straight in joint space all of it is exact.
        let curved = matches!(self.draft.path, Path::Line { .. });
        if curved && let Some(before) = before {
            reference.qddd = (reference.qdd - before) / interval;
        }
        let share = if curved { LINE_SHARE } else { 1.0 };
        let rate = rate.min(capacity.time_scale(&reference, share)?);
        self.draft.braking = self.draft.braking.sup(&reference.qdd.abs());
        if point < VERIFY_POINTS {
            self.stage = Stage::Verify {
                point: point + 1,
                rate,
                before: Some(reference.qdd),
            };
            return Ok(None);
        }
        let mut trajectory = self.draft;
        // Past the end, so that rounding of the last sample cannot leave the arm short of it.
        trajectory.end = self.draft.at(capacity.arm, t + 1.0).map_err(from_path)?.q;
        trajectory.braking *= rate * rate;
        trajectory.rate = rate * self.speed;
        Ok(Some(trajectory))
    }

    fn point(&self, arm: &ArmModel, s: f32) -> Result<PathPoint, Refusal> {
        self.draft.path.at(arm, s).map_err(from_path)
    }

    /// The joint accelerations' own limits, as a limit along the path.
    fn acceleration_ceiling(&self, arm: &ArmModel) -> f32 {
        match &self.draft.path {
            Path::Joint { delta, .. } => arm
                .limits
                .acceleration
                .iter()
                .zip(delta.iter())
                .filter(|(_, travel)| travel.abs() > NO_TRAVEL)
                .map(|(limit, travel)| limit / travel.abs())
                .fold(f32::MAX, f32::min),
            // Varies along a line; the last pass sees to it.
            Path::Line { .. } => f32::MAX,
        }
    }

    /// The profile of one vertical stroke, and when it passes the clearance.
    fn stroke(&mut self, capacity: &Capacity<'_>, down: bool) {
        let (Some(gate), Path::Joint { start, .. }) = (self.gate, &self.draft.path) else {
            self.stage = Stage::Compose { round: 0 };
            return;
        };
        let (up_bounds, down_bounds) = capacity.lift(gate.rise.max(gate.fall));
        let lift = self.draft.lift.get_or_insert(Lift {
            from: start.z,
            up: SCurve::default(),
            down: SCurve::default(),
            down_start: 0.0,
        });
        self.stage = if down {
            lift.down = stroke(gate.fall, &down_bounds);
            self.blended = lift.down.time_at(gate.fall - gate.clearance.min(gate.fall));
            Stage::Compose { round: 0 }
        } else {
            lift.up = stroke(gate.rise, &up_bounds);
            self.draft.start = lift.up.time_at(gate.clearance.min(gate.rise));
            Stage::Stroke { down: true }
        };
    }

    /// Profile from the bounds, and how the strokes of a jump lie over it in time.
    fn compose(&mut self, round: u8) {
        let travels = self.bounds.speed > 0.0;
        if travels {
            self.draft.profile = SCurve::new(1.0, &self.bounds);
        }
        let arrival = self.draft.start + self.draft.profile.duration();
        self.draft.span = match &mut self.draft.lift {
            None => arrival,
            Some(lift) => {
                lift.down_start = (arrival - self.blended).max(lift.up.duration());
                lift.down_start + lift.down.duration()
            }
        };
        self.stage = if travels && round < ROUNDS {
            Stage::Balance {
                round,
                point: 0,
                gain: [STEP; 2],
            }
        } else {
            Stage::Verify {
                point: 0,
                rate: 1.0,
                before: None,
            }
        };
    }
}

impl Default for Planner {
    fn default() -> Self {
        Self::new()
    }
}

/// A profile over a length that may be nothing.
fn stroke(length: f32, bounds: &Bounds) -> SCurve {
    if length > NO_TRAVEL {
        SCurve::new(length, bounds)
    } else {
        SCurve::default()
    }
}
