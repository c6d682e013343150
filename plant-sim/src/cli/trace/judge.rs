//! `trace check` and `trace replay`: traces checked against the rules, compared with a controller, or played onto a
//! bus.

use std::collections::BTreeMap;
use std::time::{Duration, Instant};

use firmware::mechanics::arm::ArmModel;
use link::{Link, LinkAddress, SlcanPeer};
use plant_sim::check::{Checker, Counts};
use plant_sim::interrupt;
use plant_sim::play::{Pace, PlayError, Player};
use plant_sim::replay::Replay;
use plant_sim::say;
use protocol::table;
use protocol::time::Period;
use sim::model::RobotModel;
use sim::rig::RigConfig;
use sim::scenario;
use sim::text;
use trace::Interface;

use super::args::{CheckArgs, ReplayArgs};
use super::source::Source;
use crate::cli::run::load;
use crate::cli::{Failure, show};

/// A wait of the player worth mentioning.
const LONG: Duration = Duration::from_secs(1);

/// By how much the rate of samples may differ from the one asked for, relative to it.
const UNLIKE: f64 = 0.02;

/// Every interface is a bus of its own.
type PerInterface<T> = BTreeMap<Interface, T>;

/// Place of a violation: file and line, and the interface if there are several.
fn place<T>(source: &Source, interface: Interface, all: &PerInterface<T>) -> String {
    if all.len() > 1 {
        format!("{}: {interface}", source.place())
    } else {
        source.place()
    }
}

pub(super) fn check(args: &CheckArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    let arm = ArmModel::from(&load(args.model.as_deref())?);
    let mut source = Source::open(&args.input.file, args.input.selection(args.end.to))?;
    let mut checkers: PerInterface<Checker> = BTreeMap::new();
    let mut counts = Counts::default();
    while let Some(line) = source.line() {
        let record = line.map_err(|problem| format!("{}: {problem}", source.place()))?;
        let interface = record.interface;
        let checker = checkers
            .entry(interface)
            .or_insert_with(|| Checker::new(&arm));
        let before = checker.counts();
        let judged = checker.record(&record);
        if source.counts(&record) {
            counts = counts.plus(checker.counts().minus(before));
            judged.map_err(|offence| {
                format!("{}: {offence}", place(&source, interface, &checkers))
            })?;
        }
    }
    source.verdict()?;
    if counts.judged == 0 {
        return Err(source.nothing("the log has no frame of this protocol"));
    }
    show(&format!(
        "{} frames keep every rule; {} foreign frames and {} error frames are not judged\n",
        counts.judged, counts.foreign, counts.error_frames
    ))?;
    Ok(())
}

pub(super) fn replay(args: &ReplayArgs) -> Result<(), Failure> {
    if let Some(bus) = &args.bus {
        return play(args, bus);
    }
    interrupt::listen()?;
    scenario::check_rate(args.rate).map_err(|allowed| {
        Failure::usage(format!(
            "--rate is {}; allowed: {allowed}",
            text::number(args.rate)
        ))
    })?;
    let model: RobotModel = load(args.model.as_deref())?;
    let config = RigConfig {
        nominal: ArmModel::from(&model),
        actual: model,
        period: Period::of_rate(args.rate),
        start: [0.0; 4],
        timing: args.bitrate,
    };
    let mut source = Source::open(&args.input.file, args.input.selection(args.end.to))?;
    let mut replays: PerInterface<Replay> = BTreeMap::new();
    let mut compared = 0;
    while let Some(record) = source.record_of_interface() {
        let interface = record.interface;
        let replay = replays
            .entry(interface)
            .or_insert_with(|| Replay::new(config.controller()));
        let before = replay.compared();
        let same = replay.record(&record);
        if source.counts(&record) {
            compared += replay.compared() - before;
            same.map_err(|difference| {
                let place = place(&source, interface, &replays);
                let hint = hint(args.rate, &replays[&interface]);
                format!("{place}: {difference}\n{hint}")
            })?;
        }
    }
    source.verdict()?;
    if compared == 0 {
        return Err(source.nothing("the log has no command of a controller"));
    }
    show(&format!(
        "{compared} commands are the same, byte for byte\n"
    ))?;
    Ok(())
}

/// What to do about a difference.
fn hint(rate_hz: f64, replay: &Replay) -> String {
    let this = env!("VERSION_AND_COMMIT");
    match (replay.schema(), replay.rate_hz()) {
        (Some(schema), _) if schema != table::HASH => format!(
            "the trace is of nodes with schema {schema:08x}, with which the controller of this program ({this}), schema \
             {:08x}, does not work: replay it with the version that recorded it",
            table::HASH
        ),
        (_, Some(seen_hz)) if (seen_hz / rate_hz - 1.0).abs() > UNLIKE => format!(
            "samples of this trace come at about {seen_hz:.0} Hz, and --rate is {rate_hz}: name the rate of the recorded \
             controller"
        ),
        _ => format!(
            "commands are compared with those of the controller of this program ({this}): if another version was recorded, \
             replay with that one; if not, name its --model, --rate and --bitrate, or the trace lacks frames"
        ),
    }
}

fn play(args: &ReplayArgs, bus: &LinkAddress) -> Result<(), Failure> {
    let mut source = Source::open(&args.input.file, args.input.selection(args.end.to))?;
    let link = Link::open(bus).map_err(|error| error.to_string())?;
    let mut player = Player::new(link, Pace::new(args.speed, args.skip_gaps));
    let failed = |error: PlayError| format!("{bus}: {error}");
    if let LinkAddress::Slcan(SlcanPeer::Listen(_)) = bus {
        say!("plant-sim: waiting for a client on {bus}");
        player.wait_for_client().map_err(failed)?;
    }
    let begun = Instant::now();
    let mut interfaces: Vec<Interface> = Vec::new();
    while let Some(record) = source.record() {
        if !interfaces.contains(&record.interface) {
            interfaces.push(record.interface);
            if let [first, second] = interfaces.as_slice() {
                say!(
                    "plant-sim: frames of {first} and {second} go onto one bus; --interface chooses"
                );
            }
        }
        let wait = player.wait(record.time_us);
        if wait > LONG {
            say!(
                "plant-sim: {}: {:.3} s until the next frame; --skip-gaps leaves such waits out",
                source.place(),
                wait.as_secs_f64()
            );
        }
        player
            .record(&record)
            .map_err(|error| format!("{}: {}", source.place(), failed(error)))?;
    }
    let played = player.finish().map_err(failed)?;
    source.verdict()?;
    show(&format!(
        "{} frames played onto {bus} in {:.3} s; {} had to wait for room in the queue, {} error frames left out\n",
        played.frames,
        begun.elapsed().as_secs_f64(),
        played.waited,
        played.left_out,
    ))?;
    if played.lost > 0 {
        return Err(Failure::failed(format!(
            "{bus}: {} frames were refused or not read at the other end",
            played.lost
        )));
    }
    Ok(())
}
