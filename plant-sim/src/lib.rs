//! The bench as a program: runs with their results on disk, controllers in other processes and on an emulated board, and
//! tools that look into traces.

#![forbid(unsafe_code)]

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
pub mod replay;
pub mod run;
pub mod twin;
pub mod viewers;
