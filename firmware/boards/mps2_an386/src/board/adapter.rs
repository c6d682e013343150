//! The board as a serial-line CAN adapter with a controller behind it.
//!
//! A frame is acknowledged by an empty line once the controller has processed it, after the frames that it sent in
//! answer. So a host in lock-step knows when it has them all. The opening of the bus is acknowledged too, after the
//! frames that a node sends at its start. Time is counted in samples of the drives.

use core::sync::atomic::{AtomicU32, Ordering};

use firmware::cabinet::journal::Journal;
use firmware::cabinet::sample_clock::SampleClock;
use firmware::node::Node;
use protocol::bus::{Transmit, TransmitError};
use protocol::frame::CanFrame;
use protocol::slcan::{Line, Parser, Text};
use protocol::time::Period;

use super::pins::Pins;
use super::settle;
use super::uart::{FRAMES, RECEIVED};

/// Wraps of SysTick (2^24 counts of 40 ns) without a byte after which the host counts as gone: 20 s.
const SILENCE: u32 = 30;

/// Wraps of SysTick since the start.
static WRAPS: AtomicU32 = AtomicU32::new(0);

/// The SysTick interrupt.
pub(crate) fn wrapped() {
    // The only writer.
    let wraps = WRAPS.load(Ordering::Relaxed);
    WRAPS.store(wraps.wrapping_add(1), Ordering::Relaxed);
}

/// Serves slcan until the host closes the bus or is silent for [`SILENCE`].
#[inline(never)]
pub(crate) fn serve(node: &mut Node, pins: &mut Pins, journal: &mut Journal, period: Period) {
    let mut clock = SampleClock::new(period);
    let mut parser = Parser::new();
    let mut open = false;
    while let Some(byte) = next_byte() {
        let answer = match parser.push(byte) {
            None => continue,
            Some(Ok(Line::Frame(frame))) if open => {
                if clock.observe(&frame) {
                    node.poll(clock.now(), None, &mut Uart);
                }
                node.poll(clock.now(), Some(&frame), &mut Uart);
                settle(node, clock.now(), pins, journal);
                Line::Empty
            }
            Some(Ok(Line::Open)) => {
                open = true;
                node.poll(clock.now(), None, &mut Uart);
                settle(node, clock.now(), pins, journal);
                Line::Empty
            }
            Some(Ok(Line::Close)) if open => return,
            // An emulated bus has no bit rates to set.
            Some(Ok(Line::Empty | Line::Close | Line::Bitrate(_) | Line::DataBitrate(_))) => {
                Line::Empty
            }
            Some(_) => Line::Refused,
        };
        FRAMES.send(Text::from(answer).as_bytes());
    }
}

/// Sleeps until there is a byte; `None` when the host is gone.
fn next_byte() -> Option<u8> {
    let since = WRAPS.load(Ordering::Relaxed);
    while WRAPS.load(Ordering::Relaxed).wrapping_sub(since) <= SILENCE {
        if let Some(byte) = RECEIVED.pop() {
            return Some(byte);
        }
        // With interrupts masked: one that arrives after the check still ends the sleep, and is handled after it.
        cortex_m::interrupt::free(|_| {
            if RECEIVED.is_empty() {
                cortex_m::asm::wfi();
            }
        });
    }
    None
}

/// The node's transmit side.
struct Uart;

impl Transmit for Uart {
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        FRAMES.send(Text::from(Line::Frame(*frame)).as_bytes());
        Ok(())
    }
}
