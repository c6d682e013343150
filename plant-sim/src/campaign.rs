//! Campaigns on disk: plans, results of shards, and what becomes of them.
//!
//! ```text
//! cases     what to cross, as TOML                       plan      the cases, one a line, with their hash
//! shard     which part of a plan, and writing its file   results   reading and judging such a file
//! work      a shard, on every core                       merge     shards put together, in the order of cases
//! shrink    the smallest fault that still fails          picture   the worst cases, as SVG
//! ```
//!
//! Everything streams: memory holds one batch of cases, however many there are. What a case comes to depends on the case alone,
//! so results are the same bytes whatever the sharding and however often a shard was killed.

pub mod cases;
pub mod merge;
pub mod picture;
pub mod plan;
pub mod results;
pub mod shard;
pub mod shrink;
pub mod work;

use std::io;
use std::path::{Path, PathBuf};

use self::shard::Shard;
use crate::output::OutputError;

/// Why a command of a campaign cannot do its work.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// The file cannot be read.
    #[error("{}: cannot be read: {source}", path.display())]
    Read {
        /// File.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
    /// The file is not what it should be.
    #[error("{}: {what}", path.display())]
    Wrong {
        /// File.
        path: PathBuf,
        /// What is wrong, what is allowed, and what to do.
        what: String,
    },
    /// A file of results is not complete, or not as it was written.
    #[error(
        "{}: {what}; this runs again what is damaged: plant-sim campaign run PLAN --shard {shard} --resume --out {}",
        path.display(), path.parent().unwrap_or(Path::new(".")).display()
    )]
    Damaged {
        /// File.
        path: PathBuf,
        /// Whose results it should have.
        shard: Shard,
        /// What is wrong, and where.
        what: String,
    },
    /// Results cannot be written.
    #[error(transparent)]
    Output(#[from] OutputError),
    /// A case cannot be run.
    #[error("case {case}: {what}")]
    Case {
        /// Its number.
        case: u64,
        /// Reason.
        what: String,
    },
}

impl CampaignError {
    fn read(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Read { path, source }
    }

    fn wrong(path: &Path, what: impl Into<String>) -> Self {
        Self::Wrong {
            path: path.into(),
            what: what.into(),
        }
    }

    fn damaged(path: &Path, shard: Shard, what: String) -> Self {
        Self::Damaged {
            path: path.into(),
            shard,
            what,
        }
    }

    fn write(path: &Path) -> impl FnOnce(io::Error) -> Self {
        let path = path.to_path_buf();
        move |source| Self::Output(OutputError::Write { path, source })
    }
}

/// What was read; `None` of what is damaged.
fn undamaged<T>(read: Result<T, CampaignError>) -> Result<Option<T>, CampaignError> {
    match read {
        Err(CampaignError::Damaged { .. }) => Ok(None),
        other => other.map(Some),
    }
}
