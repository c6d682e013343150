//! Spatial vector algebra: Featherstone, Rigid Body Dynamics Algorithms (2008), chapter 2 and appendix A.
//!
//! Six-dimensional vectors are kept as an angular and a linear half, with the angular half first. A Pluecker
//! coordinate frame is one Cartesian frame; all quantities are expressed in its axes and taken about its origin.

use nalgebra::{Matrix3, Vector3};
use std::ops::{Add, AddAssign, Mul};

/// Motion vector: angular velocity (rad/s) and velocity of the body point at the frame's origin (m/s), or the time
/// derivatives of both, or a joint axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    /// Angular half.
    pub(super) angular: Vector3<f64>,
    /// Linear half.
    pub(super) linear: Vector3<f64>,
}

/// Force vector: moment about the frame's origin (N m) and force (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Force {
    /// Moment.
    pub(super) moment: Vector3<f64>,
    /// Force.
    pub(super) linear: Vector3<f64>,
}

/// Change of coordinates from frame A to frame B.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    /// Turns coordinates of A into coordinates of B.
    pub(super) rotation: Matrix3<f64>,
    /// Origin of B in coordinates of A, m.
    pub(super) origin: Vector3<f64>,
}

/// Inertia of a rigid body about the frame's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertia {
    /// kg.
    pub(super) mass: f64,
    /// First moment of mass: mass times centre of mass, kg m.
    pub(super) moment: Vector3<f64>,
    /// Second moments about the origin, kg m2.
    pub(super) rotational: Matrix3<f64>,
}

impl Motion {
    /// No motion.
    pub(super) fn zero() -> Self {
        Self {
            angular: Vector3::zeros(),
            linear: Vector3::zeros(),
        }
    }

    /// Spatial cross product with a motion vector: the rate of change of `other` as it moves with `self`.
    pub(super) fn cross(&self, other: &Motion) -> Motion {
        Motion {
            angular: self.angular.cross(&other.angular),
            linear: self.angular.cross(&other.linear) + self.linear.cross(&other.angular),
        }
    }

    /// Spatial cross product with a force vector: the rate of change of `force` as it moves with `self`.
    pub(super) fn cross_force(&self, force: &Force) -> Force {
        Force {
            moment: self.angular.cross(&force.moment) + self.linear.cross(&force.linear),
            linear: self.angular.cross(&force.linear),
        }
    }
}

impl Add for Motion {
    type Output = Motion;
    fn add(self, other: Motion) -> Motion {
        Motion {
            angular: self.angular + other.angular,
            linear: self.linear + other.linear,
        }
    }
}

impl Mul<f64> for Motion {
    type Output = Motion;
    fn mul(self, factor: f64) -> Motion {
        Motion {
            angular: self.angular * factor,
            linear: self.linear * factor,
        }
    }
}

impl Force {
    /// No force.
    pub(super) fn zero() -> Self {
        Self {
            moment: Vector3::zeros(),
            linear: Vector3::zeros(),
        }
    }
}

impl Add for Force {
    type Output = Force;
    fn add(self, other: Force) -> Force {
        Force {
            moment: self.moment + other.moment,
            linear: self.linear + other.linear,
        }
    }
}

impl AddAssign for Force {
    fn add_assign(&mut self, other: Force) {
        *self = *self + other;
    }
}

impl Transform {
    /// From a frame to itself.
    pub(super) fn identity() -> Self {
        Self {
            rotation: Matrix3::identity(),
            origin: Vector3::zeros(),
        }
    }

    /// To a frame with the same axes at `origin`.
    pub(super) fn translation(origin: Vector3<f64>) -> Self {
        Self {
            rotation: Matrix3::identity(),
            origin,
        }
    }

    /// To a frame with the same origin, turned by the angle with this sine and cosine about z.
    pub(super) fn rotation_z((sin, cos): (f64, f64)) -> Self {
        Self {
            rotation: Matrix3::new(cos, sin, 0.0, -sin, cos, 0.0, 0.0, 0.0, 1.0),
            origin: Vector3::zeros(),
        }
    }

    /// From A to C, where `self` goes from A to B and `next` from B to C.
    pub(super) fn then(&self, next: &Transform) -> Transform {
        Transform {
            rotation: next.rotation * self.rotation,
            origin: self.origin + self.rotation.tr_mul(&next.origin),
        }
    }

    /// A motion vector, from A to B.
    pub(super) fn motion(&self, a: &Motion) -> Motion {
        Motion {
            angular: self.rotation * a.angular,
            linear: self.rotation * (a.linear - self.origin.cross(&a.angular)),
        }
    }

    /// A force vector, from B to A.
    pub(super) fn force_back(&self, b: &Force) -> Force {
        let linear = self.rotation.tr_mul(&b.linear);
        Force {
            moment: self.rotation.tr_mul(&b.moment) + self.origin.cross(&linear),
            linear,
        }
    }

    /// An inertia, from B to A.
    pub(super) fn inertia_back(&self, b: &Inertia) -> Inertia {
        // Parallel axes twice in one step: from B's origin to the centre of mass and out again to A's.
        let turned = self.rotation.tr_mul(&b.moment);
        let moment = turned + self.origin * b.mass;
        Inertia {
            mass: b.mass,
            moment,
            rotational: self.rotation.tr_mul(&b.rotational) * self.rotation
                + minus_cross_cross(&self.origin, &turned)
                + minus_cross_cross(&moment, &self.origin),
        }
    }
}

impl Inertia {
    /// From mass (kg), centre of mass (m) and principal moments about it along the frame's axes (kg m2).
    pub(super) fn from_com(mass: f64, com: [f64; 3], principal: [f64; 3]) -> Self {
        let com = Vector3::from(com);
        Self {
            mass,
            moment: com * mass,
            rotational: Matrix3::from_diagonal(&principal.into())
                + minus_cross_cross(&com, &com) * mass,
        }
    }

    /// Momentum of the body at velocity `v`, or the force for acceleration `v`.
    pub(super) fn apply(&self, v: &Motion) -> Force {
        Force {
            moment: self.rotational * v.angular + self.moment.cross(&v.linear),
            linear: v.linear * self.mass - self.moment.cross(&v.angular),
        }
    }
}

impl Add for Inertia {
    type Output = Inertia;
    fn add(self, other: Inertia) -> Inertia {
        Inertia {
            mass: self.mass + other.mass,
            moment: self.moment + other.moment,
            rotational: self.rotational + other.rotational,
        }
    }
}

/// `-[a x][b x]`, which is `(a . b) 1 - b a^T`.
fn minus_cross_cross(a: &Vector3<f64>, b: &Vector3<f64>) -> Matrix3<f64> {
    Matrix3::from_diagonal_element(a.dot(b)) - b * a.transpose()
}
