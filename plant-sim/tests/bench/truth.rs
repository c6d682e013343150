//! What `truth.csv` of an ordinary run says of a gate, by the numbers of the robot.

use std::fs;
use std::path::Path;

use crate::plant_sim;

/// Of the robot: lengths, m; limits, N m and N; continuous ratings; dry friction and its speeds (plant-sim/models).
pub(crate) const A: [f64; 2] = [0.56, 0.49];
pub(crate) const FLANGE: f64 = 0.1213;
pub(crate) const PEAK: [f64; 4] = [640.0, 400.0, 860.0, 30.0];
pub(crate) const RATED: [f64; 4] = [216.0, 127.0, 287.0, 10.2];
pub(crate) const SPEED: [f64; 4] = [
    7.679_448_708_775_05,
    12.217_304_763_960_307,
    2.2,
    29.670_597_283_903_604,
];
pub(crate) const COULOMB: [f64; 4] = [12.0, 6.0, 20.0, 0.6];
pub(crate) const EPS: [f64; 4] = [0.01, 0.01, 0.001, 0.01];
pub(crate) const RISE_TIME: f64 = 0.010;

/// Height of the ends, and of the gate above them.
pub(crate) const Z: f64 = -0.25;
pub(crate) const RISE: f64 = 0.025;

/// The gate in the place `mid-tan`, as anyone would write it.
pub(crate) fn scenario(kg: f64, speed: f64, dwell: f64) -> String {
    let start = "[0.7, -0.15, -0.25, 0.0]";
    let jump = |to: &str| {
        format!(
            "[[cycle]]\njump = {{ to = {to}, top = -0.225, speed = {speed} }}\n[[cycle]]\ndwell = {dwell}\n"
        )
    };
    format!(
        "name = \"mid-tan\"\ncycles = 2\nrate_hz = 1000\nlaw = \"computed-torque:observer\"\nstart = {start}\n\
         [payload]\nmass = {kg}\ncom_flange_frame = [0.0, 0.0, 0.05]\n\
         inertia_com_diag = [{0}, {0}, {1}]\n{2}{3}",
        0.004 * kg,
        0.005 * kg,
        jump("[0.7, 0.15, -0.25, 0.0]"),
        jump(start)
    )
}

/// A row of `truth.csv`.
pub(crate) struct Truth {
    pub(crate) t: f64,
    pub(crate) q: [f64; 4],
    pub(crate) qd: [f64; 4],
    pub(crate) reference: [f64; 4],
    pub(crate) moves: bool,
    pub(crate) tau: [f64; 4],
    pub(crate) tool: [f64; 4],
}

/// What an ordinary run of `scenario` leaves, with a controller that believes in another model if there is one.
pub(crate) fn truth(folder: &Path, scenario: &str, model: Option<&str>) -> Vec<Truth> {
    fs::write(folder.join("gate.toml"), scenario).unwrap();
    let run = ["run", "--scenario", "gate.toml", "--no-report", "-q"];
    let models = model.map(|model| ["--model", model, "--plant-model", "irb930-22-1.05"]);
    let output = plant_sim(
        folder,
        &[&run[..], models.as_ref().map_or(&[], |it| &it[..])].concat(),
    );
    assert!(output.status.success(), "{output:?}");
    let mut reader = csv::Reader::from_path(folder.join("out/truth.csv")).unwrap();
    let rows = reader.records().map(|row| {
        let row = row.unwrap();
        let four = |from: usize| std::array::from_fn(|axis| row[from + axis].parse().unwrap());
        let rqd: [f64; 4] = four(13);
        Truth {
            t: row[0].parse().unwrap(),
            q: four(1),
            qd: four(5),
            reference: four(9),
            moves: rqd != [0.0; 4],
            tau: four(17),
            tool: four(21),
        }
    });
    rows.collect()
}

/// The tool by the cosines of a drawing.
pub(crate) fn tool([q1, q2, q3, q4]: &[f64; 4]) -> [f64; 4] {
    let (upper, fore) = (*q1, q1 + q2);
    [
        A[0] * upper.cos() + A[1] * fore.cos(),
        A[0] * upper.sin() + A[1] * fore.sin(),
        -q3 - FLANGE,
        fore - q4,
    ]
}

pub(crate) fn distance(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    ((a[0] - b[0]).powi(2) + (a[1] - b[1]).powi(2) + (a[2] - b[2]).powi(2)).sqrt()
}

pub(crate) fn across(a: &[f64; 4], b: &[f64; 4]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}

/// Indices of the motions: the first sample at which the reference moves, and the first at which it rests again.
pub(crate) fn motions(rows: &[Truth]) -> Vec<(usize, usize)> {
    let mut motions = Vec::new();
    let mut from = None;
    for (index, row) in rows.iter().enumerate() {
        match (row.moves, from) {
            (true, None) => from = Some(index),
            (false, Some(begun)) => {
                motions.push((begun, index));
                from = None;
            }
            _ => {}
        }
    }
    motions
}

/// Root mean square over the continuous rating while the reference moves, of the worst axis.
pub(crate) fn rms(rows: &[Truth], motions: &[(usize, usize)]) -> f64 {
    let moving = || {
        motions
            .iter()
            .flat_map(|&(begun, ended)| &rows[begun..=ended])
    };
    let shares = (0..4).map(|axis| {
        let sum: f64 = moving().map(|row| row.tau[axis].powi(2)).sum();
        (sum / moving().count() as f64).sqrt() / RATED[axis]
    });
    shares.fold(0.0, f64::max)
}
