//! Watches what the drives report; limited is not failed: limits are flags, these are faults.

use nalgebra::Vector4;
use protocol::messages::{Cause, DriveStatus};
use serde::{Deserialize, Serialize};

use crate::mechanics::arm::{ArmModel, Axis};

/// Limits whose violation stops the arm.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MonitorLimits {
    /// Largest following error: rad, rad, m, rad.
    pub following_error: Vector4<f32>,
    /// Largest joint speed as a multiple of the arm's limit.
    pub speed_factor: f32,
    /// How far past its range a joint may be: rad, rad, m, rad.
    pub range_margin: Vector4<f32>,
    /// Samples in a row before a violation counts.
    pub samples: u8,
}

impl MonitorLimits {
    /// Limits for a bench: an arm that keeps them follows its path visibly well.
    pub const DEFAULT: Self = Self {
        following_error: Vector4::new(0.05, 0.05, 0.01, 0.2),
        speed_factor: 1.1,
        range_margin: Vector4::new(0.02, 0.02, 0.002, 0.05),
        samples: 3,
    };
}

/// Watches one arm: its limits, made ready for every sample, and violations in a row.
#[derive(Clone, Copy, Debug)]
pub struct Monitor {
    following_error: Vector4<f32>,
    speed: Vector4<f32>,
    /// Middle of the joint ranges, and how far from it a joint may be.
    middle: Vector4<f32>,
    reach: Vector4<f32>,
    needed: u8,
    following_count: u8,
    speed_count: u8,
    range_count: u8,
}

/// A fault with the axis and value that caused it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Finding {
    /// What is wrong.
    pub cause: Cause,
    /// Axis, where one is to blame.
    pub axis: Option<Axis>,
    /// Value found, in the unit of the axis.
    pub value: f32,
}

impl Monitor {
    /// A monitor of `arm` that has seen nothing.
    pub fn new(arm: &ArmModel, limits: &MonitorLimits) -> Self {
        Self {
            following_error: limits.following_error,
            speed: arm.limits.velocity * limits.speed_factor,
            middle: 0.5 * (arm.limits.upper + arm.limits.lower),
            reach: 0.5 * (arm.limits.upper - arm.limits.lower) + limits.range_margin,
            needed: limits.samples,
            following_count: 0,
            speed_count: 0,
            range_count: 0,
        }
    }

    /// Judges one sample; `error` is reference minus measured position.
    pub fn check(
        &mut self,
        status: DriveStatus,
        q: &Vector4<f32>,
        qd: &Vector4<f32>,
        error: &Vector4<f32>,
    ) -> Option<Finding> {
        if status.contains(DriveStatus::FAULT) || !status.contains(DriveStatus::ENCODER_VALID) {
            return Some(Finding {
                cause: Cause::DriveFault,
                axis: None,
                value: f32::from(status.bits()),
            });
        }
        let following = first_beyond(error, &self.following_error);
        let speed = first_beyond(qd, &self.speed);
        let range = first_beyond(&(q - self.middle), &self.reach);
        let needed = self.needed;
        let following = count(
            &mut self.following_count,
            following,
            needed,
            Cause::FollowingError,
        );
        let speed = count(&mut self.speed_count, speed, needed, Cause::OverSpeed);
        let range = count(&mut self.range_count, range, needed, Cause::SoftLimit);
        following.or(speed).or(range)
    }

    /// Forgets the counts, for a new start.
    pub fn reset(&mut self) {
        self.following_count = 0;
        self.speed_count = 0;
        self.range_count = 0;
    }
}

fn first_beyond(value: &Vector4<f32>, limit: &Vector4<f32>) -> Option<(Axis, f32)> {
    Axis::ALL
        .into_iter()
        .zip(value.iter())
        .zip(limit.iter())
        // By their bits, magnitudes compare like integers, and a NaN is beyond every limit.
        .find(|((_, value), limit)| value.abs().to_bits() > limit.to_bits())
        .map(|((axis, value), _)| (axis, *value))
}

fn count(
    counter: &mut u8,
    violation: Option<(Axis, f32)>,
    needed: u8,
    cause: Cause,
) -> Option<Finding> {
    let Some((axis, value)) = violation else {
        *counter = 0;
        return None;
    };
    *counter = counter.saturating_add(1);
    (*counter >= needed).then_some(Finding {
        cause,
        axis: Some(axis),
        value,
    })
}
