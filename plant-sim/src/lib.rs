//! The bench as a program: runs with their results on disk, controllers in other processes and on an emulated board,
//! and tools for traces.
//!
//! # Contents
//!
//! ```text
//! run                    one run into a folder: output (files that appear when complete)
//! external, qemu         controllers in another process and on the emulated board, each beside a twin in this one (twin)
//! campaign               many runs with faults: plans, shards, results
//! bench                  gates in closed loop beside the optimum: times, errors, torques
//! crash                  planted faults of the board, and how they end
//! check, replay, plot    a trace judged, repeated and drawn
//! mcap                   a trace or a run as MCAP, for Foxglove and Lichtblick
//! play, record, monitor  a trace sent to a bus, a bus recorded, and a bus watched
//! report                 the pages about runs (sources in pages)
//! view                   the live page: a run or a bus in the browser
//! verdicts               what became of requirements: in words, JUnit XML, needs.json and Markdown
//! chart                  the SVG of plot and of external's histogram
//! eval, input            models evaluated over the rows of a table; scenarios and robots from files
//! reference              schemas of files and JSON output, and tables of them for the documents
//! interrupt              signals
//! ```
//!
//! The command line (`cli`, in the binary) calls these, one file per subcommand. They use `sim` for the simulation,
//! `trace` for the text of traces, `link` for a real bus, `channel` for the board and `terminal` for words to the terminal. Files, clocks, threads and
//! processes are only here, in none of those.
//!
//! # The path of one Feedback frame
//!
//! With the controller in this process the frame never gets here: the rig of `sim` delivers it, and an observer writes
//! its line of `trace.log`. With `--controller external` or `qemu` the rig passes it to [`external`] or [`qemu`], which
//! send it through a link or a FIFO, wait for the answers, and compare them with those of the twin.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    reason = "an index or an expectation names an invariant of this crate; one that breaks is its own fault"
)]
#![forbid(unsafe_code)]
// They panic where standard output or error is full or gone; `say!` and the sinks of results do not.
#![deny(clippy::print_stderr, clippy::print_stdout)]

pub mod bench;
pub mod campaign;
mod chart;
pub mod check;
pub mod crash;
pub mod eval;
pub mod external;
pub mod input;
pub mod interrupt;
pub mod mcap;
pub mod monitor;
pub mod output;
mod parallel;
pub mod parameters;
pub mod play;
pub mod plot;
pub mod progress;
pub mod qemu;
pub mod record;
pub mod reference;
pub mod replay;
pub mod report;
pub mod run;
pub mod twin;
pub mod verdicts;
pub mod view;
pub mod viewers;

pub use terminal::say;
