//! Summary of a run, gathered while it runs.

mod corners;
mod faults;
mod injected;
mod recipe;
mod warmth;

use std::io;

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Cause, Message, Mode, Node, State};
use protocol::schema::Content;
use protocol::table;
use protocol::time::{Duration, Instant};
use protocol::wire::{BitTiming, FrameBits};
use schemars::JsonSchema;
use serde::Serialize;
use trace::ErrorFrame;

pub use corners::Corner;
use corners::Corners;
pub use faults::Fault;
use faults::Faults;
pub use injected::Injected;
use injected::Windows;
pub use recipe::{GainsInForce, Model, Models, Recipe};
use warmth::Thermometer;
pub use warmth::Warmth;

use crate::metrics::{CycleResult, MeanMax, Metrics, RmsMax, Spread};
use crate::observer::{Observer, Truth};
use crate::requirements::{Judge, Seen, Verdict};
use crate::rig::{Rig, RunError};
use crate::scenario::Ending;
use crate::setup::RunConfig;
use crate::world::{CellEvent, OperatorError};

/// Summary of a run, as `summary.json` holds it. Times in s, lengths in mm, shares of 1.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Summary {
    /// What was run.
    #[serde(flatten)]
    pub recipe: Recipe,
    /// Cycles completed.
    pub cycles: u32,
    /// Cycles of the scenario.
    pub cycles_asked: u32,
    /// Completed cycles in which nothing moved. They have no times, and no number below includes them.
    pub cycles_still: u32,
    /// Whether the scenario ran to its end.
    pub completed: bool,
    /// Why it did not.
    pub error: Option<String>,
    /// Whether the controller stopped the arm, for a fault or an emergency stop.
    pub stopped: bool,
    /// Whether it ended as the scenario says, and met every requirement.
    pub passed: bool,
    /// What is required of the run, and what became of it.
    pub requirements: Vec<Verdict>,
    /// Final state of the controller, as reported; `null` if never.
    pub state: Option<&'static str>,
    /// Fault latched at the end.
    pub fault: Option<String>,
    /// Whether the arm ended at rest with its brake closed.
    pub at_rest: bool,
    /// From the start of motion until the tool is back within 1 mm and 10 mrad and stays, s; `null` where nothing moved, or
    /// where any cycle did not arrive.
    pub cycle_time_s: Option<Spread>,
    /// From the end of the commanded motion until the tool is within 0.01 mm and 0.1 mrad and stays, s; `null` as
    /// above.
    pub settle_time_s: Option<MeanMax>,
    /// True tool to commanded tool at the same instant, while the reference moves, mm; without the samples that the controller has
    /// not answered by the next one, of which there is no reference.
    pub tracking_error_mm: RmsMax,
    /// True yaw to commanded yaw at the same instant, while the reference moves, mrad; without the same samples.
    pub tracking_error_mrad: RmsMax,
    /// Distance from the target at the end of a dwell, mm.
    pub final_error_mm: FinalError,
    /// Yaw error from the target at the end of a dwell, mrad.
    pub final_error_mrad: FinalError,
    /// Ends of moves with a zone, and how far from them the tool has passed.
    pub corners: Vec<Corner>,
    /// Peak effort over its limit, by axis, of 1. Each motor keeps to its own; the wrist bears the torque of the lift's nut as
    /// well, and may have more.
    pub torque_utilisation: [f64; 4],
    /// Root-mean-square effort over the continuous limit, by axis, of 1.
    pub thermal_utilisation: [f64; 4],
    /// How warm the motors got.
    pub heat: Warmth,
    /// Peak speed over its limit, by axis, of 1.
    pub speed_utilisation: [f64; 4],
    /// Least share of the planned speed at which the controller reported to move, of 1: less than 1 with a speed override, where
    /// the torque did not suffice, and with warm motors.
    pub pace: f64,
    /// Mass that the controller reported the lift to carry beyond the announced payload, at the last move, kg.
    pub burden_kg: f64,
    /// Longest time with the motor at its limit, by axis, according to the plant, s.
    pub longest_saturation_s: [f64; 4],
    /// Share of the time for which the bus was busy, of 1.
    pub bus_load: f64,
    /// Frames delivered.
    pub frames: u64,
    /// Attempts to send a frame in which a node found an error on the bus.
    pub bus_errors: u64,
    /// Samples without a command by the time of the next sample.
    pub overruns: u64,
    /// Frames lost to a full transmit queue.
    pub frames_lost: u64,
    /// Faults of the scenario, and when each was in effect.
    pub injected: Vec<Injected>,
    /// Faults that the controller reported, by an emergency or by its state; one that follows itself is listed once.
    pub faults: Vec<Fault>,
    /// Simulated time, s.
    pub sim_time_s: f64,
    /// Every cycle by itself.
    pub each_cycle: Vec<CycleResult>,
}

/// Greatest offset from the target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, JsonSchema)]
pub struct FinalError {
    /// mm or mrad; `null` if no cycle with a target was completed.
    pub max: Option<f64>,
}

/// The observer that makes a [`Summary`].
pub struct Collector {
    metrics: Metrics,
    judge: Judge,
    windows: Windows,
    corners: Corners,
    thermometer: Thermometer,
    faults: Faults,
    /// The last state.
    state: Option<State>,
    /// Least pace of a move, of 1.
    pace: f64,
    /// Mass beyond the announced one while the arm moved last, kg.
    burden: f64,
    target: Option<[f64; 4]>,
    timing: BitTiming,
    /// Whether a command has arrived since the last sample; `None` before the very first.
    answered: Option<bool>,
    overruns: u64,
}

impl Collector {
    /// An empty one for this run.
    pub fn new(config: &RunConfig) -> Self {
        Self {
            metrics: Metrics::new(&config.actual),
            judge: Judge::new(config),
            windows: Windows::new(&config.scenario),
            corners: Corners::new(config),
            thermometer: Thermometer::new(&config.actual),
            faults: Faults::default(),
            state: None,
            pace: 1.0,
            burden: 0.0,
            target: config.cycle_target(),
            timing: BitTiming::default(),
            answered: None,
            overruns: 0,
        }
    }

    /// The summary; `result` is how the run ended.
    pub fn finish(
        self,
        config: &RunConfig,
        rig: &Rig<'_>,
        result: &Result<(), RunError>,
    ) -> Summary {
        let Self {
            metrics,
            judge,
            windows,
            corners,
            thermometer,
            faults,
            state,
            pace,
            burden,
            overruns,
            ..
        } = self;
        let scenario = &config.scenario;
        let bus = rig.bus();
        let sim = rig.now();
        let frames_lost = rig.dropped();
        let requirements = judge.finish(frames_lost, sim.seconds());
        let stopped = matches!(
            result,
            Err(RunError::Operator(OperatorError::Stopped { .. }))
        );
        let ended_well = match scenario.ends {
            Ending::Completed => result.is_ok(),
            Ending::Stopped => stopped,
        };
        Summary {
            recipe: Recipe::new(config),
            cycles: metrics.cycles.len() as u32,
            cycles_asked: scenario.cycles,
            cycles_still: metrics.still() as u32,
            completed: result.is_ok(),
            error: result.as_ref().err().map(ToString::to_string),
            stopped,
            passed: ended_well && requirements.iter().all(|verdict| verdict.met),
            requirements,
            state: state.map(|state| state.mode.name()),
            fault: state
                .map(|state| state.fault())
                .filter(|fault| fault.cause != Cause::None)
                .map(|fault| fault.to_string()),
            at_rest: rig.is_at_rest(),
            cycle_time_s: metrics.cycle_time_s(),
            settle_time_s: metrics.settle_time_s(),
            tracking_error_mm: metrics.tracking_error_mm(),
            tracking_error_mrad: metrics.tracking_error_mrad(),
            final_error_mm: FinalError {
                max: metrics.final_error_mm(),
            },
            final_error_mrad: FinalError {
                max: metrics.final_error_mrad(),
            },
            corners: corners.finish(),
            torque_utilisation: metrics.torque_utilisation(),
            thermal_utilisation: metrics.thermal_utilisation(),
            heat: thermometer.finish(),
            speed_utilisation: metrics.speed_utilisation(),
            pace,
            burden_kg: burden,
            longest_saturation_s: metrics
                .longest_saturation
                .map(|samples| samples as f64 / scenario.rate_hz),
            bus_load: bus.total.load(sim.since(Instant::ORIGIN)),
            frames: bus.total.frames,
            bus_errors: bus.total.errors,
            overruns,
            frames_lost,
            injected: windows.finish(scenario, sim),
            faults: faults.finish(),
            sim_time_s: sim.seconds(),
            each_cycle: metrics.cycles,
        }
    }
}

impl Observer for Collector {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        let timing = &self.timing;
        self.judge
            .bus(time, || timing.duration(FrameBits::exact(frame)));
        match table::of_frame(frame).map(|info| info.content) {
            Some(Content::Emergency(Node::Controller)) => {}
            Some(Content::Command) => {
                self.answered = Some(true);
                return Ok(());
            }
            Some(Content::State) => {}
            _ => return Ok(()),
        }
        let Ok(received) = codec::decode(frame) else {
            return Ok(());
        };
        match received.message {
            Message::Emergency(_, emergency) => {
                let is_first = self.faults.emergency(time, &emergency);
                if is_first {
                    self.judge.fault(time);
                }
            }
            Message::State(state) => {
                self.state = Some(state);
                self.thermometer.state(time, &state);
                if state.mode == Mode::Moving {
                    self.pace = self.pace.min(f64::from(state.pace) / 100.0);
                    self.burden = f64::from(state.burden) / 100.0;
                }
                if self.faults.state(time, &state) {
                    self.judge.fault(time);
                }
            }
            _ => {}
        }
        Ok(())
    }

    /// What another node says in the controller's name is none of its faults, states and commands.
    fn foreign_frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        let timing = &self.timing;
        self.judge
            .bus(time, || timing.duration(FrameBits::exact(frame)));
        Ok(())
    }

    fn fault(&mut self, number: usize, from: Instant, until: Instant) {
        self.windows.set(number, from, until);
    }

    fn error(&mut self, time: Instant, _: &ErrorFrame, busy: Duration) -> io::Result<()> {
        self.judge.bus(time, || busy);
        Ok(())
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.thermometer.sample(truth);
        self.corners.sample(truth);
        let tracking = self.metrics.tracked(truth);
        let late = self
            .answered
            .as_mut()
            .is_some_and(|answered| !std::mem::take(answered));
        self.overruns += u64::from(late);
        let seen = Seen {
            tracking,
            saturated: self.metrics.saturated_now,
            late,
        };
        self.judge.sample(truth, &seen);
        Ok(())
    }

    fn cell_event(&mut self, event: &CellEvent) {
        match event {
            CellEvent::BeginCycle => {
                self.metrics.begin_cycle(self.target);
                self.judge.begin_cycle();
                self.corners.begin_cycle();
            }
            CellEvent::EndCycle => {
                let before = self.metrics.cycles.len();
                self.metrics.end_cycle();
                self.corners.end_cycle();
                self.judge.end_cycle(self.metrics.cycles.get(before));
            }
            CellEvent::Attach(_) | CellEvent::Release => {}
        }
    }
}
