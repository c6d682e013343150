//! A file of results, read a line at a time: the one place that says which of its lines are good.
//!
//! A line ends with a hash of the rest of it, so that a number which a disk or an editor has changed is not taken for a result.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::Serialize;
use sha2::{Digest, Sha256};
use sim::campaign::case::Case;
use sim::campaign::tally::Outcome;
use sim::campaign::verdict::Verdict;

use super::shard::{Shard, ShardHeader};
use super::{CampaignError, plan};

/// A line of results: a case and what became of it.
#[derive(Debug, Serialize, JsonSchema)]
pub struct ResultLine {
    /// Which.
    pub case: Case,
    /// What became of it.
    pub verdict: Verdict,
    /// The first 16 digits of the SHA-256 of the line up to the comma before this key.
    pub hash: String,
}

/// Length of what [`end`] gives.
const END: usize = r#","hash":"0123456789abcdef"}"#.len();

/// The line of an outcome, without its end.
pub fn line(outcome: &Outcome) -> String {
    let mut line = plan::line(outcome);
    line.truncate(line.len() - 1);
    let end = end(line.as_bytes());
    line + &end
}

/// How a line that begins like this ends.
fn end(line: &[u8]) -> String {
    let hash = Sha256::digest(line);
    let hash = hash.iter().take(8).map(|byte| format!("{byte:02x}"));
    format!(r#","hash":"{}"}}"#, hash.collect::<String>())
}

/// The outcome in a line.
///
/// # Errors
/// What the line is instead.
pub fn outcome(line: &[u8]) -> Result<Outcome, String> {
    let outcome: Outcome =
        serde_json::from_slice(line).map_err(|_| "is no result of a case".to_string())?;
    let parts = line.len().checked_sub(END).map(|at| line.split_at(at));
    match parts {
        Some((line, found)) if end(line).as_bytes() == found => Ok(outcome),
        _ => Err(format!(
            "is case {}, and not as it was written: its hash is another",
            outcome.case.case
        )),
    }
}

/// A file of results, of which the results of its part are read: in their order, none left out, and nothing else.
#[derive(Debug)]
pub struct Reader {
    path: PathBuf,
    header: ShardHeader,
    lines: Lines,
    /// The next case of the part.
    due: u64,
    /// Of the lines that were good, bytes.
    length: u64,
}

impl Reader {
    /// Opens the results of `shard`.
    ///
    /// # Errors
    /// They cannot be read, or the first line is not theirs.
    pub fn open(path: &Path, shard: Shard) -> Result<Self, CampaignError> {
        let file = File::open(path).map_err(CampaignError::read(path))?;
        Self::new(path, shard, file)
    }

    /// Those in an open file.
    ///
    /// # Errors
    /// As for [`Self::open`].
    pub fn new(path: &Path, shard: Shard, file: File) -> Result<Self, CampaignError> {
        let mut lines = Lines {
            file: BufReader::new(file),
            line: Vec::new(),
            number: 0,
        };
        lines.read(path)?;
        let header: Option<ShardHeader> = serde_json::from_slice(lines.whole()).ok();
        let header = header
            .filter(|header| header.shard == shard)
            .ok_or_else(|| {
                let what = format!("line 1 is not that of results of part {shard} of a campaign");
                CampaignError::damaged(path, shard, what)
            })?;
        Ok(Self {
            path: path.into(),
            due: shard.part,
            length: lines.line.len() as u64,
            header,
            lines,
        })
    }

    /// The next result; `None` after the last of the part.
    ///
    /// # Errors
    /// [`CampaignError::Damaged`] if it is not there, or something else is; or it cannot be read.
    pub fn advance(&mut self) -> Result<Option<Outcome>, CampaignError> {
        self.lines.read(&self.path)?;
        let (due, shard) = (self.due, self.header.shard);
        let is_over = due >= self.header.cases;
        if self.lines.line.is_empty() && is_over {
            return Ok(None);
        }
        let number = self.lines.number;
        let what = match self.lines.outcome() {
            Ok(outcome) if outcome.case.case == due && !is_over => {
                self.due += shard.of;
                self.length += self.lines.line.len() as u64;
                return Ok(Some(outcome));
            }
            Ok(outcome) if is_over => {
                format!(
                    "line {number} is case {}, after the last",
                    outcome.case.case
                )
            }
            Ok(outcome) => format!(
                "line {number} is case {}, where case {due} belongs",
                outcome.case.case
            ),
            Err(_) if self.lines.line.is_empty() => format!("it ends before case {due}"),
            Err(what) => format!("line {number} {what}"),
        };
        Err(CampaignError::damaged(&self.path, shard, what))
    }

    /// Where they are.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The first line.
    pub fn header(&self) -> &ShardHeader {
        &self.header
    }

    /// The line of the last result.
    pub fn line(&self) -> &[u8] {
        &self.lines.line
    }

    /// Length of the file up to its end.
    pub fn length(&self) -> u64 {
        self.length
    }
}

#[derive(Debug)]
struct Lines {
    file: BufReader<File>,
    /// With its end; empty after the last.
    line: Vec<u8>,
    /// From 1.
    number: u64,
}

impl Lines {
    fn read(&mut self, path: &Path) -> Result<(), CampaignError> {
        self.line.clear();
        self.number += 1;
        let read = self.file.read_until(b'\n', &mut self.line);
        read.map_err(CampaignError::read(path)).map(drop)
    }

    /// The line without its end; empty if it has none, as one that was cut short.
    fn whole(&self) -> &[u8] {
        self.line.strip_suffix(b"\n").unwrap_or_default()
    }

    fn outcome(&self) -> Result<Outcome, String> {
        outcome(self.whole())
    }
}
