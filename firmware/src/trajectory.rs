//! Motion: from a request to a reference for every sample.
//!
//! ```text
//! request -> planner (bounded work per tick) -> Trajectory -> Clock -> Reference
//! ```
//!
//! A [`Trajectory`] is a closed form: a path, a jerk-limited time law along it, for a jump a lift
//! profile superimposed on it, and one time scale for all of it. Nothing is tabulated, so it
//! costs a few hundred bytes and can be evaluated at any instant and any control rate.

mod caps;
pub mod clock;
pub mod curve;
pub mod path;
pub mod planner;
pub mod profile;
pub mod queue;
pub mod request;
pub mod tool_speed;
pub mod torque_budget;

use nalgebra::Vector4;

use crate::mechanics::arm::ArmModel;
use path::{Path, PathError, PathPoint};
use profile::{SCurve, Sample};

/// Where the arm should be: joint positions and their first two time derivatives.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reference {
    /// Joint positions: rad, rad, m, rad.
    pub q: Vector4<f32>,
    /// Joint velocities: rad/s, rad/s, m/s, rad/s.
    pub qd: Vector4<f32>,
    /// Joint accelerations: rad/s^2, rad/s^2, m/s^2, rad/s^2.
    pub qdd: Vector4<f32>,
}

impl Reference {
    /// At rest at `q`.
    pub fn rest(q: Vector4<f32>) -> Self {
        Self {
            q,
            qd: Vector4::zeros(),
            qdd: Vector4::zeros(),
        }
    }
}

/// How the arm should move, wherever it is: units as in [`Reference`].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rates {
    /// Joint velocities.
    pub qd: Vector4<f32>,
    /// Joint accelerations.
    pub qdd: Vector4<f32>,
}

/// What the arm is to follow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Setpoint {
    /// At the sampling instant.
    pub reference: Reference,
    /// When the command acts.
    pub ahead: Rates,
}

impl Setpoint {
    /// At rest at `q`.
    pub fn rest(q: Vector4<f32>) -> Self {
        Self {
            reference: Reference::rest(q),
            ahead: Rates {
                qd: Vector4::zeros(),
                qdd: Vector4::zeros(),
            },
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

impl Lift {
    /// At rest there, until its strokes are known.
    fn at_rest(from: f32) -> Self {
        Self {
            from,
            up: SCurve::default(),
            down: SCurve::default(),
            down_start: 0.0,
        }
    }

    /// d3 and its derivatives at `t`. The descent begins no sooner than the rise has ended.
    fn at(&self, t: f32) -> Sample {
        let t_down = t - self.down_start;
        if t_down > 0.0 {
            let Sample { s, v, a } = self.down.at(t_down);
            let top = self.from - self.up.distance();
            Sample { s: top + s, v, a }
        } else {
            let Sample { s, v, a } = self.up.at(t);
            Sample {
                s: self.from - s,
                v: -v,
                a: -a,
            }
        }
    }
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
    /// Duration before scaling, s.
    pub span: f32,
    /// Time scale, 0 < scale <= 1: the move lasts `span / time_scale`.
    pub time_scale: f32,
    /// Joint positions at the end.
    pub end: Vector4<f32>,
    /// How far from the end the arm may leave the path for the next one, m; 0 where it stops there.
    pub zone: f32,
    /// For how long the next move has begun when this one ends, s.
    pub overlap: f32,
    /// Greatest speed of the flange along a curve that was asked for, m/s; 0 for any.
    pub tool_speed: f32,
    /// Sequence number that the operator gave the move.
    pub sequence: u8,
}

impl Trajectory {
    /// Time from rest to rest, s.
    pub fn duration(&self) -> f32 {
        self.span / self.time_scale
    }

    /// Time at which the next move begins, s.
    pub(super) fn next_begins(&self) -> f32 {
        self.duration() - self.overlap
    }

    /// Reference at `t` seconds after the start, held at both ends.
    ///
    /// # Errors
    /// A curve of the tool that has not been surveyed by the planner may leave the reach; a planned one cannot.
    pub fn at(&self, arm: &ArmModel, t: f32) -> Result<Reference, PathError> {
        let mut reference = Reference::rest(self.end);
        self.evaluate(arm, t, &mut reference, None)?;
        Ok(reference)
    }

    /// As [`Trajectory::at`], and how the arm should move `lead` seconds later: at the place of that instant, but for the third
    /// derivative of a curve of the tool, which a few milliseconds leave without effect.
    ///
    /// # Errors
    /// As [`Trajectory::at`].
    pub fn follow(
        &self,
        arm: &ArmModel,
        t: f32,
        lead: f32,
        setpoint: &mut Setpoint,
    ) -> Result<(), PathError> {
        let Setpoint { reference, ahead } = setpoint;
        self.evaluate(arm, t, reference, Some((lead, ahead)))
    }

    /// Adds the motion of the next move, at its time `t`, to that of this one.
    ///
    /// # Errors
    /// As [`Trajectory::at`].
    // Out of line: few samples are in an overlap.
    #[inline(never)]
    pub(super) fn add(
        &self,
        next: &Self,
        arm: &ArmModel,
        t: f32,
        lead: f32,
        setpoint: &mut Setpoint,
    ) -> Result<(), PathError> {
        let mut more = Setpoint::rest(self.end);
        next.follow(arm, t, lead, &mut more)?;
        let Setpoint { reference, ahead } = setpoint;
        reference.q += more.reference.q - self.end;
        reference.qd += more.reference.qd;
        reference.qdd += more.reference.qdd;
        ahead.qd += more.ahead.qd;
        ahead.qdd += more.ahead.qdd;
        Ok(())
    }

    /// With or without a look ahead, in one copy. Into place: what is returned would be copied on the way.
    #[inline(never)]
    fn evaluate(
        &self,
        arm: &ArmModel,
        t: f32,
        reference: &mut Reference,
        ahead: Option<(f32, &mut Rates)>,
    ) -> Result<(), PathError> {
        let scale = self.time_scale;
        let (later, ahead) = match ahead {
            Some((lead, ahead)) => (Some((t + lead) * scale), Some(ahead)),
            None => (None, None),
        };
        let t = t * scale;
        let now = self.profile.at(t - self.start);
        let then = later.map_or(now, |later| self.profile.at(later - self.start));
        let squared = scale * scale;
        match &self.path {
            // As below, without what is zero: nearly every move is one of these.
            Path::Joint { start, delta, lift } => {
                reference.q = start + delta * now.s;
                reference.qd = delta * (now.v * scale);
                reference.qdd = delta * (now.a * squared);
                if let Some(lift) = lift {
                    let now = lift.at(t);
                    reference.q.z = now.s;
                    (reference.qd.z, reference.qdd.z) = (now.v * scale, now.a * squared);
                }
                if let (Some(later), Some(ahead)) = (later, ahead) {
                    ahead.qd = delta * (then.v * scale);
                    ahead.qdd = delta * (then.a * squared);
                    if let Some(lift) = lift {
                        let then = lift.at(later);
                        (ahead.qd.z, ahead.qdd.z) = (then.v * scale, then.a * squared);
                    }
                }
            }
            path @ Path::Tool { .. } => {
                let PathPoint { q, dq, ddq } = path.at(arm, now.s)?;
                let dq_then = dq + ddq * (then.s - now.s);
                reference.q = q;
                reference.qd = dq * (now.v * scale);
                reference.qdd = (dq * now.a + ddq * (now.v * now.v)) * squared;
                if let Some(ahead) = ahead {
                    ahead.qd = dq_then * (then.v * scale);
                    ahead.qdd = (dq_then * then.a + ddq * (then.v * then.v)) * squared;
                }
            }
        }
        Ok(())
    }
}
