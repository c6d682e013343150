//! Motion: from a request to a reference for every sample.
//!
//! ```text
//! request -> planner (bounded work per tick) -> Trajectory -> Clock -> Reference
//! ```
//!
//! A [`Trajectory`] is a closed form: a path, a jerk-limited time law along it, for a jump a lift
//! profile superimposed on it, and one time scale for all of it. Nothing is tabulated, so it
//! costs a few hundred bytes and can be evaluated at any instant and any control rate.

pub mod clock;
pub mod path;
pub mod planner;
pub mod profile;
pub mod queue;
pub mod request;
pub mod torque_budget;

use nalgebra::Vector4;

use crate::mechanics::arm::ArmModel;
use path::{Path, PathError, PathPoint};
use profile::{SCurve, Sample};

/// Where the arm should be: joint positions and their first three time derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Joint positions: rad, rad, m, rad.
    pub q: Vector4<f32>,
    /// Joint velocities: rad/s, rad/s, m/s, rad/s.
    pub qd: Vector4<f32>,
    /// Joint accelerations: rad/s^2, rad/s^2, m/s^2, rad/s^2.
    pub qdd: Vector4<f32>,
    /// Joint jerks: rad/s^3, rad/s^3, m/s^3, rad/s^3.
    pub qddd: Vector4<f32>,
}

impl Reference {
    /// At rest at `q`.
    pub fn rest(q: Vector4<f32>) -> Self {
        Self {
            q,
            qd: Vector4::zeros(),
            qdd: Vector4::zeros(),
            qddd: Vector4::zeros(),
        }
    }
}

/// The vertical part of a jump (gate move): up, stay, down. Lengths in m, d3 positive down.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lift {
    /// d3 at the start.
    pub from: f32,
    /// Rise.
    pub up: SCurve,
    /// Descent.
    pub down: SCurve,
    /// Time at which the descent begins, s.
    pub down_start: f32,
}

/// A planned move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Trajectory {
    /// Geometry.
    pub path: Path,
    /// Time law along the path.
    pub profile: SCurve,
    /// Time at which the motion along the path begins, s (above 0 in a jump).
    pub start: f32,
    /// Vertical part of a jump.
    pub lift: Option<Lift>,
    /// Duration before scaling, s.
    pub span: f32,
    /// Time scale, 0 < scale <= 1: the move lasts `span / time_scale`.
    pub time_scale: f32,
    /// Largest joint accelerations of the move at full speed: those a stop may use for braking.
    pub braking: Vector4<f32>,
    /// Joint positions at the end.
    pub end: Vector4<f32>,
    /// Sequence number that the operator gave the move.
    pub sequence: u8,
}

impl Trajectory {
    /// Time from rest to rest, s.
    pub fn duration(&self) -> f32 {
        self.span / self.time_scale
    }

    /// Reference at `t` seconds after the start, held at both ends.
    ///
    /// # Errors
    /// A line that has not been surveyed by the planner may leave the reach; a planned one cannot.
    pub fn at(&self, arm: &ArmModel, t: f32) -> Result<Reference, PathError> {
        let t = t * self.time_scale;
        let Sample { s, v, a, j } = self.profile.at(t - self.start);
        let mut reference = match &self.path {
            // The same as below without the terms that are zero here: nearly every move is of this kind.
            Path::Joint { start, delta } => Reference {
                q: start + delta * s,
                qd: delta * v,
                qdd: delta * a,
                qddd: delta * j,
            },
            path @ Path::Line { .. } => {
                let PathPoint { q, dq, ddq } = path.at(arm, s)?;
                Reference {
                    q,
                    qd: dq * v,
                    qdd: dq * a + ddq * (v * v),
                    // The third path derivative is left out: it only feeds the extrapolation within a sample.
                    qddd: dq * j + ddq * (3.0 * v * a),
                }
            }
        };
        if let Some(lift) = &self.lift {
            let up = lift.up.at(t);
            let down = lift.down.at(t - lift.down_start);
            reference.q.z = lift.from - up.s + down.s;
            reference.qd.z = down.v - up.v;
            reference.qdd.z = down.a - up.a;
            reference.qddd.z = down.j - up.j;
        }
        let scale = self.time_scale;
        reference.qd *= scale;
        reference.qdd *= scale * scale;
        reference.qddd *= scale * scale * scale;
        Ok(reference)
    }
}
