//! A file of results, read a line at a time: the one place that says which of its lines are good.

use std::fs::File;
use std::io::{BufRead as _, BufReader};
use std::path::{Path, PathBuf};

use sim::campaign::tally::Outcome;

use super::CampaignError;
use super::shard::{Shard, ShardHeader};

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
        let header: Option<ShardHeader> = lines.parsed();
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
        let outcome: Option<Outcome> = self.lines.parsed();
        let what = match outcome {
            Some(outcome) if outcome.case.case == due && !is_over => {
                self.due += shard.of;
                self.length += self.lines.line.len() as u64;
                return Ok(Some(outcome));
            }
            Some(outcome) if is_over => {
                format!(
                    "line {number} is case {}, after the last",
                    outcome.case.case
                )
            }
            Some(outcome) => format!(
                "line {number} is case {}, where case {due} belongs",
                outcome.case.case
            ),
            None if self.lines.line.is_empty() => format!("it ends before case {due}"),
            None => format!("line {number} is no result of a case"),
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

    /// What the line says; `None` for one that says something else or was cut short.
    fn parsed<T: serde::de::DeserializeOwned>(&self) -> Option<T> {
        self.line
            .strip_suffix(b"\n")
            .and_then(|line| serde_json::from_slice(line).ok())
    }
}
