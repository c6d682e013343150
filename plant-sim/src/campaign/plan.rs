//! A plan: the cases of a campaign, one a line, behind a line that says what they belong to.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::{self, BufRead, BufReader, Lines, Write};
use std::path::{Path, PathBuf};

use protocol::time::Instant;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};
use sim::campaign::case::{Case, Crossing};
use sim::campaign::prelude::onset;
use sim::scenario::Scenario;
use sim::setup::RunConfig;
use trace::LogHash;

use super::CampaignError;
use super::shard::Shard;

/// The first line of a plan.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Header {
    /// SHA-256 of everything after this value, the lines of the cases included.
    pub plan: String,
    /// Number of cases.
    pub cases: u64,
    /// What the robot does in them.
    pub situations: Vec<Scene>,
}

/// A situation as a plan holds it.
#[derive(Clone, Debug, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Scene {
    /// Name.
    pub name: String,
    /// Text of the scenario file.
    pub scenario: String,
}

/// Writes a plan. `cases` is gone through twice: the hash comes first.
///
/// # Errors
/// Those of `sink`.
pub fn write<I: Iterator<Item = Case>>(
    scenes: Vec<Scene>,
    cases: impl Fn() -> I,
    sink: &mut impl Write,
) -> io::Result<()> {
    let mut hash = Hash::new(&scenes);
    let mut count = 0;
    for case in cases() {
        hash.add(&line(&case));
        count += 1;
    }
    let header = Header {
        plan: hash.finish(),
        cases: count,
        situations: scenes,
    };
    writeln!(sink, "{}", line(&header))?;
    for case in cases() {
        writeln!(sink, "{}", line(&case))?;
    }
    sink.flush()
}

/// The situations of a crossing as a plan holds them.
pub fn scenes(crossing: &Crossing) -> Vec<Scene> {
    let scene = |situation: &sim::campaign::case::Situation| Scene {
        name: situation.name.clone(),
        scenario: situation.scenario.to_toml(),
    };
    crossing.situations().iter().map(scene).collect()
}

/// One line of JSON, without its end.
pub(super) fn line(value: &impl Serialize) -> String {
    serde_json::to_string(value).expect("numbers and texts can be written as JSON")
}

/// The hash of a plan.
pub(super) struct Hash(Sha256);

impl Hash {
    pub(super) fn new(scenes: &[Scene]) -> Self {
        let mut hash = Self(Sha256::new());
        hash.add(&line(&scenes));
        hash
    }

    /// Adds the line of a case.
    pub(super) fn add(&mut self, line: &str) {
        self.0.update(line);
        self.0.update("\n");
    }

    pub(super) fn finish(self) -> String {
        LogHash(self.0.finalize().into()).to_string()
    }
}

/// A plan that has been read and found whole.
#[derive(Debug)]
pub struct Plan {
    path: PathBuf,
    header: Header,
    situations: BTreeMap<String, Scenario>,
}

impl Plan {
    /// Reads the whole plan once, and keeps its first line.
    ///
    /// # Errors
    /// It cannot be read, is no plan, or is not as it was written.
    pub fn open(path: &Path) -> Result<Self, CampaignError> {
        let wrong = |what: String| CampaignError::wrong(path, what);
        let (header, lines) = begin(path)?;
        let mut hash = Hash::new(&header.situations);
        let mut count = 0;
        for line in lines {
            hash.add(&line.map_err(CampaignError::read(path))?);
            count += 1;
        }
        let refuse = |what: &str| {
            Err(wrong(format!(
                "{what}; write it again: plant-sim campaign plan"
            )))
        };
        if count != header.cases {
            return refuse(&format!("the plan has {count} cases of {}", header.cases));
        }
        if hash.finish() != header.plan {
            return refuse("the cases are here, but not as they were written");
        }
        let scenarios = header.situations.iter().map(|scene| {
            let scenario = Scenario::parse(&scene.scenario, &scene.name);
            Ok((scene.name.clone(), scenario?))
        });
        let scenarios: Result<_, sim::scenario::ScenarioError> = scenarios.collect();
        Ok(Self {
            path: path.into(),
            situations: scenarios.map_err(|error| wrong(error.to_string()))?,
            header,
        })
    }

    /// Its first line.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Its cases, read as they are needed.
    ///
    /// # Errors
    /// It can no longer be read.
    pub fn cases(
        &self,
    ) -> Result<impl Iterator<Item = Result<Case, CampaignError>>, CampaignError> {
        let (_, lines) = begin(&self.path)?;
        Ok(lines.map(|line| {
            let line = line.map_err(CampaignError::read(&self.path))?;
            serde_json::from_str(&line)
                .map_err(|error| CampaignError::wrong(&self.path, error.to_string()))
        }))
    }

    /// Those of them that belong to `shard`.
    ///
    /// # Errors
    /// It can no longer be read.
    pub fn cases_of(
        &self,
        shard: Shard,
    ) -> Result<impl Iterator<Item = Result<Case, CampaignError>>, CampaignError> {
        let is_of =
            move |case: &Result<Case, _>| case.as_ref().map_or(true, |case| shard.has(case.case));
        Ok(self.cases()?.filter(is_of))
    }

    /// The case of this number.
    ///
    /// # Errors
    /// There is none, or the plan cannot be read.
    pub fn case(&self, number: u64) -> Result<Case, CampaignError> {
        let none = || {
            let what = format!(
                "there is no case {number}; allowed: 0 to {}",
                self.header.cases.saturating_sub(1)
            );
            CampaignError::wrong(&self.path, what)
        };
        let place = usize::try_from(number).map_err(|_| none())?;
        self.cases()?.nth(place).ok_or_else(none)?
    }

    /// Up to when a case is its situation without a fault; the origin of time if the plan does not have that.
    pub(super) fn onset(&self, case: &Case) -> Instant {
        let situation = self.situations.get(&case.situation);
        situation.map_or(Instant::ORIGIN, |situation| {
            onset(&case.scenario(situation))
        })
    }

    /// What to run for a case.
    ///
    /// # Errors
    /// Its situation is not in the plan.
    pub fn config(&self, case: &Case) -> Result<RunConfig, CampaignError> {
        let situation = self.situations.get(&case.situation);
        let situation = situation.ok_or_else(|| CampaignError::Case {
            case: case.case,
            what: format!("the plan has no situation {:?}", case.situation),
        })?;
        Ok(RunConfig::new(case.scenario(situation)))
    }

    /// A plan of one case in one of these situations.
    ///
    /// # Errors
    /// Those of `sink`.
    pub fn write_one(&self, case: &Case, sink: &mut impl Write) -> io::Result<()> {
        let scenes = self.header.situations.iter();
        let scenes = scenes.filter(|scene| scene.name == case.situation);
        let cases = || {
            std::iter::once(Case {
                case: 0,
                ..case.clone()
            })
        };
        write(scenes.cloned().collect(), cases, sink)
    }
}

fn begin(path: &Path) -> Result<(Header, Lines<BufReader<File>>), CampaignError> {
    let file = File::open(path).map_err(CampaignError::read(path))?;
    let mut lines = BufReader::new(file).lines();
    let first = lines
        .next()
        .transpose()
        .map_err(CampaignError::read(path))?;
    let header = serde_json::from_str(&first.unwrap_or_default()).map_err(|_| {
        CampaignError::wrong(
            path,
            "the first line is not that of a plan; write one: plant-sim campaign plan",
        )
    })?;
    Ok((header, lines))
}
