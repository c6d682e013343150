//! Checked setup of a run: from a scenario and two robots to a rig.

mod encoder;

use firmware::mechanics::arm::{self, ArmModel};
use nalgebra::Vector4;
use protocol::time::Period;
use protocol::wire::BitTiming;

use crate::bus::Overload;
use crate::maths::hypot;
use crate::model::{AXES, JointLimits, RobotModel};
use crate::plant::Plant;
use crate::plant::arm::Arm;
use crate::plant::kinematics::{Pose, Unreachable, Violation, inverse};
use crate::plant::stop::resolvable_step;
use crate::rig::{self, RigConfig};
use crate::scenario::{Elbow, Scenario, ScenarioError, Step};
use crate::text::lines;

/// Samples that a torque has to build up in: with fewer, a cycle takes longer than with more, which the steps between two commands are
/// the reason of. From four on a shorter time still makes it faster.
const RISE_SAMPLES: f64 = 2.0;

/// Configuration of a run.
#[derive(Clone, Debug)]
pub struct RunConfig {
    /// Motion, law, payload, mismatch.
    pub scenario: Scenario,
    /// The robot as the controller knows it.
    pub nominal: RobotModel,
    /// The robot as it is, before the scenario's mismatch.
    pub actual: RobotModel,
}

/// Why a run cannot begin.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The robot cannot do what the scenario requires.
    #[error(transparent)]
    Scenario(#[from] ScenarioError),
    /// The start of the scenario is outside the robot's workspace.
    #[error(
        "scenario {scenario}: the start pose x {x}, y {y}, z {z}, yaw {yaw} is outside the workspace of {robot}: {why}"
    )]
    Start {
        /// Scenario.
        scenario: String,
        /// Robot.
        robot: String,
        /// Pose.
        x: f64,
        /// Pose.
        y: f64,
        /// Pose.
        z: f64,
        /// Pose.
        yaw: f64,
        /// What is in the way, and what would not be.
        why: String,
    },
    /// The controller cannot use the model.
    #[error("model {robot}: {source}")]
    Model {
        /// Robot.
        robot: String,
        /// Reason.
        source: arm::ModelError,
    },
    /// The simulation cannot resolve the robot on its end stops.
    #[error(
        "model {robot}: a joint on its end stop needs steps of {step_us} us, below the shortest, {} us: a centre of mass is too \
         far out, or a link too heavy, beside the inertia of the others",
        Plant::MIN_STEP_NS / 1000
    )]
    Stiff {
        /// Robot.
        robot: String,
        /// Step that it needs, us.
        step_us: f64,
    },
    /// Gains that the encoders bear do not hold the arm.
    #[error(
        "{subject}, too coarse at {rate_hz} Hz: a count would be {percent:.0} % of the \
         torque limit of the {axis}, and a loop that bears that has a bandwidth of {bandwidth:.1} rad/s, which hardly holds the arm; \
         allowed: {least} counts or more{slower}, or give gains.bandwidth and gains.observer"
    )]
    Coarse {
        /// Robot, counts of its encoders and what it carries.
        subject: String,
        /// Control rate.
        rate_hz: f64,
        /// Share of the torque limit with the usual gains, %.
        percent: f64,
        /// Of this axis.
        axis: &'static str,
        /// Bandwidth that is left, rad/s.
        bandwidth: f64,
        /// Least number of counts.
        least: f64,
        /// Rate at which these suffice, if there is one.
        slower: String,
    },
    /// The bus cannot carry the messages at this rate.
    #[error("at {rate_hz} Hz the {source}; lower the rate, to {most} Hz at the most")]
    Link {
        /// Control rate.
        rate_hz: f64,
        /// Greatest rate in whole Hz that it can carry.
        most: u32,
        /// Load.
        source: Overload,
    },
    /// Several of these.
    #[error("{}", lines(.0))]
    Several(Vec<SetupError>),
}

impl RunConfig {
    /// This scenario with the default robot, without mismatch of the model.
    pub fn new(scenario: Scenario) -> Self {
        Self {
            scenario,
            nominal: RobotModel::irb_930_22_105(),
            actual: RobotModel::irb_930_22_105(),
        }
    }

    /// The rig for the run.
    ///
    /// # Errors
    /// The robot cannot reach the start, the controller cannot use the model, or the bus cannot carry the messages.
    pub fn rig(&self) -> Result<RigConfig, SetupError> {
        let scenario = &self.scenario;
        let nominal = ArmModel::from(&self.nominal);
        let mut actual = self.actual.clone();
        for axis in 0..4 {
            actual.drive.viscous[axis] *= scenario.mismatch.friction;
            actual.drive.coulomb[axis] *= scenario.mismatch.friction;
        }
        let timing = BitTiming::default();
        let mut wrong = Vec::new();
        wrong.extend(
            scenario
                .check_with(
                    &self.nominal,
                    &self.own_gains(),
                    rig::command_delay(&timing),
                )
                .err()
                .map(SetupError::from),
        );
        wrong.extend(nominal.validate().err().map(|source| SetupError::Model {
            robot: self.nominal.name.clone(),
            source,
        }));
        let step = resolvable_step(&actual);
        if step < Plant::MIN_STEP_NS {
            wrong.push(SetupError::Stiff {
                robot: actual.name.clone(),
                step_us: step as f64 * 1e-3,
            });
        }
        wrong.extend(self.too_coarse());
        let load = rig::admit(&timing, scenario.rate_hz);
        wrong.extend(load.err().map(|source| SetupError::Link {
            rate_hz: scenario.rate_hz,
            most: greatest_rate(&timing, scenario.rate_hz as u32),
            source,
        }));
        let start = start(scenario, &actual).map_err(|error| wrong.push(error));
        if let (Ok(start), []) = (start, wrong.as_slice()) {
            return Ok(RigConfig {
                start,
                actual,
                nominal,
                period: Period::of_rate(scenario.rate_hz),
                timing,
            });
        }
        Err(if wrong.len() == 1 {
            wrong.remove(0)
        } else {
            SetupError::Several(wrong)
        })
    }

    /// What can be run, and will not go as well as one may think.
    pub fn warnings(&self) -> Vec<String> {
        let rate = self.scenario.rate_hz;
        let (timing, limits) = (BitTiming::default(), &self.nominal.limits);
        let mut warnings = Vec::new();
        let answer = rig::slowest_answer(&timing).seconds();
        if answer * rate > 1.0 && rig::admit(&timing, rate).is_ok() {
            warnings.push(format!(
                "at {rate} Hz some commands come after the next sample: with another frame in its way a command is there {:.0} us after \
                 its sample, and the next one is taken after {:.0} us; up to {:.0} Hz every one is in time",
                answer * 1e6,
                1e6 / rate,
                (1.0 / answer).floor()
            ));
        }
        let least = RISE_SAMPLES / rate;
        let short = AXES
            .iter()
            .zip(limits.effort_rise_time)
            .find(|(_, time)| *time < least);
        if let Some((axis, time)) = short {
            warnings.push(format!(
                "model {}: joint_limits.effort_rise_time_s of the {axis} is {time} s, less than two samples at {rate} Hz: a command holds \
                 for a whole sample, so that motors come to their limits and moves are slowed down instead of getting faster; say \
                 {least} s or more, or raise the rate",
                self.nominal.name
            ));
        }
        warnings.extend(self.coarse());
        warnings.extend(self.lags());
        warnings
    }

    /// Target of the tool at the end of a cycle: x, y, z (m) and yaw (rad) in frame 0; none after a stop on the path.
    pub fn cycle_target(&self) -> Option<[f64; 4]> {
        let mut target = Some(self.scenario.start);
        for step in &self.scenario.cycle {
            if matches!(step, Step::Stop(_) | Step::Estop(_)) {
                target = None;
            }
            target = self.target(step).or(target);
        }
        target
    }

    /// Where a step moves the tool: x, y, z, yaw; `None` where it is no move.
    pub(crate) fn target(&self, step: &Step) -> Option<[f64; 4]> {
        match step {
            Step::Jump(jump) => Some(jump.to),
            Step::Line(line) => Some(line.to),
            Step::Arc(arc) => Some(arc.to),
            Step::Joints(joints) => {
                let arm = Arm::new(&self.actual, None);
                let pose = arm.pose(&arm.at(&joints.to.into()));
                Some([pose.x, pose.y, pose.z, pose.yaw])
            }
            _ => None,
        }
    }
}

/// The greatest rate (whole Hz) below this one that the bus can carry.
fn greatest_rate(timing: &BitTiming, above: u32) -> u32 {
    let (mut carried, mut refused) = (0, above.saturating_add(1));
    while refused - carried > 1 {
        let rate = carried.midpoint(refused);
        match rig::admit(timing, rate.into()) {
            Ok(_) => carried = rate,
            Err(_) => refused = rate,
        }
    }
    carried
}

/// Joint positions at the start.
fn start(scenario: &Scenario, robot: &RobotModel) -> Result<[f64; 4], SetupError> {
    let [x, y, z, yaw] = scenario.start;
    let why = match inverse(&robot.geometry, &robot.limits, &Pose { x, y, z, yaw }) {
        Ok(solutions) => {
            let turn = scenario.start_turn;
            let [positive, negative] = solutions.map(|it| it.in_turn(&robot.limits, turn));
            let (asked, other, key) = match scenario.start_elbow {
                None | Some(Elbow::Positive) => (positive, negative, Elbow::Negative),
                Some(Elbow::Negative) => (negative, positive, Elbow::Positive),
            };
            let Some(violation) = asked.violation else {
                return Ok(asked.q.into());
            };
            let mut why = out_of_range(violation, robot, &asked.q);
            if let Violation::TooHigh | Violation::TooLow = violation {
                // The flange goes down as the lift goes up its axis.
                let limits = [robot.limits.upper[2], robot.limits.lower[2]];
                let [low, high] = limits.map(|limit| z + asked.q[2] - limit);
                why += &format!(", which is z from {low:.6} to {high:.6} m");
            }
            if let (Violation::Wrist, Some(turn)) = (violation, turn) {
                why += &format!(", in start_turn = {turn}");
            }
            if other.violation.is_none() {
                why += &format!(". With start_elbow = \"{key}\" the robot reaches it");
            }
            why
        }
        Err(unreachable) => {
            let radius = hypot(x, y);
            let (outer, inner) = (
                robot.geometry.a1 + robot.geometry.a2,
                (robot.geometry.a1 - robot.geometry.a2).abs(),
            );
            match unreachable {
                Unreachable::TooFar => {
                    format!(
                        "it is {radius:.6} m from axis 1, and the stretched arm reaches {outer:.6} m"
                    )
                }
                Unreachable::InsideHole => {
                    format!(
                        "it is {radius:.6} m from axis 1, and the folded arm comes no nearer than {inner:.6} m"
                    )
                }
            }
        }
    };
    Err(SetupError::Start {
        scenario: scenario.name.clone(),
        robot: robot.name.clone(),
        x,
        y,
        z,
        yaw,
        why,
    })
}

/// Which axis would be out of its range, where, and what is allowed.
fn out_of_range(violation: Violation, robot: &RobotModel, q: &Vector4<f64>) -> String {
    let (axis, name, unit) = match violation {
        Violation::Shoulder => (0, "shoulder", "rad"),
        Violation::Elbow => (1, "elbow", "rad"),
        Violation::TooHigh | Violation::TooLow => (2, "lift", "m"),
        Violation::Wrist => (3, "wrist", "rad"),
    };
    let JointLimits { lower, upper, .. } = &robot.limits;
    // With as many digits as it takes to see that it is outside.
    let text = |digits: usize| format!("{:.digits$}", q[axis]);
    let is_outside = |text: &String| {
        let shown = text.parse().unwrap_or(q[axis]);
        !(lower[axis]..=upper[axis]).contains(&shown)
    };
    let shown = [6, 9, 12].map(text).into_iter().find(is_outside);
    format!(
        "axis {name} would have to be at {} {unit}; allowed: {} to {} {unit}",
        shown.unwrap_or_else(|| q[axis].to_string()),
        lower[axis],
        upper[axis]
    )
}
