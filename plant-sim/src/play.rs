//! Plays a trace onto a bus, at the times of its records or at a multiple of their speed.
//!
//! Deadlines are absolute, so a late frame does not delay the next. All interfaces of a trace go onto the same bus.

use std::time::{Duration, Instant};

use link::{Link, LinkError};
use protocol::bus::{Transmit as _, TransmitError};
use protocol::frame::CanFrame;

use trace::{Entry, Record};

/// Interval of attempts while the transmit queue is full: a few frames of a fast bus.
const RETRY: Duration = Duration::from_micros(500);
/// Time with a full transmit queue after which nobody seems to take frames any more.
const STUCK: Duration = Duration::from_secs(2);
/// Time to stay on the bus after the last frame, for a late refusal by a serial-line adapter.
const LINGER: Duration = Duration::from_millis(100);
/// Most received frames to discard at once: a flooded bus must not keep the player from its own frames.
const BATCH: usize = 1024;

/// Why playing ended early.
#[derive(Debug, thiserror::Error)]
pub enum PlayError {
    /// The bus takes no frames.
    #[error(
        "the transmit queue has been full for {} s: does another node acknowledge the frames, or read them?",
        STUCK.as_secs()
    )]
    Stuck,
    /// The node is off the bus.
    #[error("the node is off the bus")]
    Offline,
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
}

/// When the frames of a trace are due.
#[derive(Clone, Copy, Debug)]
pub struct Pace {
    speed: f64,
    /// Longest step of time that is played.
    longest: Duration,
    /// Latest time of a record so far, us.
    newest_us: Option<u64>,
    /// Played time up to then, before division by the speed.
    recorded: Duration,
}

impl Pace {
    /// `speed` times as fast as recorded; 0 without pauses. Steps of time longer than `skip` are skipped.
    #[must_use]
    pub fn new(speed: f64, skip: Option<Duration>) -> Self {
        Self {
            speed,
            longest: skip.unwrap_or(Duration::MAX),
            newest_us: None,
            recorded: Duration::ZERO,
        }
    }

    /// Time after the first frame at which the one of this record is due: never before an earlier one, even if the
    /// clock of the trace was set back.
    pub fn due(&mut self, time_us: u64) -> Duration {
        let newest_us = *self.newest_us.get_or_insert(time_us);
        let step = Duration::from_micros(time_us.saturating_sub(newest_us));
        self.newest_us = Some(newest_us.max(time_us));
        if step <= self.longest {
            self.recorded += step;
        }
        if self.speed > 0.0 {
            let played = Duration::try_from_secs_f64(self.recorded.as_secs_f64() / self.speed);
            played.unwrap_or(Duration::MAX)
        } else {
            Duration::ZERO
        }
    }
}

/// Counts of a played trace.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Played {
    /// Frames that the bus accepted.
    pub frames: u64,
    /// Frames that had to wait for room in the transmit queue.
    pub waited: u64,
    /// Error frames: reports of a receiver, which cannot be sent.
    pub left_out: u64,
    /// Frames that a serial-line adapter refused, or that a client lost because it did not read.
    pub lost: u64,
}

/// Plays records one by one.
#[derive(Debug)]
pub struct Player {
    link: Link,
    pace: Pace,
    start: Option<Instant>,
    played: Played,
}

impl Player {
    /// A player onto `link` at this pace.
    #[must_use]
    pub fn new(link: Link, pace: Pace) -> Self {
        Self {
            link,
            pace,
            start: None,
            played: Played::default(),
        }
    }

    /// Waits until a client joins a bus that this process serves. Other buses exist already.
    ///
    /// # Errors
    /// The link failed.
    pub fn wait_for_client(&mut self) -> Result<(), PlayError> {
        while matches!(&self.link, Link::SlcanHub(hub) if !hub.is_open()) {
            self.idle(LINGER)?;
        }
        Ok(())
    }

    /// Time that the record of this time still has to wait.
    #[must_use]
    pub fn wait(&self, time_us: u64) -> Duration {
        let now = self.start.map_or(Duration::ZERO, |start| start.elapsed());
        // A copy: only playing the record advances the pace.
        let mut pace = self.pace;
        pace.due(time_us).saturating_sub(now)
    }

    /// Sends the frame of the next record when it is due.
    ///
    /// # Errors
    /// The bus does not accept it; see [`PlayError`].
    pub fn record(&mut self, record: &Record) -> Result<(), PlayError> {
        let due = self.pace.due(record.time_us);
        let Entry::Frame(frame) = &record.entry else {
            self.played.left_out += 1;
            return Ok(());
        };
        let start = *self.start.get_or_insert_with(Instant::now);
        self.idle(due.saturating_sub(start.elapsed()))?;
        self.send(frame)?;
        self.played.frames += 1;
        Ok(())
    }

    /// Waits until the last frames are sent.
    ///
    /// # Errors
    /// The bus does not accept them; see [`PlayError`].
    pub fn finish(mut self) -> Result<Played, PlayError> {
        let mut left = (self.link.unsent(), Instant::now());
        while left.0 > 0 {
            self.idle(RETRY)?;
            let now = self.link.unsent();
            if now < left.0 {
                left = (now, Instant::now());
            } else if left.1.elapsed() > STUCK {
                return Err(PlayError::Stuck);
            }
        }
        self.idle(LINGER)?;
        self.played.lost = match &self.link {
            Link::SocketCan(_) => 0,
            Link::Slcan(port) => port.refused(),
            Link::SlcanHub(hub) => hub.lost(),
        };
        Ok(self.played)
    }

    fn send(&mut self, frame: &CanFrame) -> Result<(), PlayError> {
        let mut full: Option<Instant> = None;
        loop {
            match self.link.transmit(frame) {
                Ok(()) => break,
                Err(TransmitError::QueueFull) => {
                    if full.get_or_insert_with(Instant::now).elapsed() > STUCK {
                        return Err(PlayError::Stuck);
                    }
                    self.idle(RETRY)?;
                }
                Err(TransmitError::Offline) => {
                    // Waiting on the link returns the reason, if there is one.
                    self.link.wait(Duration::ZERO)?;
                    return Err(PlayError::Offline);
                }
            }
        }
        self.played.waited += u64::from(full.is_some());
        Ok(())
    }

    /// Lets time pass, and discards received frames so that the socket does not fill.
    fn idle(&mut self, time: Duration) -> Result<(), PlayError> {
        let begun = Instant::now();
        loop {
            let left = time.saturating_sub(begun.elapsed());
            self.link.wait(left)?;
            for _ in 0..BATCH {
                if self.link.take().is_none() {
                    break;
                }
            }
            if begun.elapsed() >= time {
                return Ok(());
            }
        }
    }
}
