//! The command line.

use std::path::PathBuf;
use std::process::ExitCode;

use clap::{Args, Parser, Subcommand, ValueEnum};
use plant_sim::model::RobotModel;
use plant_sim::run::{self, RunConfig, Summary};
use plant_sim::scenario::{self, Scenario};
use plant_sim::selection::LawChoice;

/// Development bench for a SCARA drive cabinet: the controller that goes into the cabinet against
/// a simulated IRB 930, over CAN.
#[derive(Parser)]
#[command(name = "plant-sim", version, args_conflicts_with_subcommands = true)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    run: RunArgs,
}

#[derive(Subcommand)]
enum Command {
    /// Run a scenario (the default command).
    Run(RunArgs),
}

#[derive(Args, Clone)]
struct RunArgs {
    /// What to run: gate, gate-mismatch, square, pick-place, or a scenario file.
    #[arg(long, value_name = "NAME|FILE", default_value = "gate")]
    scenario: String,
    /// Control law: kinematic-joint, kinematic-task, pid, pd-gravity, computed-torque or
    /// computed-torque-task; the last two with :none, :integral or :observer (default).
    #[arg(long, value_name = "NAME")]
    law: Option<LawChoice>,
    /// Payload, announced and carried from the start.
    #[arg(long, value_name = "KG")]
    payload: Option<f64>,
    /// How often the cycle is repeated.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..=i64::from(scenario::MAX_CYCLES)))]
    cycles: Option<u32>,
    /// Control rate.
    #[arg(long, value_name = "HZ")]
    rate: Option<f64>,
    /// The bus: builtin is the bit-timed simulated one.
    #[arg(long, value_name = "BUS", default_value = "builtin")]
    bus: BusChoice,
    /// Seed of everything random.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// The robot that the controller believes in (a model file); also the true one, unless
    /// --plant-model says otherwise.
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// The robot as it is (a model file).
    #[arg(long, value_name = "FILE")]
    plant_model: Option<PathBuf>,
    /// Where trace.log, truth.csv and summary.json go.
    #[arg(long, value_name = "DIR", default_value = "out")]
    out: PathBuf,
    /// Print summary.json instead of the text.
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, ValueEnum)]
enum BusChoice {
    Builtin,
}

pub fn main() -> Result<ExitCode, String> {
    let cli = Cli::parse();
    match cli.command {
        None => run(&cli.run),
        Some(Command::Run(args)) => run(&args),
    }
}

fn run(args: &RunArgs) -> Result<ExitCode, String> {
    let BusChoice::Builtin = args.bus;
    let mut scenario = Scenario::open(&args.scenario).map_err(|error| error.to_string())?;
    if let Some(law) = args.law {
        scenario.law = law;
    }
    if let Some(cycles) = args.cycles {
        scenario.cycles = cycles;
    }
    if let Some(rate) = args.rate {
        scenario::check_rate(rate)
            .map_err(|allowed| format!("--rate is {rate}; allowed: {allowed}"))?;
        scenario.rate_hz = rate;
    }
    let model = load(args.model.as_ref())?;
    if let Some(kg) = args.payload {
        if !(0.0..=model.payload_max).contains(&kg) {
            return Err(format!(
                "--payload is {kg} kg; allowed: 0 to {} kg for {}",
                model.payload_max, model.name
            ));
        }
        scenario.payload = run::payload_of(&scenario, kg);
    }
    let plant_model = match &args.plant_model {
        Some(_) => load(args.plant_model.as_ref())?,
        None => model.clone(),
    };
    let config = RunConfig {
        scenario,
        model,
        plant_model,
        seed: args.seed,
    };
    let summary = run::execute(&config, Some(&args.out)).map_err(|error| error.to_string())?;
    if args.json {
        let json = serde_json::to_string_pretty(&summary).map_err(|error| error.to_string())?;
        println!("{json}");
    } else {
        print(&summary, &args.out);
    }
    match &summary.error {
        None => Ok(ExitCode::SUCCESS),
        Some(error) => Err(format!("the run was not completed: {error}")),
    }
}

fn load(path: Option<&PathBuf>) -> Result<RobotModel, String> {
    let Some(path) = path else {
        return Ok(RobotModel::irb_930_22_105());
    };
    let (model, warnings) = RobotModel::load(path).map_err(|error| error.to_string())?;
    for warning in warnings {
        eprintln!("plant-sim: warning: {}: {warning}", path.display());
    }
    Ok(model)
}

fn print(summary: &Summary, out: &std::path::Path) {
    let percent = |shares: &[f64; 4]| {
        shares
            .map(|share| format!("{:3.0} %", share * 100.0))
            .join("  ")
    };
    println!(
        "{} on {}, {} kg, {} at {} Hz, {} cycles",
        summary.scenario,
        summary.robot,
        summary.payload_kg,
        summary.law,
        summary.rate_hz,
        summary.cycles
    );
    match &summary.cycle_time_s {
        Some(time) => println!(
            "  cycle time        {:.4} s mean ({:.4} to {:.4}), back within 1 mm",
            time.mean, time.min, time.max
        ),
        None => println!("  cycle time        never back within 1 mm"),
    }
    match &summary.settle_time_s {
        Some(time) => println!(
            "  settling          {:.1} ms mean, {:.1} ms max, to 0.01 mm after the commanded end",
            time.mean * 1e3,
            time.max * 1e3
        ),
        None => println!("  settling          not within 0.01 mm"),
    }
    println!(
        "  tracking error    {:.4} mm rms, {:.4} mm max",
        summary.tracking_error_mm.rms, summary.tracking_error_mm.max
    );
    if let Some(error) = summary.final_error_mm.max {
        println!("  final error       {error:.4} mm max");
    }
    println!("                    shoulder  elbow  lift  wrist");
    println!(
        "  torque, peak      {}",
        percent(&summary.torque_utilisation)
    );
    println!(
        "  torque, thermal   {}",
        percent(&summary.thermal_utilisation)
    );
    println!(
        "  speed, peak       {}",
        percent(&summary.speed_utilisation)
    );
    println!(
        "  saturation        {:.1} ms at most",
        summary.longest_saturation_s * 1e3
    );
    println!(
        "  bus               {:.1} % load, {} frames, {} lost, {} overruns",
        summary.bus_load * 100.0,
        summary.frames,
        summary.frames_lost,
        summary.overruns
    );
    match summary.faults.as_slice() {
        [] => println!("  faults            none"),
        faults => {
            for fault in faults {
                println!(
                    "  fault             {:.3} s: {} ({}): {}",
                    fault.time_s, fault.cause, fault.code, fault.description
                );
            }
        }
    }
    println!(
        "  simulated         {:.2} s in {:.3} s: {:.0} times real time",
        summary.sim_time_s, summary.wall_time_s, summary.real_time_factor
    );
    println!("  trace.log, truth.csv, summary.json in {}", out.display());
}
