//! Columns of each table, and their positions in an input.

use sim::scenario::millimetres;

use super::{EvalError, Table};

impl Table {
    /// Columns of numbers that a row must have, in groups of four.
    fn inputs(self) -> Vec<String> {
        match self {
            Self::Kinematics => numbered(&["q", "qd"], 4),
            Self::Ik => ["x", "y", "z", "yaw"].map(str::to_owned).into(),
            Self::Dynamics | Self::Actuation => numbered(&["q", "qd", "qdd"], 4),
        }
    }

    /// Those of them that are lengths.
    fn lengths(self) -> &'static [&'static str] {
        match self {
            Self::Kinematics | Self::Dynamics | Self::Actuation => &["q3"],
            Self::Ik => &["x", "y", "z"],
        }
    }

    /// Columns passed on unchanged.
    fn labels(self) -> &'static [&'static str] {
        match self {
            Self::Kinematics | Self::Actuation => &["id"],
            Self::Ik => &["id", "kind"],
            Self::Dynamics => &["id", "payload"],
        }
    }

    /// Computed columns.
    pub(super) fn results(self) -> Vec<String> {
        let plain = |names: &[&str]| {
            names
                .iter()
                .map(|&name| name.to_owned())
                .collect::<Vec<_>>()
        };
        match self {
            Self::Kinematics => [
                plain(&["x", "y", "z", "yaw"]),
                matrix("R", 3, 3),
                matrix("J", 6, 4),
                plain(&["vx", "vy", "vz", "wx", "wy", "wz"]),
                numbered(&["Jdqd"], 6),
            ]
            .concat(),
            Self::Ik => [
                plain(&["reason"]),
                numbered(&["a_q"], 4),
                plain(&["a_in_limits"]),
                numbered(&["b_q"], 4),
                plain(&["b_in_limits", "detJ_a", "tol_theta2"]),
            ]
            .concat(),
            Self::Dynamics => [
                numbered(&["tau"], 4),
                matrix("M", 4, 4),
                numbered(&["n", "g"], 4),
            ]
            .concat(),
            Self::Actuation => numbered(
                &[
                    "tau_link",
                    "tau_rotor",
                    "tau_fric",
                    "tau_joint_total",
                    "tau_motor",
                    "phi_motor",
                    "phid_motor",
                ],
                4,
            ),
        }
    }
}

/// `a1 .. aN, b1 .. bN` for prefixes a, b.
fn numbered(prefixes: &[&str], count: usize) -> Vec<String> {
    prefixes
        .iter()
        .flat_map(|prefix| (1..=count).map(move |i| format!("{prefix}{i}")))
        .collect()
}

/// `M11 .. MRC`, row first.
fn matrix(prefix: &str, rows: usize, columns: usize) -> Vec<String> {
    (1..=rows)
        .flat_map(|r| (1..=columns).map(move |c| format!("{prefix}{r}{c}")))
        .collect()
}

/// Positions of a table's columns in an input.
pub(super) struct Layout {
    inputs: Vec<usize>,
    /// Columns to pass on.
    pub(super) labels: Vec<usize>,
    lengths: &'static [&'static str],
    largest: f64,
}

impl Layout {
    pub(super) fn new(table: Table, header: &[String], largest: f64) -> Result<Self, EvalError> {
        let required = table.inputs();
        let labels: Vec<String> = table.labels().iter().map(|&name| name.to_owned()).collect();
        let allowed = [labels.clone(), required.clone(), table.results()].concat();
        for (i, column) in header.iter().enumerate() {
            if !allowed.iter().any(|name| name == column) {
                return Err(EvalError::UnknownColumn {
                    column: column.to_owned(),
                    allowed: allowed.join(", "),
                });
            }
            if header.iter().take(i).any(|earlier| earlier == column) {
                return Err(EvalError::RepeatedColumn {
                    column: column.to_owned(),
                });
            }
        }
        let position = |name: &String| header.iter().position(|column| column == name);
        let inputs = required.iter().map(|name| {
            position(name).ok_or_else(|| EvalError::MissingColumn {
                column: name.clone(),
                required: required.join(", "),
            })
        });
        Ok(Self {
            inputs: inputs.collect::<Result<_, _>>()?,
            labels: labels.iter().filter_map(position).collect(),
            lengths: table.lengths(),
            largest,
        })
    }

    /// The input numbers of a row.
    pub(super) fn read(
        &self,
        header: &[String],
        line: usize,
        record: &[String],
    ) -> Result<Vec<f64>, EvalError> {
        if record.len() > header.len() {
            return Err(EvalError::TooManyValues {
                line,
                found: record.len(),
                allowed: header.len(),
            });
        }
        let wrong = |column: usize, found: &str| EvalError::Value {
            line,
            column: header[column].to_owned(),
            found: found.to_owned(),
            max: self.largest,
        };
        if record.len() < header.len() {
            return Err(wrong(record.len(), ""));
        }
        let number = |&column: &usize| {
            let text = &record[column];
            // NaN and infinities parse but are not states of a robot, nor are numbers beyond the range of an f32.
            let number = text.parse().ok().filter(|x: &f64| x.abs() <= self.largest);
            let number = number.ok_or_else(|| wrong(column, text))?;
            let name = header[column].as_str();
            match millimetres(number).filter(|_| self.lengths.contains(&name)) {
                None => Ok(number),
                Some(slip) => Err(EvalError::Unit {
                    line,
                    column: name.to_owned(),
                    found: text.clone(),
                    slip,
                }),
            }
        };
        self.inputs.iter().map(number).collect()
    }
}
