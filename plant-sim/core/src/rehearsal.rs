//! A scenario without robot, drives and bus: the controller is asked what the operator of a run asks it, plans, and follows
//! its plans on an arm that is always where it is to be.
//!
//! It is the controller of a run, so what it refuses here it refuses there, and for the same reasons. Torques are those that
//! its model needs for the planned motion. Whether law, gains and rate can follow the plan is tried in a cycle on the robot that
//! the controller believes in.

mod heat;
mod plan;
mod trial;

use std::collections::VecDeque;

use firmware::control::controller::{Config, Controller};
use firmware::control::readings::Readings;
use firmware::control::states::Event;
use firmware::mechanics::arm::ArmModel;
use firmware::mechanics::body::Body;
use firmware::mechanics::kinematics::Trig;
use firmware::trajectory::Rates;
use nalgebra::Vector4;
use protocol::messages::{
    Cause, Compensation, ControlWord, DriveStatus, Law, Mode, MotionRequest, Outcome,
};
use protocol::time::Duration;

pub use plan::{Move, Plan, Refused};

use crate::operator::program::{Action, Program, Task};
use crate::scenario::Ending;
use crate::setup::{RunConfig, SetupError};
use crate::world::{CellEvent, OperatorError, Spot, Unused};

/// Distance within which a cycle ends where it began, rad and m: roundings of f32, and far below what matters.
const SAME: f32 = 1e-5;
/// Longest wait for anything but a move.
const PATIENCE: Duration = Duration::from_secs(2);

/// A law that remembers nothing; the scenario's own has been selected, and refused where it would be, before it.
const WITHOUT_MEMORY: MotionRequest = MotionRequest::SelectLaw {
    law: Law::ComputedTorqueJoint,
    compensation: Compensation::None,
};

/// Plans a scenario. After a refusal it goes on to the end of the cycle, from where the arm then is: whoever mends one step
/// wants to know of the others.
///
/// # Errors
/// The run could not begin.
pub fn rehearse(config: &RunConfig) -> Result<Plan, SetupError> {
    let rig = config.rig()?;
    let scenario = &config.scenario;
    let mut stage = Stage::new(rig.controller(), rig.start.map(|q| q as f32).into());
    let cycles = u64::from(scenario.cycles);
    let (mut done, mut begun, mut from) = (0, 0, stage.pose());
    let mut repeated = 0;
    let mut refused: Vec<Refused> = Vec::new();
    for Task { action, spot } in Program::new(&config.asked()) {
        match action {
            Action::Cell(CellEvent::BeginCycle) => {
                (begun, from) = (stage.samples, stage.pose());
                stage.cycle = heat::Cycle::default();
            }
            Action::Cell(CellEvent::EndCycle) => {
                done += 1;
                if !refused.is_empty() {
                    break;
                }
                if stage.is_at(&from) {
                    // The others are the same.
                    repeated = (cycles - done) * (stage.samples - begun);
                    break;
                }
            }
            // The end of the run.
            Action::EmergencyStop => break,
            _ => match stage.act(&action, spot) {
                Ok(()) => {}
                Err(refusal @ OperatorError::Refused { .. }) => refused.push(refusal.into()),
                Err(end) => {
                    refused.push(end.into());
                    break;
                }
            },
        }
    }
    let mut warnings = config.warnings();
    if refused.is_empty() {
        refused.extend(trial::failure(config));
        match stage
            .cycle
            .foresee(scenario.cycles, f64::from(stage.period))
        {
            Some(Ok(warning)) => warnings.push(warning),
            Some(Err(reason)) if scenario.ends == Ending::Completed => refused.push(Refused {
                cycle: None,
                step: None,
                reason,
            }),
            _ => {}
        }
    }
    Ok(Plan {
        scenario: scenario.name.clone(),
        robot: config.nominal.name.clone(),
        cycles: scenario.cycles,
        duration_s: (stage.samples + repeated) as f64 * f64::from(stage.period),
        torque_utilisation: stage.torque,
        speed_utilisation: stage.speed,
        moves: stage.moves,
        heat: stage.cycle.for_ever(1.0),
        warnings,
        refused,
    })
}

/// The controller, and an arm that is always where it is to be.
struct Stage {
    controller: Controller,
    arm: ArmModel,
    /// The arm with the payload that was announced last.
    body: Body,
    period: f32,
    /// What was commanded last.
    control: ControlWord,
    motor_torque: Vector4<f32>,
    /// Where the arm was a sample ago.
    before: Vector4<f32>,
    samples: u64,
    sequence: u8,
    /// Whether the operator holds moves, in manual operation.
    holds: bool,
    moves: Vec<Move>,
    /// Whether an override of 0 holds the arm.
    held: bool,
    /// Numbers of the moves, from the one under way on.
    under_way: VecDeque<(u8, usize)>,
    torque: [f64; 4],
    speed: [f64; 4],
    /// What the motors give in the last cycle.
    cycle: heat::Cycle,
}

impl Stage {
    fn new(mut config: Config, start: Vector4<f32>) -> Self {
        // What moves this arm is not the torque.
        config.setup.monitor.collision = f32::MAX;
        let mut controller = Controller::new(config);
        controller.event(Event::SelfTestPassed);
        controller.event(Event::PeerReady);
        let mut stage = Self {
            controller,
            arm: config.arm,
            body: Body::new(&config.arm, &config.setup.payload),
            period: config.period.seconds(),
            control: ControlWord::EMPTY,
            motor_torque: Vector4::zeros(),
            before: start,
            samples: 0,
            sequence: 0,
            holds: false,
            moves: Vec::new(),
            held: false,
            under_way: VecDeque::new(),
            torque: [0.0; 4],
            speed: [0.0; 4],
            cycle: heat::Cycle::default(),
        };
        stage.sample_at(start);
        stage
    }

    /// Joints, and what the hand holds.
    fn pose(&self) -> (Vector4<f32>, f32) {
        (
            self.controller.reference().q,
            self.controller.setup().payload.mass,
        )
    }

    fn is_at(&self, (q, mass): &(Vector4<f32>, f32)) -> bool {
        let (here, holds) = self.pose();
        holds == *mass && (here - q).amax() < SAME
    }

    fn act(&mut self, action: &Action, spot: Option<Spot>) -> Result<(), OperatorError> {
        match action {
            Action::Request(request @ MotionRequest::Enable) => {
                // The arm obeys no torque: what a law integrates of rounding errors would grow without end.
                self.ask(&WITHOUT_MEMORY, spot)?;
                self.ask(request, spot)
            }
            Action::Request(request) => self.ask(request, spot),
            Action::WaitMode(mode) => self.until("state", |stage| stage.controller.mode() == *mode),
            Action::WaitArrived => {
                let begun = self.samples;
                while self.controller.mode() != Mode::Enabled || self.controller.queued() > 0 {
                    self.heed_hold(begun, action, spot)?;
                    self.sample()?;
                }
                Ok(())
            }
            Action::Dwell(time) => {
                let samples = (time.seconds() / f64::from(self.period)).ceil() as u64;
                (0..samples).try_for_each(|_| self.sample())
            }
            Action::Hold(pressed) => {
                self.holds = *pressed;
                Ok(())
            }
            Action::Hello | Action::EmergencyStop | Action::Cell(_) => Ok(()),
        }
    }

    /// Asks, and waits for the answer: to a move it comes when it has been planned, for which the moves before it have to make
    /// room.
    fn ask(&mut self, request: &MotionRequest, spot: Option<Spot>) -> Result<(), OperatorError> {
        self.sequence = self.sequence.wrapping_add(1);
        self.controller.request(self.sequence, request);
        if let MotionRequest::SetOverride { pace } = request {
            self.held = *pace == 0.0;
        }
        let begun = self.samples;
        loop {
            while let Some(reply) = self.controller.take_reply() {
                match reply.outcome {
                    Outcome::Refused(refusal) => {
                        return Err(OperatorError::Refused {
                            spot,
                            request: *request,
                            refusal,
                        });
                    }
                    Outcome::Accepted if reply.sequence == self.sequence => {
                        self.accepted(request, spot);
                        return Ok(());
                    }
                    Outcome::Accepted => {}
                }
            }
            self.heed_hold(begun, &Action::Request(*request), spot)?;
            self.sample()?;
        }
    }

    fn accepted(&mut self, request: &MotionRequest, spot: Option<Spot>) {
        match request {
            MotionRequest::SetPayload { .. } => {
                self.body = Body::new(&self.arm, &self.controller.setup().payload);
            }
            MotionRequest::Stop => self.under_way.clear(),
            _ if request.is_move() => {
                self.under_way.push_back((self.sequence, self.moves.len()));
                self.moves.push(Move {
                    cycle: spot.map_or(0, |spot| spot.cycle.saturating_add(1)),
                    step: spot.map_or_else(String::new, |spot| spot.key()),
                    duration_s: 0.0,
                    torque_utilisation: [0.0; 4],
                });
            }
            _ => {}
        }
    }

    /// An arm that the scenario holds comes to its next rest at once, or not at all.
    fn heed_hold(
        &self,
        begun: u64,
        action: &Action,
        spot: Option<Spot>,
    ) -> Result<(), OperatorError> {
        let end = begun + (PATIENCE.seconds() / f64::from(self.period)) as u64;
        if !self.held || self.samples <= end {
            return Ok(());
        }
        let what = action.awaited(self.sequence);
        Err(OperatorError::Held {
            spot,
            what,
            limit: PATIENCE,
        })
    }

    fn until(&mut self, what: &str, reached: impl Fn(&Self) -> bool) -> Result<(), OperatorError> {
        let end = self.samples + (PATIENCE.seconds() / f64::from(self.period)) as u64;
        while !reached(self) {
            if self.samples > end {
                return Err(OperatorError::Late {
                    what: what.into(),
                    limit: PATIENCE,
                    refused: Unused::default(),
                });
            }
            self.sample()?;
        }
        Ok(())
    }

    /// One sample, at which the arm is where the reference of the last one leads.
    fn sample(&mut self) -> Result<(), OperatorError> {
        if self.holds && matches!(self.controller.mode(), Mode::Enabled | Mode::Moving) {
            // Accepted, it is not answered.
            self.controller.request(0, &MotionRequest::Hold);
        }
        // The command acts later than in the middle of the sample, whose speed is the mean.
        let Rates { qd, qdd } = *self.controller.ahead();
        let mean = qd - qdd * self.controller.setup().command_delay;
        let q = self.controller.reference().q + mean * self.period;
        self.sample_at(q);
        let fault = self.controller.fault();
        if fault.cause != Cause::None {
            return Err(OperatorError::Stopped {
                mode: self.controller.mode(),
                fault: *fault,
            });
        }
        Ok(())
    }

    fn sample_at(&mut self, q: Vector4<f32>) {
        let drive = &self.body.drive;
        let mut status = DriveStatus::READY | DriveStatus::ENCODER_VALID;
        if self.control.contains(ControlWord::TORQUE_ENABLE) {
            status = status | DriveStatus::TORQUE_ON;
        }
        if self.control.contains(ControlWord::BRAKE_RELEASE) {
            status = status | DriveStatus::BRAKE_RELEASED;
        }
        let actions = self.controller.step(
            &Readings {
                steps: 1,
                status,
                counts: drive.counts_of_motor_angle(&drive.motor_angle(&q)),
                velocity: drive.motor_speed(&((q - self.before) / self.period)),
                torque: self.motor_torque,
            },
            &mut (),
        );
        self.before = q;
        self.control = actions.control;
        self.motor_torque = actions.torque.into();
        self.controller.plan(0);
        self.samples += 1;
        self.measure();
    }

    /// What the reference of this sample needs.
    fn measure(&mut self) {
        let reference = *self.controller.reference();
        let continuous = &self.arm.limits.effort_continuous;
        self.cycle.add(&self.body, continuous, &reference);
        let effort = self
            .body
            .inverse(&Trig::new(&reference.q), &reference.qd, &reference.qdd);
        let share = |value: f32, limit: f32| f64::from((value / limit).abs());
        let torque: [f64; 4] =
            std::array::from_fn(|axis| share(effort[axis], self.arm.limits.effort[axis]));
        let speed: [f64; 4] =
            std::array::from_fn(|axis| share(reference.qd[axis], self.arm.limits.velocity[axis]));
        raise(&mut self.torque, &torque);
        raise(&mut self.speed, &speed);
        if let Some((_, number)) = self.under_way.front().copied()
            && reference.qd.amax() > 0.0
        {
            let planned = &mut self.moves[number];
            planned.duration_s += f64::from(self.period);
            raise(&mut planned.torque_utilisation, &torque);
        }
        while let Some((sequence, _)) = self.under_way.front()
            && self.controller.completed() == *sequence
        {
            self.under_way.pop_front();
        }
    }
}

fn raise(peaks: &mut [f64; 4], values: &[f64; 4]) {
    for (peak, value) in peaks.iter_mut().zip(values) {
        *peak = peak.max(*value);
    }
}
