//! Trips on what the drives report. Saturation is not a fault: see [`limits`](super::limits).

use nalgebra::Vector4;
use protocol::messages::{Cause, DriveStatus, Fault, FaultAxis};
use protocol::parameters::ControllerParameter as Parameter;
use serde::{Deserialize, Serialize};

use crate::control::readings::Readings;
use crate::mechanics::arm::{ArmModel, Axis};

/// Share of the speed that stops an axis from which on it counts as one that is to move.
const SLOW: f32 = 0.01;
/// Share of the speed at which it was to go on from which on it goes back as a reversed encoder shows it.
const BACK: f32 = 0.75;

/// Square of the share of its way that an arm may be off by where the drives have missed a sample, as it speeds up meanwhile.
const ALIKE: f32 = 0.0225;

/// What is felt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Felt {
    /// Nothing yet.
    Nothing,
    /// A fault.
    Fault(Fault),
    /// One sample more has passed than the drives have counted.
    Missed,
}

/// Limits whose violation stops the arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MonitorLimits {
    /// Largest following error: rad, rad, m, rad.
    pub following_error: Vector4<f32>,
    /// Largest joint speed as a multiple of the arm's limit.
    pub speed_factor: f32,
    /// How far past its range a joint may be: rad, rad, m, rad.
    pub range_margin: Vector4<f32>,
    /// Largest effort that the model does not explain, as a share of the limit of the joint.
    pub collision: f32,
    /// Consecutive samples before a violation counts.
    pub samples: u32,
    /// Longest gap in the feedback across which the trajectory continues, s.
    pub gap: f32,
}

impl MonitorLimits {
    /// Limits of the bench. Following error: 0.05 rad is 53 mm at the flange of the stretched arm, which the kinematic
    /// laws keep (20 mm RMS in the gate); computed torque uses a hundredth of it. Speed: a tenth above what a plan may
    /// use. Range: the stopping distance from a fifth of full speed, so that overshoot at a limit does not trip. Three
    /// samples: two can be noise. Collision: 10 kg more than were announced come near half of the limit at full speed, a
    /// payload and friction that are a third wrong to a fifth.
    pub const DEFAULT: Self = Self {
        following_error: Vector4::new(
            Parameter::FollowingErrorShoulder.initial(1.0),
            Parameter::FollowingErrorElbow.initial(1.0),
            Parameter::FollowingErrorLift.initial(1.0),
            Parameter::FollowingErrorWrist.initial(1.0),
        ),
        speed_factor: Parameter::SpeedFactor.initial(1.0),
        range_margin: Vector4::new(
            Parameter::RangeMarginShoulder.initial(1.0),
            Parameter::RangeMarginElbow.initial(1.0),
            Parameter::RangeMarginLift.initial(1.0),
            Parameter::RangeMarginWrist.initial(1.0),
        ),
        collision: Parameter::CollisionLimit.initial(1.0),
        samples: Parameter::FaultSamples.initial(1.0) as u32,
        gap: Parameter::FeedbackGap.initial(1.0),
    };

    /// Samples that a gap in the feedback may span, at a sampling period in s.
    pub fn gap_samples(&self, period: f32) -> u32 {
        ((self.gap / period + 0.5) as u32).max(1)
    }
}

/// Monitor of one arm: its limits, prepared for use in every sample, and counts of consecutive violations.
#[derive(Clone, Copy, Debug)]
pub struct Monitor {
    following_error: Vector4<f32>,
    /// Change of the following error in a sample that no axis can make.
    jump: Vector4<f32>,
    speed: Vector4<f32>,
    /// Middle of the joint ranges, and how far from it a joint may be.
    middle: Vector4<f32>,
    reach: Vector4<f32>,
    /// Efforts that the model need not explain, N m, N m, N, N m.
    collision: Vector4<f32>,
    needed: u32,
    collision_count: u32,
    following_count: u32,
    speed_count: u32,
    range_count: u32,
    /// Velocities of the motors when an axis was first found too far from its reference, rad/s.
    velocity: Vector4<f32>,
    /// The same, and the velocities of the reference, when an effort was first not explained.
    velocity_felt: Vector4<f32>,
    wanted: Vector4<f32>,
}

impl Monitor {
    /// A monitor of `arm`, sampled every `period` seconds, that has seen nothing.
    // Out of line: what it needs of the stack is free again when the rest of a controller is built.
    #[inline(never)]
    pub fn new(arm: &ArmModel, limits: &MonitorLimits, period: f32) -> Self {
        let mut monitor = Self {
            following_error: Vector4::zeros(),
            jump: Vector4::zeros(),
            speed: Vector4::zeros(),
            middle: 0.5 * (arm.limits.upper + arm.limits.lower),
            reach: Vector4::zeros(),
            collision: Vector4::zeros(),
            needed: 0,
            collision_count: 0,
            following_count: 0,
            speed_count: 0,
            range_count: 0,
            velocity: Vector4::zeros(),
            velocity_felt: Vector4::zeros(),
            wanted: Vector4::zeros(),
        };
        monitor.adopt(arm, limits, period);
        monitor
    }

    /// Adopts other limits and keeps the counts.
    pub fn adopt(&mut self, arm: &ArmModel, limits: &MonitorLimits, period: f32) {
        self.following_error = limits.following_error;
        self.speed = arm.limits.velocity * limits.speed_factor;
        // At full speed in the wrong direction.
        self.jump = self.speed * (2.0 * period);
        self.reach = 0.5 * (arm.limits.upper - arm.limits.lower) + limits.range_margin;
        self.collision = arm.limits.effort * limits.collision;
        self.needed = limits.samples;
    }

    /// Fault that the drives report, where their torque has to be on or need not be.
    pub fn status(status: DriveStatus, has_torque: bool) -> Option<Fault> {
        let is_off = has_torque && !status.contains(DriveStatus::TORQUE_ON);
        let cause = if !status.contains(DriveStatus::ENCODER_VALID) {
            Cause::EncoderFault
        } else if is_off || status.contains(DriveStatus::FAULT) {
            Cause::DriveFault
        } else {
            return None;
        };
        Some(Fault::value(cause, f32::from(status.bits()), 0.0))
    }

    /// Judges one sample; `error` is reference minus measured position, `before` that of the last sample, and `last_qd` the velocity then.
    pub fn check(
        &mut self,
        readings: &Readings,
        q: &Vector4<f32>,
        qd: &Vector4<f32>,
        [error, before]: [&Vector4<f32>; 2],
        last_qd: impl FnOnce() -> Vector4<f32>,
    ) -> Option<Fault> {
        if is_within(error, &self.following_error)
            && is_within(qd, &self.speed)
            && is_within(&(q - self.middle), &self.reach)
        {
            (self.following_count, self.speed_count, self.range_count) = (0, 0, 0);
            return None;
        }
        self.trip(readings, [q, qd, &last_qd(), error, before])
    }

    /// Judges the axes of the shaft alone, by the same error, where the others are without torque.
    // Out of line: rarely reached in a sample.
    #[inline(never)]
    pub fn shaft(&mut self, error: &Vector4<f32>) -> Option<Fault> {
        let error = Vector4::new(0.0, 0.0, error.z, error.w);
        let following = first_beyond(&error, &self.following_error);
        let axis = count(&mut self.following_count, following, self.needed)?;
        Some(of_axis(
            Cause::FollowingError,
            axis,
            &error,
            &self.following_error,
        ))
    }

    /// Out of line: rarely reached in a sample.
    #[inline(never)]
    fn trip(
        &mut self,
        readings: &Readings,
        [q, qd, last_qd, error, before]: [&Vector4<f32>; 5],
    ) -> Option<Fault> {
        let speed = first_beyond(qd, &self.speed);
        let range = first_beyond(&(q - self.middle), &self.reach);
        // A jump shows as a speed beyond its limit, if not as a following error.
        // Nor does an axis leave its way by full speed in one sample, unless it has got faster and faster until then, or after a gap.
        let leap = first_beyond(&(qd - last_qd), &(self.speed * 0.5));
        let is_sudden = readings.steps == 1 && leap.is_some();
        let share = if is_sudden { 0.5 } else { 1.0 };
        let jump = self.jumped(&(error - before), readings.steps as f32 * share);
        if jump.is_some() {
            return jump;
        }
        if self.following_count == 0 {
            self.velocity = readings.velocity;
        }
        let needed = self.needed;
        let following = most_beyond(error, &self.following_error);
        let following = count(&mut self.following_count, following, needed).map(|axis| {
            let cause = self.why_not_following(readings, axis, axis.of(qd) * axis.of(error));
            of_axis(cause, axis, error, &self.following_error)
        });
        let speed = count(&mut self.speed_count, speed, needed)
            .map(|axis| of_axis(Cause::OverSpeed, axis, qd, &self.speed));
        let range = count(&mut self.range_count, range, needed).map(|axis| {
            let side = (q - self.middle).map(f32::signum);
            let limit = self.middle + self.reach.component_mul(&side);
            of_axis(Cause::SoftLimit, axis, q, &limit)
        });
        following.or(speed).or(range)
    }

    /// What keeps an axis from following. A stop closes the loop through its encoder; the ways in which a wrong reading shows
    /// therefore have causes of their own, whose reaction does without that loop. A blocked axis looks like a stuck encoder,
    /// and needs no stop either. `approach` is below 0 for an axis that moves away from its reference.
    fn why_not_following(&self, readings: &Readings, axis: Axis, approach: f32) -> Cause {
        if readings.is_still(axis) {
            Cause::StuckSensor
        } else if approach < 0.0 && readings.defies_torque(axis, axis.of(&self.velocity)) {
            Cause::EncoderFault
        } else {
            Cause::FollowingError
        }
    }

    /// The first axis with an effort that the model does not explain, of those that it need not.
    pub fn feels(&mut self, disturbance: &Vector4<f32>) -> Option<Axis> {
        if is_within(disturbance, &self.collision) {
            self.collision_count = 0;
            return None;
        }
        first_beyond(disturbance, &self.collision)
    }

    /// Judges what an axis feels. An arm that has met something feels it, and so does one whose encoder does not show where it is: then it is
    /// what its loop makes of that. `last_qd` is the velocity in the last sample, and `wanted` that of the reference.
    // Out of line: rarely reached in a sample.
    #[inline(never)]
    pub fn felt(
        &mut self,
        axis: Axis,
        readings: &Readings,
        [qd, last_qd, disturbance, error, wanted]: [&Vector4<f32>; 5],
    ) -> Felt {
        if self.collision_count == 0 {
            // As fast as in the last sample, or, where it speeds up, as its reference. Of two in a row, the second is where the observer began
            // anew.
            let expected = [last_qd * 2.0, wanted * 3.0 - last_qd];
            if expected.iter().any(|it| self.missed(readings, qd, it))
                || self.missed(readings, last_qd, &(qd * 2.0))
            {
                return Felt::Missed;
            }
            (self.velocity_felt, self.wanted) = (readings.velocity, *wanted);
        }
        if count(&mut self.collision_count, Some(axis), self.needed).is_none() {
            return Felt::Nothing;
        }
        // Readings of whatever axis that do not go where it went until now are not those of an obstacle, which only slows it down in so few
        // samples, nor of a load that was lost or added, which does not throw it back as fast as it went.
        let axis = most_beyond(disturbance, &self.collision).unwrap_or(axis);
        let (before, now) = (self.wanted, wanted);
        let slow = self.speed * SLOW;
        let was_to_move = |axis: Axis| axis.of(&before).abs() > axis.of(&slow);
        let is_still = |axis: Axis| readings.stays_still(axis, axis.of(&self.velocity_felt));
        let is_back = |axis: Axis| {
            let (before, now, found) = (axis.of(&before), axis.of(now), axis.of(qd));
            was_to_move(axis) && now * before > 0.0 && found * before < -BACK * before * before
        };
        let went_back = Axis::ALL.map(is_back);
        let mut suspects = went_back;
        let felt = suspects.get_mut(axis as usize);
        felt.into_iter().for_each(|felt| *felt = true);
        let stands = Axis::ALL.map(|it| is_still(it) && (it == axis || was_to_move(it)));
        // Away from its reference, and not ahead of it on the same way.
        let is_away = (axis.of(qd) - axis.of(now)).abs() > 0.5 * axis.of(qd).abs();
        Felt::Fault(if let Some(axis) = self.farthest(stands, error) {
            of_axis(Cause::StuckSensor, axis, error, &Vector4::zeros())
        } else if went_back != [false; 4]
            && let Some(axis) = self.farthest(suspects, error)
        {
            of_axis(Cause::EncoderFault, axis, error, &Vector4::zeros())
        } else if is_away && readings.runs_away(axis, axis.of(&self.velocity_felt)) {
            of_axis(Cause::EncoderFault, axis, error, &Vector4::zeros())
        } else {
            of_axis(Cause::Collision, axis, disturbance, &self.collision)
        })
    }

    /// Of these axes the one that is farthest off its reference, as a share of what it may be: a faulty axis shakes the others.
    // Out of line, for the size of two copies.
    #[inline(never)]
    fn farthest(&self, is_one: [bool; 4], error: &Vector4<f32>) -> Option<Axis> {
        let share = error.component_div(&self.following_error).abs();
        let axes = Axis::ALL.into_iter().zip(is_one);
        let axes = axes.filter_map(|(axis, is_one)| is_one.then_some(axis));
        axes.reduce(|one, other| {
            if other.of(&share) > one.of(&share) {
                other
            } else {
                one
            }
        })
    }

    /// Whether the drives have left out a sample before this one without counting it, as when their clock has missed a tick: then every axis has
    /// moved as far as it was `expected` to in two, as velocities of one sample. More would look like too many jumps of an encoder.
    fn missed(&self, readings: &Readings, qd: &Vector4<f32>, expected: &Vector4<f32>) -> bool {
        let expected = expected.component_div(&self.speed);
        let found = qd.component_div(&self.speed);
        let off = found - expected;
        let is_alike = off.dot(&off) < ALIKE * found.dot(&found);
        let moves = expected.dot(&expected) > 4.0 * SLOW * SLOW;
        readings.steps == 1 && readings.is_measured() && moves && is_alike
    }

    /// An encoder that jumps further in these samples than its axis can move.
    pub fn jumped(&self, moved: &Vector4<f32>, samples: f32) -> Option<Fault> {
        let jump = self.jump * samples;
        most_beyond(moved, &jump).map(|axis| of_axis(Cause::EncoderFault, axis, moved, &jump))
    }

    /// Forgets the counts, for a new start.
    pub fn reset(&mut self) {
        (self.collision_count, self.following_count) = (0, 0);
        (self.speed_count, self.range_count) = (0, 0);
    }
}

/// Whether no axis is beyond its limit; NaN is beyond every one.
fn is_within(value: &Vector4<f32>, limit: &Vector4<f32>) -> bool {
    // The bits of magnitudes compare like integers.
    let beyond = |(value, limit): (&f32, &f32)| value.abs().to_bits() > limit.to_bits();
    !value.iter().zip(limit.iter()).any(beyond)
}

/// The first axis whose value is beyond its limit, by magnitude.
// Out of line: rarely reached in a sample.
#[inline(never)]
pub(super) fn first_beyond(value: &Vector4<f32>, limit: &Vector4<f32>) -> Option<Axis> {
    let beyond = |axis: &Axis| axis.of(value).abs().to_bits() > axis.of(limit).to_bits();
    Axis::ALL.into_iter().find(beyond)
}

/// The axis that is farthest beyond its limit: the lift is measured through the wrist, and a faulty axis shakes the others.
// Out of line: rarely reached in a sample.
#[inline(never)]
fn most_beyond(value: &Vector4<f32>, limit: &Vector4<f32>) -> Option<Axis> {
    first_beyond(value, limit)?;
    let share = value.component_div(limit).abs();
    let most = share.max();
    let mut axes = Axis::ALL.into_iter();
    axes.find(|axis| axis.of(&share) >= most)
}

/// Counts consecutive violations; returns the axis once there are `needed` of them.
fn count(counter: &mut u32, violation: Option<Axis>, needed: u32) -> Option<Axis> {
    if violation.is_none() {
        *counter = 0;
        return None;
    }
    *counter = counter.saturating_add(1);
    violation.filter(|_| *counter >= needed)
}

// Out of line: the faults of four limits, none of them in an ordinary sample.
#[inline(never)]
fn of_axis(cause: Cause, axis: Axis, value: &Vector4<f32>, limit: &Vector4<f32>) -> Fault {
    Fault {
        cause,
        axis: axis.into(),
        value: finite(axis.of(value)),
        limit: axis.of(limit),
    }
}

impl From<Axis> for FaultAxis {
    fn from(axis: Axis) -> Self {
        match axis {
            Axis::Shoulder => Self::Shoulder,
            Axis::Elbow => Self::Elbow,
            Axis::Lift => Self::Lift,
            Axis::Wrist => Self::Wrist,
        }
    }
}

/// The nearest number that can be reported.
fn finite(value: f32) -> f32 {
    if value.is_finite() { value } else { f32::MAX }
}
