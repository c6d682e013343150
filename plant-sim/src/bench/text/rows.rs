//! Rows as CSV, under the keys that they have in JSON; of what is inside another value, `outer.inner` and `outer[0]`.

use serde::Serialize;
use serde_json::Value;

use super::super::Report;

/// Every gate, with and without mismatch.
///
/// # Errors
/// Never for numbers and texts.
pub fn csv(report: &Report) -> Result<String, String> {
    of(report.rows.iter().chain(&report.mismatched))
}

/// Every gate at random.
///
/// # Errors
/// As above.
pub fn other_csv(report: &Report) -> Result<String, String> {
    of(&report.others.rows)
}

/// Every pose that is attained again and again.
///
/// # Errors
/// As above.
pub fn repeatability_csv(report: &Report) -> Result<String, String> {
    of(&report.repeatability)
}

fn of<'a, R: Serialize + 'a>(rows: impl IntoIterator<Item = &'a R>) -> Result<String, String> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let mut header = false;
    for row in rows {
        let value = serde_json::to_value(row).map_err(|error| error.to_string())?;
        let mut cells = Vec::new();
        gather(String::new(), value, &mut cells);
        if !header {
            let names = cells.iter().map(|(name, _)| name);
            writer
                .write_record(names)
                .map_err(|error| error.to_string())?;
            header = true;
        }
        let values = cells.iter().map(|(_, value)| value);
        writer
            .write_record(values)
            .map_err(|error| error.to_string())?;
    }
    let bytes = writer.into_inner().map_err(|error| error.to_string())?;
    String::from_utf8(bytes).map_err(|error| error.to_string())
}

/// Keys and values of a row; what is `null` in JSON is blank.
fn gather(name: String, value: Value, cells: &mut Vec<(String, String)>) {
    match value {
        Value::Object(keys) => {
            let dot = if name.is_empty() { "" } else { "." };
            for (key, value) in keys {
                gather(format!("{name}{dot}{key}"), value, cells);
            }
        }
        Value::Array(elements) => {
            for (index, value) in elements.into_iter().enumerate() {
                gather(format!("{name}[{index}]"), value, cells);
            }
        }
        Value::Null => cells.push((name, String::new())),
        Value::String(text) => cells.push((name, text)),
        other => cells.push((name, other.to_string())),
    }
}
