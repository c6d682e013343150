//! Output of the board: a greeting at its start, then a reply to every request.

use firmware::cabinet::reset::Stop;
use firmware::control::phase::Phase;
use protocol::bus::TransmitError;
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;

use crate::frames::{FRAME_LEN, write_frame};
use crate::put;

/// Bytes of a reply before its frames: their number (4), a measured number (4), and one per phase (4).
pub const REPLY_HEADER: usize = 8 + 4 * PHASES;
/// Bytes of a greeting: an impossible number in place of a reply's number of frames; then, after a header's length,
/// reason of the start (1), pins (2), reserved (1), address (4), status (4).
pub const GREETING_LEN: usize = REPLY_HEADER + 12;
/// Frames that one poll may send: one control sample sends a handful, its reply queue at most eight more.
pub const REPLY_FRAMES: usize = 16;

/// Phases of a call of the node.
const PHASES: usize = Phase::ALL.len();

/// Measurements of a request.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measured {
    /// Timer ticks of a call of the node, or the number requested.
    pub number: u32,
    /// Timer ticks of each phase of the call; zeros from an image that does not measure phases.
    pub phases: [u32; PHASES],
}

impl From<u32> for Measured {
    fn from(number: u32) -> Self {
        Self {
            number,
            phases: [0; PHASES],
        }
    }
}

/// Nothing measured.
impl From<()> for Measured {
    fn from((): ()) -> Self {
        Self::default()
    }
}

/// Frames that the node sent in one call, as a growing record.
#[derive(Clone, Debug)]
pub struct Reply {
    bytes: [u8; REPLY_HEADER + REPLY_FRAMES * FRAME_LEN],
    frames: usize,
}

impl Default for Reply {
    fn default() -> Self {
        Self::new()
    }
}

impl Reply {
    /// A reply without frames.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [0; REPLY_HEADER + REPLY_FRAMES * FRAME_LEN],
            frames: 0,
        }
    }

    /// Removes all frames.
    pub fn clear(&mut self) {
        self.frames = 0;
    }

    /// Appends a frame.
    ///
    /// # Errors
    /// [`TransmitError::QueueFull`] after [`REPLY_FRAMES`] frames.
    pub fn push(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        let at = REPLY_HEADER + self.frames * FRAME_LEN;
        let record = self
            .bytes
            .get_mut(at..)
            .and_then(<[u8]>::first_chunk_mut::<FRAME_LEN>)
            .ok_or(TransmitError::QueueFull)?;
        write_frame(frame, record);
        self.frames += 1;
        Ok(())
    }

    /// The record, with the measurements of the request.
    pub fn finish(&mut self, measured: &Measured) -> &[u8] {
        let numbers = [self.frames as u32, measured.number];
        let words = numbers.iter().chain(&measured.phases);
        for (place, word) in self.bytes.as_chunks_mut().0.iter_mut().zip(words) {
            *place = word.to_le_bytes();
        }
        self.bytes
            .get(..REPLY_HEADER + self.frames * FRAME_LEN)
            .unwrap_or_default()
    }
}

/// Number of frames and the measurements in the header of a reply.
#[must_use]
pub fn reply_header(header: &[u8; REPLY_HEADER]) -> (u32, Measured) {
    let mut words = header
        .as_chunks()
        .0
        .iter()
        .map(|word| u32::from_le_bytes(*word));
    let mut next = || words.next().unwrap_or_default();
    let frames = next();
    let number = next();
    let phases = [(); PHASES].map(|()| next());
    (frames, Measured { number, phases })
}

/// Impossible number of frames, marking a greeting.
const GREETING: u32 = u32::MAX;

/// Greeting of the board at every start: how it ended before.
#[must_use]
pub fn greeting(last: &Stop) -> [u8; GREETING_LEN] {
    let mut bytes = [0; GREETING_LEN];
    put(&mut bytes, 0, &GREETING.to_le_bytes());
    put(&mut bytes, REPLY_HEADER, &[last.reason.code()]);
    put(&mut bytes, REPLY_HEADER + 1, &last.pins);
    put(&mut bytes, REPLY_HEADER + 4, &last.at.to_le_bytes());
    put(&mut bytes, REPLY_HEADER + 8, &last.status.to_le_bytes());
    bytes
}

/// Whether this is the header of a greeting instead of a reply.
#[must_use]
pub fn is_greeting(header: &[u8; REPLY_HEADER]) -> bool {
    reply_header(header).0 == GREETING
}

/// The stop in the rest of a greeting, or `None` if there is none.
#[must_use]
pub fn greeted(rest: &[u8; GREETING_LEN - REPLY_HEADER]) -> Option<Stop> {
    let [reason, found, left, _, a, b, c, d, e, f, g, h] = *rest;
    Some(Stop {
        reason: ResetReason::try_from(reason).ok()?,
        pins: [found, left],
        at: u32::from_le_bytes([a, b, c, d]),
        status: u32::from_le_bytes([e, f, g, h]),
    })
}
