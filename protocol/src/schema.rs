//! How a message is described, and the hash of all descriptions.

use crate::e2e::Profile;
use crate::messages::{Node, Server};
use crate::table::TABLE;

/// Type and meaning of the bytes of a signal. All are little-endian.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Unsigned, 8 bits.
    U8,
    /// Unsigned, 16 bits.
    U16,
    /// Unsigned, 32 bits.
    U32,
    /// Two's complement, 16 bits.
    I16,
    /// Two's complement, 32 bits.
    I32,
    /// IEEE 754 binary32, finite and within `min..=max`. The range tells sense from nonsense; the limits of the robot
    /// are narrower and belong to the controller.
    F32 {
        /// Least value.
        min: f32,
        /// Greatest value.
        max: f32,
    },
    /// One byte of this enumeration.
    Code(&'static [(u8, &'static str)]),
    /// One byte that selects which of the signals that follow are present (a DBC multiplexor).
    Selector(&'static [(u8, &'static str)]),
    /// One byte of named bits from bit 0 on; those without a name are zero.
    Flags8(&'static [&'static str]),
    /// Two bytes of named bits from bit 0 on; those without a name are zero.
    Flags16(&'static [&'static str]),
}

impl Kind {
    /// Length in bytes.
    #[must_use]
    pub const fn size(self) -> usize {
        match self {
            Self::U8 | Self::Code(_) | Self::Selector(_) | Self::Flags8(_) => 1,
            Self::U16 | Self::I16 | Self::Flags16(_) => 2,
            Self::U32 | Self::I32 | Self::F32 { .. } => 4,
        }
    }
}

/// One field of a message: a number, or several of one kind that follow each other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Name, that of the field.
    pub name: &'static str,
    /// First byte.
    pub offset: usize,
    /// Type and meaning.
    pub kind: Kind,
    /// Name and unit of each element; the name is empty if the signal is one number.
    pub elements: &'static [(&'static str, &'static str)],
    /// Present only while the selector has this value.
    pub when: Option<u8>,
}

impl Signal {
    /// First byte after the signal.
    #[must_use]
    pub const fn end(&self) -> usize {
        self.offset + self.elements.len() * self.kind.size()
    }
}

/// Which variant of [`Message`](crate::messages::Message) an identifier carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[expect(missing_docs, reason = "the variants are those of Message")]
pub enum Content {
    Nmt,
    EStop,
    Emergency(Node),
    Feedback,
    Command,
    Motion,
    State,
    MotionReply,
    ParameterReply(Server),
    ParameterRequest(Server),
    Heartbeat(Node),
}

/// When a message is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rate {
    /// Once a sampling period.
    EverySample,
    /// This often a second.
    Hertz(u8),
    /// When there is a reason.
    Event,
}

/// Everything that is fixed about a message.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MessageInfo {
    /// Name, unique.
    pub name: &'static str,
    /// 11-bit identifier.
    pub id: u16,
    /// Only sender, or `None` for any node.
    pub sender: Option<Node>,
    /// Only receiver, or `None` for all nodes.
    pub receiver: Option<Node>,
    /// When it is sent.
    pub rate: Rate,
    /// Length of the frame in bytes, padding and protection included.
    pub len: usize,
    /// Protection; its profile also says the frame format. Without protection a message is classical.
    pub protection: Option<Profile>,
    /// What the codec makes of it.
    pub content: Content,
    /// Fields, by offset.
    pub signals: &'static [Signal],
}

impl MessageInfo {
    /// Whether it is an FD frame.
    #[must_use]
    pub const fn is_fd(&self) -> bool {
        matches!(self.protection, Some(Profile::Fd))
    }

    /// Bytes before the protection: signals and padding.
    #[must_use]
    pub const fn body_len(&self) -> usize {
        match self.protection {
            Some(profile) => self.len - profile.overhead(),
            None => self.len,
        }
    }

    /// Message of this identifier, or `None`.
    #[must_use]
    pub fn of(id: u16) -> Option<&'static Self> {
        TABLE.iter().copied().find(|info| info.id == id)
    }
}

/// Hash of the whole message table, computed at compile time: two nodes of one hash agree on every identifier, length,
/// offset, type, range, unit and code.
pub const SCHEMA_HASH: u32 = schema_hash(&TABLE);

/// FNV-1a, 32 bits, of message descriptions. What does not change the meaning of bytes (documentation, Rust types) does
/// not enter.
#[must_use]
pub const fn schema_hash(mut messages: &[&MessageInfo]) -> u32 {
    let mut hash = Fnv1a::new();
    while let [info, rest @ ..] = messages {
        hash = hash.message(info);
        messages = rest;
    }
    hash.0
}

/// FNV-1a (Fowler, Noll, Vo). Texts end with 0xFF, which UTF-8 does not contain, and lists with 0xFE, so that no two
/// tables run into the same bytes.
struct Fnv1a(u32);

impl Fnv1a {
    const fn new() -> Self {
        Self(0x811C_9DC5)
    }

    const fn bytes(mut self, mut bytes: &[u8]) -> Self {
        while let [byte, rest @ ..] = bytes {
            self.0 = (self.0 ^ *byte as u32).wrapping_mul(0x0100_0193);
            bytes = rest;
        }
        self
    }

    const fn number(self, number: usize) -> Self {
        self.bytes(&(number as u32).to_le_bytes())
    }

    const fn text(self, text: &str) -> Self {
        self.bytes(text.as_bytes()).bytes(&[0xFF])
    }

    const fn message(self, info: &MessageInfo) -> Self {
        let rate = match info.rate {
            Rate::EverySample => [1, 0],
            Rate::Hertz(hertz) => [2, hertz],
            Rate::Event => [3, 0],
        };
        let protection = match info.protection {
            None => 0,
            Some(Profile::Classical) => 1,
            Some(Profile::Fd) => 2,
        };
        let mut hash = self
            .text(info.name)
            .number(info.id as usize)
            .node(info.sender)
            .node(info.receiver)
            .bytes(&rate)
            .number(info.len)
            .number(protection);
        let mut signals = info.signals;
        while let [signal, rest @ ..] = signals {
            hash = hash.signal(signal);
            signals = rest;
        }
        hash.bytes(&[0xFE])
    }

    const fn node(self, node: Option<Node>) -> Self {
        self.bytes(&[match node {
            Some(node) => node.code(),
            None => 0,
        }])
    }

    const fn signal(self, signal: &Signal) -> Self {
        let mut hash = self.text(signal.name).number(signal.offset);
        hash = match signal.when {
            Some(tag) => hash.bytes(&[1, tag]),
            None => hash.bytes(&[0]),
        };
        let mut elements = signal.elements;
        while let [(name, unit), rest @ ..] = elements {
            hash = hash.text(name).text(unit);
            elements = rest;
        }
        hash.bytes(&[0xFE]).kind(signal.kind)
    }

    const fn kind(self, kind: Kind) -> Self {
        match kind {
            Kind::U8 => self.text("u8"),
            Kind::U16 => self.text("u16"),
            Kind::U32 => self.text("u32"),
            Kind::I16 => self.text("i16"),
            Kind::I32 => self.text("i32"),
            Kind::F32 { min, max } => self
                .text("f32")
                .number(min.to_bits() as usize)
                .number(max.to_bits() as usize),
            Kind::Code(codes) => self.text("code").codes(codes),
            Kind::Selector(codes) => self.text("selector").codes(codes),
            Kind::Flags8(names) => self.text("flags8").names(names),
            Kind::Flags16(names) => self.text("flags16").names(names),
        }
    }

    const fn codes(self, mut codes: &[(u8, &str)]) -> Self {
        let mut hash = self;
        while let [(code, name), rest @ ..] = codes {
            hash = hash.bytes(&[*code]).text(name);
            codes = rest;
        }
        hash.bytes(&[0xFE])
    }

    const fn names(self, mut names: &[&str]) -> Self {
        let mut hash = self;
        while let [name, rest @ ..] = names {
            hash = hash.text(name);
            names = rest;
        }
        hash.bytes(&[0xFE])
    }
}

#[cfg(test)]
mod tests {
    use super::Fnv1a;

    /// Test vectors of the algorithm's authors.
    #[test]
    fn fnv1a_is_the_published_one() {
        for (text, hash) in [
            ("", 0x811C_9DC5),
            ("a", 0xE40C_292C),
            ("foobar", 0xBF9C_F968),
        ] {
            assert_eq!(Fnv1a::new().bytes(text.as_bytes()).0, hash);
        }
    }
}
