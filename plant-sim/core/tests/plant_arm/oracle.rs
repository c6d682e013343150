//! Textbook mechanics in Denavit-Hartenberg frames.

use std::f64::consts::PI;

use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector3, Vector4, Vector6};
use sim::model::{Payload, RobotModel};

/// Three rows of a Jacobian.
type Half = SMatrix<f64, 3, 4>;

/// A body for the oracle: centre of mass and principal moments in the DH frame of the link that carries it.
pub(crate) struct Body {
    link: usize,
    pub(crate) mass: f64,
    pub(crate) com: Vector3<f64>,
    pub(crate) inertia: Matrix3<f64>,
}

/// The oracle's arm.
pub(crate) struct Oracle {
    pub(crate) model: RobotModel,
    pub(crate) bodies: Vec<Body>,
}

impl Oracle {
    pub(crate) fn new(model: &RobotModel, payload: &Payload) -> Self {
        let g = model.geometry;
        // From each joint frame to the DH frame at the far end of the link.
        let turned = Matrix3::from_diagonal(&Vector3::new(1.0, -1.0, -1.0));
        let to_dh = |link: usize, com: Vector3<f64>| match link {
            0 => com - Vector3::new(g.a1, 0.0, g.d1),
            1 => turned * (com - Vector3::new(g.a2, 0.0, g.d2)),
            2 => com,
            _ => com - Vector3::new(0.0, 0.0, g.d4),
        };
        let body = |link, mass, com, inertia: [f64; 3]| Body {
            link,
            mass,
            com,
            inertia: Matrix3::from_diagonal(&inertia.into()),
        };
        let mut bodies: Vec<_> = (0..4)
            .map(|i| (i, model.links[i]))
            .map(|(i, l)| body(i, l.mass, to_dh(i, l.com.into()), l.inertia))
            .collect();
        bodies.push(body(3, payload.mass, payload.com.into(), payload.inertia));
        Self {
            model: model.clone(),
            bodies,
        }
    }

    /// DH frames 0 to 4 in frame 0.
    pub(crate) fn frames(&self, q: &Vector4<f64>) -> [Matrix4<f64>; 5] {
        let g = &self.model.geometry;
        let rows = [
            (q[0], g.d1, g.a1, 0.0),
            (q[1], g.d2, g.a2, PI),
            (0.0, q[2], 0.0, 0.0),
            (q[3], g.d4, 0.0, 0.0),
        ];
        let mut frames = [Matrix4::identity(); 5];
        for (i, (theta, d, a, alpha)) in rows.into_iter().enumerate() {
            let ((st, ct), (sa, ca)) = (theta.sin_cos(), f64::sin_cos(alpha));
            #[rustfmt::skip]
            let link = Matrix4::new(
                ct, -st * ca, st * sa, a * ct,
                st, ct * ca, -ct * sa, a * st,
                0.0, sa, ca, d,
                0.0, 0.0, 0.0, 1.0,
            );
            frames[i + 1] = frames[i] * link;
        }
        frames
    }

    /// Linear and angular Jacobian of a point fixed to a link, by cross products.
    pub(crate) fn jacobian(
        frames: &[Matrix4<f64>; 5],
        link: usize,
        point: &Vector3<f64>,
    ) -> (Half, Half) {
        let (mut linear, mut angular) = (Half::zeros(), Half::zeros());
        for (joint, frame) in frames.iter().take(link + 1).enumerate() {
            let axis: Vector3<f64> = frame.fixed_view::<3, 1>(0, 2).into();
            let origin: Vector3<f64> = frame.fixed_view::<3, 1>(0, 3).into();
            if joint == 2 {
                linear.set_column(joint, &axis);
            } else {
                linear.set_column(joint, &axis.cross(&(point - origin)));
                angular.set_column(joint, &axis);
            }
        }
        (linear, angular)
    }

    fn place(frames: &[Matrix4<f64>; 5], body: &Body) -> (Vector3<f64>, Matrix3<f64>) {
        let frame = &frames[body.link + 1];
        let rotation: Matrix3<f64> = frame.fixed_view::<3, 3>(0, 0).into();
        let origin: Vector3<f64> = frame.fixed_view::<3, 1>(0, 3).into();
        (origin + rotation * body.com, rotation)
    }

    pub(crate) fn mass_matrix(&self, q: &Vector4<f64>) -> Matrix4<f64> {
        let frames = self.frames(q);
        let of_body = |body: &Body| {
            let (com, rotation) = Self::place(&frames, body);
            let (linear, angular) = Self::jacobian(&frames, body.link, &com);
            linear.tr_mul(&linear) * body.mass
                + angular.tr_mul(&(rotation * body.inertia * rotation.transpose() * angular))
        };
        self.bodies.iter().map(of_body).sum()
    }

    pub(crate) fn potential_energy(&self, q: &Vector4<f64>) -> f64 {
        let frames = self.frames(q);
        self.bodies
            .iter()
            .map(|body| body.mass * self.model.gravity * Self::place(&frames, body).0.z)
            .sum()
    }

    /// `C qd + g` from Lagrange's equations with central differences of step `h`.
    pub(crate) fn bias(&self, q: &Vector4<f64>, qd: &Vector4<f64>, h: f64) -> Vector4<f64> {
        let shifted = |k: usize, by: f64| q + Vector4::ith(k, by);
        let slope =
            |k| (self.mass_matrix(&shifted(k, h)) - self.mass_matrix(&shifted(k, -h))) / (2.0 * h);
        let slopes: [Matrix4<f64>; 4] = std::array::from_fn(slope);
        Vector4::from_fn(|i, _| {
            let rate: f64 = (0..4).map(|k| (slopes[k] * qd)[i] * qd[k]).sum();
            let gravity = (self.potential_energy(&shifted(i, h))
                - self.potential_energy(&shifted(i, -h)))
                / (2.0 * h);
            rate - 0.5 * qd.dot(&(slopes[i] * qd)) + gravity
        })
    }

    /// Articulated-body algorithm: Featherstone 2008, table 7.1, in DH frames.
    pub(crate) fn forward_dynamics(
        &self,
        q: &Vector4<f64>,
        qd: &Vector4<f64>,
        tau: &Vector4<f64>,
    ) -> Vector4<f64> {
        let frames = self.frames(q);
        let mut step = [Matrix6::zeros(); 4];
        let mut axis = [Vector6::zeros(); 4];
        let mut inertia = [Matrix6::zeros(); 4];
        for body in &self.bodies {
            inertia[body.link] += dense_inertia(body);
        }
        let (mut velocity, mut coriolis, mut force) = (
            [Vector6::zeros(); 4],
            [Vector6::zeros(); 4],
            [Vector6::zeros(); 4],
        );
        for i in 0..4 {
            step[i] = dense_transform(&(frames[i].try_inverse().unwrap() * frames[i + 1]));
            axis[i] = step[i]
                * if i == 2 {
                    Vector6::ith(5, 1.0)
                } else {
                    Vector6::ith(2, 1.0)
                };
            let before = if i == 0 {
                Vector6::zeros()
            } else {
                velocity[i - 1]
            };
            velocity[i] = step[i] * before + axis[i] * qd[i];
            coriolis[i] = dense_cross(&velocity[i]) * axis[i] * qd[i];
            force[i] = -dense_cross(&velocity[i]).transpose() * inertia[i] * velocity[i];
        }
        let (mut u, mut d, mut big_u) = ([0.0; 4], [0.0; 4], [Vector6::zeros(); 4]);
        for i in (0..4).rev() {
            big_u[i] = inertia[i] * axis[i];
            d[i] = axis[i].dot(&big_u[i]);
            u[i] = tau[i] - axis[i].dot(&force[i]);
            if i > 0 {
                let apparent = inertia[i] - big_u[i] * big_u[i].transpose() / d[i];
                let bias = force[i] + apparent * coriolis[i] + big_u[i] * (u[i] / d[i]);
                inertia[i - 1] += step[i].transpose() * apparent * step[i];
                force[i - 1] += step[i].transpose() * bias;
            }
        }
        let mut acceleration = Vector6::new(0.0, 0.0, 0.0, 0.0, 0.0, self.model.gravity);
        Vector4::from_fn(|i, _| {
            acceleration = step[i] * acceleration + coriolis[i];
            let qdd = (u[i] - big_u[i].dot(&acceleration)) / d[i];
            acceleration += axis[i] * qdd;
            qdd
        })
    }
}

fn dense_transform(frame: &Matrix4<f64>) -> Matrix6<f64> {
    let e: Matrix3<f64> = frame.fixed_view::<3, 3>(0, 0).transpose();
    let r: Vector3<f64> = frame.fixed_view::<3, 1>(0, 3).into();
    let mut x = Matrix6::zeros();
    x.fixed_view_mut::<3, 3>(0, 0).copy_from(&e);
    x.fixed_view_mut::<3, 3>(3, 3).copy_from(&e);
    x.fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&(-e * r.cross_matrix()));
    x
}

fn dense_cross(v: &Vector6<f64>) -> Matrix6<f64> {
    let (w, l) = (
        Vector3::new(v[0], v[1], v[2]).cross_matrix(),
        Vector3::new(v[3], v[4], v[5]).cross_matrix(),
    );
    let mut x = Matrix6::zeros();
    x.fixed_view_mut::<3, 3>(0, 0).copy_from(&w);
    x.fixed_view_mut::<3, 3>(3, 3).copy_from(&w);
    x.fixed_view_mut::<3, 3>(3, 0).copy_from(&l);
    x
}

fn dense_inertia(body: &Body) -> Matrix6<f64> {
    let c = body.com.cross_matrix();
    let mut i = Matrix6::zeros();
    i.fixed_view_mut::<3, 3>(0, 0)
        .copy_from(&(body.inertia + c * c.transpose() * body.mass));
    i.fixed_view_mut::<3, 3>(0, 3).copy_from(&(c * body.mass));
    i.fixed_view_mut::<3, 3>(3, 0)
        .copy_from(&(c.transpose() * body.mass));
    i.fixed_view_mut::<3, 3>(3, 3)
        .copy_from(&(Matrix3::identity() * body.mass));
    i
}
