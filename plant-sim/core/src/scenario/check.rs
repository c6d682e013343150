//! Checks of a scenario before anything runs: ranges, and that the gripper can do what it has to.

use std::f64::consts::TAU;

use toml::de::{DeTable, DeValue};

use super::{
    Jump, Line, MAX_CYCLES, PayloadSpec, Place, Scenario, ScenarioError, Step, check_rate,
};
use crate::allowed::schema::Each;
use crate::allowed::{Allowed, PAYLOAD_COM, PAYLOAD_INERTIA, PAYLOAD_MASS, check_moments};
use crate::model::RobotModel;
use crate::text;

pub(super) const LENGTH: Allowed = Allowed::within(-10.0, 10.0, "m");
/// Two turns either way; the range of the wrist is checked with the robot.
const YAW: Allowed = Allowed::within(-2.0 * TAU, 2.0 * TAU, "rad");
const JOINT: Allowed = Allowed::within(-20.0, 20.0, "rad");
/// Of a pose: x, y, z, yaw.
pub(super) const POSE: Each = Each([LENGTH, LENGTH, LENGTH, YAW]);
/// Of a pose or of joint positions, whichever allows more.
pub(super) const EITHER: Each = Each([Allowed::within(-20.0, 20.0, ""); 4]);
pub(super) const RATE: Allowed = Allowed::within(100.0, 10_000.0, "Hz");
pub(super) const CLEARANCE: Allowed = Allowed::within(0.0, 1.0, "m");
pub(super) const SPEED: Allowed = Allowed::above_zero(1.0, "of full speed");
pub(super) const SECONDS: Allowed = Allowed::within(0.0, 3600.0, "s");
pub(super) const FACTOR: Allowed = Allowed::within(0.0, 10.0, "");

impl Scenario {
    /// Checks everything that does not depend on the robot.
    pub(super) fn check(&self) -> Result<(), ScenarioError> {
        if !(1..=MAX_CYCLES).contains(&self.cycles) {
            return Err(self.wrong("cycles", self.cycles, format!("1 to {MAX_CYCLES}")));
        }
        check_rate(self.rate_hz).map_err(|allowed| self.wrong("rate_hz", self.rate_hz, allowed))?;
        self.pose("start", &self.start)?;
        if let Some(payload) = &self.payload {
            self.payload("payload", payload)?;
        }
        self.number("mismatch.friction", self.mismatch.friction, FACTOR)?;
        self.number("mismatch.payload", self.mismatch.payload, FACTOR)?;
        if self.cycle.is_empty() {
            return Err(self.wrong("cycle", "empty", "at least one step"));
        }
        for (index, step) in self.cycle.iter().enumerate() {
            self.step(&format!("cycle[{index}]"), step)?;
        }
        Ok(())
    }

    /// Checks what depends on the nominal robot: payloads that it may carry, gains that the rate allows, a gripper that
    /// is empty before a pick and full before a place.
    ///
    /// # Errors
    /// See [`ScenarioError`].
    pub fn check_with(&self, robot: &RobotModel) -> Result<(), ScenarioError> {
        if let Some(gains) = &self.gains {
            let period = (1.0 / self.rate_hz) as f32;
            for (key, parameter, value) in gains.each(period) {
                let rule = parameter.rule();
                rule.check(value as f32, period).map_err(|_| {
                    let (lower, upper) = (rule.lower, rule.upper_at(period));
                    self.wrong(
                        key,
                        value,
                        format!("{lower} to {upper} at {} Hz", self.rate_hz),
                    )
                })?;
            }
        }
        let carry = Allowed::within(0.0, robot.payload_max, "kg");
        let mut held = self.payload.filter(|payload| payload.mass > 0.0);
        if let Some(payload) = held {
            self.number("payload.mass", payload.mass, carry)?;
        }
        // The gripper begins a cycle with whatever it held at the end of the previous one.
        for _ in 0..self.cycles.min(2) {
            for (index, step) in self.cycle.iter().enumerate() {
                match step {
                    Step::Pick(payload) => {
                        let key = format!("cycle[{index}].pick");
                        if let Some(held) = held.replace(*payload) {
                            return Err(self.wrong(
                                &key,
                                format!("a payload of {} kg", payload.mass),
                                format!(
                                    "an empty gripper; it holds {} kg, so place that first",
                                    held.mass
                                ),
                            ));
                        }
                        self.number(&format!("{key}.mass"), payload.mass, carry)?;
                    }
                    Step::Place {} if held.take().is_none() => {
                        return Err(self.wrong(
                            &format!("cycle[{index}].place"),
                            "nothing",
                            "a gripper that holds something: pick first",
                        ));
                    }
                    _ => {}
                }
            }
        }
        Ok(())
    }

    fn step(&self, key: &str, step: &Step) -> Result<(), ScenarioError> {
        match step {
            Step::Jump(Jump {
                to,
                top,
                clearance,
                speed,
            }) => {
                self.pose(&format!("{key}.jump.to"), to)?;
                self.number(&format!("{key}.jump.top"), *top, LENGTH)?;
                self.number(&format!("{key}.jump.clearance"), *clearance, CLEARANCE)?;
                self.number(&format!("{key}.jump.speed"), *speed, SPEED)
            }
            Step::Line(Line { to, speed }) => {
                self.pose(&format!("{key}.line.to"), to)?;
                self.number(&format!("{key}.line.speed"), *speed, SPEED)
            }
            Step::Joints(Line { to, speed }) => {
                let key = format!("{key}.joints");
                self.numbers(&format!("{key}.to"), to, |axis| {
                    if axis == 2 { LENGTH } else { JOINT }
                })?;
                self.number(&format!("{key}.speed"), *speed, SPEED)
            }
            Step::Dwell(seconds) => self.number(&format!("{key}.dwell"), *seconds, SECONDS),
            Step::Stop(seconds) => self.number(&format!("{key}.stop"), *seconds, SECONDS),
            Step::Pick(payload) => {
                let key = format!("{key}.pick");
                if payload.mass == 0.0 {
                    return Err(self.wrong(&format!("{key}.mass"), 0.0, "more than 0 kg"));
                }
                self.payload(&key, payload)
            }
            Step::Place {} => Ok(()),
        }
    }

    fn pose(&self, key: &str, pose: &[f64; 4]) -> Result<(), ScenarioError> {
        self.numbers(key, pose, |axis| if axis == 3 { YAW } else { LENGTH })
    }

    fn payload(&self, key: &str, payload: &PayloadSpec) -> Result<(), ScenarioError> {
        self.number(&format!("{key}.mass"), payload.mass, PAYLOAD_MASS)?;
        let com = format!("{key}.com_flange_frame");
        self.numbers(&com, &payload.com_flange_frame, |_| PAYLOAD_COM)?;
        let inertia = format!("{key}.inertia_com_diag");
        self.numbers(&inertia, &payload.inertia_com_diag, |_| PAYLOAD_INERTIA)?;
        check_moments(payload.inertia_com_diag).map_err(|(axis, allowed)| {
            let moment = payload.inertia_com_diag[axis];
            self.wrong(&format!("{inertia}[{axis}]"), moment, allowed)
        })
    }

    fn numbers<const N: usize>(
        &self,
        key: &str,
        values: &[f64; N],
        allowed: impl Fn(usize) -> Allowed,
    ) -> Result<(), ScenarioError> {
        for (index, value) in values.iter().enumerate() {
            self.number(&format!("{key}[{index}]"), *value, allowed(index))?;
        }
        Ok(())
    }

    fn number(&self, key: &str, value: f64, allowed: Allowed) -> Result<(), ScenarioError> {
        allowed
            .check(value)
            .map(|_| ())
            .map_err(|allowed| self.wrong(key, value, allowed))
    }

    /// Where the value under a key is said; the last change counts.
    fn place(&self, key: &str) -> Place {
        let change = self.changes.iter().rev().find(|change| change.is_of(key));
        match change {
            Some(change) => Place::Change(change.said.clone()),
            None => place(&self.source.text, key)
                .map_or(Place::Default, |(line, column)| Place::Text(line, column)),
        }
    }

    fn wrong(&self, key: &str, value: impl ToString, allowed: impl Into<String>) -> ScenarioError {
        ScenarioError::Value {
            origin: self.source.origin.clone(),
            place: self.place(key),
            key: key.into(),
            value: value.to_string(),
            allowed: allowed.into(),
        }
    }
}

/// Line and column of the value under a key such as `cycle[2].jump.to[0]`, if it is in the text: a default is not.
fn place(toml: &str, key: &str) -> Option<(usize, usize)> {
    let document = DeTable::parse(toml).ok()?;
    let mut at = document.span();
    let mut value: Option<&DeValue<'_>> = None;
    for word in key.split(['.', '[']) {
        let next = match word.strip_suffix(']') {
            Some(index) => value?.as_array()?.get(index.parse::<usize>().ok()?),
            None => match value {
                None => document.get_ref().get(word),
                Some(value) => value.as_table()?.get(word),
            },
        };
        let next = next?;
        at = next.span();
        value = Some(next.get_ref());
    }
    Some(text::place(toml, at.start))
}
