//! The rigid chain: recursive Newton-Euler and composite-rigid-body algorithms (Featherstone 2008, tables 5.1 and 6.2),
//! for links only; rotors and friction are in [`super::drive`].
//!
//! All axes of a SCARA are parallel. Its links therefore move in horizontal planes, apart from the lift, which is
//! independent of the rotations: three planar bodies turn (upper arm, forearm with the sleeve of the shaft, shaft with
//! payload), and the shaft's mass moves up and down separately. Only the bodies' moments of inertia about the vertical
//! matter.
//!
//! The controller's dynamics come from Lagrange's equations and from Denavit-Hartenberg frames. This derivation shares no
//! formula with them, so that the plant can contradict the controller. The tests compare it with the same algorithms in
//! six dimensions, which know nothing of a SCARA.

use super::planar::{Force, Inertia, Motion, Transform};
use crate::maths::sin_cos;
use crate::model::{Geometry, Payload, RobotModel};
use nalgebra::{Matrix4, Vector4};

/// A serial chain of four rigid links with one joint each, and the payload at its flange.
#[derive(Clone, Debug, PartialEq)]
pub struct Arm {
    pub(super) geometry: Geometry,
    /// Turning bodies, each about its own joint, in axes that are those of frame 0 at joint position zero.
    bodies: [Inertia; 3],
    /// Mass carried by the lift, kg.
    lifted: f64,
    /// Heights of all centres of mass above frame 0 with the lift at zero, times their masses, kg m.
    first_moment: f64,
    /// Acceleration of gravity along -z of frame 0, m/s2.
    gravity: f64,
}

/// Direction of the wrist's rotation seen from above: its axis points down.
pub(super) const WRIST: f64 = -1.0;

/// The arm at one set of joint positions, so that trigonometry is done once.
#[derive(Clone, Copy, Debug)]
pub struct Configuration {
    pub(super) q: Vector4<f64>,
    pub(super) elbow: Transform,
    pub(super) wrist: Transform,
}

impl Arm {
    /// The chain of `model`, holding `payload`.
    pub fn new(model: &RobotModel, payload: Option<&Payload>) -> Self {
        let geometry = model.geometry;
        let [upper_arm, forearm, sleeve, shaft] = model.links;
        // Frames 3 and 4 point down: turned about x, so that their y is the other way round.
        let above = |mass, com: [f64; 3], inertia: [f64; 3]| {
            Inertia::from_com(mass, [com[0], com[1]], inertia[2])
        };
        let below = |mass, com: [f64; 3], inertia: [f64; 3]| {
            Inertia::from_com(mass, [com[0], -com[1]], inertia[2])
        };
        let at_wrist = Transform {
            along: geometry.a2,
            turn: (0.0, 1.0),
        };
        let mut turning = below(shaft.mass, shaft.com, shaft.inertia);
        let top = geometry.d1 + geometry.d2;
        let mut first_moment = upper_arm.mass * upper_arm.com[2]
            + forearm.mass * (geometry.d1 + forearm.com[2])
            + sleeve.mass * (top - sleeve.com[2])
            + shaft.mass * (top - shaft.com[2]);
        if let Some(payload) = payload {
            turning = turning + below(payload.mass, payload.com, payload.inertia);
            first_moment += payload.mass * (top - geometry.d4 - payload.com[2]);
        }
        Self {
            geometry,
            bodies: [
                above(upper_arm.mass, upper_arm.com, upper_arm.inertia),
                above(forearm.mass, forearm.com, forearm.inertia)
                    + at_wrist.inertia_back(&below(sleeve.mass, sleeve.com, sleeve.inertia)),
                turning,
            ],
            lifted: sleeve.mass + turning.mass,
            first_moment,
            gravity: model.gravity,
        }
    }

    /// The arm at joint positions `q`.
    pub fn at(&self, q: &Vector4<f64>) -> Configuration {
        Configuration {
            q: *q,
            elbow: Transform {
                along: self.geometry.a1,
                turn: sin_cos(q[1]),
            },
            wrist: Transform {
                along: self.geometry.a2,
                turn: sin_cos(WRIST * q[3]),
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
        let velocity = self.velocities(at, qd);
        let upper_arm = Motion::rotation(qdd[0]);
        let forearm = at.elbow.motion(&upper_arm)
            + Motion::rotation(qdd[1])
            + velocity[1].cross_rotation(qd[1]);
        let shaft = at.wrist.motion(&forearm)
            + Motion::rotation(WRIST * qdd[3])
            + velocity[2].cross_rotation(WRIST * qd[3]);
        let acceleration = [upper_arm, forearm, shaft];
        let mut force: [Force; 3] = std::array::from_fn(|i| {
            let momentum = self.bodies[i].apply(&velocity[i]);
            self.bodies[i].apply(&acceleration[i]) + velocity[i].cross_force(&momentum)
        });
        let on_forearm = at.wrist.force_back(&force[2]);
        force[1] += on_forearm;
        let on_upper_arm = at.elbow.force_back(&force[1]);
        force[0] += on_upper_arm;
        // Downwards is positive, so gravity helps: a base that accelerates upwards is indistinguishable from it.
        Vector4::new(
            force[0].moment,
            force[1].moment,
            self.lifted * (qdd[2] - self.gravity),
            WRIST * force[2].moment,
        )
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
    pub fn mass_matrix(&self, at: &Configuration) -> Matrix4<f64> {
        let turn = Motion::rotation(1.0);
        let shaft = self.bodies[2];
        let forearm = self.bodies[1] + at.wrist.inertia_back(&shaft);
        let upper_arm = self.bodies[0] + at.elbow.inertia_back(&forearm);
        // The force that gives each composite body a unit acceleration about its joint, projected on the joints before
        // it.
        let at_wrist = shaft.apply(&turn);
        let at_elbow = at.wrist.force_back(&at_wrist);
        let (m44, m42) = (at_wrist.moment, WRIST * at_elbow.moment);
        let m41 = WRIST * at.elbow.force_back(&at_elbow).moment;
        let at_elbow = forearm.apply(&turn);
        let m22 = at_elbow.moment;
        let m21 = at.elbow.force_back(&at_elbow).moment;
        let m11 = upper_arm.second;
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
        let turning: f64 = self
            .bodies
            .iter()
            .zip(self.velocities(at, qd))
            .map(|(body, velocity)| body.kinetic_energy(&velocity))
            .sum();
        turning + 0.5 * self.lifted * qd[2] * qd[2]
    }

    /// Potential energy of the links, zero with all mass in the plane of frame 0, J.
    pub fn potential_energy(&self, at: &Configuration) -> f64 {
        self.gravity * (self.first_moment - self.lifted * at.q[2])
    }

    /// Velocities of the bodies that turn, each about its own joint and in its own axes.
    fn velocities(&self, at: &Configuration, qd: &Vector4<f64>) -> [Motion; 3] {
        let upper_arm = Motion::rotation(qd[0]);
        let forearm = at.elbow.motion(&upper_arm) + Motion::rotation(qd[1]);
        let shaft = at.wrist.motion(&forearm) + Motion::rotation(WRIST * qd[3]);
        [upper_arm, forearm, shaft]
    }
}
