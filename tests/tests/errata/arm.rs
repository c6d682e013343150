//! The arm in f64, the states of the reference tables, and the report of an erratum.

use std::fs;

use nalgebra::{Matrix3, Matrix4, Vector3, Vector4};
use serde_json::Value;
use tests::{Row, reference};

/// Unit roundoff of f32: half the distance between 1 and the next number, 2^-24.
pub(crate) const U32: f64 = 0.5 * f32::EPSILON as f64;

/// Unit roundoff of f64, 2^-53.
pub(crate) const U64: f64 = 0.5 * f64::EPSILON;

/// A rigid link: mass, centre of mass in its standard-DH frame, inertia about the centre of mass.
#[derive(Clone, Copy)]
pub(crate) struct Link {
    pub mass: f64,
    pub com: Vector3<f64>,
    pub inertia: Matrix3<f64>,
}

impl Link {
    fn from_json(value: &Value, com: &str) -> Self {
        Self {
            mass: number(&value["mass"]),
            com: vector(&value[com]),
            inertia: Matrix3::from_diagonal(&vector(&value["inertia_com_diag"])),
        }
    }

    /// The rigid body that this link and `other`, given in the same frame, form together (parallel-axis theorem).
    fn joined(&self, other: &Link) -> Link {
        let mass = self.mass + other.mass;
        let com = (self.com * self.mass + other.com * other.mass) / mass;
        let about = |body: &Link| {
            let d = body.com - com;
            body.inertia + (Matrix3::identity() * d.norm_squared() - d * d.transpose()) * body.mass
        };
        Link {
            mass,
            com,
            inertia: about(self) + about(other),
        }
    }
}

/// The arm of the reference tables, in f64 and from their own model file, so that rounding the controller's constants
/// to f32 cannot be mistaken for a property of a formula.
#[derive(Clone, Copy)]
pub(crate) struct Arm {
    pub a1: f64,
    pub a2: f64,
    pub d4: f64,
    pub g: f64,
    /// Distance of the centre of mass of links 1 and 2 from the axis of their own joint.
    pub lc: [f64; 2],
    pub links: [Link; 4],
}

impl Arm {
    /// The bare arm.
    pub(crate) fn bare() -> Self {
        Self::from_json(&model())
    }

    /// The arm with a payload of the `payload` column of `dynamics.csv`: `none` or `p10`.
    pub(crate) fn with_payload(label: &str) -> Self {
        let model = model();
        let mut arm = Self::from_json(&model);
        match label {
            "none" => {}
            "p10" => {
                let load = Link::from_json(&model["payload_test_10kg"], "com_flange_frame");
                arm.links[3] = arm.links[3].joined(&load);
            }
            other => panic!("no payload {other}"),
        }
        arm
    }

    /// Mass that the lift carries: carriage, shaft and payload (kg).
    pub(crate) fn lifted_mass(&self) -> f64 {
        self.links[2].mass + self.links[3].mass
    }

    fn from_json(model: &Value) -> Self {
        let dh = &model["dh"];
        let links = &model["links"];
        Self {
            a1: number(&dh["a1"]),
            a2: number(&dh["a2"]),
            d4: number(&dh["d4"]),
            g: -number(&model["gravity"][2]),
            lc: [number(&links[0]["lc"]), number(&links[1]["lc"])],
            links: std::array::from_fn(|i| Link::from_json(&links[i], "com_dh_frame")),
        }
    }
}

fn model() -> Value {
    let text = fs::read_to_string(reference("model.json")).expect("model.json is there");
    serde_json::from_str(&text).expect("model.json is JSON")
}

fn number(value: &Value) -> f64 {
    value
        .as_f64()
        .unwrap_or_else(|| panic!("model.json: {value} is not a number"))
}

fn vector(value: &Value) -> Vector3<f64> {
    Vector3::from_fn(|i, _| number(&value[i]))
}

/// Joint position, velocity and acceleration of a row; acceleration is zero where the table has none.
#[derive(Clone, Copy)]
pub(crate) struct State {
    pub q: Vector4<f64>,
    pub qd: Vector4<f64>,
    pub qdd: Vector4<f64>,
}

impl State {
    /// The state of a row of a dynamics table.
    pub(crate) fn of(row: &Row) -> Self {
        Self {
            q: row.vector("q"),
            qd: row.vector("qd"),
            qdd: row.vector("qdd"),
        }
    }
}

/// Angular and linear velocity of a frame.
#[derive(Clone, Copy, Default)]
pub(crate) struct Twist {
    pub angular: Vector3<f64>,
    pub linear: Vector3<f64>,
}

/// Rotation part of a homogeneous transform.
pub(crate) fn rotation(t: &Matrix4<f64>) -> Matrix3<f64> {
    t.fixed_view::<3, 3>(0, 0).into_owned()
}

/// Translation part of a homogeneous transform.
pub(crate) fn translation(t: &Matrix4<f64>) -> Vector3<f64> {
    t.fixed_view::<3, 1>(0, 3).into_owned()
}

/// The greater magnitude. NaN fails the test: `f64::max` would drop it, and a formula that yields NaN would pass as
/// exact.
fn greater(so_far: f64, value: &f64) -> f64 {
    assert!(!value.is_nan(), "an error is not a number");
    so_far.max(value.abs())
}

/// The largest magnitude among the elements of a vector or matrix.
pub(crate) fn largest<'a>(values: impl IntoIterator<Item = &'a f64>) -> f64 {
    values.into_iter().fold(0.0, greater)
}

/// Largest error of the printed and of the corrected form over some cases.
pub(crate) fn worst<T>(
    cases: impl IntoIterator<Item = T>,
    errors: impl Fn(T) -> (f64, f64),
) -> (f64, f64) {
    cases.into_iter().fold((0.0, 0.0), |so_far, case| {
        let (printed, corrected) = errors(case);
        (greater(so_far.0, &printed), greater(so_far.1, &corrected))
    })
}

/// The largest of `bound` over some cases.
pub(crate) fn bound_over<T>(cases: impl IntoIterator<Item = T>, bound: impl Fn(T) -> f64) -> f64 {
    worst(cases, |case| (bound(case), 0.0)).0
}

/// Prints the two errors against the oracle and asserts that the printed form is wrong by at least `wrong_by` and the
/// corrected one right within `right_within`.
pub(crate) fn verdict(
    erratum: u8,
    what: &str,
    unit: &str,
    (printed, corrected): (f64, f64),
    wrong_by: f64,
    right_within: f64,
) {
    let (printed, corrected) = (printed.abs(), corrected.abs());
    println!(
        "erratum {erratum:02}  {what}: printed off by {printed:.3e}, corrected by {corrected:.1e} {unit} (bound {right_within:.1e})"
    );
    assert!(
        wrong_by > right_within,
        "{what}: no difference to be seen between {wrong_by} and {right_within}"
    );
    assert!(
        printed >= wrong_by,
        "{what}: printed form is off by {printed} {unit} only, expected {wrong_by}"
    );
    assert!(
        corrected <= right_within,
        "{what}: corrected form is off by {corrected} {unit}, at most {right_within}"
    );
}
