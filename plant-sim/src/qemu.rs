//! The controller as an image on an emulated Cortex-M4F, in lock-step, and held against its twin to the byte.

mod board;
mod difference;
mod image;
mod log;
mod serial;

use std::cell::RefCell;
use std::path::PathBuf;
use std::rc::Rc;

pub use channel::Channel;
use channel::{Fault, Measured, Request, Setup};
use firmware::cabinet::reset::Stop;
use firmware::cabinet::sample_clock::SampleClock;
use firmware::control::controller::Config;
use firmware::control::phase::Phase;
use firmware::node::Node;
pub use image::build;
use protocol::frame::CanFrame;

use board::Board;
use sim::endpoint::{Endpoint, EndpointError, InProcess};

/// What the emulation is asked for.
#[derive(Clone, Debug, Default)]
pub struct Options {
    /// The image; `None` builds [`IMAGE`] from the sources.
    pub image: Option<PathBuf>,
    /// How frames travel between the rig and the board.
    pub channel: Channel,
    /// Count instructions: the emulated clock then moves by instructions and by nothing else. Slower, and
    /// over the FIFOs only.
    pub count: Option<Rc<RefCell<Costs>>>,
}

/// What a run has cost the board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Costs {
    /// Every call of the node.
    pub polls: Vec<Poll>,
    /// Most stack used, bytes.
    pub stack: u32,
}

/// What one call of the node has cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Poll {
    /// Instructions from frame in to frames out.
    pub instructions: u32,
    /// Instructions of each phase, zeros from an image that does not tell them apart.
    pub phases: [u32; Phase::ALL.len()],
    /// Identifier of the frame that came, if any.
    pub received: Option<u32>,
    /// Whether a move was being planned.
    pub planning: bool,
}

/// The image that goes into runs, and the one that can plant faults into itself.
pub const IMAGE: &str = "mps2-an386";
/// See [`IMAGE`].
pub const FAULTS_IMAGE: &str = "mps2-an386-faults";
/// The image that measures the phases of a call.
pub const COST_IMAGE: &str = "mps2-an386-cost";

/// The controller in QEMU with its twin in this process.
#[derive(Debug)]
pub struct Qemu {
    image: PathBuf,
    twin: InProcess,
    expected: Vec<CanFrame>,
    board: Board,
    /// Time on the UART: that of the drives' samples, since slcan carries no other.
    clock: Option<SampleClock>,
    period_ns: u64,
    /// How the board ended when it last started again.
    last_stop: Option<Stop>,
    count: Option<Rc<RefCell<Costs>>>,
}

impl Qemu {
    /// Starts the emulator with the image and tells the board its configuration.
    ///
    /// # Errors
    /// The image cannot be built, the emulator is missing or does not answer; each with what to do about it.
    pub fn start(config: Config, options: &Options) -> Result<Self, EndpointError> {
        let image = match &options.image {
            Some(image) => image.clone(),
            None => build(IMAGE)?,
        };
        let setup = Setup {
            channel: options.channel,
            config,
        };
        Ok(Self {
            twin: InProcess::new(config),
            expected: Vec::new(),
            board: Board::start(&image, &setup, options.count.is_some())?,
            image,
            period_ns: setup.period_ns(),
            last_stop: None,
            clock: (setup.channel == Channel::Uart).then(|| SampleClock::new(setup.period_ns())),
            count: options.count.clone(),
        })
    }

    /// Has the image plant this fault into itself; only [`FAULTS_IMAGE`] does. Follows the board through its start, and
    /// starts the twin for the same reason.
    ///
    /// # Errors
    /// The board does not start again.
    pub fn plant(&mut self, fault: Fault) -> Result<(), EndpointError> {
        self.board.tell(&Request::Plant(fault))?;
        let stop = self.board.restart()?;
        self.last_stop = Some(stop);
        self.twin.restart(stop.reason);
        Ok(())
    }

    /// How the board ended when it last started again in this run.
    pub fn last_stop(&self) -> Option<Stop> {
        self.last_stop
    }

    /// Ends the emulation; returns what the board has logged, one message a line.
    ///
    /// # Errors
    /// The log cannot be read.
    pub fn take_log(&mut self) -> Result<String, String> {
        self.say_goodbye();
        let bytes = self.board.take_log().map_err(|error| error.to_string())?;
        let image = std::fs::read(&self.image).map_err(|error| error.to_string())?;
        log::decode(&image, &bytes)
    }

    /// Hands over the frame that resets the board, and follows it through its start.
    fn reset(&mut self, now: u64, frame: Option<CanFrame>) -> Result<(), EndpointError> {
        match (&mut self.clock, frame) {
            (Some(clock), Some(frame)) => {
                self.board.send(&frame)?;
                *clock = SampleClock::new(self.period_ns);
            }
            _ => self.board.tell(&Request::Poll { now, frame })?,
        }
        self.last_stop = Some(self.board.restart()?);
        Ok(())
    }

    /// What the board can tell only at the very end: bytes lost, and the stack when the deepest path has been taken.
    fn say_goodbye(&mut self) {
        if self.clock.take().is_some()
            && let Ok(lost @ 1..) = self.board.close_bus()
        {
            eprintln!("plant-sim: the controller in QEMU has lost {lost} bytes on its UART");
        }
        if let Some(count) = self.count.take()
            && let Ok(stack) = self.board.ask(&Request::Stack, &mut Vec::new())
        {
            count.borrow_mut().stack = stack.number;
        }
    }
}

impl Endpoint for Qemu {
    fn poll(
        &mut self,
        now: u64,
        received: Option<&CanFrame>,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        let first = sent.len();
        let mut now = now;
        let frame = received.copied();
        match (&mut self.clock, received) {
            (None, _) => {}
            (Some(clock), Some(frame)) => {
                clock.observe(frame);
                now = clock.now();
            }
            // Without a frame there is nothing that the UART could tell the board.
            (Some(_), None) => return Ok(()),
        }
        let planning = self.twin.node().controller().is_planning();
        self.expected.clear();
        self.twin.poll(now, received, &mut self.expected)?;
        if self.twin.node().reset_asked() {
            return self.reset(now, frame);
        }
        let measured = match received {
            Some(frame) if self.clock.is_some() => {
                self.board.exchange(frame, sent)?;
                Measured::default()
            }
            _ => self.board.ask(&Request::Poll { now, frame }, sent)?,
        };
        if let Some(what) = difference::first(&self.expected, &sent[first..], now) {
            return Err(failure(what));
        }
        if let Some(count) = &self.count {
            count.borrow_mut().polls.push(Poll {
                instructions: board::instructions(measured.number),
                phases: measured.phases.map(board::instructions),
                received: received.map(CanFrame::raw_id),
                planning: planning || self.twin.node().controller().is_planning(),
            });
        }
        Ok(())
    }

    fn node(&self) -> &Node {
        self.twin.node()
    }
}

impl Drop for Qemu {
    fn drop(&mut self) {
        self.say_goodbye();
    }
}

fn failure(what: impl Into<String>) -> EndpointError {
    EndpointError {
        who: "in QEMU".into(),
        what: what.into(),
    }
}
