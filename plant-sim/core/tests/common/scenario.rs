//! A scenario to spoil, and what is said of one that is spoilt.

use sim::scenario::Scenario;
use sim::setup::RunConfig;

pub(crate) const BASE: &str = "name = \"t\"
cycles = 2
rate_hz = 1000
law = \"computed-torque:observer\"
start = [0.5, 0.1, -0.2, 0.0]

[payload]
mass = 2.0
com_flange_frame = [0.0, 0.0, 0.05]
inertia_com_diag = [0.008, 0.008, 0.01]

[[cycle]]
jump = { to = [0.6, 0.1, -0.2, 0.0], top = -0.15, clearance = 0.005 }
[[cycle]]
dwell = 0.1
";

/// The refusal of a scenario, by its text or before a run.
pub(crate) fn said_of(text: &str) -> String {
    match Scenario::parse(text, "x.toml") {
        Err(error) => error.to_string(),
        Ok(scenario) => RunConfig::new(scenario).rig().expect_err(text).to_string(),
    }
}
