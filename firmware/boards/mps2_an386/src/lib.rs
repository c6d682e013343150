//! What the emulated board and the host that emulates it tell each other, compiled by both of its ends.
//!
//! Two FIFOs, standard input and output of the emulator, which the board opens through Arm semihosting. At every start the
//! board says how it ended before ([`greeting`]), the host what the controller is to know and how frames travel
//! ([`Setup`]), and the board answers once it is ready ([`Reply`]). Then
//!
//! - [`Channel::Fifo`]: the host asks ([`Request`]) and waits for the answer ([`Reply`]) for ever after, and ends the
//!   conversation by closing its end. This is the path for long comparisons: a round trip takes microseconds.
//! - [`Channel::Uart`]: frames travel as slcan lines over UART 0, as they would on silicon. An empty line acknowledges a
//!   frame, after the frames that answer it. `O` opens the bus; `C` closes it, and the board's last [`Reply`] says how
//!   many bytes its receiver has lost.
//!
//! Every record from the host has a fixed length. Numbers are little-endian, frames in records are in the layout of
//! Linux's `struct canfd_frame`.

#![cfg_attr(not(test), no_std)]
#![forbid(unsafe_code)]
#![cfg_attr(
    not(test),
    deny(
        clippy::unwrap_used,
        clippy::expect_used,
        clippy::panic,
        clippy::indexing_slicing
    )
)]

pub mod ring;

use core::ffi::CStr;

use firmware::controller::Config;
use firmware::phase::Phase;
use firmware::reset::Stop;
use protocol::bus::TransmitError;
use protocol::frame::{CanFrame, ExtendedId, FrameKind, Id, StandardId};
use protocol::messages::ResetReason;
use serde::{Deserialize, Serialize};

/// FIFO that the host writes and the board reads. Both can be opened again after a reset.
pub const TO_BOARD: &CStr = c"/dev/stdin";
/// FIFO that the board writes and the host reads.
pub const FROM_BOARD: &CStr = c"/dev/stdout";

/// Bytes of the setup record; more than any setup takes, the rest is zero.
pub const SETUP_LEN: usize = 768;
/// Bytes of a frame: identifier and flags (4), length (1), FD flags (1), reserved (2), data (64).
pub const FRAME_LEN: usize = 72;
/// Bytes of a request: kind (1), time (8), frame.
pub const REQUEST_LEN: usize = 9 + FRAME_LEN;
/// Bytes of a reply before its frames: their number (4), a measured number (4), and one for each phase (4).
pub const REPLY_HEADER: usize = 8 + 4 * PHASES;
/// Bytes of a greeting: where a reply has its number of frames, a number that none has; then, after a header's length,
/// reason of the start (1), pins (2), reserved (1), address (4), status (4).
pub const GREETING_LEN: usize = REPLY_HEADER + 12;
/// Frames that one poll may send: one control sample sends a handful, its reply queue at most eight more.
pub const REPLY_FRAMES: usize = 16;

/// Phases of a call of the node.
const PHASES: usize = Phase::ALL.len();

const EXTENDED: u32 = 1 << 31;
const REMOTE: u32 = 1 << 30;
const BRS: u8 = 1;
const ESI: u8 = 2;
const FDF: u8 = 4;

/// How frames travel between host and board.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Channel {
    /// In records over the FIFOs.
    #[default]
    Fifo,
    /// As slcan over UART 0.
    Uart,
}

/// What the host tells the board before anything else.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Setup {
    /// How frames travel.
    pub channel: Channel,
    /// What the controller is to know.
    pub config: Config,
}

impl Setup {
    /// The record, or `None` if it does not fit.
    #[must_use]
    pub fn to_bytes(&self) -> Option<[u8; SETUP_LEN]> {
        let mut bytes = [0; SETUP_LEN];
        postcard::to_slice(self, &mut bytes).ok()?;
        Some(bytes)
    }

    /// The setup in a record, or `None` if there is none.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; SETUP_LEN]) -> Option<Self> {
        postcard::from_bytes(bytes).ok()
    }

    /// Sampling period, ns, for a clock that counts samples: both ends have the same one.
    #[must_use]
    pub fn period_ns(&self) -> u64 {
        u64::from((self.config.period * 1e9 + 0.5) as u32)
    }
}

/// What the host asks for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Call the node. The answer holds what it sent, and the timer ticks that it took.
    Poll {
        /// Time, µs.
        now: u64,
        /// The frame that has come, if any.
        frame: Option<CanFrame>,
    },
    /// Report the most stack used so far: an answer without frames, with bytes instead of ticks.
    Stack,
    /// Fail. There is no answer but the greeting of the next start.
    Plant(Fault),
}

/// A fault that the image made for it plants into itself.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// An instruction that does not exist.
    HardFault,
    /// A function that calls itself for ever.
    StackOverflow,
    /// The same in an interrupt.
    OverflowInInterrupt,
    /// A panic.
    Panic,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 4] = [
        Self::HardFault,
        Self::StackOverflow,
        Self::OverflowInInterrupt,
        Self::Panic,
    ];

    /// Name, lower case with hyphens.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::HardFault => "hard-fault",
            Self::StackOverflow => "stack-overflow",
            Self::OverflowInInterrupt => "overflow-in-interrupt",
            Self::Panic => "panic",
        }
    }
}

/// First byte of a request.
const POLL: u8 = 0;
const POLL_WITH_FRAME: u8 = 1;
const STACK: u8 = 2;
const PLANT: u8 = 3;

impl Request {
    /// The record.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; REQUEST_LEN] {
        let mut bytes = [0; REQUEST_LEN];
        match self {
            Self::Poll { now, frame: None } => {
                put(&mut bytes, 0, &[POLL]);
                put(&mut bytes, 1, &now.to_le_bytes());
            }
            Self::Poll {
                now,
                frame: Some(frame),
            } => {
                put(&mut bytes, 0, &[POLL_WITH_FRAME]);
                put(&mut bytes, 1, &now.to_le_bytes());
                put(&mut bytes, 9, &frame_to_bytes(frame));
            }
            Self::Stack => put(&mut bytes, 0, &[STACK]),
            Self::Plant(fault) => put(&mut bytes, 0, &[PLANT, *fault as u8]),
        }
        bytes
    }

    /// The request in a record, or `None` if it holds none.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; REQUEST_LEN]) -> Option<Self> {
        let (&kind, rest) = bytes.split_first()?;
        let (now, record) = rest.split_first_chunk()?;
        let now = u64::from_le_bytes(*now);
        match kind {
            POLL => Some(Self::Poll { now, frame: None }),
            POLL_WITH_FRAME => {
                let frame = Some(frame_from_bytes(record.first_chunk()?)?);
                Some(Self::Poll { now, frame })
            }
            STACK => Some(Self::Stack),
            PLANT => {
                let (&fault, _) = rest.split_first()?;
                let fault = Fault::ALL.get(usize::from(fault))?;
                Some(Self::Plant(*fault))
            }
            _ => None,
        }
    }
}

/// What a request has measured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Measured {
    /// Timer ticks of a call of the node, or the number that was asked for.
    pub number: u32,
    /// Timer ticks of each phase of the call; zeros from an image that does not tell them apart.
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

/// What the node sent in one call, as a record that grows.
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
    /// No frame.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            bytes: [0; REPLY_HEADER + REPLY_FRAMES * FRAME_LEN],
            frames: 0,
        }
    }

    /// Forgets all frames.
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

    /// The record, with what the request has measured.
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

/// Number of frames and what has been measured, in the header of a reply.
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

/// Number of frames that no reply has.
const GREETING: u32 = u32::MAX;

/// What the board says at every start: how it ended before.
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

/// Whether what follows this header is the rest of a greeting, and not a reply.
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

/// A frame as `struct canfd_frame`.
#[must_use]
pub fn frame_to_bytes(frame: &CanFrame) -> [u8; FRAME_LEN] {
    let mut bytes = [0; FRAME_LEN];
    write_frame(frame, &mut bytes);
    bytes
}

/// Writes a frame as `struct canfd_frame`; bytes beyond its data stay as they were.
fn write_frame(frame: &CanFrame, record: &mut [u8; FRAME_LEN]) {
    let (remote, flags) = match frame.kind() {
        FrameKind::Classical { remote } => (remote, 0),
        FrameKind::Fd { brs, esi } => (false, FDF | (u8::from(brs) * BRS) | (u8::from(esi) * ESI)),
    };
    let id =
        frame.raw_id() | (u32::from(frame.is_extended()) * EXTENDED) | (u32::from(remote) * REMOTE);
    let data = frame.data();
    let len = if remote {
        usize::from(frame.dlc())
    } else {
        data.len()
    };
    let [a, b, c, d] = id.to_le_bytes();
    let (header, rest) = record.split_at_mut(8);
    header.copy_from_slice(&[a, b, c, d, len as u8, flags, 0, 0]);
    if let Some(place) = rest.get_mut(..data.len()) {
        place.copy_from_slice(data);
    }
}

/// The frame in a `struct canfd_frame`, or `None` if no controller could have sent it.
#[must_use]
pub fn frame_from_bytes(bytes: &[u8; FRAME_LEN]) -> Option<CanFrame> {
    let (&[a, b, c, d, len, flags, _, _], data) = bytes.split_first_chunk::<8>()?;
    let word = u32::from_le_bytes([a, b, c, d]);
    let raw = word & !(EXTENDED | REMOTE);
    let id = if word & EXTENDED != 0 {
        Id::Extended(ExtendedId::new(raw)?)
    } else {
        Id::Standard(StandardId::new(u16::try_from(raw).ok()?)?)
    };
    let len = usize::from(len);
    if word & REMOTE != 0 {
        return CanFrame::remote(id, len);
    }
    let data = data.get(..len)?;
    if flags & FDF == 0 {
        return CanFrame::classical(id, data);
    }
    CanFrame::fd(id, data, flags & BRS != 0).map(|frame| frame.with_esi(flags & ESI != 0))
}

/// Writes `part` at `at`; what does not fit is left out.
fn put(bytes: &mut [u8], at: usize, part: &[u8]) {
    for (place, byte) in bytes.iter_mut().skip(at).zip(part) {
        *place = *byte;
    }
}

#[cfg(test)]
mod tests {
    use firmware::arm::IRB_930;
    use proptest::prelude::*;

    use super::*;

    fn any_frame() -> impl Strategy<Value = CanFrame> {
        let id = prop_oneof![
            (0..=StandardId::MAX.as_raw())
                .prop_filter_map("11 bits", StandardId::new)
                .prop_map(Id::Standard),
            (0..=ExtendedId::MAX.as_raw())
                .prop_filter_map("29 bits", ExtendedId::new)
                .prop_map(Id::Extended),
        ];
        let data = proptest::collection::vec(any::<u8>(), 0..=64);
        (id, data, any::<(bool, bool)>(), 0..3).prop_filter_map(
            "too long",
            |(id, data, (brs, esi), kind)| match kind {
                0 => CanFrame::classical(id, &data[..data.len().min(8)]),
                1 => CanFrame::remote(id, data.len() % 9),
                _ => CanFrame::fd(id, &data, brs).map(|frame| frame.with_esi(esi)),
            },
        )
    }

    proptest! {
        #[test]
        fn every_frame_comes_back(frame in any_frame()) {
            prop_assert_eq!(frame_from_bytes(&frame_to_bytes(&frame)), Some(frame));
        }

        #[test]
        fn every_request_comes_back(now: u64, frame in proptest::option::of(any_frame())) {
            let request = Request::Poll { now, frame };
            prop_assert_eq!(Request::from_bytes(&request.to_bytes()), Some(request));
        }

        #[test]
        fn any_record_is_a_frame_or_none(bytes in proptest::array::uniform32(any::<u8>())) {
            let mut record = [0; FRAME_LEN];
            record[..32].copy_from_slice(&bytes);
            if let Some(frame) = frame_from_bytes(&record) {
                prop_assert_eq!(frame_from_bytes(&frame_to_bytes(&frame)), Some(frame));
            }
        }
    }

    /// Layout of `struct canfd_frame` in linux/can.h, written out by hand.
    #[test]
    fn frames_have_the_layout_of_linux() {
        let id = ExtendedId::new(0x18FF_1234).unwrap();
        let bytes = frame_to_bytes(&CanFrame::fd(id, &[1, 2, 3], true).unwrap());
        assert_eq!(
            bytes[..12],
            [0x34, 0x12, 0xFF, 0x98, 3, 5, 0, 0, 1, 2, 3, 0]
        );
    }

    #[test]
    fn the_configuration_comes_back_to_the_bit() {
        let mut config = Config::new(IRB_930, 1e-3);
        let channel = Channel::Uart;
        assert_eq!(Setup { channel, config }.period_ns(), 1_000_000);
        config.command_delay = 2.345e-4;
        config.arm.geometry.a2 = f32::from_bits(0x3EFA_E148);
        for channel in [Channel::Fifo, Channel::Uart] {
            let setup = Setup { channel, config };
            assert_eq!(Setup::from_bytes(&setup.to_bytes().unwrap()), Some(setup));
        }
    }

    #[test]
    fn every_planted_fault_comes_back() {
        for fault in Fault::ALL {
            let request = Request::Plant(fault);
            assert_eq!(Request::from_bytes(&request.to_bytes()), Some(request));
        }
        let mut bytes = Request::Plant(Fault::Panic).to_bytes();
        bytes[1] += 1;
        assert_eq!(Request::from_bytes(&bytes), None);
    }

    #[test]
    fn a_greeting_comes_back_and_is_no_reply() {
        let stop = Stop {
            reason: ResetReason::HardFault,
            pins: [7, 8],
            at: 0x0102_0304,
            status: 0x8000_0010,
        };
        let bytes = greeting(&stop);
        let (header, rest) = bytes.split_first_chunk().unwrap();
        assert!(is_greeting(header));
        assert_eq!(greeted(rest.first_chunk().unwrap()), Some(stop));
        assert!(!is_greeting(
            Reply::new().finish(&u32::MAX.into()).first_chunk().unwrap()
        ));
    }

    #[test]
    fn a_full_reply_refuses_one_more() {
        let frame = CanFrame::classical(StandardId::ZERO, &[7]).unwrap();
        let mut reply = Reply::new();
        for _ in 0..REPLY_FRAMES {
            reply.push(&frame).unwrap();
        }
        assert_eq!(reply.push(&frame), Err(TransmitError::QueueFull));
        let mut measured = Measured::from(9);
        measured.phases = [(); PHASES].map(|()| {
            measured.number += 1;
            measured.number
        });
        let bytes = reply.finish(&measured);
        assert_eq!(bytes.len(), REPLY_HEADER + REPLY_FRAMES * FRAME_LEN);
        assert_eq!(
            reply_header(bytes.first_chunk().unwrap()),
            (REPLY_FRAMES as u32, measured)
        );
    }
}
