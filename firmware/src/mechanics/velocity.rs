//! Velocity propagation: the velocities of all link frames, from the base outwards.
//!
//! The paper's eq. 30 to 33 apply the joint rate about the axis of the new frame, which is right for Craig's modified
//! Denavit-Hartenberg frames. The arm's table is the standard one, where joint i + 1 turns about z of frame i. With the
//! half turn between frames 1 and 2 the difference flips signs (eq. 34 to 39 as printed), so here the joint rate is
//! added before the vector is transformed to the new frame.
//!
//! Paper functions; not on the control path, which takes tool velocities from the Jacobian.

use nalgebra::{Vector3, Vector4};

use crate::mechanics::kinematics::LinkFrame;

/// Velocity of one link frame, components in that frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkVelocity {
    /// Angular velocity (rad/s).
    pub angular: Vector3<f32>,
    /// Velocity of the origin (m/s).
    pub linear: Vector3<f32>,
}

impl LinkVelocity {
    const REST: Self = Self {
        angular: Vector3::new(0.0, 0.0, 0.0),
        linear: Vector3::new(0.0, 0.0, 0.0),
    };

    /// The next frame, turning about z of this one at `rate` (eq. 30 and 32, corrected).
    fn revolute(&self, frame: &LinkFrame, rate: f32) -> Self {
        let angular = frame.carry(&(self.angular + Vector3::new(0.0, 0.0, rate)));
        Self {
            angular,
            linear: frame.carry(&self.linear) + angular.cross(&frame.offset),
        }
    }

    /// The next frame, moving along z of this one at `rate` (eq. 31 and 33, corrected).
    fn prismatic(&self, frame: &LinkFrame, rate: f32) -> Self {
        let angular = frame.carry(&self.angular);
        let linear = frame.carry(&(self.linear + Vector3::new(0.0, 0.0, rate)));
        Self {
            angular,
            linear: linear + angular.cross(&frame.offset),
        }
    }
}

/// Velocities of frames 1 to 4 at joint speeds `qd`, given the frames of the joint position
/// ([`link_frames`](crate::mechanics::kinematics::link_frames)).
#[must_use]
pub fn propagate(frames: &[LinkFrame; 4], qd: &Vector4<f32>) -> [LinkVelocity; 4] {
    let [arm1, arm2, lift, wrist] = frames;
    let v1 = LinkVelocity::REST.revolute(arm1, qd.x);
    let v2 = v1.revolute(arm2, qd.y);
    let v3 = v2.prismatic(lift, qd.z);
    let v4 = v3.revolute(wrist, qd.w);
    [v1, v2, v3, v4]
}
