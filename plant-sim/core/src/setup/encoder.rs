//! What the steps of the encoders make of the torques, foreseen: see [`Gains`].

use firmware::control::laws::Gains;
use firmware::control::monitor::MonitorLimits;
use firmware::mechanics::arm::{ArmModel, Payload};
use firmware::mechanics::body::Body;

use super::{RunConfig, SetupError};
use crate::model::{self, AXES};
use crate::scenario::{PayloadSpec, Scenario, Step};

/// Bandwidth (rad/s) below which the controller's own gains are refused: it takes a tenth of a second to answer, in which friction alone
/// puts the tool off by millimetres.
const LEAST_BANDWIDTH: f64 = 10.0;
/// Least control rate, Hz.
const LEAST_RATE: f64 = 100.0;

impl RunConfig {
    /// The gains of a scenario that says none: those that the controller has by itself, or lower ones for a load off the axis of the flange.
    pub(crate) fn own_gains(&self) -> Gains {
        Gains::for_load(
            &ArmModel::from(&self.nominal),
            &self.hardest_load().0,
            self.period(),
        )
    }

    /// The scenario with every gain, if it has any or needs others than the controller has by itself.
    pub(crate) fn asked(&self) -> Scenario {
        let mut scenario = self.scenario.clone();
        let own = self.own_gains();
        let needs = own != Gains::for_arm(&ArmModel::from(&self.nominal), self.period());
        let asked = scenario.gains.or_else(|| needs.then(Default::default));
        scenario.gains = asked.map(|it| it.complete(&own));
        scenario
    }

    /// Of the heaviest payload on the axis of the flange and those that the scenario has, the one with which a count of an encoder makes the
    /// greatest step, wherever axis 4 turns it; and as which payload the scenario has that.
    fn hardest_load(&self) -> (Payload, Option<PayloadSpec>) {
        let arm = ArmModel::from(&self.nominal);
        let usual = Gains::for_period(self.period());
        let step = |load: &Payload| usual.encoder_step(&arm, load, self.period()).1;
        let picked = |step: &Step| match step {
            Step::Pick(payload) => Some(*payload),
            _ => None,
        };
        let picked = self.scenario.cycle.iter().filter_map(picked);
        let heaviest = Payload {
            mass: arm.payload_max,
            ..Payload::NONE
        };
        let mut hardest = (heaviest, None);
        for spec in self.scenario.payload.into_iter().chain(picked) {
            let mut load = Payload::from(&model::Payload::from(spec));
            load.com.x = spec.off_axis() as f32;
            load.com.y = 0.0;
            if step(&load) > step(&hardest.0) {
                hardest = (load, Some(spec));
            }
        }
        hardest
    }

    fn period(&self) -> f32 {
        (1.0 / self.scenario.rate_hz) as f32
    }

    /// The axis on which a count makes the greatest step of the torque with these gains, and that step as a share of its limit.
    fn step(&self, gains: &Gains) -> (&'static str, f64) {
        let arm = ArmModel::from(&self.nominal);
        let (axis, share) = gains.encoder_step(&arm, &self.hardest_load().0, self.period());
        (AXES[axis as usize], f64::from(share))
    }

    /// Whether the scenario leaves bandwidth and observer to the controller.
    fn leaves_gains(&self) -> bool {
        let asked = self.scenario.gains.unwrap_or_default();
        asked.bandwidth.is_none() && asked.observer.is_none()
    }

    /// The robot, and what its encoders are.
    fn subject(&self) -> String {
        let load = self.hardest_load().1.map_or_else(String::new, |load| {
            format!(
                " and a payload of {} kg has its centre of mass {:.2} m off the axis of the flange",
                load.mass,
                load.off_axis()
            )
        });
        format!(
            "model {}: drive.encoder_counts_per_motor_rev is {}{load}",
            self.nominal.name, self.nominal.drive.encoder_counts
        )
    }

    /// Encoders so coarse that gains which they bear do not hold the arm.
    pub(super) fn too_coarse(&self) -> Option<SetupError> {
        let bandwidth = f64::from(self.own_gains().bandwidth);
        let usual = Gains::for_period(self.period());
        let (axis, share) = self.step(&usual);
        let is_lowered = share > f64::from(Gains::ENCODER_STEP);
        if !is_lowered || bandwidth >= LEAST_BANDWIDTH || !self.leaves_gains() {
            return None;
        }
        // What is left goes with the counts, and against the rate.
        let left = f64::from(usual.bandwidth) * f64::from(Gains::ENCODER_STEP) / share;
        let (counts, rate_hz) = (self.nominal.drive.encoder_counts, self.scenario.rate_hz);
        let slower = (rate_hz * left / LEAST_BANDWIDTH).floor();
        Some(SetupError::Coarse {
            subject: self.subject(),
            rate_hz,
            percent: share * 100.0,
            axis,
            bandwidth: left,
            least: (f64::from(counts) * LEAST_BANDWIDTH / left).ceil(),
            slower: if slower < LEAST_RATE {
                String::new()
            } else {
                format!(", or a rate_hz up to {slower}")
            },
        })
    }

    /// Encoders that cost the loop something, and what to do.
    pub(super) fn coarse(&self) -> Option<String> {
        let usual = Gains::for_period(self.period());
        let (axis, share) = self.step(&usual);
        if self.leaves_gains() {
            let enough = self.finer(&usual)?;
            let own = self.own_gains();
            let law = self.scenario.law;
            let blind = if law.law.takes_compensation() {
                String::new()
            } else {
                format!(
                    "; {law} has no model of the arm and follows by its gains alone, so that fast moves may end with a following error"
                )
            };
            return Some(format!(
                "{}, coarse at {} Hz: with a bandwidth of {:.0} rad/s a count would be {:.0} % of the torque limit of the {axis}; the \
                 controller uses gains.bandwidth {:.1} and gains.observer {:.1}, with which the tool is as much further off its path; a lower \
                 rate_hz bears more, and {enough} counts all{blind}",
                self.subject(),
                self.scenario.rate_hz,
                usual.bandwidth,
                share * 100.0,
                own.bandwidth,
                own.observer,
            ));
        }
        let advice = self.lower_gains()?;
        Some(format!(
            "{advice}: torques swing, which slows moves down and may stop the arm for chatter"
        ))
    }

    /// A law without a model of the arm, at a rate at which it stays behind by more than the lift's following error. It needs an error to speed up by:
    /// the acceleration over the square of the bandwidth.
    pub(super) fn lags(&self) -> Option<String> {
        let Scenario { law, rate_hz, .. } = self.scenario;
        if law.law.takes_compensation() {
            return None;
        }
        let arm = ArmModel::from(&self.nominal);
        let payload = self.scenario.payload.unwrap_or(PayloadSpec::NOTHING);
        let body = Body::new(&arm, &Payload::from(&model::Payload::from(payload)));
        let fastest = f64::from(body.torque_limit.z / body.nominal_inertia.z);
        let limit = f64::from(MonitorLimits::DEFAULT.following_error.z);
        let own = self.own_gains();
        let [(_, _, bandwidth), ..] = self.scenario.gains.unwrap_or_default().each(&own);
        let least = (fastest / limit).sqrt();
        (bandwidth < least).then(|| {
            format!(
                "at {rate_hz} Hz {law}, which has no model of the arm, has a bandwidth of {bandwidth:.0} rad/s: a lift that speeds up with all its \
                 torque, {fastest:.0} m/s2, is {:.0} mm behind, and more than {:.0} mm end a run as a following error; from {least:.0} rad/s on it \
                 keeps up, by itself at {:.0} Hz; say a lower speed, a higher rate_hz or another law",
                fastest / (bandwidth * bandwidth) * 1e3,
                limit * 1e3,
                (rate_hz * least / f64::from(Gains::for_period(self.period()).bandwidth)).ceil(),
            )
        })
    }

    /// What may help a run that its controller stops, where encoders are too coarse for the usual gains.
    pub(crate) fn encoder_advice(&self) -> Option<String> {
        let coarse = || {
            let least = self.finer(&Gains::for_period(self.period()))?;
            Some(format!(
                "{}, coarse at {} Hz, so that gains are low: a lower speed, a lower rate_hz, {least} counts or a law with a model of the arm, \
                 such as computed-torque, may help",
                self.subject(),
                self.scenario.rate_hz
            ))
        };
        self.lower_gains().or_else(coarse)
    }

    /// Counts that bear these gains, where the encoders do not.
    fn finer(&self, gains: &Gains) -> Option<f64> {
        let needed = self.step(gains).1 / f64::from(Gains::ENCODER_STEP);
        let counts = f64::from(self.nominal.drive.encoder_counts);
        (needed > 1.0).then(|| (counts * needed).ceil())
    }

    /// Which gains to lower to what, where the encoders are too coarse for those of the scenario.
    pub(crate) fn lower_gains(&self) -> Option<String> {
        let own = self.own_gains();
        let asked = self.scenario.gains.unwrap_or_default();
        let [bandwidth, damping, observer] = asked.each(&own).map(|(_, _, gain)| gain as f32);
        let gains = Gains {
            bandwidth,
            damping,
            observer,
        };
        // Those that are refused for themselves need no advice.
        gains.check(self.period(), 0.0, false).ok()?;
        let (axis, share) = self.step(&gains);
        let most = f64::from(Gains::ENCODER_STEP);
        // What the controller lowers by itself ends next to it.
        if share <= most * 1.001 {
            return None;
        }
        let lowered = |gain: f32| (f64::from(gain) * most / share * 10.0).floor() / 10.0;
        Some(format!(
            "{}: at {} Hz with gains.bandwidth {bandwidth} and gains.observer {observer} a count of the {axis} is {:.0} % of its torque \
             limit; lower gains.bandwidth to {} and gains.observer to {}, or leave both out",
            self.subject(),
            self.scenario.rate_hz,
            share * 100.0,
            lowered(bandwidth),
            lowered(observer),
        ))
    }
}
