//! Limits of joint acceleration and jerk, of a robot that has them to protect its gears; most have not.

use nalgebra::Vector4;

use super::Rates;
use super::torque_budget::{TorqueBudget, ratio, slower};
use crate::mechanics::math::{cbrt, sqrt};

impl TorqueBudget<'_> {
    /// The largest time scale, at most 1, at which these joint accelerations, and the jerks since those `time` s before, use no more than
    /// `share` of the limits.
    #[cold]
    pub fn cap_scale(
        &self,
        qdd: &Vector4<f32>,
        before: &Vector4<f32>,
        time: f32,
        share: f32,
    ) -> f32 {
        let jerk = (qdd - before) / time;
        let limits = &self.arm.limits;
        let within = |limit: &Vector4<f32>, value: &Vector4<f32>| {
            ratio((limit * share).as_slice(), value.as_slice())
        };
        let acceleration = sqrt(within(&limits.acceleration, qdd)).min(1.0);
        acceleration.min(cbrt(within(&limits.jerk, &jerk)))
    }

    /// Keeps the change of the slope of a time scale within this share of the limits of jerk, for a trajectory whose motion is `rates`.
    #[cold]
    pub(super) fn cap_bend(&self, rates: &Rates, share: f32, bend: f32) -> f32 {
        let joints = rates
            .qd
            .as_slice()
            .iter()
            .zip(self.arm.limits.jerk.as_slice());
        joints.fold(bend, |bend, (qd, jerk)| slower(bend, share * jerk, *qd))
    }

    /// Keeps the slope of a time scale, of one that is to get `faster` or slower, within the limits of acceleration, likewise.
    #[cold]
    pub(super) fn cap_slope(
        &self,
        rates: &Rates,
        time_scale: f32,
        faster: bool,
        steepest: f32,
    ) -> f32 {
        let joints = rates.qd.as_slice().iter().zip(rates.qdd.as_slice());
        let limits = self.arm.limits.acceleration.as_slice();
        joints
            .zip(limits)
            .fold(steepest, |steepest, ((qd, qdd), limit)| {
                // An acceleration along the motion leaves more room for slowing down, and less for speeding up.
                let own = qdd * (time_scale * time_scale);
                let left = if (*qd > 0.0) == faster {
                    limit - own
                } else {
                    limit + own
                };
                slower(steepest, left.max(0.0), *qd)
            })
    }
}
