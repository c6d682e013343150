//! Limits of joint acceleration and jerk, of a robot that has them to protect its gears; most have not.

use nalgebra::Vector4;

use super::Reference;
use super::torque_budget::{Braking, STOP_SHARE, TorqueBudget, ratio, slower};
use crate::mechanics::math::{cbrt, sqrt};

impl TorqueBudget<'_> {
    /// The largest time scale, at most 1, at which these joint accelerations and jerks use no more than `share` of the limits.
    #[cold]
    pub fn cap_scale(&self, qdd: &Vector4<f32>, jerk: &Vector4<f32>, share: f32) -> f32 {
        let limits = &self.arm.limits;
        let within = |limit: &Vector4<f32>, value: &Vector4<f32>| {
            ratio((limit * share).as_slice(), value.as_slice())
        };
        let acceleration = sqrt(within(&limits.acceleration, qdd)).min(1.0);
        acceleration.min(cbrt(within(&limits.jerk, jerk)))
    }

    /// Keeps a stop within the limits: of a trajectory whose motion is `rest`, and which would have the speed `qd` if its clock had not
    /// been slowed down.
    #[cold]
    pub(super) fn cap_braking(&self, rest: &Reference, qd: &Vector4<f32>, braking: &mut Braking) {
        let limits = &self.arm.limits;
        let joints = qd.iter().zip(rest.qdd.iter());
        for ((qd, qdd), (acceleration, jerk)) in
            joints.zip(limits.acceleration.iter().zip(limits.jerk.iter()))
        {
            // An acceleration along the motion leaves more room for slowing down.
            let own = if *qd > 0.0 { *qdd } else { -qdd };
            braking.slope = slower(braking.slope, (acceleration + own).max(0.0), *qd);
            braking.bend = slower(braking.bend, STOP_SHARE * jerk, *qd);
        }
    }
}
