//! Message to frame and back.
//!
//! postcard reads malleable input: trailing bytes, overlong integers, NaN. Decoding therefore checks more, in this
//! order: identifier, format and length; CRC; postcard; padding zero and re-encoding equal to the input, so that each
//! message has exactly one frame; every float finite and within its range. A frame that fails
//! anywhere yields an error and nothing else. The counter is judged outside, by [`Receiver`](crate::e2e::Receiver),
//! because only the caller knows what was received before.
//!
//! The two messages of every sample bypass postcard: they are packed without padding, so that every readable body has
//! one form anyway.

mod encoder;

use core::fmt;

use serde::{Serialize, de::DeserializeOwned};

use crate::frame::{CanFrame, FD_MAX};
use crate::messages::{Command, EStop, EStopReason, Feedback, Message};
use crate::packed::Packed;
use crate::schema::{Content, Kind, MessageInfo};
use crate::table;

pub use encoder::Encoder;

/// A received message, with its end-to-end counter if it carries one.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Received {
    /// Message.
    pub message: Message,
    /// Counter for [`Receiver::check`](crate::e2e::Receiver::check).
    pub counter: Option<u8>,
}

/// A float that must be neither sent nor used.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ValueError {
    /// Infinite or not a number.
    NotFinite {
        /// Signal.
        signal: &'static str,
        /// Element of it; empty if it is one number.
        element: &'static str,
    },
    /// Out of the signal's range.
    OutOfRange {
        /// Signal.
        signal: &'static str,
        /// Element of it; empty if it is one number.
        element: &'static str,
        /// Value.
        value: f32,
        /// Least value allowed.
        min: f32,
        /// Greatest value allowed.
        max: f32,
    },
}

/// Why encoding failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum EncodeError {
    /// A value that the receiver would refuse.
    Value(ValueError),
    /// Struct and table disagree on the length: a defect of this crate.
    TooLong,
}

/// Why decoding failed.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum DecodeError {
    /// No message has this identifier; no message has a 29-bit one.
    UnknownId,
    /// Remote frame, or FD instead of classical or the reverse.
    WrongKind,
    /// Not the message's length.
    WrongLength {
        /// Bytes in the frame.
        found: usize,
        /// Bytes of the message.
        expected: usize,
    },
    /// The end-to-end CRC does not match content and identifier.
    Crc,
    /// A code or bit without meaning.
    Malformed,
    /// Padding or an encoding that is not canonical.
    NotCanonical,
    /// Not a finite number, or out of range.
    Value(ValueError),
}

/// Frame of a message. `counter` counts the frames of the identifier, wrapping at 256; it is reduced to the width that
/// the frame has room for, and ignored where there is none.
///
/// # Errors
/// A float is not finite or out of its range: what every receiver would refuse must not be sent.
pub fn encode(message: &Message, counter: u8) -> Result<CanFrame, EncodeError> {
    encode_with(message, counter, |frame| *frame)
}

/// Like [`encode`], for a sender that only needs to look at the frame: returning it would copy it, which takes longer
/// than making it.
///
/// # Errors
/// Those of [`encode`]; `look` is not called then.
pub fn encode_with<T>(
    message: &Message,
    counter: u8,
    look: impl FnOnce(&CanFrame) -> T,
) -> Result<T, EncodeError> {
    // That of every sample by itself, so that the compiler can work out what the table says of it.
    if matches!(message, Message::Command(_)) {
        encode_as(&table::COMMAND, message, counter, look)
    } else {
        encode_as(info_of(message), message, counter, look)
    }
}

#[inline(always)]
fn encode_as<T>(
    info: &MessageInfo,
    message: &Message,
    counter: u8,
    look: impl FnOnce(&CanFrame) -> T,
) -> Result<T, EncodeError> {
    let mut frame = CanFrame::zeroed(info.id, info.is_fd(), info.len);
    let data = frame.data_mut();
    let body = data
        .get_mut(..info.body_len())
        .ok_or(EncodeError::TooLong)?;
    write(message, body).ok_or(EncodeError::TooLong)?;
    check_values(info, body).map_err(EncodeError::Value)?;
    if let Some(profile) = info.protection {
        profile.protect(info.id, counter, data);
    }
    Ok(look(&frame))
}

/// Message of a frame. Bit rate switch and error state indicator belong to the link and do not matter.
///
/// # Errors
/// The frame is not one that [`encode`] makes; [`DecodeError`] names the first check it fails.
// Out of line: inside a caller's loop, the compiler would set it up even without a frame.
#[inline(never)]
pub fn decode(frame: &CanFrame) -> Result<Received, DecodeError> {
    // As in encoding.
    if table::FEEDBACK.identifies(frame) {
        decode_as(&table::FEEDBACK, frame)
    } else {
        decode_other(frame)
    }
}

// Out of line: most frames are feedback.
#[inline(never)]
fn decode_other(frame: &CanFrame) -> Result<Received, DecodeError> {
    let info = table::of_frame(frame).ok_or(DecodeError::UnknownId)?;
    decode_as(info, frame)
}

#[inline(always)]
fn decode_as(info: &MessageInfo, frame: &CanFrame) -> Result<Received, DecodeError> {
    if frame.is_remote() || frame.is_fd() != info.is_fd() {
        return Err(DecodeError::WrongKind);
    }
    let data = frame.data();
    if info.content == Content::EStop && data.is_empty() {
        let estop = EStop {
            reason: EStopReason::UNSPECIFIED,
            counter: 0,
        };
        return Ok(Received {
            message: Message::EStop(estop),
            counter: None,
        });
    }
    if data.len() != info.len {
        return Err(DecodeError::WrongLength {
            found: data.len(),
            expected: info.len,
        });
    }
    let (body, counter) = match info.protection {
        None => (data, None),
        Some(profile) => {
            let (body, counter) = profile.check(info.id, data).ok_or(DecodeError::Crc)?;
            if counter > profile.counter_max() {
                return Err(DecodeError::NotCanonical);
            }
            (body, Some(counter))
        }
    };
    if info.content == Content::Feedback && has_range::<_, Feedback>(body) {
        // That of every sample straight to its place.
        let message = Message::Feedback(unpack(body)?);
        return Ok(Received { message, counter });
    }
    read(info, body, counter)
}

/// The row of the table for this message.
#[must_use]
pub const fn info_of(message: &Message) -> &'static MessageInfo {
    match message {
        Message::Nmt(_) => &table::NMT,
        Message::EStop(_) => &table::ESTOP,
        Message::Emergency(node, _) => table::emergency(*node),
        Message::Feedback(_) => &table::FEEDBACK,
        Message::Command(_) => &table::COMMAND,
        Message::Motion(_) => &table::MOTION,
        Message::State(_) => &table::STATE,
        Message::MotionReply(_) => &table::MOTION_REPLY,
        Message::ParameterReply(server, _) => table::parameter_reply(*server),
        Message::ParameterRequest(server, _) => table::parameter_request(*server),
        Message::Heartbeat(node, _) => table::heartbeat(*node),
    }
}

// Out of line: reading writes as well, and would carry a copy of it.
#[inline(never)]
fn put<T: Serialize>(value: &T, body: &mut [u8]) -> Option<()> {
    postcard::to_slice(value, body).ok().map(|_| ())
}

/// Writes the message to the beginning of `body`; `None` if it does not fit.
#[inline(always)]
fn write(message: &Message, body: &mut [u8]) -> Option<()> {
    fn pack<const LEN: usize, T: Packed<LEN>>(value: &T, body: &mut [u8]) -> Option<()> {
        value.pack(body.first_chunk_mut()?)
    }
    match message {
        Message::Nmt(nmt) => put(nmt, body),
        Message::EStop(estop) => put(estop, body),
        Message::Emergency(_, emergency) => put(emergency, body),
        Message::Feedback(feedback) => pack(feedback, body),
        Message::Command(command) => pack(command, body),
        Message::Motion(motion) => put(motion, body),
        Message::State(state) => put(state, body),
        Message::MotionReply(reply) => put(reply, body),
        Message::ParameterReply(_, reply) => put(reply, body),
        Message::ParameterRequest(_, request) => put(request, body),
        Message::Heartbeat(_, heartbeat) => put(heartbeat, body),
    }
}

/// The one message that is written as `body`.
// Out of line: most frames are feedback.
#[inline(never)]
fn read(info: &MessageInfo, body: &[u8], counter: Option<u8>) -> Result<Received, DecodeError> {
    let message = match info.content {
        Content::Nmt => Message::Nmt(take(body)?),
        Content::EStop => Message::EStop(take(body)?),
        Content::Emergency(node) => Message::Emergency(node, take(body)?),
        Content::Feedback => Message::Feedback(unpack(body)?),
        Content::Command => Message::Command(unpack(body)?),
        Content::Motion => Message::Motion(take(body)?),
        Content::State => Message::State(take(body)?),
        Content::MotionReply => Message::MotionReply(take(body)?),
        Content::ParameterReply(server) => Message::ParameterReply(server, take(body)?),
        Content::ParameterRequest(server) => Message::ParameterRequest(server, take(body)?),
        Content::Heartbeat(node) => Message::Heartbeat(node, take(body)?),
    };
    check_values(info, body).map_err(DecodeError::Value)?;
    Ok(Received { message, counter })
}

#[inline(always)]
fn unpack<const LEN: usize, T: Packed<LEN>>(body: &[u8]) -> Result<T, DecodeError> {
    let body = body.try_into().map_err(|_| DecodeError::Malformed)?;
    T::unpack(body).ok_or(DecodeError::Malformed)
}

// Out of line, so that the messages of every sample do not carry its buffer.
#[inline(never)]
fn take<T: Serialize + DeserializeOwned>(body: &[u8]) -> Result<T, DecodeError> {
    let (message, _) = postcard::take_from_bytes(body).map_err(|_| DecodeError::Malformed)?;
    // Postcard's output followed by zeros is the one body this message has.
    let mut canonical = [0; FD_MAX];
    put(&message, &mut canonical).ok_or(DecodeError::Malformed)?;
    if !canonical.starts_with(body) {
        return Err(DecodeError::NotCanonical);
    }
    Ok(message)
}

/// Whether the floats of a packed message are in their range.
fn has_range<const LEN: usize, T: Packed<LEN>>(body: &[u8]) -> bool {
    body.try_into().is_ok_and(T::in_range)
}

/// Applies the table's ranges to the bytes: the sender before sending, the receiver before use.
fn check_values(info: &MessageInfo, body: &[u8]) -> Result<(), ValueError> {
    // For the messages of every sample, the table is only needed to name what is wrong.
    if info.content == Content::Command && has_range::<_, Command>(body) {
        return Ok(());
    }
    check_by_table(info, body)
}

// Out of line: rarely reached in a sample.
#[inline(never)]
fn check_by_table(info: &MessageInfo, body: &[u8]) -> Result<(), ValueError> {
    let mut selected = None;
    for signal in info.signals {
        if signal.when.is_some() && signal.when != selected {
            continue;
        }
        let field = body.get(signal.offset..).unwrap_or_default();
        match signal.kind {
            Kind::Selector(_) => selected = field.first().copied(),
            Kind::F32 { min, max } => {
                for (bytes, &(element, _)) in field.as_chunks().0.iter().zip(signal.elements) {
                    let value = f32::from_le_bytes(*bytes);
                    // The range is finite, so it contains no infinity and no NaN.
                    if !(min..=max).contains(&value) {
                        return Err(out_of_range(signal.name, element, value, min, max));
                    }
                }
            }
            _ => {}
        }
    }
    Ok(())
}

#[cold]
fn out_of_range(
    signal: &'static str,
    element: &'static str,
    value: f32,
    min: f32,
    max: f32,
) -> ValueError {
    if value.is_finite() {
        ValueError::OutOfRange {
            signal,
            element,
            value,
            min,
            max,
        }
    } else {
        ValueError::NotFinite { signal, element }
    }
}

impl fmt::Display for ValueError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NotFinite { signal, element } => write!(f, "{signal} {element} is not finite"),
            Self::OutOfRange {
                signal,
                element,
                value,
                min,
                max,
            } => {
                write!(f, "{signal} {element} is {value}; allowed: {min} to {max}")
            }
        }
    }
}

impl fmt::Display for EncodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Value(value) => value.fmt(f),
            Self::TooLong => f.write_str("message is longer than its table entry"),
        }
    }
}

impl fmt::Display for DecodeError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::UnknownId => f.write_str("unknown identifier"),
            Self::WrongKind => f.write_str("wrong frame format"),
            Self::WrongLength { found, expected } => {
                write!(f, "{found} bytes, expected {expected}")
            }
            Self::Crc => f.write_str("end-to-end CRC is wrong"),
            Self::Malformed => f.write_str("code or bit without meaning"),
            Self::NotCanonical => f.write_str("non-canonical padding or encoding"),
            Self::Value(value) => value.fmt(f),
        }
    }
}

impl core::error::Error for ValueError {}
impl core::error::Error for EncodeError {}
impl core::error::Error for DecodeError {}
