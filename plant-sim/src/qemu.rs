//! The controller as an image on an emulated Cortex-M4F, compared with its twin byte for byte.
//!
//! The twin knows what the board has to answer, so that the run goes on with the twin's answer at once, and compares the
//! board's when it comes: board and run work side by side. A run ends at the first difference, a few dozen samples later than
//! that; the message has its time.

mod board;
mod costs;
mod image;
mod log;
mod serial;
mod supervise;

use std::cell::RefCell;
use std::collections::VecDeque;
use std::path::PathBuf;
use std::rc::Rc;

pub use channel::Channel;
use channel::ring::CAPACITY;
use channel::{Fault, Request, Setup};
pub use costs::{Costs, Poll};
use firmware::cabinet::reset::Stop;
use firmware::control::controller::Config;
pub use image::image;
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;
use protocol::slcan::MAX_LINE;
use protocol::time::{Duration, Instant};

use crate::external::peers;
use crate::say;
use crate::twin::Twin;
use board::Board;
use sim::controller::COMPUTE;
use sim::peer::{Outbox, Peer, PeerError};
use sim::world::World;
use trace::difference::Difference;

/// Options of the emulation.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The image; `None` builds [`IMAGE`] from the sources.
    pub image: Option<PathBuf>,
    /// How frames travel between the rig and the board.
    pub channel: Channel,
    /// Count instructions: the emulated clock then advances by instructions alone. Slower, and
    /// over the FIFOs only.
    pub count: Option<Rc<RefCell<Costs>>>,
    /// Go on only once the board has answered: for faults that are planted into it, which its twin does not know of.
    pub in_step: bool,
}

/// Calls of the node that the board may be behind over the FIFOs, before the run waits for half of them: enough for the board
/// never to wait. All their requests fit into a pipe.
const AHEAD: usize = 64;
/// The same over the UART: as many lines as its receiver holds.
const LINES_AHEAD: usize = CAPACITY / MAX_LINE;

/// The image for runs.
pub const IMAGE: &str = "mps2-an386";
/// The image that can plant faults into itself.
pub const FAULTS_IMAGE: &str = "mps2-an386-faults";
/// The image that measures the phases of a call.
pub const COST_IMAGE: &str = "mps2-an386-cost";

/// The controller in QEMU with its twin in this process.
#[derive(Debug)]
pub struct Qemu {
    image: PathBuf,
    twin: Twin,
    board: Board,
    /// How frames travel; `None` once the bus is closed.
    channel: Option<Channel>,
    /// Frames sent by the board; empty between calls.
    sent: Vec<CanFrame>,
    /// How the board ended before its last restart.
    last_stop: Option<Stop>,
    count: Option<Rc<RefCell<Costs>>>,
    /// Calls that the twin has answered and the board has not, the oldest first.
    ahead: VecDeque<Call>,
    /// At this number the run waits for half of them.
    most_ahead: usize,
}

/// A call of the node.
#[derive(Debug)]
struct Call {
    now: Instant,
    /// What the board has been asked for it.
    asked: Vec<Asked>,
    /// What the twin has sent.
    due: Vec<CanFrame>,
}

impl Call {
    /// Compares what the board has sent with it.
    fn compare(&self, found: &[CanFrame]) -> Result<(), PeerError> {
        let places = 0..self.due.len().max(found.len());
        let difference = places
            .filter_map(|place| Difference::between(self.due.get(place), found.get(place)))
            .next();
        difference.map_or(Ok(()), |difference| {
            let at = self.now.seconds();
            Err(failure(format!(
                "differs from this process at {at:.6} s: {difference}"
            )))
        })
    }
}

/// A request to the board to call the node once.
#[derive(Debug)]
struct Asked {
    received: Option<u32>,
    planning: bool,
}

impl Qemu {
    /// Starts the emulator with the image and sends the board its configuration.
    ///
    /// # Errors
    /// The image cannot be built, the emulator is missing or does not answer; the error says what to do.
    pub fn start(config: Config, options: &Options) -> Result<Self, PeerError> {
        let image = image(options.image.as_deref(), IMAGE)?;
        let setup = Setup {
            channel: options.channel,
            config,
        };
        let mut sent = Vec::new();
        let mut qemu = Self {
            twin: Twin::new(config),
            board: Board::start(&image, &setup, options.count.is_some(), &mut sent)?,
            sent,
            image,
            channel: Some(options.channel),
            last_stop: None,
            count: options.count.clone(),
            ahead: VecDeque::new(),
            most_ahead: match options.channel {
                _ if options.in_step => 1,
                Channel::Fifo => AHEAD,
                Channel::Uart => LINES_AHEAD,
            },
        };
        // Every run begins like this, wherever the controller is.
        qemu.reset(peers::reset())?;
        qemu.last_stop = None;
        Ok(qemu)
    }

    /// Lets the image plant this fault into itself, which only [`FAULTS_IMAGE`] does. Follows the board through its
    /// restart and restarts the twin with the same reason.
    ///
    /// # Errors
    /// The board does not restart.
    pub fn plant(&mut self, fault: Fault) -> Result<(), PeerError> {
        self.catch_up(0)?;
        self.board.send_request(&Request::Plant(fault))?;
        let reason = self.follow_restart()?;
        self.twin.restart(reason);
        Ok(())
    }

    /// Follows the board through its restart; returns the reason.
    fn follow_restart(&mut self) -> Result<ResetReason, PeerError> {
        let stop = self.board.restart(&mut self.sent)?;
        self.last_stop = Some(stop);
        Ok(stop.reason)
    }

    /// How the board ended before its last restart in this run.
    pub fn last_stop(&self) -> Option<Stop> {
        self.last_stop
    }

    /// Ends the emulation; returns the board's log, one message per line.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn take_log(&mut self) -> Result<String, String> {
        self.say_goodbye();
        let bytes = self.board.take_log().map_err(|error| error.to_string())?;
        log::read(&self.image, bytes)
    }

    /// Asks the board to call the node once.
    fn ask(&mut self, frame: Option<&CanFrame>, planning: bool) -> Result<Asked, PeerError> {
        self.board.send_request(&Request::Poll {
            now: self.twin.controller().now(),
            frame: frame.copied(),
        })?;
        Ok(Asked {
            received: frame.map(CanFrame::raw_id),
            planning,
        })
    }

    /// Waits for what the board has been asked, and records its cost.
    fn hear(&mut self, asked: &Asked) -> Result<(), PeerError> {
        if self.channel == Some(Channel::Uart) {
            return self.board.answer_line(&mut self.sent);
        }
        let measured = self.board.answer(&mut self.sent)?;
        if let Some(count) = &self.count {
            count.borrow_mut().polls.push(Poll {
                instructions: board::instructions(measured.number),
                phases: measured.phases.map(board::instructions),
                received: asked.received,
                planning: asked.planning,
            });
        }
        Ok(())
    }

    /// Sends the frame that resets the board, and follows it through its restart.
    fn reset(&mut self, frame: CanFrame) -> Result<(), PeerError> {
        self.sent.clear();
        match self.channel {
            Some(Channel::Uart) => self.board.send(&frame)?,
            _ => self.board.send_request(&Request::Poll {
                now: self.twin.controller().now(),
                frame: Some(frame),
            })?,
        }
        self.follow_restart().map(drop)
    }

    /// Calls the twin, and asks the board for the same; `None` if that has reset both.
    fn call(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
    ) -> Result<Option<Call>, PeerError> {
        let before = self.twin.controller().now();
        let planning = |twin: &Twin| twin.node().controller().is_planning();
        let was_planning = planning(&self.twin);
        self.twin.call(now, received);
        if let (Some(frame), true) = (received, self.twin.controller().is_new()) {
            self.catch_up(0)?;
            self.reset(*frame)?;
            return Ok(None);
        }
        let mut asked = Vec::new();
        let planning = was_planning || planning(&self.twin);
        match (self.channel, received) {
            // On the UART the board starts when the bus is opened, and its time follows the frames.
            (Some(Channel::Uart), None) => {}
            (Some(Channel::Uart), Some(frame)) => {
                self.board.send(frame)?;
                asked.push(Asked {
                    received: Some(frame.raw_id()),
                    planning,
                });
            }
            (_, received) => {
                // Like the twin when a frame has advanced the time.
                if received.is_some() && self.twin.controller().now() > before {
                    asked.push(self.ask(None, false)?);
                }
                asked.push(self.ask(received, planning)?);
            }
        }
        let due = self.twin.due().drain(..).collect();
        Ok(Some(Call { now, asked, due }))
    }

    /// Waits for the board until it is no more than this many calls behind, and compares its frames with the twin's.
    fn catch_up(&mut self, calls: usize) -> Result<(), PeerError> {
        while self.ahead.len() > calls
            && let Some(call) = self.ahead.pop_front()
        {
            for asked in &call.asked {
                self.hear(asked)?;
            }
            call.compare(&self.sent)?;
            self.sent.clear();
        }
        Ok(())
    }

    /// What the board reports at the end: bytes lost, and the most stack used.
    fn say_goodbye(&mut self) {
        // A run that has ended by an error leaves answers behind.
        let is_level = self.catch_up(0).is_ok();
        if self.channel.take() == Some(Channel::Uart)
            && let Ok(lost @ 1..) = self.board.close_bus()
        {
            say!("plant-sim: the controller in QEMU has lost {lost} bytes on its UART");
        }
        if let Some(count) = self.count.take()
            && is_level
            && let Ok(stack) = self.board.ask(&Request::Stack, &mut Vec::new())
        {
            count.borrow_mut().stack = stack.number;
        }
    }
}

impl Peer for Qemu {
    fn wake(&self) -> Option<Instant> {
        let twin = self.twin.controller();
        (twin.is_new() || self.channel == Some(Channel::Fifo)).then(|| twin.due())
    }

    fn poll(
        &mut self,
        now: Instant,
        received: Option<&CanFrame>,
        world: &mut World,
        out: &mut Outbox,
    ) -> Result<(), PeerError> {
        // A board reset over the UART has already sent its first frames; the twin has yet to be called for them.
        if let Some(call) = self.call(now, received)? {
            let sent = call.due.iter().map(|frame| (now + COMPUTE, *frame));
            out.extend(sent);
            self.ahead.push_back(call);
            if self.ahead.len() >= self.most_ahead {
                self.catch_up(self.most_ahead / 2)?;
            }
        }
        world.mind = self.twin.controller().mind();
        Ok(())
    }

    fn bus_off(&mut self, now: Instant) -> Result<Duration, PeerError> {
        // A serial-line adapter has no word for it.
        if self.channel != Some(Channel::Fifo) {
            return Ok(Duration::ZERO);
        }
        self.board.send_request(&Request::BusOff)?;
        Ok(self.twin.bus_off(now))
    }

    fn took(&mut self, time: Duration) -> Result<(), PeerError> {
        self.board.send_request(&Request::Took(time))?;
        self.twin.took(time);
        Ok(())
    }

    fn finish(&mut self) -> Result<(), PeerError> {
        self.catch_up(0)
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.say_goodbye();
    }
}

fn failure(what: impl Into<String>) -> PeerError {
    PeerError {
        who: "in QEMU".into(),
        what: what.into(),
    }
}

#[cfg(test)]
mod tests {
    use protocol::frame::StandardId;

    use super::*;

    fn frame(byte: u8) -> CanFrame {
        CanFrame::classical(StandardId::new(0x123).unwrap(), &[byte]).unwrap()
    }

    /// A board that is behind is told from its twin by the time of the call, not by that of the answer.
    #[test]
    fn every_frame_of_a_call_is_compared() {
        let call = Call {
            now: Instant::from_nanos(1_500_000),
            asked: Vec::new(),
            due: vec![frame(1), frame(2)],
        };
        call.compare(&[frame(1), frame(2)]).unwrap();
        for found in [
            &[frame(1), frame(3)][..],
            &[frame(1)],
            &[],
            &[frame(1), frame(2), frame(2)],
            &[frame(2), frame(1)],
        ] {
            let error = call.compare(found).unwrap_err();
            let starts = "differs from this process at 0.001500 s: ";
            assert!(error.what.starts_with(starts), "{found:?}: {error}");
        }
    }
}
