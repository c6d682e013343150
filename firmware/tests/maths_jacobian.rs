//! Properties of the differential kinematics: the Jacobian is the derivative of the pose, its inverses invert
//! it, and damping bounds the speeds.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::{U, arm, assert_close, position, speed, within};
use firmware::mechanics::arm::{ArmModel, IRB_930};
use firmware::mechanics::jacobian::{DAMPING_ONSET, Jacobian, SINGULAR_SINE};
use firmware::mechanics::kinematics::Trig;
use nalgebra::{Matrix2, Matrix4, Vector2, Vector4};
use proptest::prelude::*;

/// Error of an element, as documented.
fn element_error(arm: &ArmModel) -> f64 {
    U * (5.0 * f64::from(arm.geometry.a1) + 12.0 * f64::from(arm.geometry.a2))
}

fn reach(arm: &ArmModel) -> f64 {
    f64::from(arm.geometry.reach())
}

fn jacobian(arm: &ArmModel, q: &Vector4<f32>) -> Jacobian {
    Jacobian::new(&arm.geometry, &Trig::new(q))
}

/// The task coordinates in f64 (paper, eq. 11, 15, 19), yaw unwrapped so that it has a derivative.
fn task_position(arm: &ArmModel, q: &Vector4<f64>) -> Vector4<f64> {
    let (a1, a2) = (f64::from(arm.geometry.a1), f64::from(arm.geometry.a2));
    let (s1, c1) = q.x.sin_cos();
    let (s12, c12) = (q.x + q.y).sin_cos();
    Vector4::new(
        a1 * c1 + a2 * c12,
        a1 * s1 + a2 * s12,
        -q.z,
        q.x + q.y - q.w,
    )
}

/// Step of a central difference in f64: truncation h^2 / 6 = 2e-9 of the derivative's bound, rounding 2^-53 / h = 1e-12.
const STEP: f64 = 1e-4;
const DIFFERENCE: f64 = STEP * STEP / 6.0 + 1e-11;

fn wide(vector: &Vector4<f32>) -> Vector4<f64> {
    vector.map(f64::from)
}

/// Horizontal task velocities up to 10 m/s, the other components likewise.
fn task_velocity() -> impl Strategy<Value = Vector4<f32>> {
    within(Vector4::new(10.0, 10.0, 3.0, 30.0))
}

proptest! {
    #![proptest_config(common::draws::cases(512))]

    #[test]
    fn jacobian_is_the_derivative_of_the_pose(arm in arm(), q in position()) {
        let task = jacobian(&arm, &q).task();
        for joint in 0..4 {
            let mut step = Vector4::zeros();
            step[joint] = STEP;
            let difference = (task_position(&arm, &(wide(&q) + step)) - task_position(&arm, &(wide(&q) - step))) / (2.0 * STEP);
            let bound = Vector4::repeat(element_error(&arm) + DIFFERENCE * (reach(&arm) + 12.0));
            assert_close("column", &task.column(joint).into(), &difference, &bound);
        }
    }

    /// The geometric Jacobian has the task rows, and two rows that are zero in a SCARA.
    #[test]
    fn geometric_rows_are_the_task_rows(arm in arm(), q in position()) {
        let jacobian = jacobian(&arm, &q);
        let (geometric, task) = (jacobian.geometric(), jacobian.task());
        prop_assert_eq!(geometric.rows(0, 3), task.rows(0, 3));
        prop_assert!(geometric.rows(3, 2).iter().all(|&element| element == 0.0));
        prop_assert_eq!(geometric.row(5), task.row(3));
    }

    #[test]
    fn velocity_is_jacobian_times_speed(arm in arm(), q in position(), qd in speed()) {
        let jacobian = jacobian(&arm, &q);
        let expected = wide(&(jacobian.task() * qd));
        let bound = Vector4::repeat(8.0 * U * (reach(&arm) + 1.0) * qd.map(f64::from).abs().sum());
        assert_close("velocity", &jacobian.task_velocity(&qd), &expected, &bound);
    }

    #[test]
    fn rate_is_the_derivative_of_the_jacobian(arm in arm(), q in position(), qd in speed()) {
        let jacobian = jacobian(&arm, &q);
        // Along a straight line in joint space the pose has the second derivative J' qd.
        let fast = f64::from(qd.x.abs() + qd.y.abs());
        let h = 1e-3 / (1.0 + fast);
        let at = |s: f64| task_position(&arm, &(wide(&q) + wide(&qd) * s));
        let mut difference = (at(h) - at(0.0) * 2.0 + at(-h)) / (h * h);
        (difference.z, difference.w) = (0.0, 0.0);
        // Truncation h^2 / 12 of the fourth derivative; f64 rounding over h^2; elements times squared rates, 8 roundings.
        let planar = reach(&arm) * fast.powi(4) * h * h / 12.0 + 1e-14 / (h * h)
            + (2.0 * element_error(&arm) + 8.0 * U * reach(&arm)) * 2.0 * fast * fast;
        let bound = Vector4::new(planar, planar, 0.0, 0.0);
        assert_close("bias", &jacobian.bias(&qd), &difference, &bound);
        assert_close("rate times qd", &(jacobian.time_derivative(&qd) * qd), &difference, &bound);
    }

    /// Product and sum of squares determine the pair of singular values; and their meaning.
    #[test]
    fn singular_values_bound_the_velocity(arm in arm(), q in position(), angle in 0.0..std::f32::consts::TAU) {
        let jacobian = jacobian(&arm, &q);
        let (greatest, least) = jacobian.singular_values();
        let (greatest, least) = (f64::from(greatest), f64::from(least));
        let task = jacobian.task().map(f64::from);
        let sum: f64 = task.fixed_view::<2, 2>(0, 0).iter().map(|element| element * element).sum();
        prop_assert!(greatest >= least && least >= 0.0);
        // Four squares and their sums 4 u, the gap 4 u, and the roots halve their errors: below 8 u in total.
        prop_assert!((greatest * greatest + least * least - sum).abs() <= 16.0 * U * sum);
        prop_assert!((greatest * least - f64::from(jacobian.determinant()).abs()).abs() <= 2.0 * U * sum);

        let (sin, cos) = f64::from(angle).sin_cos();
        let velocity = task * Vector4::new(cos, sin, 0.0, 0.0);
        let length = velocity.x.hypot(velocity.y);
        let slack = 16.0 * U * sum.sqrt() + 4.0 * element_error(&arm);
        prop_assert!(least - slack <= length && length <= greatest + slack);
    }

    #[test]
    fn determinant_is_that_of_the_planar_block(arm in arm(), q in position()) {
        let jacobian = jacobian(&arm, &q);
        let task = jacobian.task().map(f64::from);
        // Determinant of the whole matrix: the lift's -1 times the wrist's -1 times the block's.
        let block = task.m11 * task.m22 - task.m12 * task.m21;
        prop_assert!((f64::from(jacobian.determinant()) - block).abs() <= 4.0 * reach(&arm) * element_error(&arm));
    }

    #[test]
    fn inverse_inverts(arm in arm(), q in position(), v in task_velocity()) {
        let jacobian = jacobian(&arm, &q);
        let sine = f64::from(Trig::new(&q).s2).abs();
        let Some(inverse) = jacobian.inverse() else {
            prop_assert!(sine < f64::from(SINGULAR_SINE));
            return Ok(());
        };
        let qd = jacobian.joint_speed(&v).expect("defined where the inverse is");
        // The cofactors over the determinant are each exact to a few roundings of the elements of J, times their
        // condition.
        let (a1, a2) = (f64::from(arm.geometry.a1), f64::from(arm.geometry.a2));
        let norm = reach(&arm) + a2;
        let gain = norm / (a1 * a2 * sine);
        let error = gain * (element_error(&arm) * 4.0 + 16.0 * U * norm);
        let unit = (inverse.map(f64::from) * jacobian.task().map(f64::from) - Matrix4::identity()).abs();
        prop_assert!(unit.max() <= error * 2.0 + 8.0 * U, "{:e}, allowed {:e}", unit.max(), error * 2.0);
        let speed = f64::from(v.x.abs() + v.y.abs()) + 1.0;
        let bound = Vector4::repeat(8.0 * U * (2.0 * gain * speed + f64::from(v.abs().sum())));
        assert_close("speed", &(inverse * v), &wide(&qd), &bound);
    }

    /// Beyond the onset the damped inverse is the inverse; below it, it is bounded. Height and yaw are exact everywhere.
    #[test]
    fn damped_inverse_is_bounded(arm in arm(), q in position(), near_stretch in -0.2..=0.2f32, v in task_velocity()) {
        for q in [q, Vector4::new(q.x, near_stretch, q.z, q.w), Vector4::new(q.x, 0.0, q.z, q.w)] {
            let jacobian = jacobian(&arm, &q);
            let qd = jacobian.joint_speed_damped(&v);
            let onset = f64::from(DAMPING_ONSET) * reach(&arm);
            let (_, least) = jacobian.singular_values();

            let horizontal = f64::from(v.x).hypot(f64::from(v.y));
            let speed = f64::from(qd.x).hypot(f64::from(qd.y));
            // The determinant and the elements are rounded separately: 1 % covers that at the worst gain.
            prop_assert!(speed <= 1.155 / onset * horizontal * 1.01, "{speed} rad/s at {q}");

            // The estimate of the least singular value is low by at most a factor of sqrt 2.
            if f64::from(least) > 1.5 * onset {
                let exact = jacobian.joint_speed(&v).expect("regular");
                let bound = Vector4::repeat(32.0 * U * (horizontal / onset + f64::from(v.abs().sum())));
                assert_close("speed", &qd, &wide(&exact), &bound);
            }
            let velocity = jacobian.task_velocity(&qd);
            prop_assert_eq!(velocity.z, v.z);
            let yaw = 8.0 * U * f64::from(qd.x.abs() + qd.y.abs() + qd.w.abs() + v.w.abs());
            prop_assert!(f64::from((velocity.w - v.w).abs()) <= yaw);
        }
    }

    /// The definition of damped least squares: `|J w - v|^2 + damping |w|^2` is minimal, so its gradient is zero and
    /// `J^T (v - J w)` is the damping times w, a damping between zero and a quarter of the squared onset.
    #[test]
    fn damped_speed_is_a_least_squares_solution(q in position(), near_stretch in -0.2..=0.2f32, v in task_velocity()) {
        let q = Vector4::new(q.x, near_stretch, q.z, q.w);
        let jacobian = jacobian(&IRB_930, &q);
        let qd = jacobian.joint_speed_damped(&v);
        let block: Matrix2<f64> = jacobian.task().map(f64::from).fixed_view::<2, 2>(0, 0).into();
        let (w, v) = (wide(&qd).xy(), wide(&v).xy());
        let gradient = block.transpose() * (v - block * w);

        // The determinant and the elements it is made of are rounded separately, by 4 reach times an element's error.
        // With n for the norm of the block, the denominator is at least n^2 e^2 / 4, so that w is off by at most 16
        // reach / (n e^2) of that times v, and the gradient by n^2 of it; all other roundings are of smaller terms.
        let onset = f64::from(DAMPING_ONSET) * reach(&IRB_930);
        let norm = block.iter().map(|element| element * element).sum::<f64>().sqrt();
        let length = |x: Vector2<f64>| x.x.hypot(x.y);
        let error = 17.0 * norm * reach(&IRB_930) * element_error(&IRB_930) / (onset * onset) * length(v);
        let across = gradient.x * w.y - gradient.y * w.x;
        prop_assert!(across.abs() <= error * length(w), "{across:e}, allowed {:e}", error * length(w));
        let along = gradient.dot(&w);
        let most = onset * onset / 4.0 * w.dot(&w);
        prop_assert!(-error * length(w) <= along && along <= most + error * length(w));
    }
}

#[test]
fn stretched_arm_is_singular() {
    let jacobian = jacobian(&IRB_930, &Vector4::new(0.3, 0.0, 0.1, 0.0));
    assert_eq!(jacobian.determinant(), 0.0);
    assert_eq!(jacobian.singular_values().1, 0.0);
    assert_eq!(jacobian.inverse(), None);
}
