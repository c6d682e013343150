//! The summary of a run as text.

use std::fmt::Write as _;
use std::path::Path;

use plant_sim::report::FILE;
use plant_sim::run::Results;
use plant_sim::verdicts::{ending, finding, limit};
use sim::metrics::CycleResult;
use sim::model::AXES;
use sim::scenario::Ending;
use sim::setup::RunConfig;
use sim::summary::{Injected, Summary};

/// kg that the lift has to feel beyond what was announced to be told: several times what friction leaves in a stroke.
const TOLD_BURDEN: f64 = 0.5;

/// A line of text; writing to a string cannot fail.
macro_rules! line {
    ($text:ident, $($arg:tt)*) => {{
        let _ = writeln!($text, $($arg)*);
    }};
}

/// The summary as text; the files are in `out`.
pub(super) fn report(results: &Results, config: &RunConfig, out: &Path) -> String {
    let summary = &results.summary;
    let mut text = String::new();
    line!(
        text,
        "{} on {}, {} kg, {} at {} Hz, {}",
        summary.recipe.scenario,
        config.actual.name,
        summary.recipe.payload_kg,
        summary.recipe.law,
        summary.recipe.rate_hz,
        cycles(summary)
    );
    difference(config, &mut text);
    motion(summary, &mut text);
    corners(summary, &mut text);
    load(summary, &mut text);
    let errors = match summary.bus_errors {
        0 => String::new(),
        1 => ", 1 error".into(),
        errors => format!(", {errors} errors"),
    };
    line!(
        text,
        "  bus               {:.1} % load, {} frames, {} lost, {} overruns{errors}",
        summary.bus_load * 100.0,
        summary.frames,
        summary.frames_lost,
        summary.overruns
    );
    end(summary, &mut text);
    line!(
        text,
        "  simulated         {:.2} s in {:.3} s: {:.0} times real time",
        summary.sim_time_s,
        results.wall_time_s,
        results.real_time_factor
    );
    let page = if out.join(FILE).exists() {
        "report.html to look at, "
    } else {
        ""
    };
    let files = match &results.trace_sha256 {
        Some(_) => "trace.log, truth.csv, summary.json",
        None => "summary.json",
    };
    line!(text, "  {page}{files} in {}", out.display());
    text
}

fn cycles(summary: &Summary) -> String {
    match (summary.cycles, summary.cycles_asked) {
        (1, 1) => "1 cycle".into(),
        (done, asked) if done == asked => format!("{done} cycles"),
        (done, asked) => format!("{done} of {asked} cycles"),
    }
}

/// Mismatch between the controller's model and the robot.
fn difference(config: &RunConfig, text: &mut String) {
    let mismatch = &config.scenario.mismatch;
    let mut wrong = Vec::new();
    if config.nominal.name != config.actual.name {
        wrong.push(format!(
            "the controller is configured for {}",
            config.nominal.name
        ));
    } else if config.nominal != config.actual {
        wrong.push("the controller's model has other numbers".into());
    }
    if mismatch.friction != 1.0 {
        wrong.push(format!(
            "actual friction is {} times nominal",
            mismatch.friction
        ));
    }
    if mismatch.payload != 1.0 {
        wrong.push(format!(
            "actual payload is {} times nominal",
            mismatch.payload
        ));
    }
    if !wrong.is_empty() {
        line!(text, "  mismatch          {}", wrong.join("; "));
    }
}

fn motion(summary: &Summary, text: &mut String) {
    let still = summary.cycles_still;
    if still > 0 {
        line!(
            text,
            "  nothing moved     in {still} of {}, which have no times",
            cycles(summary)
        );
    }
    match &summary.cycle_time_s {
        Some(time) => line!(
            text,
            "  cycle time        {:.4} s mean ({:.4} to {:.4}), back within 1 mm and 10 mrad",
            time.mean,
            time.min,
            time.max
        ),
        None => line!(text, "  cycle time        none: {}", no_time(summary)),
    }
    match &summary.settle_time_s {
        Some(time) => line!(
            text,
            "  settling          {:.1} ms mean, {:.1} ms max, to 0.01 mm and 0.1 mrad after the commanded end",
            time.mean * 1e3,
            time.max * 1e3
        ),
        None if summary.cycle_time_s.is_some() => {
            line!(text, "  settling          not within 0.01 mm and 0.1 mrad");
        }
        None => {}
    }
    line!(
        text,
        "  tracking error    {:.4} mm rms, {:.4} mm max; yaw {:.4} mrad rms, {:.4} mrad max",
        summary.tracking_error_mm.rms,
        summary.tracking_error_mm.max,
        summary.tracking_error_mrad.rms,
        summary.tracking_error_mrad.max
    );
    if let (Some(distance), Some(yaw)) = (summary.final_error_mm.max, summary.final_error_mrad.max)
    {
        line!(
            text,
            "  final error       {distance:.4} mm max; yaw {yaw:.4} mrad max"
        );
    }
}

/// Corners that the arm may cut.
fn corners(summary: &Summary, text: &mut String) {
    for (index, corner) in summary.corners.iter().enumerate() {
        if let (Some(passed), Some(margin)) = (corner.passed_mm, corner.margin_mm) {
            let name = if index == 0 { "corners passed" } else { "" };
            line!(
                text,
                "  {name:<18}{} at {passed:.3} mm, zone {} mm, margin {margin:.3} mm",
                corner.step,
                (corner.zone_mm * 1e3).round() / 1e3
            );
        }
    }
}

/// Why there is no cycle time.
fn no_time(summary: &Summary) -> &'static str {
    if summary.each_cycle.is_empty() {
        "no cycle was completed"
    } else if summary.each_cycle.iter().all(|cycle| !cycle.moved) {
        "nothing moved"
    } else if summary.final_error_mm.max.is_none() {
        "the cycle ends in a stop on its path"
    } else {
        "not every cycle came back within 1 mm and 10 mrad"
    }
}

/// Load of the axes.
fn load(summary: &Summary, text: &mut String) {
    let row = |name: &str, values: [String; 4]| {
        let [shoulder, elbow, lift, wrist] = values;
        format!("  {name:<18}{shoulder:>8} {elbow:>8} {lift:>8} {wrist:>8}\n")
    };
    let percent = |shares: [f64; 4]| shares.map(|share| format!("{:.0} %", share * 100.0));
    *text += &row("", AXES.map(String::from));
    *text += &row("torque, peak", percent(summary.torque_utilisation));
    *text += &row("torque, thermal", percent(summary.thermal_utilisation));
    *text += &row("speed, peak", percent(summary.speed_utilisation));
    let saturation = summary.longest_saturation_s;
    *text += &row(
        "at its limit",
        saturation.map(|time| format!("{:.1} ms", time * 1e3)),
    );
    heat(summary, text);
    if summary.pace < 1.0 {
        line!(
            text,
            "  pace              down to {:.0} % of the planned speed: an override, a move that was not held, warm motors, or too little torque, as under a heavier load",
            summary.pace * 100.0
        );
    }
    let burden = summary.burden_kg;
    if burden.abs() >= TOLD_BURDEN {
        let more = if burden > 0.0 { "more" } else { "less" };
        line!(
            text,
            "  burden            the lift feels {:.1} kg {more} than was announced",
            burden.abs()
        );
    }
}

/// How warm the motors got.
fn heat(summary: &Summary, text: &mut String) {
    let heat = &summary.heat;
    let slowed = heat.slowed_from_s.map_or_else(String::new, |from| {
        let each = &summary.each_cycle;
        let time = |cycle: Option<&CycleResult>| cycle.and_then(|cycle| cycle.cycle_time_s);
        let slower = match (time(each.first()), time(each.last())) {
            (Some(first), Some(last)) if last > first => {
                format!(": the last cycle took {last:.3} s, the first {first:.3} s")
            }
            _ => String::new(),
        };
        format!("; moves slowed down from {from:.1} s on{slower}")
    });
    line!(
        text,
        "  heat              {} at the most {:.0} % of what it may have for ever{slowed}",
        heat.warmest,
        heat.greatest * 100.0
    );
}

/// End of the run.
fn end(summary: &Summary, text: &mut String) {
    for (index, injected) in summary.injected.iter().enumerate() {
        let name = if index == 0 { "injected" } else { "" };
        line!(text, "  {name:<18}{}: {}", injected.fault, when(injected));
    }
    if summary.faults.is_empty() {
        line!(text, "  faults            none");
    }
    for fault in &summary.faults {
        line!(
            text,
            "  fault             {:.3} s: {} (code {}: {})",
            fault.time_s,
            fault.text,
            fault.code,
            fault.description
        );
    }
    requirements(summary, text);
    if !summary.completed {
        let rest = if summary.at_rest {
            "at rest, brake closed"
        } else {
            "not at rest on a closed brake"
        };
        line!(text, "  arm in the end    {rest}");
    }
}

/// When a fault was in effect.
fn when(injected: &Injected) -> String {
    match (injected.from_s, injected.until_s) {
        (Some(from), Some(until)) if injected.times > 1 => {
            format!("{} times, from {from:.3} s to {until:.3} s", injected.times)
        }
        (Some(from), Some(until)) => format!("from {from:.3} s to {until:.3} s"),
        _ => "never in effect".into(),
    }
}

/// What is required, and what became of it.
fn requirements(summary: &Summary, text: &mut String) {
    for (index, verdict) in summary.requirements.iter().enumerate() {
        let requirement = &verdict.requirement;
        line!(
            text,
            "  {:<18}{} {}: {}; {}",
            if index == 0 { "requirements" } else { "" },
            if verdict.met { "met   " } else { "MISSED" },
            requirement.id,
            limit(requirement),
            finding(verdict)
        );
    }
    if summary.recipe.ends == Ending::Stopped {
        let (Ok(end) | Err(end)) = ending(summary);
        line!(text, "  end               {end}");
    }
}
