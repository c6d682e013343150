//! The controller as an image on an emulated Cortex-M4F, in lock-step, compared with its twin byte for byte.

mod board;
mod image;
mod log;
mod serial;
mod supervise;

use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;

pub use channel::Channel;
use channel::{Fault, Request, Setup};
use firmware::cabinet::reset::Stop;
use firmware::control::controller::Config;
use firmware::control::phase::Phase;
pub use image::image;
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;
use protocol::time::Instant;

use crate::external::peers;
use crate::say;
use crate::twin::Twin;
use board::Board;
use sim::controller::COMPUTE;
use sim::peer::{Outbox, Peer, PeerError};
use sim::world::Mind;
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
}

/// Cost of a run on the board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Costs {
    /// Every call of the node.
    pub polls: Vec<Poll>,
    /// Most stack used, bytes.
    pub stack: u32,
}

/// Cost of one call of the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Poll {
    /// Instructions from frame in to frames out.
    pub instructions: u32,
    /// Instructions of each phase; zeros from an image that does not measure phases.
    pub phases: [u32; Phase::ALL.len()],
    /// Identifier of the frame received, if any.
    pub received: Option<u32>,
    /// Whether a move was being planned.
    pub planning: bool,
}

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
        let image = std::fs::read(&self.image).map_err(|error| error.to_string())?;
        log::decode(&image, &bytes)
    }

    /// Calls the node on the board once and records the cost.
    fn ask(&mut self, frame: Option<&CanFrame>, planning: bool) -> Result<(), PeerError> {
        let request = Request::Poll {
            now: self.twin.controller().now(),
            frame: frame.copied(),
        };
        let measured = self.board.ask(&request, &mut self.sent)?;
        if let Some(count) = &self.count {
            count.borrow_mut().polls.push(Poll {
                instructions: board::instructions(measured.number),
                phases: measured.phases.map(board::instructions),
                received: frame.map(CanFrame::raw_id),
                planning,
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

    /// Calls board and twin alike; the board's frames are in `sent`.
    fn call(&mut self, now: Instant, received: Option<&CanFrame>) -> Result<(), PeerError> {
        let before = self.twin.controller().now();
        let planning = |twin: &Twin| twin.node().controller().is_planning();
        let was_planning = planning(&self.twin);
        self.twin.call(now, received);
        if let (Some(frame), true) = (received, self.twin.controller().is_new()) {
            return self.reset(*frame);
        }
        match (self.channel, received) {
            // On the UART the board starts when the bus is opened, and its time follows the frames.
            (Some(Channel::Uart), None) => {}
            (Some(Channel::Uart), Some(frame)) => self.board.exchange(frame, &mut self.sent)?,
            (_, received) => {
                // Like the twin when a frame has advanced the time.
                if received.is_some() && self.twin.controller().now() > before {
                    self.ask(None, false)?;
                }
                self.ask(received, was_planning || planning(&self.twin))?;
            }
        }
        Ok(())
    }

    /// Compares the board's frames with the twin's.
    fn compare(&mut self, now: Instant) -> Result<(), PeerError> {
        let differs = |difference: Difference| {
            failure(format!(
                "differs from this process at {:.6} s: {difference}",
                now.seconds()
            ))
        };
        for frame in &self.sent {
            self.twin.compare(frame).map_err(differs)?;
        }
        let missing = self.twin.due().front();
        Difference::between(missing, None).map_or(Ok(()), |missing| Err(differs(missing)))
    }

    /// What the board reports at the end: bytes lost, and the most stack used.
    fn say_goodbye(&mut self) {
        if self.channel.take() == Some(Channel::Uart)
            && let Ok(lost @ 1..) = self.board.close_bus()
        {
            say!("plant-sim: the controller in QEMU has lost {lost} bytes on its UART");
        }
        if let Some(count) = self.count.take()
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
        self.call(now, received)?;
        // A board reset over the UART has already sent its first frames; the twin has yet to be called for them.
        if !self.twin.controller().is_new() {
            self.compare(now)?;
            out.extend(self.sent.drain(..).map(|frame| (now + COMPUTE, frame)));
        }
        world.mind = Mind::of(self.twin.node());
        Ok(())
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
