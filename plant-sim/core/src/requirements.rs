//! Requirements judged while a run goes: how near each of them came to its limit, and when.

mod stop;
mod watch;

use protocol::time::{Duration, Instant};
use schemars::JsonSchema;
use serde::Serialize;

use crate::metrics::{CycleResult, Offset};
use crate::model::JointLimits;
use crate::observer::Truth;
use crate::scenario::{Quantity, Requirement};
use crate::setup::RunConfig;
use stop::Stop;
use watch::Watch;

/// The lift, among the axes.
const LIFT: usize = 2;
/// Those that turn.
const TURNING: [usize; 3] = [0, 1, 3];

/// A requirement, and what became of it.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Verdict {
    /// What is required.
    #[serde(flatten)]
    pub requirement: Requirement,
    /// Whether it was met. What was never measured was not.
    pub met: bool,
    /// The value nearest to a limit, or farthest beyond it; `null` where nothing was measured, or a cycle never arrived.
    pub value: Option<f64>,
    /// Its distance from the limit, in the unit of the quantity; negative beyond it; `null` like the value.
    pub margin: Option<f64>,
    /// When that was, s; `null` where nothing was measured.
    pub time_s: Option<f64>,
}

/// What is known of a sample besides its truth.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Seen {
    /// Offset of the tool from its reference, where there is one that moves.
    pub(crate) tracking: Option<Offset>,
    /// Samples for which each motor has been at its limit.
    pub(crate) saturated: [u64; 4],
    /// Whether the sample before had no command.
    pub(crate) late: bool,
}

/// Follows a run and judges it.
pub(crate) struct Judge {
    watches: Vec<Watch>,
    limits: JointLimits,
    period_s: f64,
    /// The cycle that runs, counted from 1.
    cycle: Option<u32>,
    begun: u32,
    stop: Stop,
    last: f64,
}

impl Judge {
    /// Knows what is required of this run.
    pub(crate) fn new(config: &RunConfig) -> Self {
        let scenario = &config.scenario;
        Self {
            watches: scenario.requirements.iter().map(Watch::new).collect(),
            limits: config.actual.limits,
            period_s: 1.0 / scenario.rate_hz,
            cycle: None,
            begun: 0,
            stop: Stop::default(),
            last: 0.0,
        }
    }

    /// The bus was busy for so long, with a frame or with one in vain.
    pub(crate) fn bus(&mut self, time: Instant, duration: impl FnOnce() -> Duration) {
        let t = time.seconds();
        let mut loads = watches(&mut self.watches, t, self.cycle)
            .filter(|watch| watch.quantity() == Quantity::BusLoad)
            .peekable();
        if loads.peek().is_some() {
            let busy = duration().seconds();
            loads.for_each(|watch| watch.add(0, busy));
        }
    }

    /// The controller has reported a fault.
    pub(crate) fn fault(&mut self, time: Instant) {
        let t = time.seconds();
        for watch in watches(&mut self.watches, t, self.cycle) {
            if watch.quantity() == Quantity::Faults {
                watch.count(t);
            }
        }
    }

    pub(crate) fn begin_cycle(&mut self) {
        self.begun += 1;
        self.cycle = Some(self.begun);
    }

    /// The cycle has ended, with this result if it had a sample.
    pub(crate) fn end_cycle(&mut self, result: Option<&CycleResult>) {
        if let Some(result) = result {
            let arrived = result.start_s + result.commanded_s;
            for watch in &mut self.watches {
                let (t, value) = match watch.quantity() {
                    Quantity::CycleTime if result.moved => (arrived, result.cycle_time_s),
                    Quantity::SettleTime if result.moved => (arrived, result.settle_time_s),
                    Quantity::FinalMm if result.final_error_mm.is_some() => {
                        (self.last, result.final_error_mm)
                    }
                    Quantity::FinalMrad if result.final_error_mrad.is_some() => {
                        (self.last, result.final_error_mrad)
                    }
                    _ => continue,
                };
                if watch.admits(t, self.cycle) {
                    watch.observe(t, value);
                }
            }
        }
        self.cycle = None;
    }

    /// One sample.
    pub(crate) fn sample(&mut self, truth: &Truth, seen: &Seen) {
        let t = truth.plant.t;
        self.last = t;
        let stop = self.stop.sample(truth);
        let in_cycle = self.cycle.is_some();
        let share = |values: &[f64; 4], limits: &[f64; 4]| {
            std::array::from_fn::<f64, 4, _>(|axis| values[axis].abs() / limits[axis])
        };
        for watch in watches(&mut self.watches, t, self.cycle) {
            watch.sample(t);
            let of_axes = |values: [f64; 4]| watch.of_axes(&values, &[0, 1, 2, 3]);
            let following = |axis: usize| (truth.mind.q[axis] - truth.plant.q[axis]).abs() * 1e3;
            let value = match watch.quantity() {
                Quantity::TrackingMm => seen.tracking.map(|offset| offset.position * 1e3),
                Quantity::TrackingMrad => seen.tracking.map(|offset| offset.yaw * 1e3),
                Quantity::StopDistance => stop.map(|(_, distance)| distance * 1e3),
                Quantity::StopTime => stop.map(|(time, _)| time),
                Quantity::Reached => watch.reached(truth.mind.mode, t),
                Quantity::Overruns => {
                    if seen.late {
                        watch.count(t);
                    }
                    None
                }
                // The others are of cycles, as in the summary.
                _ if !in_cycle => None,
                Quantity::FollowingMrad | Quantity::FollowingMm if !truth.is_answered() => None,
                Quantity::FollowingMrad => {
                    let errors = std::array::from_fn(following);
                    Some(watch.of_axes(&errors, &TURNING))
                }
                Quantity::FollowingMm => Some(following(LIFT)),
                Quantity::Torque => Some(of_axes(share(&truth.plant.tau, &self.limits.effort))),
                Quantity::Speed => Some(of_axes(share(&truth.plant.qd, &self.limits.velocity))),
                Quantity::Saturation => {
                    let period = self.period_s;
                    Some(of_axes(
                        seen.saturated.map(|samples| samples as f64 * period),
                    ))
                }
                Quantity::Thermal => {
                    let shares = share(&truth.plant.tau, &self.limits.effort_continuous);
                    for (axis, share) in shares.into_iter().enumerate() {
                        watch.add(axis, share * share);
                    }
                    watch.weigh();
                    None
                }
                _ => None,
            };
            if value.is_some() {
                watch.observe(t, value);
            }
        }
    }

    /// What became of each requirement.
    pub(crate) fn finish(self, frames_lost: u64, sim_time_s: f64) -> Vec<Verdict> {
        let Self {
            watches, period_s, ..
        } = self;
        let verdict = |watch: Watch| match watch.quantity() {
            Quantity::FramesLost => watch.verdict_of(sim_time_s, frames_lost as f64),
            Quantity::SimTime => watch.verdict_of(sim_time_s, sim_time_s),
            _ => watch.verdict(period_s),
        };
        watches.into_iter().map(verdict).collect()
    }
}

/// Those that this instant is of.
fn watches(all: &mut [Watch], t: f64, cycle: Option<u32>) -> impl Iterator<Item = &mut Watch> {
    all.iter_mut().filter(move |watch| watch.admits(t, cycle))
}
