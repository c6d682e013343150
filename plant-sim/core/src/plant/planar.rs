//! Planar vector algebra: Featherstone, Rigid Body Dynamics Algorithms (2008), section 2.16.
//!
//! The spatial algebra of bodies that move in parallel planes. A motion vector is an angular velocity about the normal of
//! the plane and the velocity of the body point at the frame's origin; a force vector is a moment and a force. All
//! quantities are in the axes of one frame and about its origin.

use std::ops::{Add, AddAssign};

/// Motion vector: angular velocity (rad/s) and velocity of the body point at the frame's origin (m/s), or the time
/// derivatives of both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Motion {
    pub(super) angular: f64,
    pub(super) x: f64,
    pub(super) y: f64,
}

/// Force vector: moment about the frame's origin (N m) and force (N).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Force {
    pub(super) moment: f64,
    pub(super) x: f64,
    pub(super) y: f64,
}

/// Change of coordinates from frame A to frame B, whose origin lies on the x axis of A.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Transform {
    /// Origin of B in A, m.
    pub(super) along: f64,
    /// Sine and cosine of the angle that turns the axes of A into those of B.
    pub(super) turn: (f64, f64),
}

/// Inertia of a rigid body about the frame's origin.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Inertia {
    /// kg.
    pub(super) mass: f64,
    /// First moment of mass: mass times centre of mass, kg m.
    pub(super) first: [f64; 2],
    /// Second moment about the origin, kg m2.
    pub(super) second: f64,
}

impl Motion {
    /// A turn about the frame's origin.
    pub(super) fn rotation(angular: f64) -> Self {
        Self {
            angular,
            x: 0.0,
            y: 0.0,
        }
    }

    /// Rate of change of a turn about the origin, `rate`, as it moves with `self`: the spatial cross product.
    pub(super) fn cross_rotation(&self, rate: f64) -> Self {
        Self {
            angular: 0.0,
            x: self.y * rate,
            y: -self.x * rate,
        }
    }

    /// Rate of change of `force` as it moves with `self`.
    pub(super) fn cross_force(&self, force: &Force) -> Force {
        Force {
            moment: self.x * force.y - self.y * force.x,
            x: -self.angular * force.y,
            y: self.angular * force.x,
        }
    }

    /// Power of `force` on this motion, W.
    pub(super) fn dot(&self, force: &Force) -> f64 {
        self.angular * force.moment + self.x * force.x + self.y * force.y
    }
}

impl Add for Motion {
    type Output = Motion;
    fn add(self, other: Motion) -> Motion {
        Motion {
            angular: self.angular + other.angular,
            x: self.x + other.x,
            y: self.y + other.y,
        }
    }
}

impl Add for Force {
    type Output = Force;
    fn add(self, other: Force) -> Force {
        Force {
            moment: self.moment + other.moment,
            x: self.x + other.x,
            y: self.y + other.y,
        }
    }
}

impl AddAssign for Force {
    fn add_assign(&mut self, other: Force) {
        *self = *self + other;
    }
}

impl Transform {
    /// A motion vector, from A to B.
    pub(super) fn motion(&self, a: &Motion) -> Motion {
        let (sin, cos) = self.turn;
        let y = a.y + a.angular * self.along;
        Motion {
            angular: a.angular,
            x: cos * a.x + sin * y,
            y: cos * y - sin * a.x,
        }
    }

    /// A force vector, from B to A.
    pub(super) fn force_back(&self, b: &Force) -> Force {
        let [x, y] = self.turn_back([b.x, b.y]);
        Force {
            moment: b.moment + self.along * y,
            x,
            y,
        }
    }

    /// An inertia, from B to A.
    pub(super) fn inertia_back(&self, b: &Inertia) -> Inertia {
        let [x, y] = self.turn_back(b.first);
        // Parallel axes twice in one step: from B's origin to the centre of mass and out again to A's.
        Inertia {
            mass: b.mass,
            first: [x + b.mass * self.along, y],
            second: b.second + self.along * (2.0 * x + b.mass * self.along),
        }
    }

    /// The components in A of a vector of the plane with these components in B.
    pub(super) fn turn_back(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn;
        [cos * x - sin * y, sin * x + cos * y]
    }
}

impl Inertia {
    /// From mass (kg), centre of mass (m) and the moment of inertia about it (kg m2).
    pub(super) fn from_com(mass: f64, [x, y]: [f64; 2], about_com: f64) -> Self {
        Self {
            mass,
            first: [mass * x, mass * y],
            second: about_com + mass * (x * x + y * y),
        }
    }

    /// Momentum of the body at velocity `v`, or the force for acceleration `v`.
    pub(super) fn apply(&self, v: &Motion) -> Force {
        let [x, y] = self.first;
        Force {
            moment: self.second * v.angular + x * v.y - y * v.x,
            x: self.mass * v.x - y * v.angular,
            y: self.mass * v.y + x * v.angular,
        }
    }

    /// Kinetic energy at velocity `v`, J.
    pub(super) fn kinetic_energy(&self, v: &Motion) -> f64 {
        0.5 * v.dot(&self.apply(v))
    }
}

impl Add for Inertia {
    type Output = Inertia;
    fn add(self, other: Inertia) -> Inertia {
        Inertia {
            mass: self.mass + other.mass,
            first: [
                self.first[0] + other.first[0],
                self.first[1] + other.first[1],
            ],
            second: self.second + other.second,
        }
    }
}
