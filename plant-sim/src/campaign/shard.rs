//! A part of a plan, and the file of its results.
//!
//! The file is called `.partial` until it is complete. Results are appended a batch at a time: whatever ends the process leaves
//! whole lines and at most a piece of one. The next run goes on after the last line up to which all are those of the plan.

use std::fmt;
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{Seek as _, SeekFrom, Write as _};
use std::path::{Path, PathBuf};
use std::str::FromStr;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::plan::{self, Plan, Scene};
use super::results::Reader;
use super::{CampaignError, undamaged};
use crate::output::{OutputError, refuse_tilde};
use crate::say;

/// Part `part` of `of`, counted from 0: the cases whose number leaves this remainder.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
pub struct Shard {
    /// Which, from 0.
    pub part: u64,
    /// Of how many.
    pub of: u64,
}

impl Shard {
    /// The whole plan.
    pub const WHOLE: Self = Self { part: 0, of: 1 };

    /// Whether a case belongs to it.
    pub fn has(self, case: u64) -> bool {
        case % self.of == self.part
    }

    /// How many of `cases` belong to it.
    pub fn share(self, cases: u64) -> u64 {
        cases / self.of + u64::from(self.part < cases % self.of)
    }

    /// Name of the file of its results.
    pub fn file(self) -> String {
        format!("results-{}-of-{}.jsonl", self.part, self.of)
    }

    /// Whose results a file of this name has.
    pub fn of_file(name: &str) -> Option<Self> {
        let numbers = name.strip_prefix("results-")?.strip_suffix(".jsonl")?;
        let shard: Self = numbers.replace("-of-", "/").parse().ok()?;
        (shard.file() == name).then_some(shard)
    }
}

/// `K/N`.
impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.part, self.of)
    }
}

/// `K/N`.
impl FromStr for Shard {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(part, of)| Some((part.parse().ok()?, of.parse().ok()?)));
        match numbers {
            Some((part, of)) if part < of => Ok(Self { part, of }),
            _ => Err("allowed: K/N with K from 0 to N-1, such as 0/4".into()),
        }
    }
}

/// The first line of a file of results.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
pub struct ShardHeader {
    /// Hash of the plan.
    pub plan: String,
    /// Number of its cases.
    pub cases: u64,
    /// Its situations, without which the hash cannot be worked out again.
    #[serde(default)]
    pub situations: Vec<Scene>,
    /// Build of the program: results of two builds are not those of one campaign.
    pub build: String,
    /// Which part of the plan is here.
    pub shard: Shard,
}

impl ShardHeader {
    /// For this part of a plan, by this program.
    pub fn new(plan: &Plan, shard: Shard) -> Self {
        let header = plan.header();
        Self {
            plan: header.plan.clone(),
            cases: header.cases,
            situations: header.situations.clone(),
            build: env!("COMMIT").into(),
            shard,
        }
    }

    /// Whether both are results of one plan.
    pub fn is_of_plan_of(&self, other: &Self) -> bool {
        self.plan == other.plan && self.cases == other.cases && self.situations == other.situations
    }
}

/// Results of a shard on their way to disk.
#[derive(Debug)]
pub struct Results {
    file: File,
    partial: PathBuf,
    path: PathBuf,
}

/// Results that a shard finds in its folder.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Kept {
    /// How many cases.
    pub cases: u64,
    /// How many of them missed a requirement.
    pub missed: u64,
    /// Length of their lines, and of the first.
    length: u64,
    /// Whether that is all of the shard, and nothing else.
    is_whole: bool,
}

impl Results {
    /// The results in `folder`, which is created if missing, and the file for the rest, `None` if nothing is left. With `resume`
    /// the results there are kept, otherwise they are replaced.
    ///
    /// # Errors
    /// Another process writes them, they belong to another plan, or the folder does not accept them.
    pub fn open(
        folder: &Path,
        plan: &Plan,
        header: &ShardHeader,
        resume: bool,
    ) -> Result<(Kept, Option<Self>), CampaignError> {
        refuse_tilde(folder)?;
        fs::create_dir_all(folder).map_err(CampaignError::write(folder))?;
        let path = folder.join(header.shard.file());
        let partial = partial_of(&path);
        if resume && path.exists() {
            let file = File::open(&path).map_err(CampaignError::read(&path))?;
            let kept = kept(&path, plan, header, file)?;
            if kept.is_whole {
                return Ok((kept, None));
            }
            let all = header.shard.share(header.cases);
            let (shown, good) = (path.display(), kept.cases);
            say!("{shown}: damaged after {good} of {all} cases; the rest is run again");
            // A file that another run has begun since is the one to go on with.
            if !partial.exists() {
                fs::rename(&path, &partial).map_err(CampaignError::write(&partial))?;
            }
        }
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(&partial)
            .map_err(CampaignError::write(&partial))?;
        if let Err(TryLockError::WouldBlock) = file.try_lock() {
            return Err(OutputError::Locked {
                path: folder.into(),
            }
            .into());
        }
        let kept = if resume {
            let same = file.try_clone().map_err(CampaignError::read(&partial))?;
            kept(&partial, plan, header, same)?
        } else {
            Kept::default()
        };
        let first = plan::line(header) + "\n";
        file.set_len(kept.length)
            .and_then(|()| file.seek(SeekFrom::Start(kept.length)))
            .and_then(|_| match kept.length {
                0 => file.write_all(first.as_bytes()),
                _ => Ok(()),
            })
            .map_err(CampaignError::write(&partial))?;
        let results = Self {
            file,
            partial,
            path,
        };
        Ok((kept, Some(results)))
    }

    /// Appends whole lines.
    ///
    /// # Errors
    /// The disk is full, for example.
    pub fn append(&mut self, lines: &str) -> Result<(), CampaignError> {
        let written = self.file.write_all(lines.as_bytes());
        written.map_err(CampaignError::write(&self.partial))
    }

    /// Gives the file its name.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn complete(self) -> Result<(), CampaignError> {
        let done = self
            .file
            .sync_all()
            .and_then(|()| fs::rename(&self.partial, &self.path));
        done.map_err(CampaignError::write(&self.path))
    }
}

fn partial_of(path: &Path) -> PathBuf {
    let mut name = path.as_os_str().to_owned();
    name.push(".partial");
    name.into()
}

/// How far a file that may be incomplete or damaged has the results of the plan.
fn kept(path: &Path, plan: &Plan, header: &ShardHeader, file: File) -> Result<Kept, CampaignError> {
    let mut kept = Kept::default();
    let Some(mut reader) = undamaged(Reader::new(path, header.shard, file))? else {
        return Ok(kept);
    };
    agree(path, header, reader.header())?;
    kept.length = reader.length();
    for case in plan.cases_of(header.shard)? {
        let case = case?;
        match undamaged(reader.advance())? {
            Some(Some(outcome)) if outcome.case == case => {
                kept.cases += 1;
                kept.missed += u64::from(!outcome.verdict.missed.is_empty());
                kept.length = reader.length();
            }
            _ => return Ok(kept),
        }
    }
    kept.is_whole = undamaged(reader.advance())? == Some(None);
    Ok(kept)
}

fn agree(path: &Path, expected: &ShardHeader, found: &ShardHeader) -> Result<(), CampaignError> {
    if found == expected {
        return Ok(());
    }
    let what = if found.build == expected.build {
        "these are results of another plan"
    } else {
        "these are results of another build of this program"
    };
    Err(CampaignError::wrong(
        path,
        format!("{what}; choose another folder by --out, or leave out --resume to replace them"),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_share_every_case_once() {
        for (cases, of) in [(0, 1), (1, 3), (10, 3), (12, 4), (5, 9)] {
            let shards: Vec<_> = (0..of).map(|part| Shard { part, of }).collect();
            for case in 0..cases {
                let owners = shards.iter().filter(|shard| shard.has(case)).count();
                assert_eq!(owners, 1, "{case}");
            }
            for shard in &shards {
                let counted = (0..cases).filter(|case| shard.has(*case)).count();
                assert_eq!(shard.share(cases), counted as u64);
            }
        }
    }

    #[test]
    fn a_shard_is_counted_from_0() {
        assert_eq!("0/1".parse(), Ok(Shard::WHOLE));
        for wrong in ["1/1", "1", "a/2", "-1/2", "0/0", ""] {
            assert!(wrong.parse::<Shard>().is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_file_is_called_after_its_shard() {
        let shard = Shard { part: 2, of: 11 };
        assert_eq!(shard.file(), "results-2-of-11.jsonl");
        assert_eq!(Shard::of_file(&shard.file()), Some(shard));
        for wrong in ["02-of-11", "11-of-11", "2/11", "copy"] {
            let name = format!("results-{wrong}.jsonl");
            assert_eq!(Shard::of_file(&name), None, "{name}");
        }
    }
}
