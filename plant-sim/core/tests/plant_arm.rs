//! The rigid arm against textbook mechanics in Denavit-Hartenberg frames, on robots drawn at random.
//!
//! The oracle shares neither frames nor formulas with the plant: homogeneous transforms of the standard DH table,
//! Jacobians by cross products, Lagrange's equations with the mass matrix differentiated numerically, and the
//! articulated-body algorithm on dense 6 x 6 matrices.

use nalgebra::{Matrix3, Matrix4, Matrix6, SMatrix, Vector3, Vector4, Vector6};
use proptest::array::{uniform3, uniform4};
use proptest::prelude::*;
use sim::model::{Payload, RobotModel};
use sim::plant::arm::Arm;
use sim::plant::kinematics::{self, Pose, wrap};
use std::f64::consts::PI;

/// Three rows of a Jacobian.
type Half = SMatrix<f64, 3, 4>;

/// A body as the oracle wants it: centre of mass and principal moments in the DH frame of the link that carries it.
struct Body {
    link: usize,
    mass: f64,
    com: Vector3<f64>,
    inertia: Matrix3<f64>,
}

struct Oracle {
    model: RobotModel,
    bodies: Vec<Body>,
}

impl Oracle {
    fn new(model: &RobotModel, payload: &Payload) -> Self {
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
    fn frames(&self, q: &Vector4<f64>) -> [Matrix4<f64>; 5] {
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
    fn jacobian(frames: &[Matrix4<f64>; 5], link: usize, point: &Vector3<f64>) -> (Half, Half) {
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

    fn mass_matrix(&self, q: &Vector4<f64>) -> Matrix4<f64> {
        let frames = self.frames(q);
        let of_body = |body: &Body| {
            let (com, rotation) = Self::place(&frames, body);
            let (linear, angular) = Self::jacobian(&frames, body.link, &com);
            linear.tr_mul(&linear) * body.mass
                + angular.tr_mul(&(rotation * body.inertia * rotation.transpose() * angular))
        };
        self.bodies.iter().map(of_body).sum()
    }

    fn potential_energy(&self, q: &Vector4<f64>) -> f64 {
        let frames = self.frames(q);
        self.bodies
            .iter()
            .map(|body| body.mass * self.model.gravity * Self::place(&frames, body).0.z)
            .sum()
    }

    /// `C qd + g` from Lagrange's equations with central differences of step `h`.
    fn bias(&self, q: &Vector4<f64>, qd: &Vector4<f64>, h: f64) -> Vector4<f64> {
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
    fn forward_dynamics(
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

/// Holds the arm against the oracle at one state.
///
/// `scale` of an effort is the sum of the magnitudes that go into it. The oracle and the plant each add fewer than 100
/// products, so exact formulas agree within 200 eps; central differences of trigonometric polynomials of first degree
/// err by h^2 / 6 of the amplitude, plus 4 eps / h from cancellation.
fn check(
    model: &RobotModel,
    payload: &Payload,
    q: &Vector4<f64>,
    qd: &Vector4<f64>,
    qdd: &Vector4<f64>,
) {
    let (oracle, arm) = (Oracle::new(model, payload), Arm::new(model, Some(payload)));
    let at = arm.at(q);
    let exact = 200.0 * f64::EPSILON;
    let mass = arm.mass_matrix(&at);
    // Lengths enter squared; the model's vertical offsets cancel in M only after they were added.
    let mass_scale = size(&oracle);
    let error = (mass - oracle.mass_matrix(q)).amax();
    assert!(error <= exact * mass_scale, "M is off by {error:e}");

    let bias = arm.bias(&at, qd);
    let speed = qd.amax().powi(2);
    let bias_scale = 4.0 * mass_scale * (speed + model.gravity.abs());
    let h = 1e-5;
    let error = (bias - oracle.bias(q, qd, h)).amax();
    let bound = (h * h / 6.0 + 4.0 * f64::EPSILON / h) * 16.0 * bias_scale;
    assert!(error <= bound, "bias is off by {error:e}, bound {bound:e}");

    let energy = arm.kinetic_energy(&at, qd);
    let error = (energy - 0.5 * qd.dot(&(mass * qd))).abs();
    assert!(
        error <= exact * 16.0 * mass_scale * speed,
        "kinetic energy is off by {error:e}"
    );
    let error = (arm.potential_energy(&at) - oracle.potential_energy(q)).abs();
    assert!(
        error <= exact * mass_scale * model.gravity.abs(),
        "potential energy is off by {error:e}"
    );

    let tau = arm.inverse_dynamics(&at, qd, qdd);
    assert!(
        (tau - mass * qdd - bias).amax() <= exact * 4.0 * (mass_scale * qdd.amax() + bias_scale)
    );
    // Forward dynamics is compared by the efforts, where an error is not magnified by the condition of M.
    let residual = (mass * (oracle.forward_dynamics(q, qd, &tau) - qdd)).amax();
    let condition = mass_scale / mass.symmetric_eigenvalues().min();
    assert!(
        residual <= exact * condition * 4.0 * (mass_scale * qdd.amax() + bias_scale),
        "ABA: {residual:e}"
    );
}

/// Bound of every term in the mass matrix and in the first moments: all mass at the end of all lengths, squared.
fn size(oracle: &Oracle) -> f64 {
    let g = &oracle.model.geometry;
    let lengths = g.a1 + g.a2 + g.d1.abs() + g.d2.abs() + g.d4.abs() + oracle.model.limits.upper[2];
    let of_body = |body: &Body| {
        let reach = 1.0 + lengths + 2.0 * body.com.norm();
        body.mass * reach * reach + body.inertia.trace()
    };
    oracle.bodies.iter().map(of_body).sum()
}

prop_compose! {
    fn link()(mass in 0.2..20.0, com in uniform3(-0.5..0.5), inertia in uniform3(1e-3..0.5)) -> sim::model::Link {
        sim::model::Link { mass, com, inertia }
    }
}

prop_compose! {
    fn robot()(a in [0.1..0.8, 0.1..0.8], d in uniform3(-0.3..0.3), links in uniform4(link()), gravity in -10.0..10.0)
        -> RobotModel {
        let mut model = RobotModel::irb_930_22_105();
        (model.geometry.a1, model.geometry.a2) = (a[0], a[1]);
        (model.geometry.d1, model.geometry.d2, model.geometry.d4) = (d[0], d[1], d[2]);
        (model.links, model.gravity) = (links, gravity);
        model
    }
}

prop_compose! {
    fn payload()(mass in 0.0..25.0, com in uniform3(-0.2..0.2), inertia in uniform3(0.0..0.5)) -> Payload {
        Payload { mass, com, inertia }
    }
}

fn joints(span: [f64; 4]) -> impl Strategy<Value = Vector4<f64>> {
    uniform4(-1.0..1.0).prop_map(move |x| Vector4::from(x).component_mul(&Vector4::from(span)))
}

fn positions() -> impl Strategy<Value = Vector4<f64>> {
    joints([PI, 2.5, 0.3, 7.0])
}

proptest! {
    #[test]
    fn any_arm_obeys_lagrange(
        model in robot(), payload in payload(), q in positions(),
        qd in joints([8.0, 12.0, 2.2, 30.0]), qdd in joints([60.0, 120.0, 60.0, 600.0]),
    ) {
        check(&model, &payload, &q, &qd, &qdd);
    }

    #[test]
    fn the_built_in_arms_obey_lagrange(
        payload in payload(), q in positions(),
        qd in joints([8.0, 12.0, 2.2, 30.0]), qdd in joints([60.0, 120.0, 60.0, 600.0]),
    ) {
        check(&RobotModel::irb_930_22_105(), &payload, &q, &qd, &qdd);
        check(&RobotModel::irb_930_12_085(), &payload, &q, &qd, &qdd);
    }

    #[test]
    fn the_flange_is_where_the_dh_table_puts_it(model in robot(), q in positions(), qd in joints([1.0; 4])) {
        let (oracle, arm) = (Oracle::new(&model, &Payload { mass: 0.0, com: [0.0; 3], inertia: [0.0; 3] }), Arm::new(&model, None));
        let (at, frames) = (arm.at(&q), oracle.frames(&q));
        let origin: Vector3<f64> = frames[4].fixed_view::<3, 1>(0, 3).into();
        let rotation: Matrix3<f64> = frames[4].fixed_view::<3, 3>(0, 0).into();
        let (found_origin, found_rotation) = arm.flange(&at);
        // Lengths below 3 m and angles below 10 rad, some 20 roundings each.
        prop_assert!((origin - found_origin).amax() < 1e-14);
        prop_assert!((rotation - found_rotation).amax() < 1e-14);

        let (linear, angular) = Oracle::jacobian(&frames, 3, &origin);
        let jacobian = arm.jacobian(&at);
        prop_assert!((jacobian.fixed_view::<3, 4>(0, 0) - linear).amax() < 1e-14);
        prop_assert!((jacobian.fixed_view::<3, 4>(3, 0) - angular).amax() < 1e-14);

        // Central difference along the motion; third derivatives are below 3 m (2 rad/s)^3.
        let h = 1e-4;
        let twist = |time: f64| arm.twist(&arm.at(&(q + qd * time)), &qd);
        let rate = (twist(h) - twist(-h)) / (2.0 * h);
        prop_assert!((rate - arm.jacobian_rate_times(&at, &qd)).amax() < h * h * 24.0);
    }

    #[test]
    fn inverse_kinematics_undoes_forward(model in robot(), q in positions()) {
        prop_assume!(q[1].abs() > 1e-3);
        let arm = Arm::new(&model, None);
        let pose = arm.pose(&arm.at(&q));
        let solutions = kinematics::inverse(&model.geometry, &model.limits, &pose).unwrap();
        let same = &solutions[usize::from(q[1] < 0.0)].q;
        // theta2 follows the radius with a slope r / (a1 a2 sin theta2), and theta1 follows theta2; with two arms of
        // nearly one length the shoulder's own direction is ill-conditioned as 1 / r.
        let (a1, a2) = (model.geometry.a1, model.geometry.a2);
        let slope = (a1 + a2) * (a1 + a2) / (a1 * a2 * q[1].sin().abs()) + 1.0 / pose.x.hypot(pose.y);
        for i in [0, 1, 3] {
            prop_assert!(wrap(same[i] - q[i]).abs() < 1e-14 * slope, "axis {i}: {same} {q}");
        }
        prop_assert!((same[2] - q[2]).abs() < 1e-15);
        for solution in solutions {
            let back = arm.pose(&arm.at(&solution.q));
            prop_assert!((back.x - pose.x).hypot(back.y - pose.y) < 1e-14 * slope);
            prop_assert!((back.z - pose.z).abs() < 1e-15);
            prop_assert!(wrap(back.yaw - pose.yaw).abs() < 1e-14);
        }
    }
}

#[test]
fn a_limited_wrist_may_use_another_turn() {
    let mut model = RobotModel::irb_930_22_105();
    (model.limits.lower[3], model.limits.upper[3]) = (PI, 2.0 * PI);
    // theta1 + theta2 - yaw = -1 is out of reach as it stands, and within reach one turn on.
    let arm = Arm::new(&model, None);
    let pose = arm.pose(&arm.at(&Vector4::new(0.3, 1.0, 0.1, -1.0)));
    let reach = |pose: &Pose| {
        kinematics::inverse(&model.geometry, &model.limits, pose).unwrap()[0].violation
    };
    assert_eq!(reach(&pose), None);
    assert_eq!(
        reach(&Pose {
            yaw: pose.yaw - 2.0,
            ..pose
        }),
        Some(kinematics::Violation::Wrist)
    );
}
