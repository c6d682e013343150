//! The controller's f32 mathematics against the reference tables.
//!
//! No tolerance is chosen. A bound is a number of roundings times u = 2^-24 times the magnitudes that are summed:
//! the roundings of the computation, as documented in the firmware, and those of converting the table's f64 inputs and
//! the model's decimals to f32. The latter have a relative error of u in an angle, and its sine or cosine moves by as
//! much, u in a speed, 2 u in its square, and 3 u in a product of up to three model parameters.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod dynamics;
mod inverse;
mod kinematics;
#[path = "../../../firmware/tests/common/magnitude.rs"]
mod magnitude;

use std::f64::consts::{PI, TAU};

use firmware::mechanics::arm::{
    ArmModel, Axis, DriveTrain, Geometry, IRB_930, JointLimits, Link, Payload,
};
use firmware::mechanics::dynamics::drive::Drive;
use firmware::mechanics::dynamics::lagrange::Lagrange;
use firmware::mechanics::dynamics::newton_euler;
use firmware::mechanics::jacobian::Jacobian;
use firmware::mechanics::kinematics::{
    Elbow, IkError, Pose, REACH_TOLERANCE, Trig, forward, inverse, link_frames, rotation, solve,
};
use firmware::mechanics::velocity::propagate;
use magnitude::{LAGRANGE, NEWTON_EULER};
use nalgebra::{Matrix4, SMatrix, Vector3, Vector4};
use tests::{Row, Table, reference};

/// Unit roundoff of f32.
const U: f64 = 1.0 / (1u32 << 24) as f64;

const A1: f64 = 0.56;
const A2: f64 = 0.49;
const REACH: f64 = A1 + A2;

/// Position, speeds and accelerations of a row, as in the table and as the controller gets them.
struct State {
    wide: [Vector4<f64>; 3],
    narrow: [Vector4<f32>; 3],
}

impl State {
    fn of(row: &Row<'_>, columns: &[&str]) -> Self {
        let read = |i: usize| {
            columns
                .get(i)
                .map_or_else(Vector4::zeros, |column| row.vector::<4>(column))
        };
        let wide = [read(0), read(1), read(2)];
        Self {
            wide,
            narrow: wide.map(narrow),
        }
    }

    /// Effect of rounding the angles on a sine or cosine of any sum of them, in u.
    fn angles(&self) -> f64 {
        let [q, ..] = &self.wide;
        q.x.abs() + q.y.abs() + q.w.abs()
    }
}

fn narrow<const R: usize, const C: usize>(wide: SMatrix<f64, R, C>) -> SMatrix<f32, R, C> {
    wide.map(|value| value as f32)
}

/// Asserts `|actual - expected| <= bound`, element by element.
#[track_caller]
fn agree<const R: usize, const C: usize>(
    row: &Row<'_>,
    what: &str,
    actual: SMatrix<f32, R, C>,
    expected: SMatrix<f64, R, C>,
    bound: SMatrix<f64, R, C>,
) {
    for i in 0..R {
        for j in 0..C {
            let error = (f64::from(actual[(i, j)]) - expected[(i, j)]).abs();
            assert!(
                error <= bound[(i, j)],
                "{row}: {what}[{}][{}] is {}, not {}: off by {error:e}, allowed {:e}",
                i + 1,
                j + 1,
                actual[(i, j)],
                expected[(i, j)],
                bound[(i, j)],
            );
        }
    }
}

fn turn_between(a: f64, b: f64) -> f64 {
    (a - b) - TAU * ((a - b) / TAU).round()
}

/// Roundings in a coordinate of the flange, in u of the reach: 9.1 of the worse sine, 2 sums and products, 1 model length.
const POSITION: f64 = 13.0;

/// Every number of the built-in arm, rounded once.
#[test]
fn built_in_arm_is_the_reference_arm() {
    let text = std::fs::read_to_string(reference("model.json")).expect("readable");
    let json: serde_json::Value = serde_json::from_str(&text).expect("JSON");
    let number = |path: &str| {
        let value = json.pointer(path).unwrap_or_else(|| panic!("no {path}"));
        value
            .as_f64()
            .unwrap_or_else(|| panic!("{path} is not a number")) as f32
    };
    let joint = |path: &str| Vector4::from_fn(|i, _| number(&format!("{path}/{i}")));
    let vector = |path: &str| Vector3::from_fn(|i, _| number(&format!("{path}/{i}")));
    let arm = ArmModel {
        geometry: Geometry {
            a1: number("/dh/a1"),
            a2: number("/dh/a2"),
            d1: number("/dh/d1") + number("/dh/d2"),
            d4: number("/dh/d4"),
        },
        links: std::array::from_fn(|i| Link {
            mass: number(&format!("/links/{i}/mass")),
            com: vector(&format!("/links/{i}/com_joint_frame")),
            inertia: vector(&format!("/links/{i}/inertia_com_diag")),
        }),
        gravity: -number("/gravity/2"),
        limits: JointLimits {
            lower: joint("/joint_limits/lower"),
            upper: joint("/joint_limits/upper"),
            velocity: joint("/joint_limits/velocity"),
            // The table has estimates of both; torque and its rate are the limit.
            acceleration: Vector4::repeat(JointLimits::NONE),
            jerk: Vector4::repeat(JointLimits::NONE),
            effort: joint("/joint_limits/effort_peak"),
            effort_rise_time: Vector4::repeat(0.010),
            effort_continuous: joint("/joint_limits/effort_continuous_rms"),
        },
        drive: DriveTrain {
            gear_ratio: joint("/drive/gear_ratio"),
            screw_lead: number("/drive/ball_screw_lead_m_per_rev"),
            screw_hand: number("/drive/screw_hand_sign"),
            rotor_inertia: joint("/drive/rotor_inertia_motor_side"),
            motor_torque_limit: joint("/drive/motor_torque_limit_model"),
            motor_torque_rated: joint("/drive/motor_rated_torque"),
            motor_speed_limit: joint("/drive/motor_max_speed_rad_s"),
            viscous: joint("/drive/viscous"),
            coulomb: joint("/drive/coulomb"),
            coulomb_eps: joint("/drive/coulomb_tanh_eps"),
            encoder_counts: number("/drive/encoder_counts_per_motor_rev") as u32,
        },
        payload_max: number("/spec/payload_max"),
    };
    assert_eq!(IRB_930, arm);
}
