//! Limits of joint acceleration and jerk, of a robot that has them to protect its gears; most have not.

use nalgebra::Vector4;

use super::Reference;
use super::torque_budget::{Ramp, TorqueBudget, ratio, slower};
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

    /// Keeps a change of the time scale within the limits, with this share of the jerk: of a trajectory whose motion is `rest`, and
    /// which would have the speed `qd` at full pace.
    #[cold]
    pub(super) fn cap_ramp(
        &self,
        rest: &Reference,
        qd: &Vector4<f32>,
        share: f32,
        ramp: &mut Ramp,
    ) {
        let limits = &self.arm.limits;
        let joints = qd.iter().zip(rest.qdd.iter());
        for ((qd, qdd), (acceleration, jerk)) in
            joints.zip(limits.acceleration.iter().zip(limits.jerk.iter()))
        {
            // An acceleration along the motion leaves more room for slowing down, and less for speeding up.
            let own = if *qd > 0.0 { *qdd } else { -qdd };
            ramp.slower = slower(ramp.slower, (acceleration + own).max(0.0), *qd);
            ramp.faster = slower(ramp.faster, (acceleration - own).max(0.0), *qd);
            ramp.bend = slower(ramp.bend, share * jerk, *qd);
        }
    }
}
