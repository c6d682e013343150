//! The node on a simulated bus: what it answers, refuses and ignores.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod bench;
mod beyond;
mod faults;
mod following;
mod gains;
mod manual;
mod pair;
mod parameters;
mod peers;
mod reports;
mod requests;
mod shell;
mod stops;
mod strain;
mod switching;
mod wire;

#[path = "../common/draws.rs"]
mod draws;
#[path = "../common/table.rs"]
mod table;
