//! Results of shards put together, in the order of the cases: the same bytes whatever the sharding.

use std::cmp::Reverse;
use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::fmt::Write as _;
use std::fs;
use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sim::campaign::tally::{Outcome, Tally};

use super::CampaignError;
use super::plan::{self, Hash};
use super::results::{self, Reader};
use super::shard::{Shard, ShardHeader};
use crate::say;

/// The first line of merged results.
#[derive(Debug, Deserialize, Serialize)]
struct Merged {
    plan: String,
    cases: u64,
    build: String,
}

/// Merges the results in these folders into `sink`.
///
/// # Errors
/// Results are missing or there twice, or are not of one plan and one build of the program.
pub fn merge(folders: &[PathBuf], sink: &mut impl Write) -> Result<(), CampaignError> {
    let mut sources = Vec::new();
    for (path, shard) in files(folders)? {
        sources.push(Reader::open(&path, shard)?);
    }
    let Some(first) = sources.first() else {
        return Err(nothing(folders));
    };
    let (header, path) = (first.header().clone(), first.path());
    for other in &sources {
        belong_together((&header, path), (other.header(), other.path()))?;
    }
    let failed = CampaignError::write(Path::new("standard output"));
    put_together(header, sources, sink, failed)
}

/// Whether two files have results of one plan and one build of the program.
fn belong_together(
    (header, path): (&ShardHeader, &Path),
    (found, other): (&ShardHeader, &Path),
) -> Result<(), CampaignError> {
    let what = if !found.is_of_plan_of(header) {
        "these are results of another plan than"
    } else if found.build != header.build {
        "these are results of another build of the program than"
    } else {
        return Ok(());
    };
    let what = format!("{what} {}; take those of one only", path.display());
    Err(CampaignError::wrong(other, what))
}

fn put_together(
    header: ShardHeader,
    mut sources: Vec<Reader>,
    sink: &mut impl Write,
    failed: impl FnOnce(io::Error) -> CampaignError,
) -> Result<(), CampaignError> {
    let mut hash = Hash::new(&header.situations);
    let merged = Merged {
        plan: header.plan,
        cases: header.cases,
        build: header.build,
    };
    let mut written = writeln!(sink, "{}", plan::line(&merged));
    // The next case of each source, the lowest first, and its line in the plan.
    let next = |index, source: &mut Reader| {
        let of = |one: Outcome| Reverse((one.case.case, index, plan::line(&one.case)));
        source.advance().map(|outcome| outcome.map(of))
    };
    let mut heap = BinaryHeap::new();
    for (index, source) in sources.iter_mut().enumerate() {
        heap.extend(next(index, source)?);
    }
    let mut expected = 0;
    while let Some(Reverse((case, index, planned))) = heap.pop() {
        let source = &mut sources[index];
        if case != expected {
            let what = if case < expected {
                format!("case {case} is here and in another file, too; keep one of them")
            } else {
                format!("case {expected} is missing before case {case}; {RUN_IT}")
            };
            return Err(CampaignError::wrong(source.path(), what));
        }
        expected += 1;
        hash.add(&planned);
        written = written.and_then(|()| sink.write_all(source.line()));
        heap.extend(next(index, source)?);
    }
    let what = if expected < merged.cases {
        format!(
            "case {expected} of {} is in no file; {RUN_IT}",
            merged.cases
        )
    } else if hash.finish() != merged.plan {
        NOT_AS_PLANNED.into()
    } else {
        String::new()
    };
    if let (false, Some(source)) = (what.is_empty(), sources.first()) {
        return Err(CampaignError::wrong(source.path(), what));
    }
    match written.and_then(|()| sink.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(failed(error)),
        _ => Ok(()),
    }
}

const AGAIN: &str = "merge them again";
const RUN_IT: &str = "plant-sim campaign missing lists the shards to run";
const NOT_AS_PLANNED: &str = "a case here, or in a file merged with it, is not as the plan has it; plant-sim campaign run PLAN \
                              --shard K/N --resume finds it and runs it again, if it is given each part";

/// Files of results in these folders, and whose results they should have.
fn files(folders: &[PathBuf]) -> Result<BTreeMap<PathBuf, Shard>, CampaignError> {
    let mut files = BTreeMap::new();
    for folder in folders {
        for entry in fs::read_dir(folder).map_err(CampaignError::read(folder))? {
            let path = entry.map_err(CampaignError::read(folder))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with("results-") && name.ends_with(".jsonl") {
                let shard = Shard::of_file(&name).ok_or_else(|| {
                    CampaignError::wrong(
                        &path,
                        "results are called results-K-of-N.jsonl, with K from 0 to N-1",
                    )
                })?;
                files.insert(path, shard);
            }
        }
    }
    Ok(files)
}

fn nothing(folders: &[PathBuf]) -> CampaignError {
    let folder = folders.first().map_or(Path::new("."), PathBuf::as_path);
    CampaignError::wrong(
        folder,
        "no shard is complete here; run one: plant-sim campaign run",
    )
}

/// Shards without complete and valid results, as a job array takes them: `1,3-5`; empty where nothing is missing.
///
/// # Errors
/// There are no results, so that the number of shards is unknown, or those of different numbers, plans or builds are mixed.
pub fn missing(folders: &[PathBuf]) -> Result<String, CampaignError> {
    let mut of = None;
    let mut first: Option<(ShardHeader, PathBuf)> = None;
    let mut complete = BTreeSet::new();
    for (path, shard) in files(folders)? {
        let Shard { part, of: number } = shard;
        if *of.get_or_insert(number) != number {
            let what = format!(
                "this is a shard of {number}, others are of another number; name folders of one division only"
            );
            return Err(CampaignError::wrong(&path, what));
        }
        match read(&path, shard) {
            Err(damaged @ CampaignError::Damaged { .. }) => say!("{damaged}"),
            other => {
                let header = other?;
                complete.insert(part);
                match &first {
                    Some((one, at)) => belong_together((one, at), (&header, &path))?,
                    None => first = Some((header, path)),
                }
            }
        }
    }
    let of = of.ok_or_else(|| nothing(folders))?;
    Ok(ranges((0..of).filter(|part| !complete.contains(part))))
}

/// Reads results to their end, and returns their header.
fn read(path: &Path, shard: Shard) -> Result<ShardHeader, CampaignError> {
    let mut reader = Reader::open(path, shard)?;
    while reader.advance()?.is_some() {}
    Ok(reader.header().clone())
}

/// Rising numbers as `1,3-5`.
fn ranges(numbers: impl Iterator<Item = u64>) -> String {
    let mut runs: Vec<(u64, u64)> = Vec::new();
    for number in numbers {
        match runs.last_mut() {
            Some((_, last)) if *last + 1 == number => *last = number,
            _ => runs.push((number, number)),
        }
    }
    let mut text = String::new();
    for (first, last) in runs {
        let comma = if text.is_empty() { "" } else { "," };
        let _ = match last - first {
            0 => write!(text, "{comma}{first}"),
            _ => write!(text, "{comma}{first}-{last}"),
        };
    }
    text
}

/// The tally of merged results.
///
/// # Errors
/// They cannot be read, or are not merged results, all of them.
pub fn tally(path: &Path, results: impl Read) -> Result<Tally, CampaignError> {
    let mut lines = BufReader::new(results).lines();
    let first = lines
        .next()
        .transpose()
        .map_err(CampaignError::read(path))?;
    let merged: Merged = serde_json::from_str(&first.unwrap_or_default()).map_err(|_| {
        CampaignError::wrong(
            path,
            "the first line is not that of merged results; make them: plant-sim campaign merge",
        )
    })?;
    let mut tally = Tally::default();
    for (number, line) in (2..).zip(lines) {
        let line = line.map_err(CampaignError::read(path))?;
        let outcome = results::outcome(line.as_bytes())
            .map_err(|what| CampaignError::wrong(path, format!("line {number} {what}; {AGAIN}")))?;
        tally.add(&outcome);
    }
    if tally.cases() != merged.cases {
        let what = format!(
            "{} of {} cases are here; {AGAIN}",
            tally.cases(),
            merged.cases
        );
        return Err(CampaignError::wrong(path, what));
    }
    Ok(tally)
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn numbers_are_written_as_a_job_array_takes_them() {
        assert_eq!(ranges([].into_iter()), "");
        assert_eq!(ranges([0].into_iter()), "0");
        assert_eq!(ranges([1, 3, 4, 5].into_iter()), "1,3-5");
        assert_eq!(ranges([0, 1, 7, 9, 10].into_iter()), "0-1,7,9-10");
    }
}
