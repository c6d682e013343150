//! Eq. 44-48 and the unnumbered lines between them: the Newton-Euler recursion, with each of its misprints selectable.
//!
//! With no misprint it is the recursion for standard DH frames (Luh, Walker, Paul 1980); with one misprint only that
//! line is the paper's, which shows the effect of that line; with all of them it is the paper's recursion.

use nalgebra::{Matrix3, Vector3, Vector4};

use super::kinematics::{DhRow, eq_2, table_1};
use crate::arm::{Arm, Link, State, rotation, translation};

/// A line of the recursion as printed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Misprint {
    /// Eq. 30: `w' = R w + thd z'`; the axis of the joint is z, not z'.
    AngularVelocity,
    /// No base acceleration: gravity does not occur anywhere in the recursion.
    NoGravity,
    /// Prismatic `a'`: the Coriolis term is `R (2 w' x dd z)` with the second derivative of d, and w' is of the wrong frame.
    Coriolis,
    /// Revolute `alpha'`: `R (alpha + w x thd z) + thdd z'`; the rate turns about z, the acceleration about z'.
    AngularAcceleration,
    /// Revolute `a'`: `R (a + alpha x P + w x (w x P))`, although P turns with the joint.
    OriginAcceleration,
    /// `a_c = a + w x (a x P_c) + w x (w x P_c)`, a linear acceleration where alpha belongs.
    ComAcceleration,
    /// `N = l_c alpha + w x (l_c w)` with l_c the distance to the centre of mass.
    LeverForInertia,
    /// Eq. 45: `f = R f'` with f' in frame i already, so rotated twice.
    ForceFrame,
    /// Eq. 46-48: moment about the origin of the distal frame, projected on its own z.
    DistalMoment,
}

impl Misprint {
    /// The recursion as printed.
    pub(crate) const ALL: [Self; 9] = [
        Self::AngularVelocity,
        Self::NoGravity,
        Self::Coriolis,
        Self::AngularAcceleration,
        Self::OriginAcceleration,
        Self::ComAcceleration,
        Self::LeverForInertia,
        Self::ForceFrame,
        Self::DistalMoment,
    ];
}

/// A joint of a chain: its DH row and how it moves.
pub(crate) struct Joint {
    pub row: DhRow,
    pub prismatic: bool,
    pub rate: f64,
    pub acceleration: f64,
}

/// Motion of a frame in its own axes: angular velocity, angular acceleration, acceleration of the origin.
#[derive(Clone, Copy, Default)]
pub(crate) struct Motion {
    pub w: Vector3<f64>,
    pub alpha: Vector3<f64>,
    pub a: Vector3<f64>,
}

/// One step of the outward pass.
pub(crate) fn outward(joint: &Joint, last: &Motion, misprints: &[Misprint]) -> Motion {
    let wrong = |m| misprints.contains(&m);
    let link = eq_2(&joint.row);
    let r = rotation(&link).transpose();
    let p = translation(&link);
    let rate = Vector3::z() * joint.rate;
    let acceleration = Vector3::z() * joint.acceleration;
    let about =
        |m: &Motion, lever: Vector3<f64>| m.alpha.cross(&lever) + m.w.cross(&m.w.cross(&lever));
    let mut next = Motion::default();
    if joint.prismatic {
        next.w = r * last.w;
        next.alpha = r * last.alpha;
        next.a = r * (last.a + acceleration + about(last, p))
            + if wrong(Misprint::Coriolis) {
                r * (2.0 * next.w.cross(&acceleration))
            } else {
                2.0 * next.w.cross(&(r * rate))
            };
    } else {
        next.w = if wrong(Misprint::AngularVelocity) {
            r * last.w + rate
        } else {
            r * (last.w + rate)
        };
        next.alpha = if wrong(Misprint::AngularAcceleration) {
            r * (last.alpha + last.w.cross(&rate)) + acceleration
        } else {
            r * (last.alpha + last.w.cross(&rate) + acceleration)
        };
        next.a = if wrong(Misprint::OriginAcceleration) {
            r * (last.a + about(last, p))
        } else {
            r * last.a + about(&next, r * p)
        };
    }
    next
}

/// Joint efforts: torque, torque, force, torque (N m, N).
pub(crate) fn inverse_dynamics(arm: &Arm, state: &State, misprints: &[Misprint]) -> Vector4<f64> {
    let wrong = |m| misprints.contains(&m);
    let rows = table_1(arm, &state.q);
    let mut motion = Motion::default();
    if !wrong(Misprint::NoGravity) {
        // A base accelerating upwards loads the arm like its weight (Featherstone 2008, section 5.3).
        motion.a = Vector3::z() * arm.g;
    }
    let motions: [Motion; 4] = std::array::from_fn(|i| {
        let joint = Joint {
            row: rows[i],
            prismatic: i == 2,
            rate: state.qd[i],
            acceleration: state.qdd[i],
        };
        motion = outward(&joint, &motion, misprints);
        motion
    });

    let transforms = rows.map(|row| eq_2(&row));
    let mut tau = Vector4::zeros();
    let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
    for i in (0..4).rev() {
        let link = &arm.links[i];
        let (inertia_force, inertia_moment) = inertial(link, &motions[i], misprints);
        // Rotation and origin of the next frame in this one; there is no load at the flange.
        let (r_next, p_next) = match transforms.get(i + 1) {
            Some(t) => (rotation(t), translation(t)),
            None => (Matrix3::identity(), Vector3::zeros()),
        };
        let carried = r_next * force;
        let to_joint = rotation(&transforms[i]).transpose();
        if wrong(Misprint::DistalMoment) {
            moment = r_next * moment
                + inertia_moment
                + link.com.cross(&inertia_force)
                + p_next.cross(&carried);
        } else {
            let p = to_joint * translation(&transforms[i]);
            moment = r_next * moment
                + inertia_moment
                + (p + link.com).cross(&inertia_force)
                + p.cross(&carried);
        }
        force = inertia_force
            + if wrong(Misprint::ForceFrame) {
                r_next * carried
            } else {
                carried
            };
        let axis = if wrong(Misprint::DistalMoment) {
            Vector3::z()
        } else {
            to_joint * Vector3::z()
        };
        tau[i] = if i == 2 { force } else { moment }.dot(&axis);
    }
    tau
}

/// Force F and moment N for the motion of a link.
fn inertial(link: &Link, motion: &Motion, misprints: &[Misprint]) -> (Vector3<f64>, Vector3<f64>) {
    let wrong = |m| misprints.contains(&m);
    let Motion { w, alpha, a } = *motion;
    let turning = if wrong(Misprint::ComAcceleration) {
        w.cross(&a.cross(&link.com))
    } else {
        alpha.cross(&link.com)
    };
    let a_c = a + turning + w.cross(&w.cross(&link.com));
    let inertia = if wrong(Misprint::LeverForInertia) {
        Matrix3::identity() * link.com.norm()
    } else {
        link.inertia
    };
    (link.mass * a_c, inertia * alpha + w.cross(&(inertia * w)))
}
