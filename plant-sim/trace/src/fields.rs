//! Frames decoded by the message table: every field with name, unit and value.

use std::fmt;

use protocol::codec::{self, DecodeError};
use protocol::frame::{CanFrame, FD_MAX};
use protocol::schema::{Kind, MessageInfo, Signal};
use protocol::table;

/// A frame that passed every check of the protocol.
#[derive(Clone, Copy, Debug)]
pub struct Decoded {
    /// Entry of the message table.
    pub info: &'static MessageInfo,
    /// End-to-end counter, if the message carries one.
    pub counter: Option<u8>,
    body: [u8; FD_MAX],
    len: usize,
}

impl Decoded {
    /// Decodes a frame.
    ///
    /// # Errors
    /// The frame does not decode, or is not canonical.
    pub fn new(frame: &CanFrame) -> Result<Self, DecodeError> {
        let counter = codec::decode(frame)?.counter;
        let info = table::of_frame(frame).ok_or(DecodeError::UnknownId)?;
        let mut body = [0; FD_MAX];
        // An emergency stop may be empty: then it has no field.
        let len = info.body_len().min(frame.data().len());
        body[..len].copy_from_slice(&frame.data()[..len]);
        Ok(Self {
            info,
            counter,
            body,
            len,
        })
    }

    /// The bytes before the protection.
    pub(crate) fn body(&self) -> &[u8] {
        &self.body[..self.len]
    }

    /// The fields that are present, in the order of the table.
    pub fn fields(&self) -> impl Iterator<Item = Field<'_>> {
        let mut selected = None;
        let body = self.body();
        self.info.signals.iter().filter_map(move |signal| {
            if signal.when.is_some() && signal.when != selected {
                return None;
            }
            let bytes = body.get(signal.offset..signal.end())?;
            if let Kind::Selector(_) = signal.kind {
                selected = bytes.first().copied();
            }
            Some(Field { signal, bytes })
        })
    }
}

/// One signal of a frame: a number, or one per axis or coordinate.
#[derive(Clone, Copy, Debug)]
pub struct Field<'a> {
    /// Its description.
    pub signal: &'static Signal,
    bytes: &'a [u8],
}

impl<'a> Field<'a> {
    /// Name of the element (empty if the signal is one number), unit and value of each.
    pub fn elements(self) -> impl Iterator<Item = (&'static str, &'static str, Value)> + use<'a> {
        let kind = self.signal.kind;
        self.signal
            .elements
            .iter()
            .zip(self.bytes.chunks_exact(kind.size()))
            .map(move |(&(element, unit), bytes)| (element, unit, Value::new(kind, bytes)))
    }
}

/// Value of one element.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Unsigned number.
    Unsigned(u32),
    /// Signed number.
    Signed(i32),
    /// Real number.
    Float(f32),
    /// Name of an enumeration's byte.
    Code(&'static str),
    /// Bits, and their names from bit 0 on.
    Flags(u32, &'static [&'static str]),
}

impl Value {
    /// Value of the first of the little-endian `bytes`, as many as the kind takes.
    pub(crate) fn new(kind: Kind, bytes: &[u8]) -> Self {
        let raw = match (kind.size(), bytes) {
            (1, &[a, ..]) => u32::from(a),
            (2, &[a, b, ..]) => u32::from(u16::from_le_bytes([a, b])),
            (_, &[a, b, c, d, ..]) => u32::from_le_bytes([a, b, c, d]),
            _ => 0,
        };
        match kind {
            Kind::U8 | Kind::U16 | Kind::U32 => Self::Unsigned(raw),
            Kind::I16 => Self::Signed(i32::from(raw as i16)),
            Kind::I32 => Self::Signed(raw as i32),
            Kind::F32 { .. } => Self::Float(f32::from_bits(raw)),
            Kind::Code(codes) | Kind::Selector(codes) => Self::Code(
                codes
                    .iter()
                    .find(|(code, _)| u32::from(*code) == raw)
                    .map_or("?", |(_, name)| name),
            ),
            Kind::Flags8(names) | Kind::Flags16(names) => Self::Flags(raw, names),
        }
    }

    /// Names of the bits that are set; none unless the value is a set of flags.
    pub fn flags(self) -> impl Iterator<Item = &'static str> {
        let (bits, names) = match self {
            Self::Flags(bits, names) => (bits, names),
            _ => (0, [].as_slice()),
        };
        names
            .iter()
            .enumerate()
            .filter(move |(bit, _)| bits >> bit & 1 == 1)
            .map(|(_, &name)| name)
    }
}

/// Numbers with enough digits to distinguish them from their neighbours; flags as `ready|torque-on`, none as `-`.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unsigned(value) => value.fmt(f),
            Self::Signed(value) => value.fmt(f),
            Self::Float(value) => value.fmt(f),
            Self::Code(name) => f.write_str(name),
            Self::Flags(..) => {
                let mut names = self.flags();
                f.write_str(names.next().unwrap_or("-"))?;
                names.try_for_each(|name| write!(f, "|{name}"))
            }
        }
    }
}

/// Name of an element among all elements of its message, as the DBC has it too: `position_elbow`.
#[must_use]
pub fn full_name(signal: &str, element: &str) -> String {
    if element.is_empty() {
        signal.to_owned()
    } else {
        format!("{signal}_{element}")
    }
}
