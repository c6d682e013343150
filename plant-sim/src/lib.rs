//! The bench as a program: runs with their results on disk, controllers in other processes and on an emulated board, and
//! tools that look into traces.
//!
//! # What lives here
//!
//! ```text
//! run                    one run into a folder: output (files that appear when complete)
//! external, qemu         controllers in another process and on the emulated board, each beside a twin in this one (twin)
//! crash                  planted faults of the board, and where they end
//! check, replay, plot    a trace judged, repeated and drawn
//! play, record, monitor  a trace sent to a bus, a bus recorded, and a bus watched
//! report                 the pages about runs (sources in pages)
//! chart                  the SVG of plot and of external's histogram
//! eval, input            models by rows of a table; scenarios and robots from files
//! ```
//!
//! The command line (`cli`, in the binary) calls these, one file per subcommand. They lean on `sim` for the simulation,
//! `trace` for the text of traces, `link` for a real bus and `channel` for the board. Files, clocks, threads and processes
//! are here and nowhere below.
//!
//! # The way of one Feedback frame
//!
//! In process it never comes here: the rig of `sim` delivers it and its recorder, an observer, writes the line of
//! `trace.log`. With `--controller external` or `qemu` the rig hands it to [`external`] or [`qemu`], which send it through
//! a link or a FIFO, wait for the frames that answer, and compare them with those of the twin.

#![forbid(unsafe_code)]

mod chart;
pub mod check;
pub mod crash;
pub mod eval;
pub mod external;
pub mod input;
pub mod monitor;
pub mod output;
pub mod parameters;
pub mod play;
pub mod plot;
pub mod progress;
pub mod qemu;
pub mod record;
pub mod replay;
pub mod report;
pub mod run;
pub mod twin;
pub mod viewers;
