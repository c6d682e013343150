//! `plant-sim view`: the live page.

use std::io;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::mpsc::sync_channel;
use std::time::Duration;

use clap::Args;
use link::{Link, LinkAddress};
use plant_sim::external::WallClock;
use plant_sim::interrupt::{self, Heeding};
use plant_sim::record::Recording;
use plant_sim::view::{Air, Done, Ear, ROOM, Scribe, Server, Session, Subject, offers};
use plant_sim::{report, say};
use protocol::frame::CanFrame;
use protocol::time::{self, Instant, Period};
use protocol::wire::BitTiming;
use sim::controller::InProcess;
use sim::observer::Observer;
use sim::record::of_run;
use trace::{Entry, ErrorFrame, Interface};

use super::arrival::record;
use super::bitrate::bit_timing;
use super::run::{ConfigArgs, ScenarioArgs};
use super::{Failure, show};

/// Room for wishes that the loop has not yet taken.
const WISHES: usize = 64;
/// Longest wait for a frame, or for a viewer, before checking for signals.
const WAIT: Duration = Duration::from_millis(20);
/// Frames of a bus taken before signals get their turn.
const BATCH: usize = 4096;

/// Arguments of `view`.
#[derive(Args)]
pub(super) struct ViewArgs {
    #[command(flatten)]
    scenario: ScenarioArgs,
    #[command(flatten)]
    config: ConfigArgs,
    /// Watch this bus instead of running a scenario: socketcan:INTERFACE, slcan:TERMINAL, slcan:tcp:HOST:PORT or
    /// slcan:listen:HOST:PORT. The page then shows and does not ask for anything; --model says which robot it is.
    #[arg(
        long,
        value_name = "BUS",
        conflicts_with_all = ["name", "scenario", "set", "law", "payload", "cycles", "rate", "fault", "seed", "plant_model"]
    )]
    bus: Option<LinkAddress>,
    /// Bit rates of that bus, bit/s, for its load.
    #[arg(long, value_name = "N[,D]", default_value = "1M,5M", value_parser = bit_timing)]
    bitrate: BitTiming,
    /// Port of this machine for the page; 0 takes any that is free.
    #[arg(long, value_name = "N", default_value_t = 7930)]
    port: u16,
    /// Do not open a browser; the URL is printed in any case.
    #[arg(long)]
    no_open: bool,
    /// Keep every frame in this file, which must not exist: a candump log, or by its ending Vector ASC or pcapng. What a
    /// person has asked for on the page is in it, so that plant-sim trace replay repeats it.
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
}

/// Shows the page until a signal ends it.
pub(super) fn run(args: &ViewArgs) -> Result<(), Failure> {
    match &args.bus {
        Some(bus) => watch(args, bus),
        None => live(args),
    }
}

/// A run of its own, in real time.
fn live(args: &ViewArgs) -> Result<(), Failure> {
    let config = args.config.config(args.scenario.name())?;
    config.rig().map_err(Failure::usage)?;
    interrupt::listen()?;
    let recording = recording(args)?;
    let (ear, heard) = sync_channel(ROOM);
    let (asked, wishes) = sync_channel(WISHES);
    let subject = Subject {
        title: config.scenario.name.clone(),
        bus: "builtin".into(),
        robot: config.actual.clone(),
        timing: BitTiming::default(),
        period_s: Some(1.0 / config.scenario.rate_hz),
        is_real: false,
    };
    let air = Arc::new(Air::default());
    let setup = subject.setup(&offers::of_run(&config.scenario, &config.nominal));
    let server = Server::start(
        args.port,
        report::live(),
        &setup,
        Arc::clone(&air),
        Some(asked),
    )?;
    let scribe = Scribe::start(&subject, heard, Arc::clone(&air));
    announce(&server, args);
    say!(
        "plant-sim: {} begins when somebody looks; Ctrl-C ends it",
        subject.title
    );
    while !air.is_seen() && !interrupt::asked() {
        std::thread::sleep(WAIT);
    }
    let session = Session::new(
        &config,
        |config| Ok(InProcess::new(config)),
        wishes,
        Ear::new(ear),
    )
    .map_err(Failure::failed)?;
    let clock = WallClock::new(Period::of_rate(config.scenario.rate_hz));
    let mut recorder = recording.map(Recorder);
    let ended = session.run(&mut Heeding(&mut clock.clone()), &mut recorder);
    drop(server);
    let _ = scribe.join();
    // However it ended, the recording gets its name.
    let kept = finish(args, recorder.map(|recorder| recorder.0))?;
    let done = ended.map_err(Failure::failed)?;
    show(&summary(&done, &air))?;
    show(&kept)?;
    show(&clock.timing().report())
}

/// A bus of others.
fn watch(args: &ViewArgs, bus: &LinkAddress) -> Result<(), Failure> {
    let robot = args.config.nominal()?;
    interrupt::listen()?;
    let mut link = Link::watch(bus).map_err(|error| error.to_string())?;
    let mut recording = recording(args)?;
    let (ear, heard) = sync_channel(ROOM);
    let subject = Subject {
        title: bus.to_string(),
        bus: bus.to_string(),
        robot,
        timing: args.bitrate,
        period_s: None,
        is_real: true,
    };
    let air = Arc::new(Air::default());
    let server = Server::start(
        args.port,
        report::live(),
        &subject.setup(&[]),
        Arc::clone(&air),
        None,
    )?;
    let scribe = Scribe::start(&subject, heard, Arc::clone(&air));
    announce(&server, args);
    say!("plant-sim: watching {bus}; Ctrl-C ends it");
    let mut ear = Ear::new(ear);
    let mut frames = 0_u64;
    let ended = loop {
        if interrupt::asked() {
            break Ok(());
        }
        if let Err(error) = link.wait(WAIT) {
            break Err(Failure::failed(error));
        }
        for _ in 0..BATCH {
            let Some(arrival) = link.next_arrival() else {
                break;
            };
            let Some(record) = record(&arrival, Interface::CAN0) else {
                continue;
            };
            frames += 1;
            ear.record(record);
            if let Some(recording) = &mut recording {
                recording.record(&record).map_err(Failure::failed)?;
            }
        }
        ear.lost(link.lost());
        ear.deliver();
    };
    drop((server, ear));
    let _ = scribe.join();
    let kept = finish(args, recording)?;
    ended?;
    show(&format!(
        "{frames} frames of {bus}, up to {} viewers at a time\n{kept}",
        air.most_viewers()
    ))
}

/// Every frame of a run into a file.
struct Recorder(Recording);

impl Observer for Recorder {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        let record = of_run(time, Entry::Frame(*frame));
        self.0.record(&record).map_err(io::Error::other)
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, _: time::Duration) -> io::Result<()> {
        let record = of_run(time, Entry::Error(*error));
        self.0.record(&record).map_err(io::Error::other)
    }
}

fn recording(args: &ViewArgs) -> Result<Option<Recording>, Failure> {
    let create = |path| Recording::create(path, None);
    Ok(args.record.as_deref().map(create).transpose()?)
}

/// Completes a recording; says what is in it.
fn finish(args: &ViewArgs, recording: Option<Recording>) -> Result<String, Failure> {
    let (Some(path), Some(recording)) = (&args.record, recording) else {
        return Ok(String::new());
    };
    let frames = recording.finish()?.frames;
    Ok(format!("{frames} frames in {}\n", path.display()))
}

/// Says where the page is, and opens it where there is a browser.
fn announce(server: &Server, args: &ViewArgs) {
    let url = server.url();
    say!("plant-sim: the page is at {url}");
    if !args.no_open
        && let Err(error) = open::that_detached(&url)
    {
        say!("plant-sim: no browser opens by itself ({error}); open that address in one");
    }
}

/// What was done, in words.
fn summary(done: &Done, air: &Air) -> String {
    let mut text = format!(
        "lived {:.3} s, up to {} viewers at a time\nasked for: {} done, {} refused or failed\n",
        done.time_s,
        air.most_viewers(),
        done.good,
        done.bad
    );
    for fault in &done.faults {
        text += &format!("planted: --fault {fault}\n");
    }
    if done.more_faults > 0 {
        text += &format!("planted: {} more\n", done.more_faults);
    }
    text
}
