//! The chain in six dimensions: a check that knows nothing of a SCARA but its list of joints.
//!
//! Recursive Newton-Euler and composite rigid bodies in spatial form (Featherstone 2008, tables 5.1 and 6.2).

use super::spatial::{Force, Inertia, Motion, Transform};
use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use sim::model::{Payload, RobotModel};

/// A serial chain of four rigid links with one joint each, and the payload at its flange.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Chain {
    /// From the parent link's frame to the joint's frame at joint position zero.
    mounting: [Transform; 4],
    /// In the link's frame; that of link 4 includes the payload.
    inertia: [Inertia; 4],
    /// Acceleration of gravity along -z of frame 0, m/s2.
    gravity: f64,
}

/// How a joint moves; always about or along z of its own frame.
#[derive(Clone, Copy)]
enum Joint {
    Revolute,
    Prismatic,
}

const JOINTS: [Joint; 4] = [
    Joint::Revolute,
    Joint::Revolute,
    Joint::Prismatic,
    Joint::Revolute,
];

impl Joint {
    /// The motion subspace S.
    fn axis(self) -> Motion {
        match self {
            Self::Revolute => Motion {
                angular: Vector3::z(),
                linear: Vector3::zeros(),
            },
            Self::Prismatic => Motion {
                angular: Vector3::zeros(),
                linear: Vector3::z(),
            },
        }
    }

    /// `S^T f`.
    fn project(self, force: &Force) -> f64 {
        match self {
            Self::Revolute => force.moment.z,
            Self::Prismatic => force.linear.z,
        }
    }

    fn transform(self, position: f64) -> Transform {
        match self {
            Self::Revolute => Transform::rotation_z(position.sin_cos()),
            Self::Prismatic => Transform::translation(Vector3::new(0.0, 0.0, position)),
        }
    }
}

/// The arm at one set of joint positions: each link's transform from its parent, so that trigonometry is done once.
#[derive(Clone, Copy, Debug)]
pub(super) struct Configuration {
    from_parent: [Transform; 4],
}

impl Chain {
    /// The chain of `model`, holding `payload`.
    pub(super) fn new(model: &RobotModel, payload: Option<&Payload>) -> Self {
        let geometry = &model.geometry;
        let down = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let flange = Transform::translation(Vector3::new(0.0, 0.0, geometry.d4));
        let mut inertia = model
            .links
            .map(|link| Inertia::from_com(link.mass, link.com, link.inertia));
        if let Some(payload) = payload {
            let held = Inertia::from_com(payload.mass, payload.com, payload.inertia);
            inertia[3] = inertia[3] + flange.inertia_back(&held);
        }
        Self {
            mounting: [
                Transform::identity(),
                Transform::translation(Vector3::new(geometry.a1, 0.0, geometry.d1)),
                Transform {
                    rotation: down,
                    origin: Vector3::new(geometry.a2, 0.0, geometry.d2),
                },
                Transform::identity(),
            ],
            inertia,
            gravity: model.gravity,
        }
    }

    /// The arm at joint positions `q`.
    pub(super) fn at(&self, q: &Vector4<f64>) -> Configuration {
        let mut from_parent = self.mounting;
        for (i, transform) in from_parent.iter_mut().enumerate() {
            *transform = transform.then(&JOINTS[i].transform(q[i]));
        }
        Configuration { from_parent }
    }

    /// Joint efforts for accelerations `qdd`: `M qdd + C qd + g`, N m and N.
    pub(super) fn inverse_dynamics(
        &self,
        at: &Configuration,
        qd: &Vector4<f64>,
        qdd: &Vector4<f64>,
    ) -> Vector4<f64> {
        // A base that accelerates upwards is indistinguishable from gravity.
        let upwards = Motion {
            linear: Vector3::new(0.0, 0.0, self.gravity),
            ..Motion::zero()
        };
        let (mut velocity, mut acceleration) = (Motion::zero(), upwards);
        let mut force = [Force::zero(); 4];
        for i in 0..4 {
            let transform = &at.from_parent[i];
            let own = JOINTS[i].axis() * qd[i];
            velocity = transform.motion(&velocity) + own;
            acceleration =
                transform.motion(&acceleration) + JOINTS[i].axis() * qdd[i] + velocity.cross(&own);
            let momentum = self.inertia[i].apply(&velocity);
            force[i] = self.inertia[i].apply(&acceleration) + velocity.cross_force(&momentum);
        }
        let mut effort = Vector4::zeros();
        for i in (0..4).rev() {
            effort[i] = JOINTS[i].project(&force[i]);
            if i > 0 {
                let on_parent = at.from_parent[i].force_back(&force[i]);
                force[i - 1] += on_parent;
            }
        }
        effort
    }

    /// Mass matrix of the joint space.
    pub(super) fn mass_matrix(&self, at: &Configuration) -> Matrix4<f64> {
        let mut matrix = Matrix4::zeros();
        let mut composite = self.inertia[3];
        for i in (0..4).rev() {
            let mut force = composite.apply(&JOINTS[i].axis());
            matrix[(i, i)] = JOINTS[i].project(&force);
            for j in (0..i).rev() {
                force = at.from_parent[j + 1].force_back(&force);
                matrix[(i, j)] = JOINTS[j].project(&force);
                matrix[(j, i)] = matrix[(i, j)];
            }
            if i > 0 {
                composite = self.inertia[i - 1] + at.from_parent[i].inertia_back(&composite);
            }
        }
        matrix
    }
}
