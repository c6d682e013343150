//! Description of a message.

use crate::e2e::Profile;
use crate::frame::CanFrame;
use crate::messages::{Node, Server};

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
    /// IEEE 754 binary32, finite and within `min..=max`. The range only excludes nonsense; the limits of the
    /// robot are narrower and belong to the controller.
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
    /// One byte of named bits, from bit 0 up; bits without a name are zero.
    Flags8(&'static [&'static str]),
    /// Two bytes of named bits, from bit 0 up; bits without a name are zero.
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

/// One field of a message: a number, or several consecutive ones of the same kind.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Signal {
    /// Name of the struct's field.
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
    /// Once per sampling period.
    EverySample,
    /// This many times per second.
    Hertz(u8),
    /// On an event.
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
    /// The message that it carries.
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

    /// Whether a frame carries this message, judged by its identifier alone.
    #[must_use]
    pub fn identifies(&self, frame: &CanFrame) -> bool {
        !frame.is_extended() && frame.raw_id() == u32::from(self.id)
    }

    /// A frame of this message with about half of the possible stuff bits: alternating bits need none, equal ones
    /// the most.
    #[must_use]
    pub fn specimen(&self) -> CanFrame {
        let mut frame = CanFrame::zeroed(self.id, self.is_fd(), self.len);
        frame.data_mut().fill(0x0F);
        frame
    }

    /// Bytes before the protection: signals and padding.
    #[must_use]
    pub const fn body_len(&self) -> usize {
        match self.protection {
            Some(profile) => self.len - profile.overhead(),
            None => self.len,
        }
    }
}
