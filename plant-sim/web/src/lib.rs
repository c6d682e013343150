//! The simulation as WebAssembly: a request as text in, the results of a run as text out.
//!
//! A module that imports nothing and exports its memory and four functions. The host writes a [`Request`] as UTF-8 JSON
//! into the memory and reads the results there:
//!
//! ```js
//! const { memory, input, run, output, output_len } = instance.exports;
//! const request = new TextEncoder().encode(JSON.stringify({ scenario, law: "pid", rate_hz: 500 }));
//! const place = input(request.length);
//! // Anew after each call: memory that grows gets another buffer.
//! new Uint8Array(memory.buffer, place, request.length).set(request);
//! const status = run();
//! const text = (which) => new TextDecoder().decode(new Uint8Array(memory.buffer, output(which), output_len(which)));
//! const trace = text(0), truth = text(1), summary = text(2), error = text(3), drawing = text(4);
//! ```
//!
//! The trace equals the `trace.log`, the truth the `truth.csv` of `plant-sim run`, to the byte. The memory of a run is
//! freed by the next one.

use std::cell::RefCell;

use serde::{Deserialize, Serialize};
use sim::curves::Curves;
use sim::record::{TraceLog, TruthLog};
use sim::run::in_process;
use sim::scenario::{MAX_CYCLES, Scenario, check_rate};
use sim::selection::LawChoice;
use sim::setup::RunConfig;
use sim::summary::Summary;

/// A requested run.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Request {
    /// Text of a scenario file.
    scenario: String,
    /// Overrides the scenario: control law, such as `computed-torque:observer`.
    law: Option<LawChoice>,
    /// Overrides the scenario: control rate, Hz.
    rate_hz: Option<f64>,
    /// Overrides the scenario: number of cycles.
    cycles: Option<u32>,
}

/// Results of a run.
struct Results {
    trace: Vec<u8>,
    truth: Vec<u8>,
    summary: Vec<u8>,
    drawing: Vec<u8>,
}

/// The summary, with what `summary.json` says of the trace.
#[derive(Serialize)]
struct Summarised {
    #[serde(flatten)]
    summary: Summary,
    trace_sha256: String,
}

/// Executes a request. A scenario that could not be completed also has results; its summary says why.
fn answer(request: &[u8]) -> Result<Results, String> {
    let request: Request =
        serde_json::from_slice(request).map_err(|error| format!("request: {error}"))?;
    let mut scenario =
        Scenario::parse(&request.scenario, "of the request").map_err(|error| error.to_string())?;
    if let Some(law) = request.law {
        scenario.law = law;
    }
    if let Some(rate_hz) = request.rate_hz {
        check_rate(rate_hz)
            .map_err(|allowed| format!("rate_hz is {rate_hz}; allowed: {allowed}"))?;
        scenario.rate_hz = rate_hz;
    }
    if let Some(cycles) = request.cycles {
        if !(1..=MAX_CYCLES).contains(&cycles) {
            return Err(format!("cycles is {cycles}; allowed: 1 to {MAX_CYCLES}"));
        }
        scenario.cycles = cycles;
    }

    let unwritten = |error: std::io::Error| error.to_string();
    let truth = TruthLog::new(Vec::new()).map_err(unwritten)?;
    let config = RunConfig::new(scenario);
    let trace = TraceLog::new(Vec::new());
    let mut observers = (trace, (truth, Curves::new(&config)));
    let summary = in_process(&config, &mut observers).map_err(|failure| failure.to_string())?;
    let (trace, (truth, curves)) = observers;
    let (trace, hash) = trace.finish().map_err(unwritten)?;
    let summary = Summarised {
        summary,
        trace_sha256: hash.to_string(),
    };
    let json = |error: serde_json::Error| error.to_string();
    Ok(Results {
        trace,
        truth: truth.finish().map_err(unwritten)?,
        summary: serde_json::to_vec(&summary).map_err(json)?,
        drawing: serde_json::to_vec(&curves.finish(&config)).map_err(json)?,
    })
}

thread_local! {
    static INPUT: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
    /// Trace, truth, summary, error, drawing.
    static OUTPUT: RefCell<[Vec<u8>; 5]> = const { RefCell::new([const { Vec::new() }; 5]) };
}

/// Makes room for a request of `len` bytes and returns the address to write it to.
// SAFETY: the exported names are unique in the module; nothing else is unsafe about this function, nor about those below.
#[unsafe(no_mangle)]
pub extern "C" fn input(len: usize) -> *mut u8 {
    INPUT.with_borrow_mut(|input| {
        *input = vec![0; len];
        input.as_mut_ptr()
    })
}

/// Runs the request in the input: 0 with results, 1 with an error instead.
#[unsafe(no_mangle)]
pub extern "C" fn run() -> u32 {
    // First, so that the memory of the last run can be reused for this one.
    OUTPUT.set(Default::default());
    let request = INPUT.take();
    match answer(&request) {
        Ok(Results {
            trace,
            truth,
            summary,
            drawing,
        }) => {
            OUTPUT.set([trace, truth, summary, Vec::new(), drawing]);
            0
        }
        Err(error) => {
            OUTPUT.set([
                Vec::new(),
                Vec::new(),
                Vec::new(),
                error.into_bytes(),
                Vec::new(),
            ]);
            1
        }
    }
}

/// Where a result is: 0 trace, 1 truth, 2 summary (JSON), 3 error. Valid until the next run.
#[unsafe(no_mangle)]
pub extern "C" fn output(which: usize) -> *const u8 {
    OUTPUT.with_borrow(|output| output.get(which).map_or(std::ptr::null(), Vec::as_ptr))
}

/// Length of this result in bytes; 0 where there is none.
#[unsafe(no_mangle)]
pub extern "C" fn output_len(which: usize) -> usize {
    OUTPUT.with_borrow(|output| output.get(which).map_or(0, Vec::len))
}

#[cfg(test)]
mod tests {
    use super::{answer, input, output_len, run};

    fn refused(request: &str) -> String {
        answer(request.as_bytes()).err().expect("refused")
    }

    #[test]
    fn what_is_asked_for_instead_of_the_scenarios_own_is_run() {
        let gate = include_str!("../../scenarios/gate.toml");
        let request = serde_json::json!({ "scenario": gate, "law": "pd-gravity", "rate_hz": 500, "cycles": 1 });
        let results = answer(request.to_string().as_bytes()).unwrap();
        let summary: serde_json::Value = serde_json::from_slice(&results.summary).unwrap();
        assert_eq!(summary["law"], "pd-gravity");
        assert_eq!(summary["rate_hz"], 500.0);
        assert_eq!(summary["cycles"], 1);
        let second_row = results.truth.split(|byte| *byte == b'\n').nth(2).unwrap();
        assert!(second_row.starts_with(b"0.002,"));
    }

    #[test]
    fn errors_say_what_is_wrong_and_what_is_allowed() {
        let gate = include_str!("../../scenarios/gate.toml");
        let with = |key: &str, value: serde_json::Value| {
            let mut request = serde_json::json!({ "scenario": gate });
            request[key] = value;
            refused(&request.to_string())
        };
        for (message, expected) in [
            (refused("{}"), "missing field `scenario`"),
            (refused("{\"scenario\": \"\"}"), "missing field `name`"),
            (
                with("law", "magic".into()),
                "no control law 'magic'; allowed: kinematic-joint",
            ),
            (
                with("rate_hz", 1.into()),
                "rate_hz is 1; allowed: 100 to 10000 Hz",
            ),
            (
                with("cycles", 0.into()),
                "cycles is 0; allowed: 1 to 1000000",
            ),
            (with("speed", 1.into()), "unknown field `speed`"),
        ] {
            assert!(message.contains(expected), "{message}");
        }
    }

    #[test]
    fn an_error_leaves_no_results() {
        input(2);
        assert_eq!(run(), 1);
        assert_eq!([0, 1, 2, 4, 5].map(|which| output_len(which)), [0; 5]);
        assert!(output_len(3) > 0);
    }
}
