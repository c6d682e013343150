//! Pages about runs: one self-contained file that loads nothing from anywhere.
//!
//! The sources are in `plant-sim/pages`: plain modules that are concatenated in order and share one scope, a style
//! sheet, and the library that draws curves. A page carries its runs as JSON; a page about two runs is made from the
//! pages of each.

use std::io::{self, Write as _};
use std::path::{Path, PathBuf};

use base64::Engine as _;
use base64::prelude::BASE64_STANDARD;
use flate2::Compression;
use flate2::write::GzEncoder;
use serde::de::IgnoredAny;
use sha2::{Digest as _, Sha256};
use sim::curves::Drawing;

use crate::run::Results;

/// Name of a run's page in the folder of its results.
pub const FILE: &str = "report.html";

/// Parts of every page, in this order.
const SHARED: [&str; 9] = [
    include_str!("../pages/vendor/uplot/uPlot.iife.min.js"),
    include_str!("../pages/page.js"),
    include_str!("../pages/run.js"),
    include_str!("../pages/arm.js"),
    include_str!("../pages/charts.js"),
    include_str!("../pages/plots.js"),
    include_str!("../pages/player.js"),
    include_str!("../pages/board.js"),
    include_str!("../pages/facts.js"),
];

const STYLE: &str = concat!(
    include_str!("../pages/vendor/uplot/uPlot.min.css"),
    include_str!("../pages/style.css"),
);

/// Place of the runs in a page about runs.
const RUNS: [&str; 2] = [
    r#"<script type="application/json" id="runs">["#,
    "]</script>",
];

/// The page about a run with `results`.
pub fn page(results: &Results, drawing: &Drawing) -> String {
    let name = &results.summary.recipe.scenario;
    let mut results = serde_json::to_value(results).expect("numbers and texts are JSON");
    // As long as the run itself, and the page draws it anyway.
    if let Some(members) = results.as_object_mut() {
        members.remove("each_cycle");
    }
    let drawing = drawing.json();
    of_runs(
        name,
        &[format!(r#"{{"results":{results},"drawing":{drawing}}}"#)],
    )
}

/// Why two runs cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum CompareError {
    /// There is no page to read.
    #[error(
        "{}: cannot be read: {source}; it has to be there in both folders: plant-sim run --out FOLDER, without --no-report",
        path.display()
    )]
    Read {
        /// Which.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
    /// It is not what this program writes.
    #[error("{}: not a report of one run as this version of plant-sim writes it; run it again", path.display())]
    Foreign {
        /// Which.
        path: PathBuf,
    },
}

/// The page about the runs in two folders, made from the page that each of them has.
///
/// # Errors
/// See [`CompareError`].
pub fn compare(folders: [&Path; 2]) -> Result<String, CompareError> {
    let [one, other] = folders.map(run_of);
    Ok(of_runs("Two runs", &[one?, other?]))
}

/// The JSON of the run in the page of a folder.
fn run_of(folder: &Path) -> Result<String, CompareError> {
    let path = folder.join(FILE);
    let page = match std::fs::read_to_string(&path) {
        Ok(page) => page,
        Err(source) => return Err(CompareError::Read { path, source }),
    };
    let [begin, end] = RUNS;
    page.split_once(begin)
        .and_then(|(_, rest)| rest.split_once(end))
        .map(|(run, _)| run)
        .filter(|run| serde_json::from_str::<IgnoredAny>(run).is_ok())
        .map(str::to_owned)
        .ok_or(CompareError::Foreign { path })
}

fn of_runs(title: &str, runs: &[String]) -> String {
    let [begin, end] = RUNS;
    // Within a script, `<` is the one letter that could end it.
    let runs = runs.join(",").replace('<', "\\u003c");
    let script = [&SHARED[..], &[include_str!("../pages/report.js")]].concat();
    html(
        title,
        &format!("{begin}{runs}{end}"),
        &script.join("\n"),
        [""; 2],
    )
}

/// The page that runs the simulation: `module` is the crate `web` as WebAssembly.
///
/// # Panics
/// Never: memory takes all that is written.
pub fn what_if(module: &[u8]) -> String {
    let mut packed = GzEncoder::new(Vec::new(), Compression::best());
    packed.write_all(module).expect("memory takes it");
    let packed = packed.finish().expect("memory takes it");
    let module = BASE64_STANDARD.encode(packed);
    let data = format!(r#"<script type="text/plain" id="module">{module}</script>"#);
    let own = [
        include_str!("../pages/simulation.js"),
        include_str!("../pages/what-if.js"),
    ];
    let script = [&SHARED[..], &own].concat().join("\n");
    // The module is compiled in the page, and runs in a thread that is made from a text of the page.
    let rights = [" 'wasm-unsafe-eval'", "; worker-src blob:"];
    html("What if", &data, &script, rights)
}

/// The page that shows what its server streams, and asks for what the server offers.
pub fn live() -> String {
    let own = [
        include_str!("../pages/stream.js"),
        include_str!("../pages/panel.js"),
        include_str!("../pages/live.js"),
    ];
    let script = [&SHARED[..], &own].concat().join("\n");
    html("Live", "", &script, ["", "; connect-src 'self'"])
}

/// A page that may do nothing but run its own script in its own style, and what the `rights` allow: more scripts, and the
/// rest.
fn html(title: &str, data: &str, script: &str, rights: [&str; 2]) -> String {
    let hash = |text: &str| format!("'sha256-{}'", BASE64_STANDARD.encode(Sha256::digest(text)));
    let [scripts, rest] = rights;
    let policy = format!(
        "default-src 'none'; script-src {}{scripts}; style-src {}{rest}; base-uri 'none'; form-action 'none'",
        hash(script),
        hash(STYLE)
    );
    let title = title.replace('&', "&amp;").replace('<', "&lt;");
    format!(
        include_str!("../pages/page.html"),
        title = title,
        policy = policy,
        style = STYLE,
        data = data,
        script = script
    )
}

#[cfg(test)]
mod tests {
    use super::{CompareError, FILE, compare, of_runs};

    #[test]
    fn a_run_stays_in_its_place_and_is_read_back() {
        let folders = [(); 2].map(|()| tempfile::tempdir().unwrap());
        let run = r#"{"scenario":"</script><img src=x><!-- <script>"}"#;
        let page = of_runs("a < b & c", &[run.into()]);
        // One for the data, one for the script.
        assert_eq!(page.matches("</script>").count(), 2);
        assert!(!page.contains("<img"));
        assert!(page.contains("<title>a &lt; b &amp; c</title>"));
        for folder in &folders {
            std::fs::write(folder.path().join(FILE), &page).unwrap();
        }
        let [one, other] = folders.each_ref().map(tempfile::TempDir::path);
        let both = compare([one, other]).unwrap();
        let (_, rest) = both.split_once(r#"id="runs">"#).unwrap();
        let (data, _) = rest.split_once("</script>").unwrap();
        let data: serde_json::Value = serde_json::from_str(data).unwrap();
        let run: serde_json::Value = serde_json::from_str(run).unwrap();
        assert_eq!(data, serde_json::json!([run, run]));

        // A page about two runs is not one about one run.
        std::fs::write(other.join(FILE), both).unwrap();
        let error = compare([one, other]).unwrap_err();
        assert!(matches!(error, CompareError::Foreign { .. }), "{error}");
    }
}
