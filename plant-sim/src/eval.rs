//! The formulas of the models as a filter over CSV: rows of states in, rows of results out.
//!
//! Column names are those of the reference tables in `tests/reference`, so that a table can be piped through and
//! compared. Result columns in the input are ignored.

mod cell;
mod controller;
mod plant;
mod table;

use cell::Cell;
use controller::Controller;
use nalgebra::Vector4;
use plant::PlantSide;
use sim::model::{Payload, RobotModel};
use std::io::{self, BufRead, BufReader, Read, Write};
use table::Layout;
use thiserror::Error;

/// What to compute.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Table {
    /// Flange pose, Jacobian, twist and Jdot qd of q (rad, rad, m, rad), qd
    Kinematics,
    /// Both joint solutions of x, y, z (m), yaw (rad)
    Ik,
    /// Efforts, mass matrix, Coriolis and gravity of q, qd, qdd
    Dynamics,
    /// Efforts with rotors and friction, motor torques, angles and speeds of q, qd, qdd
    Actuation,
}

/// Side to which the elbow bends.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Elbow {
    /// theta2 >= 0, as a right arm bends: the solution a
    Positive,
    /// theta2 <= 0, as a left arm bends: the solution b
    Negative,
}

/// Which of the joint positions of a pose are meant.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Posture {
    /// The solution that has to be within the limits; otherwise the better one.
    pub elbow: Option<Elbow>,
    /// Whole revolutions of theta4, 0 from -pi to pi; otherwise 0, judged by whether any is within the limits.
    pub turn: Option<i8>,
}

/// Which implementation computes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum By {
    /// The controller, with Lagrange's closed form (f32)
    Lagrange,
    /// The controller, with the recursive Newton-Euler algorithm (f32)
    NewtonEuler,
    /// The simulated robot (f64)
    Plant,
}

/// Why an evaluation stopped. Lines are counted from 1, which is the header.
#[derive(Debug, Error)]
pub enum EvalError {
    /// The input is not text, or cannot be read.
    #[error("line {line}: cannot read the input: {cause}")]
    Read {
        /// First line that could not be read.
        line: usize,
        /// Error of the operating system.
        cause: io::Error,
    },
    /// The output cannot be written.
    #[error("cannot write the output: {0}")]
    Write(io::Error),
    /// The controller cannot use this model.
    #[error("the controller refuses the model: {0}")]
    Model(firmware::mechanics::arm::ModelError),
    /// A column that the table does not have.
    #[error("line 1: unknown column {column:?}; allowed: {allowed}")]
    UnknownColumn {
        /// Its name.
        column: String,
        /// Names of all columns of the table.
        allowed: String,
    },
    /// A column that occurs twice.
    #[error("line 1: column {column} occurs twice; allowed: once")]
    RepeatedColumn {
        /// Its name.
        column: String,
    },
    /// A missing input column.
    #[error("line 1: column {column} is missing; required are {required}")]
    MissingColumn {
        /// Its name.
        column: String,
        /// Names of all input columns of the table.
        required: String,
    },
    /// A cell that is empty or not a number.
    #[error(
        "line {line}, column {column}: found {found:?}; allowed: a finite number of magnitude up to {max:e}"
    )]
    Value {
        /// Line of the row.
        line: usize,
        /// Name of the column.
        column: String,
        /// Content of the cell.
        found: String,
        /// Largest number that the implementation can represent.
        max: f64,
    },
    /// A length in another unit.
    #[error("line {line}, column {column}: found {found:?}; {slip}")]
    Unit {
        /// Line of the row.
        line: usize,
        /// Name of the column.
        column: String,
        /// Content of the cell.
        found: String,
        /// What it is in the unit that is read.
        slip: String,
    },
    /// A row longer than the header.
    #[error("line {line}: {found} values; allowed: the header's {allowed}")]
    TooManyValues {
        /// Line of the row.
        line: usize,
        /// Values in the row.
        found: usize,
        /// Columns in the header.
        allowed: usize,
    },
}

/// Reads rows of the input columns of `table` and writes for each its result columns as computed `by` one
/// implementation, preceded by the labels (`id`, `kind`, `payload`) in the input. `posture` is for [`Table::Ik`].
///
/// Numbers are printed as the shortest decimals that read back as the same number, `nan` where there is no
/// result.
pub fn eval(
    table: Table,
    posture: Posture,
    by: By,
    model: &RobotModel,
    payload: Option<&Payload>,
    input: impl Read,
    output: impl Write,
) -> Result<(), EvalError> {
    let side: Box<dyn Side> = match by {
        By::Plant => Box::new(PlantSide::new(model, payload)),
        By::Lagrange => Box::new(Controller::lagrange(model, payload)?),
        By::NewtonEuler => Box::new(Controller::newton_euler(model, payload)?),
    };
    let mut lines = BufReader::new(input)
        .lines()
        .enumerate()
        .map(|(index, text)| {
            let line = index + 1;
            text.map(|text| (line, split(&text)))
                .map_err(|cause| EvalError::Read { line, cause })
        });
    let header = lines
        .next()
        .transpose()?
        .map(|(_, cells)| cells)
        .unwrap_or_default();
    let layout = Layout::new(table, &header, side.largest())?;

    let mut writer = csv::Writer::from_writer(output);
    let names = layout
        .labels
        .iter()
        .map(|&i| header[i].to_owned())
        .chain(table.results());
    writer.write_record(names).map_err(write_error)?;
    for record in lines {
        let (line, record) = record?;
        if record.is_empty() {
            continue;
        }
        let values = layout.read(&header, line, &record)?;
        let four = |i: usize| Vector4::from_column_slice(&values[4 * i..4 * i + 4]);
        let results = match table {
            Table::Kinematics => side.kinematics(&four(0), &four(1)),
            Table::Ik => side.ik(&four(0), posture),
            Table::Dynamics => side.dynamics(&four(0), &four(1), &four(2)),
            Table::Actuation => side.actuation(&four(0), &four(1), &four(2)),
        };
        let labels = layout.labels.iter().map(|&i| record[i].to_owned());
        writer
            .write_record(labels.chain(results.iter().map(Cell::to_string)))
            .map_err(write_error)?;
    }
    writer.flush().map_err(EvalError::Write)
}

/// The cells of one line. A table of numbers has no multi-line cells, so lines are split here and not by the CSV
/// reader: errors can then name their line. A blank line has no cells.
fn split(line: &str) -> Vec<String> {
    let mut reader = csv::ReaderBuilder::new()
        .has_headers(false)
        .trim(csv::Trim::All)
        .from_reader(line.as_bytes());
    let record = reader
        .records()
        .next()
        .and_then(Result::ok)
        .unwrap_or_default();
    record.iter().map(str::to_owned).collect()
}

fn write_error(error: csv::Error) -> EvalError {
    EvalError::Write(error.into())
}

/// An implementation of the formulas; every method gives the result columns of one table.
trait Side {
    /// Largest input number.
    fn largest(&self) -> f64;
    fn kinematics(&self, q: &Vector4<f64>, qd: &Vector4<f64>) -> Vec<Cell>;
    /// `pose` is x, y, z, yaw.
    fn ik(&self, pose: &Vector4<f64>, posture: Posture) -> Vec<Cell>;
    fn dynamics(&self, q: &Vector4<f64>, qd: &Vector4<f64>, qdd: &Vector4<f64>) -> Vec<Cell>;
    fn actuation(&self, q: &Vector4<f64>, qd: &Vector4<f64>, qdd: &Vector4<f64>) -> Vec<Cell>;
}
