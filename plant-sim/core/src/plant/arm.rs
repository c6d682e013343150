//! The rigid chain: Newton-Euler equations and composite rigid bodies, for links only; rotors and friction are in
//! [`super::drive`].
//!
//! All axes of a SCARA are parallel. Its links therefore move in horizontal planes, apart from the lift, which is
//! independent of the rotations: three bodies turn (upper arm, forearm with the sleeve of the shaft, shaft with
//! payload), and the shaft's mass moves up and down separately. Seen from above a body is a mass, a centre of mass and a
//! moment of inertia about the vertical through it, and nothing else of it matters.
//!
//! Every position is in the axes of the upper arm, so that no vector has to change its coordinates. Forces are mass times
//! acceleration of the centres of mass, and what they do to a joint is their lever about it.
//!
//! The controller's dynamics come from Lagrange's equations and from Denavit-Hartenberg frames. This derivation shares no
//! formula with them, so that the plant can contradict the controller. The tests compare it with the recursive algorithms
//! in six dimensions (Featherstone, Rigid Body Dynamics Algorithms, 2008), which know nothing of a SCARA.

use crate::maths::{sin_cos, square};
use crate::model::{Geometry, Payload, RobotModel};
use nalgebra::{Matrix4, Vector2, Vector4};

/// A serial chain of four rigid links with one joint each, and the payload at its flange.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    pub(super) geometry: Geometry,
    /// Turning bodies, each from its own joint, in axes that are those of frame 0 at joint position zero.
    upper_arm: Body,
    forearm: Body,
    shaft: Body,
    /// Mass carried by the lift, kg.
    lifted: f64,
    /// Heights of all centres of mass above frame 0 with the lift at zero, times their masses, kg m.
    first_moment: f64,
    /// Acceleration of gravity along -z of frame 0, m/s2.
    gravity: f64,
}

/// A rigid body seen from above.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Body {
    /// kg.
    mass: f64,
    /// Centre of mass, m.
    com: Vector2<f64>,
    /// Moment of inertia about the centre of mass, kg m2.
    inertia: f64,
}

/// Direction of the wrist's rotation seen from above: its axis points down.
pub(super) const WRIST: f64 = -1.0;

/// The arm at one set of joint positions, so that trigonometry is done once. Vectors (m) are in the axes of the upper arm.
#[derive(Clone, Copy, Debug)]
pub struct Configuration {
    pub(super) q: Vector4<f64>,
    /// From the shoulder to the elbow, and from there to the wrist.
    pub(super) elbow: Vector2<f64>,
    pub(super) wrist: Vector2<f64>,
    /// Centres of mass: the forearm's from the elbow, the shaft's from the wrist.
    forearm: Vector2<f64>,
    shaft: Vector2<f64>,
}

impl Body {
    /// This body and another one, moved by `offset`, as one.
    fn with(&self, other: &Self, offset: Vector2<f64>) -> Self {
        let mass = self.mass + other.mass;
        let between = other.com + offset - self.com;
        let share = other.mass / mass;
        Self {
            mass,
            com: self.com + between * share,
            inertia: self.inertia + other.inertia + self.mass * share * between.dot(&between),
        }
    }

    /// Moment about a point for a unit of angular acceleration about another one; the centre of mass from both.
    fn moment(&self, from_one: Vector2<f64>, from_other: Vector2<f64>) -> f64 {
        self.inertia + self.mass * from_one.dot(&from_other)
    }
}

/// A vector of constant length that turns at these rates: its second derivative.
fn second_derivative(vector: Vector2<f64>, speed: f64, acceleration: f64) -> Vector2<f64> {
    turned(vector) * acceleration - vector * square(speed)
}

/// The vector turned by a right angle: its derivative at a unit of angular velocity.
fn turned(vector: Vector2<f64>) -> Vector2<f64> {
    Vector2::new(-vector.y, vector.x)
}

/// Angular velocities of the turning bodies, or the accelerations.
fn absolute(joints: &Vector4<f64>) -> [f64; 3] {
    let forearm = joints[0] + joints[1];
    [joints[0], forearm, forearm + WRIST * joints[3]]
}

impl Arm {
    /// The chain of `model`, holding `payload`.
    pub fn new(model: &RobotModel, payload: Option<&Payload>) -> Self {
        let geometry = model.geometry;
        let [upper_arm, forearm, sleeve, shaft] = model.links;
        // Frames 3 and 4 point down: turned about x, so that their y is the other way round.
        let above = |mass, [x, y, _]: [f64; 3], [.., inertia]: [f64; 3]| Body {
            mass,
            com: Vector2::new(x, y),
            inertia,
        };
        let below = |mass, [x, y, z]: [f64; 3], inertia| above(mass, [x, -y, z], inertia);
        let mut turning = below(shaft.mass, shaft.com, shaft.inertia);
        let top = geometry.d1 + geometry.d2;
        let mut first_moment = upper_arm.mass * upper_arm.com[2]
            + forearm.mass * (geometry.d1 + forearm.com[2])
            + sleeve.mass * (top - sleeve.com[2])
            + shaft.mass * (top - shaft.com[2]);
        if let Some(payload) = payload {
            let held = below(payload.mass, payload.com, payload.inertia);
            turning = turning.with(&held, Vector2::zeros());
            first_moment += payload.mass * (top - geometry.d4 - payload.com[2]);
        }
        Self {
            geometry,
            upper_arm: above(upper_arm.mass, upper_arm.com, upper_arm.inertia),
            forearm: above(forearm.mass, forearm.com, forearm.inertia).with(
                &below(sleeve.mass, sleeve.com, sleeve.inertia),
                Vector2::new(geometry.a2, 0.0),
            ),
            shaft: turning,
            lifted: sleeve.mass + turning.mass,
            first_moment,
            gravity: model.gravity,
        }
    }

    /// The arm at joint positions `q`.
    pub fn at(&self, q: &Vector4<f64>) -> Configuration {
        let turn = |(sin, cos): (f64, f64), v: Vector2<f64>| {
            Vector2::new(cos * v.x - sin * v.y, sin * v.x + cos * v.y)
        };
        let elbow = sin_cos(q[1]);
        let shaft = self.shaft.com;
        Configuration {
            q: *q,
            elbow: Vector2::new(self.geometry.a1, 0.0),
            wrist: turn(elbow, Vector2::new(self.geometry.a2, 0.0)),
            forearm: turn(elbow, self.forearm.com),
            // Often on the axis, where nothing turns it away.
            shaft: if shaft == Vector2::zeros() {
                shaft
            } else {
                turn(sin_cos(q[1] + WRIST * q[3]), shaft)
            },
        }
    }

    /// Joint efforts for accelerations `qdd`: `M qdd + C qd + g`, N m and N.
    pub fn inverse_dynamics(
        &self,
        at: &Configuration,
        qd: &Vector4<f64>,
        qdd: &Vector4<f64>,
    ) -> Vector4<f64> {
        let (speed, turning) = (absolute(qd), absolute(qdd));
        let moves = |body: usize, vector| second_derivative(vector, speed[body], turning[body]);
        let elbow = moves(0, at.elbow);
        let on_forearm = (elbow + moves(1, at.forearm)) * self.forearm.mass;
        let on_shaft = (elbow + moves(1, at.wrist) + moves(2, at.shaft)) * self.shaft.mass;
        let wrist = self.shaft.inertia * turning[2] + at.shaft.perp(&on_shaft);
        let elbow = self.forearm.inertia * turning[1]
            + at.forearm.perp(&on_forearm)
            + at.wrist.perp(&on_shaft)
            + wrist;
        let com = self.upper_arm.com;
        let shoulder = self.upper_arm.moment(com, com) * turning[0]
            + at.elbow.perp(&(on_forearm + on_shaft))
            + elbow;
        // Downwards is positive, so gravity helps: a base that accelerates upwards is indistinguishable from it.
        let lift = self.lifted * (qdd[2] - self.gravity);
        Vector4::new(shoulder, elbow, lift, WRIST * wrist)
    }

    /// `C qd + g`: the efforts that hold the joint speeds constant.
    pub fn bias(&self, at: &Configuration, qd: &Vector4<f64>) -> Vector4<f64> {
        self.inverse_dynamics(at, qd, &Vector4::zeros())
    }

    /// `g`: the efforts that hold the arm at rest.
    pub fn gravity(&self, at: &Configuration) -> Vector4<f64> {
        self.bias(at, &Vector4::zeros())
    }

    /// Mass matrix of the joint space.
    ///
    /// An element is the moment about one joint for a unit of acceleration of another one, which turns all bodies beyond
    /// both.
    pub fn mass_matrix(&self, at: &Configuration) -> Matrix4<f64> {
        let com = self.upper_arm.com;
        let forearm = [at.elbow + at.forearm, at.forearm];
        let shaft = [
            at.elbow + at.wrist + at.shaft,
            at.wrist + at.shaft,
            at.shaft,
        ];
        let both = |one: usize, other: usize| {
            self.forearm.moment(forearm[one], forearm[other])
                + self.shaft.moment(shaft[one], shaft[other])
        };
        let m11 = self.upper_arm.moment(com, com) + both(0, 0);
        let (m21, m22) = (both(1, 0), both(1, 1));
        let m41 = WRIST * self.shaft.moment(shaft[2], shaft[0]);
        let m42 = WRIST * self.shaft.moment(shaft[2], shaft[1]);
        let m44 = self.shaft.moment(shaft[2], shaft[2]);
        #[rustfmt::skip]
        let matrix = Matrix4::new(
            m11, m21, 0.0, m41,
            m21, m22, 0.0, m42,
            0.0, 0.0, self.lifted, 0.0,
            m41, m42, 0.0, m44,
        );
        matrix
    }

    /// Kinetic energy of the links, from the velocity of each, J.
    pub fn kinetic_energy(&self, at: &Configuration, qd: &Vector4<f64>) -> f64 {
        let speed = absolute(qd);
        let moves = |body: usize, vector| turned(vector) * speed[body];
        let elbow = moves(0, at.elbow);
        let energy = |body: &Body, turns: f64, velocity: Vector2<f64>| {
            0.5 * (body.mass * velocity.dot(&velocity) + body.inertia * square(turns))
        };
        energy(&self.upper_arm, speed[0], moves(0, self.upper_arm.com))
            + energy(&self.forearm, speed[1], elbow + moves(1, at.forearm))
            + energy(
                &self.shaft,
                speed[2],
                elbow + moves(1, at.wrist) + moves(2, at.shaft),
            )
            + 0.5 * self.lifted * square(qd[2])
    }

    /// Potential energy of the links, zero with all mass in the plane of frame 0, J.
    pub fn potential_energy(&self, at: &Configuration) -> f64 {
        self.gravity * (self.first_moment - self.lifted * at.q[2])
    }
}
