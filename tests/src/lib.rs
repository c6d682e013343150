//! Shared by the tests that cross crates: the reference tables.
//!
//! The tests are in `tests/tests`: `agreement_*` compare controller and plant with the tables, `closed_loop` tests
//! whole runs and so follows Feedback frames from encoder to torque, `errata` tests the paper, `eval` the command line,
//! `walls` the architecture. The program `docs` keeps the documents correct.
//!
//! The tables under `tests/reference` come from engines that share no code with this workspace (Pinocchio, MuJoCo).
//! All quantities are SI; vectors and matrices are spread over numbered columns: `q1..q4`, `M11..M44`.
//!
//! A missing, ragged or misspelt table is a broken test, not a condition to handle, so every accessor panics with the
//! file, line and column that it wanted.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    reason = "for tests, which fail by panicking"
)]

use std::path::PathBuf;

use nalgebra::{SMatrix, SVector};

/// Path of a file under `tests/reference`.
pub fn reference(file: &str) -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join("reference")
        .join(file)
}

/// A reference table, held in memory.
pub struct Table {
    header: Header,
    records: Vec<csv::StringRecord>,
}

struct Header {
    file: String,
    columns: Vec<String>,
}

impl Table {
    /// Reads `tests/reference/<file>`.
    pub fn load(file: &str) -> Self {
        let mut reader =
            csv::Reader::from_path(reference(file)).unwrap_or_else(|e| panic!("{file}: {e}"));
        let columns = reader.headers().unwrap_or_else(|e| panic!("{file}: {e}"));
        let columns = columns.iter().map(str::to_owned).collect();
        let records: Vec<_> = reader
            .records()
            .map(|record| record.unwrap_or_else(|e| panic!("{file}: {e}")))
            .collect();
        // A loop over no rows would pass all its assertions.
        assert!(!records.is_empty(), "{file}: no rows");
        let header = Header {
            file: file.to_owned(),
            columns,
        };
        Self { header, records }
    }

    /// The rows in file order.
    pub fn rows(&self) -> impl Iterator<Item = Row<'_>> {
        self.records.iter().map(|record| Row {
            header: &self.header,
            record,
        })
    }

    /// The rows whose text in `column` is `value`, such as `payload` = `none`; at least one.
    pub fn rows_where(&self, column: &str, value: &str) -> impl Iterator<Item = Row<'_>> {
        let selected: Vec<_> = self
            .rows()
            .filter(|row| row.text(column) == value)
            .collect();
        assert!(
            !selected.is_empty(),
            "{}: no row has {column} = {value}",
            self.header.file
        );
        selected.into_iter()
    }
}

/// One row, read by column name.
#[derive(Clone, Copy)]
pub struct Row<'a> {
    header: &'a Header,
    record: &'a csv::StringRecord,
}

impl<'a> Row<'a> {
    /// The cell as in the file.
    pub fn text(&self, column: &str) -> &'a str {
        let index = self.header.columns.iter().position(|c| c == column);
        let index = index.unwrap_or_else(|| panic!("{self}: no column {column}"));
        &self.record[index]
    }

    /// The cell as a number; `nan` is one.
    pub fn f64(&self, column: &str) -> f64 {
        let text = self.text(column);
        text.parse()
            .unwrap_or_else(|_| panic!("{self}: {column} is {text:?}, not a number"))
    }

    /// The cell as a flag: `1` or `0`.
    pub fn flag(&self, column: &str) -> bool {
        match self.text(column) {
            "1" => true,
            "0" => false,
            other => panic!("{self}: {column} is {other:?}, not 0 or 1"),
        }
    }

    /// Columns `<prefix>1` to `<prefix>N`.
    pub fn array<const N: usize>(&self, prefix: &str) -> [f64; N] {
        std::array::from_fn(|i| self.f64(&format!("{prefix}{}", i + 1)))
    }

    /// Columns `<prefix>1` to `<prefix>N` as a column vector.
    pub fn vector<const N: usize>(&self, prefix: &str) -> SVector<f64, N> {
        SVector::from(self.array(prefix))
    }

    /// Columns `<prefix>11` to `<prefix>RC`, row first.
    pub fn matrix<const R: usize, const C: usize>(&self, prefix: &str) -> SMatrix<f64, R, C> {
        SMatrix::from_fn(|r, c| self.f64(&format!("{prefix}{}{}", r + 1, c + 1)))
    }
}

impl std::fmt::Display for Row<'_> {
    /// File and line, for the message of a failed assertion.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let line = self.record.position().map_or(0, csv::Position::line);
        write!(f, "{}:{line}", self.header.file)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_reads_by_name() {
        let table = Table::load("dynamics.csv");
        let row = table.rows().next().unwrap();
        assert_eq!(row.text("payload"), "none");
        assert_eq!(row.array::<4>("qd")[0], row.f64("qd1"));
        assert_eq!(row.matrix::<4, 4>("M")[(0, 1)], row.f64("M12"));
        assert_eq!(row.to_string(), "dynamics.csv:2");
    }

    #[test]
    fn nan_and_flags_are_read() {
        let table = Table::load("ik.csv");
        let row = table.rows_where("reason", "too_far").next().unwrap();
        assert!(row.f64("a_q1").is_nan());
        assert!(!row.flag("a_in_limits"));
    }

    #[test]
    #[should_panic(expected = "dynamics.csv:2: no column torque")]
    fn a_misspelt_column_is_named() {
        let table = Table::load("dynamics.csv");
        table.rows().next().unwrap().f64("torque");
    }
}
