//! Results of shards put together, in the order of the cases: the same bytes whatever the sharding.

use std::cmp::Reverse;
use std::collections::{BTreeSet, BinaryHeap};
use std::fmt::Write as _;
use std::fs;
use std::fs::File;
use std::io::{self, BufRead as _, BufReader, Read, Write};
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};
use sim::campaign::tally::Tally;

use super::CampaignError;
use super::plan;
use super::shard::{self, Shard, ShardHeader};

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
    for path in files(folders)? {
        sources.push(Source::open(path)?);
    }
    let Some(first) = sources.first() else {
        return Err(nothing(folders));
    };
    let Source { header, path, .. } = first;
    let merged = Merged {
        plan: header.plan.clone(),
        cases: header.cases,
        build: header.build.clone(),
    };
    for other in &sources {
        let what = if other.header.plan != merged.plan {
            "these are results of another plan than"
        } else if other.header.build != merged.build {
            "these are results of another build of the program than"
        } else {
            continue;
        };
        let what = format!("{what} {}; merge those of one only", path.display());
        return Err(CampaignError::wrong(&other.path, what));
    }
    let failed = CampaignError::write(Path::new("standard output"));
    put_together(&merged, sources, sink, failed)
}

fn put_together(
    merged: &Merged,
    mut sources: Vec<Source>,
    sink: &mut impl Write,
    failed: impl FnOnce(io::Error) -> CampaignError,
) -> Result<(), CampaignError> {
    let mut written = writeln!(sink, "{}", plan::line(merged));
    // The next case of each source, the lowest first.
    let mut heap = BinaryHeap::new();
    for (index, source) in sources.iter_mut().enumerate() {
        heap.extend(source.advance()?.map(|case| Reverse((case, index))));
    }
    let mut expected = 0;
    while let Some(Reverse((case, index))) = heap.pop() {
        let source = &mut sources[index];
        if case != expected {
            let what = if case < expected {
                format!("case {case} is here and in another file, too; keep one of them")
            } else {
                format!("case {expected} is missing before case {case}; {RUN_IT}")
            };
            return Err(CampaignError::wrong(&source.path, what));
        }
        expected += 1;
        written = written.and_then(|()| sink.write_all(source.line.as_bytes()));
        heap.extend(source.advance()?.map(|case| Reverse((case, index))));
    }
    if let (true, Some(source)) = (expected < merged.cases, sources.first()) {
        let what = format!(
            "case {expected} of {} is in no file; {RUN_IT}",
            merged.cases
        );
        return Err(CampaignError::wrong(&source.path, what));
    }
    match written.and_then(|()| sink.flush()) {
        Err(error) if error.kind() != io::ErrorKind::BrokenPipe => Err(failed(error)),
        _ => Ok(()),
    }
}

const RUN_IT: &str = "plant-sim campaign missing lists the shards to run";

/// A file of results that is being read.
struct Source {
    path: PathBuf,
    header: ShardHeader,
    reader: BufReader<File>,
    line: String,
}

impl Source {
    fn open(path: PathBuf) -> Result<Self, CampaignError> {
        let mut reader = shard::reader(&path)?;
        let header = shard::header(&path, &mut reader)?;
        Ok(Self {
            path,
            header,
            reader,
            line: String::new(),
        })
    }

    /// Reads the next line; returns the number of its case.
    fn advance(&mut self) -> Result<Option<u64>, CampaignError> {
        #[derive(Deserialize)]
        struct Line {
            case: Number,
        }
        #[derive(Deserialize)]
        struct Number {
            case: u64,
        }
        self.line.clear();
        let read = self.reader.read_line(&mut self.line);
        if read.map_err(CampaignError::read(&self.path))? == 0 {
            return Ok(None);
        }
        let line: Result<Line, _> = serde_json::from_str(&self.line);
        let line = line.map_err(|error| {
            CampaignError::wrong(&self.path, format!("{error}: this is no result of a case"))
        })?;
        Ok(Some(line.case.case))
    }
}

/// Complete files of results in these folders.
fn files(folders: &[PathBuf]) -> Result<BTreeSet<PathBuf>, CampaignError> {
    let mut files = BTreeSet::new();
    for folder in folders {
        for entry in fs::read_dir(folder).map_err(CampaignError::read(folder))? {
            let path = entry.map_err(CampaignError::read(folder))?.path();
            let name = path.file_name().unwrap_or_default().to_string_lossy();
            if name.starts_with("results-") && name.ends_with(".jsonl") {
                files.insert(path);
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

/// Shards without complete results, as a job array takes them: `1,3-5`; empty where nothing is missing.
///
/// # Errors
/// No shard is complete, so that their number is unknown, or shards of different numbers are mixed.
pub fn missing(folders: &[PathBuf]) -> Result<String, CampaignError> {
    let mut of = None;
    let mut complete = BTreeSet::new();
    for path in files(folders)? {
        let header = Source::open(path.clone())?.header;
        let Shard { part, of: number } = header.shard;
        if *of.get_or_insert(number) != number {
            let what = format!(
                "this is a shard of {number}, others are of another number; name folders of one division only"
            );
            return Err(CampaignError::wrong(&path, what));
        }
        complete.insert(part);
    }
    let of = of.ok_or_else(|| nothing(folders))?;
    Ok(ranges((0..of).filter(|part| !complete.contains(part))))
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
    for line in lines {
        tally.add(&shard::outcome(
            path,
            &line.map_err(CampaignError::read(path))?,
        )?);
    }
    if tally.cases() != merged.cases {
        let what = format!(
            "{} of {} cases are here; merge them again",
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
