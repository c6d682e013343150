//! `plant-sim record`: records a bus into files.

use std::path::PathBuf;
use std::time::{Duration, Instant};

use clap::Args;
use link::{Link, LinkAddress};
use plant_sim::record::Recording;
use plant_sim::{interrupt, say};
use trace::Interface;

use super::{Failure, arrival, show};

/// Longest wait for a frame before checking for signals; also the time between two flushes.
const WAIT: Duration = Duration::from_millis(100);
/// Frames taken before flush and signals get their turn.
const BATCH: usize = 4096;
/// Longest time after the signal for taking the frames already received.
const LAST: Duration = Duration::from_secs(1);

/// Arguments of `record`.
#[derive(Args)]
pub(super) struct RecordArgs {
    /// The bus: socketcan:INTERFACE, slcan:TERMINAL, slcan:tcp:HOST:PORT or slcan:listen:HOST:PORT.
    #[arg(long, value_name = "BUS")]
    bus: LinkAddress,
    /// The file, which must not exist: FILE.asc is Vector ASC, FILE.pcapng for Wireshark, any other a candump log. While it
    /// grows it is called FILE.part.
    #[arg(long, value_name = "FILE")]
    out: PathBuf,
    /// Begin a new file when one reaches this size (64M): FILE-0001.log, FILE-0002.log and so on.
    #[arg(long, value_name = "SIZE", value_parser = size)]
    rotate: Option<u64>,
}

/// Records until a signal arrives.
pub(super) fn run(args: &RecordArgs) -> Result<(), Failure> {
    interrupt::listen()?;
    // The bus first: without one, no file is left behind.
    let mut link = Link::watch(&args.bus).map_err(|error| error.to_string())?;
    let mut recording = Recording::create(&args.out, args.rotate)?;
    say!("plant-sim: recording {}; Ctrl-C ends it", args.bus);
    let begun = Instant::now();
    let ended = record(&mut link, &args.bus, &mut recording);
    // However it ended, the recording gets its name.
    let recorded = recording.finish().map_err(|error| error.to_string())?;
    show(&format!(
        "{} frames and {} error frames in {:.3} s, {} bytes in {} files\n",
        recorded.frames,
        recorded.error_frames,
        begun.elapsed().as_secs_f64(),
        recorded.bytes,
        recorded.files,
    ))?;
    let lost = ended?;
    if lost > 0 {
        return Err(Failure::failed(format!(
            "{}: {lost} frames are not in the recording: they came faster than they were read, or could not be read",
            args.bus
        )));
    }
    Ok(())
}

/// Records until a signal arrives or the bus is gone; returns the number of frames lost.
fn record(link: &mut Link, bus: &LinkAddress, recording: &mut Recording) -> Result<u64, String> {
    let interface = interface(bus);
    let mut flushed = Instant::now();
    while !interrupt::asked() {
        let alive = link.wait(WAIT);
        take(link, interface, recording)?;
        alive.map_err(|error| error.to_string())?;
        if flushed.elapsed() >= WAIT {
            recording.flush().map_err(|error| error.to_string())?;
            flushed = Instant::now();
        }
    }
    // Frames received so far belong to the recording; a bus that is never quiet must not delay the end.
    let ended = Instant::now();
    while take(link, interface, recording)? > 0 && ended.elapsed() < LAST {}
    Ok(link.lost())
}

/// Records the available frames, a batch at most; returns their number.
fn take(link: &mut Link, interface: Interface, recording: &mut Recording) -> Result<usize, String> {
    for taken in 0..BATCH {
        let Some(arrival) = link.next_arrival() else {
            return Ok(taken);
        };
        if let Some(record) = arrival::record(&arrival, interface) {
            recording
                .record(&record)
                .map_err(|error| error.to_string())?;
        }
    }
    Ok(BATCH)
}

/// The name of the bus in the recording.
fn interface(bus: &LinkAddress) -> Interface {
    match bus {
        LinkAddress::SocketCan(name) => Interface::new(name).unwrap_or(Interface::CAN0),
        LinkAddress::Slcan(_) => Interface::CAN0,
    }
}

/// Bytes, with `k`, `M` or `G` for powers of 1000.
fn size(text: &str) -> Result<u64, String> {
    let (digits, unit) = match text.as_bytes() {
        [digits @ .., b'k' | b'K'] => (digits.len(), 1_000),
        [digits @ .., b'M'] => (digits.len(), 1_000_000),
        [digits @ .., b'G'] => (digits.len(), 1_000_000_000),
        digits => (digits.len(), 1),
    };
    text[..digits]
        .parse::<u64>()
        .ok()
        .and_then(|number| number.checked_mul(unit))
        .filter(|&size| size >= 1_000)
        .ok_or_else(|| "allowed: bytes from 1000 on, also as 500k, 64M or 2G".into())
}
