//! One run: scenario and robots in, results out - a trace, the truth and a summary.

use std::fs::{self, File};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};
use std::time::Instant;

use firmware::arm::ArmModel;
use firmware::controller::Config;
use protocol::frame::CanFrame;
use protocol::messages::Emergency;
use serde::Serialize;

use crate::bus::BitTiming;
use crate::endpoint::{Endpoint, EndpointError, InProcess};
use crate::metrics::{CycleResult, MeanMax, Metrics, RmsMax, Spread};
use crate::model::RobotModel;
use crate::operator::{Hand, Operator};
use crate::plant::arm::Arm;
use crate::plant::kinematics::{Pose, inverse};
use crate::rig::{self, Observer, Rig, RigConfig, RunError, Truth};
use crate::scenario::{PayloadSpec, Scenario, Step};
use crate::trace::{Interface, LogHash, Writer};

/// What to run with what.
#[derive(Clone, Debug)]
pub struct RunConfig {
    /// Motion, law, payload, mismatch.
    pub scenario: Scenario,
    /// The robot that the controller believes in.
    pub model: RobotModel,
    /// The robot as it is, before the scenario's mismatch.
    pub plant_model: RobotModel,
    /// Seed of everything random. Nothing is random without injected faults; the seed is recorded.
    pub seed: u64,
}

/// Why there was no complete run.
#[derive(Debug, thiserror::Error)]
pub enum ExecuteError {
    /// The start of the scenario is outside the robot's workspace.
    #[error(
        "scenario {scenario}: the start pose x {x}, y {y}, z {z}, yaw {yaw} is outside the workspace of {robot}"
    )]
    Start {
        /// Scenario.
        scenario: String,
        /// Robot.
        robot: String,
        /// Pose.
        x: f64,
        /// Pose.
        y: f64,
        /// Pose.
        z: f64,
        /// Pose.
        yaw: f64,
    },
    /// The controller cannot work with the model.
    #[error("model {robot}: {source}")]
    Model {
        /// Robot.
        robot: String,
        /// Reason.
        source: firmware::arm::ModelError,
    },
    /// The bus cannot carry the messages at this rate.
    #[error("at {rate_hz} Hz the {source}; lower the rate")]
    Link {
        /// Control rate.
        rate_hz: f64,
        /// Load.
        source: crate::bus::Overload,
    },
    /// The controller could not be started.
    #[error(transparent)]
    Controller(#[from] EndpointError),
    /// Files cannot be written.
    #[error("cannot write to {}: {source}", path.display())]
    Output {
        /// Where.
        path: PathBuf,
        /// Reason.
        source: io::Error,
    },
}

/// Summary of a run, as `summary.json` holds it. Times in s, lengths in mm, shares of 1.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Summary {
    /// Scenario.
    pub scenario: String,
    /// Robot that the controller believes in.
    pub robot: String,
    /// Law and compensation.
    pub law: String,
    /// Control rate.
    pub rate_hz: f64,
    /// Announced payload.
    pub payload_kg: f64,
    /// Seed.
    pub seed: u64,
    /// Cycles completed.
    pub cycles: u32,
    /// Whether the scenario ran to its end.
    pub completed: bool,
    /// Why not.
    pub error: Option<String>,
    /// From the start of motion until the tool is back within 1 mm and stays.
    pub cycle_time_s: Option<Spread>,
    /// From the end of the commanded motion until the tool is within 0.01 mm and stays.
    pub settle_time_s: Option<MeanMax>,
    /// True tool to commanded tool at the same instant, while the reference moves.
    pub tracking_error_mm: RmsMax,
    /// Distance from the target at the end of a dwell.
    pub final_error_mm: FinalError,
    /// Peak effort over its limit.
    pub torque_utilisation: [f64; 4],
    /// Root-mean-square effort over the continuous limit.
    pub thermal_utilisation: [f64; 4],
    /// Peak speed over its limit.
    pub speed_utilisation: [f64; 4],
    /// Longest time with a motor at its limit.
    pub longest_saturation_s: f64,
    /// Share of the time that the bus was taken.
    pub bus_load: f64,
    /// Frames delivered.
    pub frames: u64,
    /// Samples whose command had not come when the next sample was taken.
    pub overruns: u64,
    /// Frames that a full transmit queue or an identifier collision lost.
    pub frames_lost: u64,
    /// Faults that the controller reported.
    pub faults: Vec<Fault>,
    /// Simulated time.
    pub sim_time_s: f64,
    /// Time it took.
    pub wall_time_s: f64,
    /// Simulated over wall time.
    pub real_time_factor: f64,
    /// SHA-256 of `trace.log`.
    pub trace_sha256: String,
    /// Every cycle by itself.
    pub each_cycle: Vec<CycleResult>,
}

/// Greatest distance from the target.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct FinalError {
    /// mm.
    pub max: Option<f64>,
}

/// A fault that the controller reported.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fault {
    /// When, s.
    pub time_s: f64,
    /// Cause.
    pub cause: &'static str,
    /// Emergency error code (CiA 301, CiA 402), hexadecimal.
    pub code: String,
    /// What it means.
    pub description: &'static str,
}

/// Where results go as they come.
struct Recorder {
    trace: Writer<Sink>,
    truth: Sink,
    metrics: Metrics,
    faults: Vec<Fault>,
    target: [f64; 3],
    progress: Progress,
}

/// A file that appears under its name when it is complete, or nothing at all.
enum Sink {
    File(BufWriter<File>),
    Nowhere,
}

impl Write for Sink {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::File(file) => file.write(bytes),
            Self::Nowhere => Ok(bytes.len()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self {
            Self::File(file) => file.flush(),
            Self::Nowhere => Ok(()),
        }
    }
}

impl Observer for Recorder {
    fn frame(&mut self, time: u64, frame: &CanFrame) -> io::Result<()> {
        self.trace.frame(time / 1000, frame)
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.metrics.sample(truth);
        write_truth(&mut self.truth, truth)
    }

    fn hand(&mut self, hand: &Hand) {
        match hand {
            Hand::BeginCycle => self.metrics.begin_cycle(self.target),
            Hand::EndCycle => {
                self.metrics.end_cycle();
                self.progress.cycle();
            }
            Hand::Attach(_) | Hand::Release => {}
        }
    }

    fn emergency(&mut self, time: u64, emergency: &Emergency) {
        self.faults.push(Fault {
            time_s: time as f64 * 1e-9,
            cause: emergency.cause.name(),
            code: format!("{:04x}", emergency.code),
            description: emergency.cause.describe(),
        });
    }
}

const TRUTH_HEADER: &str = "t,q1,q2,q3,q4,qd1,qd2,qd3,qd4,rq1,rq2,rq3,rq4,rqd1,rqd2,rqd3,rqd4,\
                            tau1,tau2,tau3,tau4,x,y,z,yaw\n";

fn write_truth(sink: &mut Sink, truth: &Truth) -> io::Result<()> {
    let Sink::File(file) = sink else {
        return Ok(());
    };
    // A third of the run's time would go into the standard library's shortest digits.
    let mut digits = zmij::Buffer::new();
    file.write_all(digits.format(truth.t).as_bytes())?;
    for group in [
        &truth.q,
        &truth.qd,
        &truth.rq,
        &truth.rqd,
        &truth.tau,
        &truth.tool,
    ] {
        for value in group {
            file.write_all(b",")?;
            file.write_all(digits.format(*value).as_bytes())?;
        }
    }
    file.write_all(b"\n")
}

/// Says on standard error how far a long run is.
struct Progress {
    total: u32,
    done: u32,
    shown: Instant,
}

impl Progress {
    fn cycle(&mut self) {
        self.done += 1;
        if self.shown.elapsed().as_secs() >= 2 {
            self.shown = Instant::now();
            eprintln!("cycle {} of {}", self.done, self.total);
        }
    }
}

/// Runs a scenario. With `out`, writes `trace.log`, `truth.csv` and `summary.json` there; each
/// appears under its name when it is complete.
///
/// A scenario that could not be completed still has a summary, with `completed` false and the
/// reason in `error`.
///
/// # Errors
/// Nothing was run, or nothing could be written; see [`ExecuteError`].
pub fn execute(config: &RunConfig, out: Option<&Path>) -> Result<Summary, ExecuteError> {
    execute_with(config, out, |config| Ok(InProcess::new(config)))
}

/// Runs a scenario as [`execute`] does, with the controller that `connect` starts.
///
/// # Errors
/// As [`execute`], and [`ExecuteError::Controller`] when `connect` fails.
pub fn execute_with<E: Endpoint>(
    config: &RunConfig,
    out: Option<&Path>,
    connect: impl FnOnce(Config) -> Result<E, EndpointError>,
) -> Result<Summary, ExecuteError> {
    let scenario = &config.scenario;
    let rig = rig_config(config)?;
    let output = |path: &Path| {
        let path = path.to_path_buf();
        move |source| ExecuteError::Output { path, source }
    };
    let open = |name: &str| match out {
        None => Ok(Sink::Nowhere),
        Some(directory) => {
            let path = partial(directory, name);
            let file = fs::create_dir_all(directory).and_then(|()| File::create(&path));
            file.map(|file| Sink::File(BufWriter::new(file)))
                .map_err(output(&path))
        }
    };
    let mut truth = open("truth.csv")?;
    truth
        .write_all(TRUTH_HEADER.as_bytes())
        .map_err(output(Path::new("truth.csv")))?;
    let mut recorder = Recorder {
        trace: Writer::new(open("trace.log")?, Interface::CAN0),
        truth,
        metrics: Metrics::new(&rig.plant),
        faults: Vec::new(),
        target: cycle_target(scenario, &rig.plant),
        progress: Progress {
            total: scenario.cycles,
            done: 0,
            shown: Instant::now(),
        },
    };

    let began = Instant::now();
    let mut operator = Operator::new(scenario);
    let controller = connect(rig.controller())?;
    let mut rig = Rig::new(&rig, controller);
    let result = rig.run(&mut operator, &mut recorder);
    let wall = began.elapsed().as_secs_f64();

    let Recorder {
        trace,
        mut truth,
        metrics,
        faults,
        ..
    } = recorder;
    let directory = out.unwrap_or(Path::new("."));
    let (mut trace, hash) = trace.finish().map_err(output(directory))?;
    for sink in [&mut trace, &mut truth] {
        sink.flush().map_err(output(directory))?;
    }
    if let Err(RunError::Output(source)) = result {
        return Err(ExecuteError::Output {
            path: directory.into(),
            source,
        });
    }
    let summary = summarise(config, &rig, &metrics, faults, &result, wall, &hash);
    if let Some(directory) = out {
        let json = serde_json::to_string_pretty(&summary).map_err(io::Error::other);
        json.and_then(|json| fs::write(partial(directory, "summary.json"), json + "\n"))
            .and_then(|()| {
                ["trace.log", "truth.csv", "summary.json"]
                    .iter()
                    .try_for_each(|name| fs::rename(partial(directory, name), directory.join(name)))
            })
            .map_err(output(directory))?;
    }
    Ok(summary)
}

/// The rig that a run needs.
///
/// # Errors
/// The robot cannot start there, the controller not work with it, or the bus not carry the messages.
pub fn rig_config(config: &RunConfig) -> Result<RigConfig, ExecuteError> {
    let scenario = &config.scenario;
    let believed = ArmModel::from(&config.model);
    believed.validate().map_err(|source| ExecuteError::Model {
        robot: config.model.name.clone(),
        source,
    })?;
    let mut plant = config.plant_model.clone();
    for axis in 0..4 {
        plant.drive.viscous[axis] *= scenario.mismatch.friction;
        plant.drive.coulomb[axis] *= scenario.mismatch.friction;
    }
    let rig = RigConfig {
        start: start(scenario, &plant)?,
        plant,
        believed,
        rate_hz: scenario.rate_hz,
        timing: BitTiming::default(),
    };
    rig::admit(&rig.timing, rig.rate_hz).map_err(|source| ExecuteError::Link {
        rate_hz: rig.rate_hz,
        source,
    })?;
    Ok(rig)
}

fn partial(directory: &Path, name: &str) -> PathBuf {
    directory.join(format!("{name}.partial"))
}

fn start(scenario: &Scenario, robot: &RobotModel) -> Result<[f64; 4], ExecuteError> {
    let [x, y, z, yaw] = scenario.start;
    inverse(&robot.geometry, &robot.limits, &Pose { x, y, z, yaw })
        .ok()
        .filter(|[positive, _]| positive.violation.is_none())
        .map(|[positive, _]| positive.q.into())
        .ok_or_else(|| ExecuteError::Start {
            scenario: scenario.name.clone(),
            robot: robot.name.clone(),
            x,
            y,
            z,
            yaw,
        })
}

/// Where the tool stands when a cycle has ended.
fn cycle_target(scenario: &Scenario, robot: &RobotModel) -> [f64; 3] {
    let last = scenario.cycle.iter().rev().find_map(|step| match step {
        Step::Jump(jump) => Some(jump.to),
        Step::Line(line) => Some(line.to),
        Step::Joints(joints) => {
            let arm = Arm::new(robot, None);
            let pose = arm.pose(&arm.at(&joints.to.into()));
            Some([pose.x, pose.y, pose.z, pose.yaw])
        }
        Step::Dwell(_) | Step::Stop(_) | Step::Pick(_) | Step::Place {} => None,
    });
    let [x, y, z, _] = last.unwrap_or(scenario.start);
    [x, y, z]
}

fn summarise(
    config: &RunConfig,
    rig: &Rig<impl Endpoint>,
    metrics: &Metrics,
    faults: Vec<Fault>,
    result: &Result<(), RunError>,
    wall: f64,
    hash: &LogHash,
) -> Summary {
    let scenario = &config.scenario;
    let bus = rig.bus();
    let sim = rig.time();
    Summary {
        scenario: scenario.name.clone(),
        robot: config.model.name.clone(),
        law: scenario.law.to_string(),
        rate_hz: scenario.rate_hz,
        payload_kg: scenario.payload.map_or(0.0, |payload| payload.mass),
        seed: config.seed,
        cycles: metrics.cycles.len() as u32,
        completed: result.is_ok(),
        error: result.as_ref().err().map(ToString::to_string),
        cycle_time_s: metrics.cycle_time_s(),
        settle_time_s: metrics.settle_time_s(),
        tracking_error_mm: metrics.tracking_error_mm(),
        final_error_mm: FinalError {
            max: metrics.final_error_mm(),
        },
        torque_utilisation: metrics.torque_utilisation(),
        thermal_utilisation: metrics.thermal_utilisation(),
        speed_utilisation: metrics.speed_utilisation(),
        longest_saturation_s: metrics.longest_saturation as f64 / scenario.rate_hz,
        bus_load: bus.total.load((sim * 1e9) as u64),
        frames: bus.total.frames,
        overruns: rig.drives().overruns(),
        frames_lost: rig.dropped() + 2 * bus.collisions,
        faults,
        sim_time_s: sim,
        wall_time_s: wall,
        real_time_factor: sim / wall,
        trace_sha256: hash.to_string(),
        each_cycle: metrics.cycles.clone(),
    }
}

/// The payload that `--payload` asks for.
pub fn payload_of(scenario: &Scenario, kg: f64) -> Option<PayloadSpec> {
    if kg == 0.0 {
        return None;
    }
    Some(match scenario.payload {
        Some(payload) if payload.mass > 0.0 => payload.scaled(kg / payload.mass),
        _ => PayloadSpec::compact(kg),
    })
}
