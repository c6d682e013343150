//! Kinematics of the flange: pose, velocity, and inverse kinematics.

use super::arm::{Arm, Configuration, WRIST};
use crate::maths::{atan2, hypot, sin_cos, square};
use crate::model::{Geometry, JointLimits};
use nalgebra::{Matrix3, SMatrix, Vector2, Vector3, Vector4, Vector6};
use std::f64::consts::{PI, TAU};

/// Pose of the flange in the coordinates that a SCARA can move; it always points down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// m, frame 0.
    pub x: f64,
    /// m, frame 0.
    pub y: f64,
    /// m, frame 0, up.
    pub z: f64,
    /// `theta1 + theta2 - theta4`, rad in (-pi, pi].
    pub yaw: f64,
}

/// The violated limit of an otherwise possible solution.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Violation {
    /// The elbow folds or stretches too far.
    Elbow,
    /// Axis 1 would exceed its limit.
    Shoulder,
    /// The target is above the retracted shaft.
    TooHigh,
    /// The target is below the extended shaft.
    TooLow,
    /// No turn of axis 4 gives the yaw.
    Wrist,
}

/// One of the two solutions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Solution {
    /// Joint positions; revolute ones in (-pi, pi].
    pub q: Vector4<f64>,
    /// The first limit that the solution breaks, in the order of [`Violation`].
    pub violation: Option<Violation>,
}

impl Solution {
    /// The same with theta4 in this turn, `turn` whole revolutions from where it is; without one, in the turn nearest to 0
    /// that the limits allow.
    #[must_use]
    pub fn in_turn(mut self, limits: &JointLimits, turn: Option<i8>) -> Self {
        const MOST: i8 = 8;
        let within = |theta4: &f64| {
            (limits.lower[3] - TOLERANCE..=limits.upper[3] + TOLERANCE).contains(theta4)
        };
        let own = self.q[3];
        let turned = |turn: i8| own + TAU * f64::from(turn);
        if let Some(turn) = turn {
            self.q[3] = turned(turn);
            let of_wrist = (!within(&self.q[3])).then_some(Violation::Wrist);
            let of_others = self.violation.filter(|which| *which != Violation::Wrist);
            self.violation = of_others.or(of_wrist);
        } else {
            let turns = (-MOST..=MOST).map(turned).filter(within);
            let nearest = turns.min_by(|a, b| a.abs().total_cmp(&b.abs()));
            self.q[3] = nearest.unwrap_or(own);
        }
        self
    }
}

/// Radius that the arm lengths do not allow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unreachable {
    /// Beyond the stretched arm.
    TooFar,
    /// Inside the folded arm.
    InsideHole,
}

/// Radii (m) and limits (m, rad) count as reached within this: far below any mechanism, far above rounding.
const TOLERANCE: f64 = 1e-9;

impl Arm {
    /// Origin (m) and orientation of the flange in frame 0.
    pub fn flange(&self, at: &Configuration) -> (Vector3<f64>, Matrix3<f64>) {
        let (_, origin) = self.elbow_and_flange(at);
        let (sin, cos) = sin_cos(at.q[0] + at.q[1] + WRIST * at.q[3]);
        // Turned by the yaw about the vertical, and pointing down.
        let rotation = Matrix3::new(cos, sin, 0.0, sin, -cos, 0.0, 0.0, 0.0, -1.0);
        (origin, rotation)
    }

    /// Forward kinematics.
    pub fn pose(&self, at: &Configuration) -> Pose {
        let (_, origin) = self.elbow_and_flange(at);
        Pose {
            x: origin.x,
            y: origin.y,
            z: origin.z,
            yaw: wrap(at.q[0] + at.q[1] + WRIST * at.q[3]),
        }
    }

    /// Geometric Jacobian of the flange origin, in the axes of frame 0; rows vx vy vz wx wy wz.
    pub fn jacobian(&self, at: &Configuration) -> SMatrix<f64, 6, 4> {
        let (elbow, flange) = self.elbow_and_flange(at);
        let forearm = flange - elbow;
        SMatrix::from_columns(&[
            Vector6::new(-flange.y, flange.x, 0.0, 0.0, 0.0, 1.0),
            Vector6::new(-forearm.y, forearm.x, 0.0, 0.0, 0.0, 1.0),
            Vector6::new(0.0, 0.0, -1.0, 0.0, 0.0, 0.0),
            Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, WRIST),
        ])
    }

    /// Velocity of the flange origin (m/s) over its angular velocity (rad/s), in the axes of frame 0.
    pub fn twist(&self, at: &Configuration, qd: &Vector4<f64>) -> Vector6<f64> {
        self.jacobian(at) * qd
    }

    /// Time derivative of the Jacobian times `qd`: the classical acceleration of the flange at zero joint acceleration,
    /// which is what keeps each arm's end on its circle.
    pub fn jacobian_rate_times(&self, at: &Configuration, qd: &Vector4<f64>) -> Vector6<f64> {
        let (elbow, flange) = self.elbow_and_flange(at);
        let forearm = flange - elbow;
        let (first, second) = (square(qd[0]), square(qd[0] + qd[1]));
        Vector6::new(
            -first * elbow.x - second * forearm.x,
            -first * elbow.y - second * forearm.y,
            0.0,
            0.0,
            0.0,
            0.0,
        )
    }

    /// Where axis 2 meets the height of the flange, and the origin of the flange; m, frame 0.
    fn elbow_and_flange(&self, at: &Configuration) -> (Vector3<f64>, Vector3<f64>) {
        let Geometry { d1, d2, d4, .. } = self.geometry;
        let (sin, cos) = sin_cos(at.q[0]);
        let z = d1 + d2 - d4 - at.q[2];
        let in_frame_0 =
            |v: Vector2<f64>| Vector3::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y, z);
        (in_frame_0(at.elbow), in_frame_0(at.elbow + at.wrist))
    }
}

/// Inverse kinematics: the solutions with `theta2 >= 0` and with `theta2 <= 0`, in this order.
///
/// Half-angle form of the law of cosines, which stays well conditioned up to the stretched arm; radii beyond the
/// workspace by less than 1e-9 m are moved onto its border.
pub fn inverse(
    geometry: &Geometry,
    limits: &JointLimits,
    pose: &Pose,
) -> Result<[Solution; 2], Unreachable> {
    let Geometry { a1, a2, d1, d2, d4 } = *geometry;
    let radius = hypot(pose.x, pose.y);
    let (outer, inner) = (a1 + a2, (a1 - a2).abs());
    if radius > outer + TOLERANCE {
        return Err(Unreachable::TooFar);
    }
    if radius < inner - TOLERANCE {
        return Err(Unreachable::InsideHole);
    }
    let to_outer = ((outer - radius) * (outer + radius)).max(0.0).sqrt();
    let to_inner = ((radius - inner) * (radius + inner)).max(0.0).sqrt();
    Ok([1.0, -1.0].map(|side| {
        let theta2 = side * 2.0 * atan2(to_outer, to_inner);
        let (sin, cos) = sin_cos(theta2);
        let theta1 = wrap(atan2(pose.y, pose.x) - atan2(a2 * sin, a1 + a2 * cos));
        let q = Vector4::new(
            theta1,
            theta2,
            d1 + d2 - d4 - pose.z,
            wrap(theta1 + theta2 - pose.yaw),
        );
        Solution {
            q,
            violation: violation(limits, &q),
        }
    }))
}

fn violation(limits: &JointLimits, q: &Vector4<f64>) -> Option<Violation> {
    let within = |axis: usize, value: f64| {
        (limits.lower[axis] - TOLERANCE..=limits.upper[axis] + TOLERANCE).contains(&value)
    };
    // Only the smallest turn not below the lower limit needs checking.
    let some_turn_within = |axis: usize| {
        let turns = ((limits.lower[axis] - TOLERANCE - q[axis]) / TAU).ceil();
        within(axis, q[axis] + TAU * turns)
    };
    if !some_turn_within(1) {
        Some(Violation::Elbow)
    } else if !some_turn_within(0) {
        Some(Violation::Shoulder)
    } else if q[2] < limits.lower[2] - TOLERANCE {
        Some(Violation::TooHigh)
    } else if q[2] > limits.upper[2] + TOLERANCE {
        Some(Violation::TooLow)
    } else if !some_turn_within(3) {
        Some(Violation::Wrist)
    } else {
        None
    }
}

/// The same angle in (-pi, pi].
pub fn wrap(angle: f64) -> f64 {
    angle - TAU * ((angle - PI) / TAU).ceil()
}
