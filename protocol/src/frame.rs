//! CAN data and remote frames, classical and FD (ISO 11898-1:2015).
//!
//! `embedded-can` has no FD frame, hence a type of our own; identifiers are those of `embedded-can`. A frame that no
//! controller could send cannot be built: lengths are those of a data length code, only classical frames are remote,
//! only FD frames switch the bit rate.

use core::fmt;
use core::hint::black_box;

pub use embedded_can::{ExtendedId, Id, StandardId};

/// Most data bytes of a classical frame.
pub const CLASSICAL_MAX: usize = 8;
/// Most data bytes of an FD frame.
pub const FD_MAX: usize = 64;

/// Data bytes of an FD frame, by data length code. The first nine are those of a classical frame.
const FD_LENGTHS: [u8; 16] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 12, 16, 20, 24, 32, 48, 64];

/// Smallest length an FD frame can have that holds `len` bytes, or `None` above [`FD_MAX`].
#[must_use]
pub const fn fd_length(len: usize) -> Option<usize> {
    Some(match len {
        0..=8 => len,
        9..=12 => 12,
        13..=16 => 16,
        17..=20 => 20,
        21..=24 => 24,
        25..=32 => 32,
        33..=48 => 48,
        49..=64 => 64,
        _ => return None,
    })
}

/// Length in bytes of an FD frame with this data length code, or `None` above 15.
#[must_use]
pub fn fd_length_of_dlc(dlc: u8) -> Option<usize> {
    FD_LENGTHS
        .get(usize::from(dlc))
        .map(|&len| usize::from(len))
}

/// Frame format and the flags that exist in it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum FrameKind {
    /// Classical CAN, 0 to 8 data bytes.
    Classical {
        /// Remote transmission request: asks for data and carries none.
        remote: bool,
    },
    /// CAN FD, 0 to 64 data bytes.
    Fd {
        /// Bit rate switch: the data phase runs at the data bit rate.
        brs: bool,
        /// Error state indicator: the sender is error passive.
        esi: bool,
    },
}

/// One frame as on the bus, without the fields that a controller adds (CRC, stuffing, acknowledge).
#[derive(Clone, Copy, PartialEq, Eq, Hash)]
// This order aligns the data to words, so that they are copied by words.
#[repr(C)]
pub struct CanFrame {
    /// Zero past the end of the data, so that derived equality compares frames.
    buffer: [[u8; 4]; FD_MAX / 4],
    kind: FrameKind,
    /// Data bytes; in a remote frame, the number requested.
    len: u8,
    id: Id,
}

/// Zeros. The compiler is not to know: it would call a function to set 64 bytes, which takes six times as many instructions.
#[inline(always)]
fn blank() -> [[u8; 4]; FD_MAX / 4] {
    [black_box(0_u32).to_le_bytes(); FD_MAX / 4]
}

impl CanFrame {
    /// Classical data frame; `None` above 8 bytes.
    #[must_use]
    pub fn classical(id: impl Into<Id>, data: &[u8]) -> Option<Self> {
        if data.len() > CLASSICAL_MAX {
            return None;
        }
        Self::with_data(id.into(), FrameKind::Classical { remote: false }, data)
    }

    /// Classical remote frame asking for `len` bytes; `None` above 8.
    #[must_use]
    pub fn remote(id: impl Into<Id>, len: usize) -> Option<Self> {
        if len > CLASSICAL_MAX {
            return None;
        }
        Some(Self {
            id: id.into(),
            kind: FrameKind::Classical { remote: true },
            len: len as u8,
            buffer: blank(),
        })
    }

    /// FD frame of an error-active sender, padded with zeros to the next length an FD frame can have; `None` above
    /// 64 bytes.
    #[must_use]
    pub fn fd(id: impl Into<Id>, data: &[u8], brs: bool) -> Option<Self> {
        Self::with_data(id.into(), FrameKind::Fd { brs, esi: false }, data)
    }

    /// A frame with zeroed data for the encoder to fill in place, of an identifier and a length that are those of a row of the message table:
    /// it asserts that frames can have them.
    // No `Option`: the frame would be copied out of it, which takes longer than making it.
    #[inline(always)]
    pub(crate) fn zeroed(id: u16, is_fd: bool, len: usize) -> Self {
        let kind = if is_fd {
            FrameKind::Fd {
                brs: true,
                esi: false,
            }
        } else {
            FrameKind::Classical { remote: false }
        };
        Self {
            id: StandardId::new(id).unwrap_or(StandardId::MAX).into(),
            kind,
            len: len as u8,
            buffer: blank(),
        }
    }

    /// The data bytes of [`Self::zeroed`].
    #[inline(always)]
    pub(crate) fn data_mut(&mut self) -> &mut [u8] {
        self.buffer
            .as_flattened_mut()
            .get_mut(..usize::from(self.len))
            .unwrap_or_default()
    }

    /// The same frame with this error state indicator. A classical frame has none and is left unchanged.
    #[must_use]
    pub fn with_esi(mut self, passive: bool) -> Self {
        if let FrameKind::Fd { esi, .. } = &mut self.kind {
            *esi = passive;
        }
        self
    }

    fn with_data(id: Id, kind: FrameKind, data: &[u8]) -> Option<Self> {
        let len = fd_length(data.len())?;
        let mut buffer = blank();
        buffer
            .as_flattened_mut()
            .get_mut(..data.len())?
            .copy_from_slice(data);
        Some(Self {
            id,
            kind,
            len: len as u8,
            buffer,
        })
    }

    /// Copy of a frame of another driver's type; `None` if that reports a length above 8 bytes.
    #[must_use]
    pub fn from_embedded<F: embedded_can::Frame>(frame: &F) -> Option<Self> {
        if frame.is_remote_frame() {
            Self::remote(frame.id(), frame.dlc())
        } else {
            Self::classical(frame.id(), frame.data())
        }
    }

    /// The frame as another driver's type; `None` for an FD frame, which `embedded-can` cannot express.
    #[must_use]
    pub fn to_embedded<F: embedded_can::Frame>(&self) -> Option<F> {
        match self.kind {
            FrameKind::Classical { remote: false } => F::new(self.id, self.data()),
            FrameKind::Classical { remote: true } => F::new_remote(self.id, usize::from(self.len)),
            FrameKind::Fd { .. } => None,
        }
    }

    /// Identifier; its `Ord` is the order of arbitration.
    #[must_use]
    pub const fn id(&self) -> Id {
        self.id
    }

    /// Identifier as a number of 11 or 29 bits, see [`Self::is_extended`].
    #[must_use]
    pub fn raw_id(&self) -> u32 {
        match self.id {
            Id::Standard(id) => u32::from(id.as_raw()),
            Id::Extended(id) => id.as_raw(),
        }
    }

    /// Whether the identifier has 29 bits.
    #[must_use]
    pub const fn is_extended(&self) -> bool {
        matches!(self.id, Id::Extended(_))
    }

    /// Format and flags.
    #[must_use]
    pub const fn kind(&self) -> FrameKind {
        self.kind
    }

    /// Whether this is an FD frame.
    #[must_use]
    pub const fn is_fd(&self) -> bool {
        matches!(self.kind, FrameKind::Fd { .. })
    }

    /// Whether this is a remote frame.
    #[must_use]
    pub const fn is_remote(&self) -> bool {
        matches!(self.kind, FrameKind::Classical { remote: true })
    }

    /// Bit rate switch; false in a classical frame.
    #[must_use]
    pub const fn brs(&self) -> bool {
        matches!(self.kind, FrameKind::Fd { brs: true, .. })
    }

    /// Error state indicator; false in a classical frame.
    #[must_use]
    pub const fn esi(&self) -> bool {
        matches!(self.kind, FrameKind::Fd { esi: true, .. })
    }

    /// Data bytes, padding included; none in a remote frame.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        let len = if self.is_remote() { 0 } else { self.len };
        self.padded().get(..usize::from(len)).unwrap_or_default()
    }

    /// Data bytes, followed by zeros.
    #[must_use]
    pub const fn padded(&self) -> &[u8] {
        self.buffer.as_flattened()
    }

    /// Data length code, 0 to 15 (0 to 8 in a classical frame).
    #[must_use]
    pub const fn dlc(&self) -> u8 {
        match self.len {
            0..=8 => self.len,
            9..=12 => 9,
            13..=16 => 10,
            17..=20 => 11,
            21..=24 => 12,
            25..=32 => 13,
            33..=48 => 14,
            _ => 15,
        }
    }
}

/// As `candump -L` prints it: `240#0102`, `1C0##1FF` (FD, flags 1), `123#R8` (remote).
impl fmt::Display for CanFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.id {
            Id::Standard(id) => write!(f, "{:03X}#", id.as_raw())?,
            Id::Extended(id) => write!(f, "{:08X}#", id.as_raw())?,
        }
        match self.kind {
            FrameKind::Classical { remote: true } => return write!(f, "R{}", self.len),
            FrameKind::Classical { remote: false } => {}
            FrameKind::Fd { brs, esi } => write!(f, "#{}", u8::from(brs) | u8::from(esi) << 1)?,
        }
        self.data()
            .iter()
            .try_for_each(|byte| write!(f, "{byte:02X}"))
    }
}

impl fmt::Debug for CanFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        fmt::Display::fmt(self, f)
    }
}

#[cfg(feature = "defmt")]
impl defmt::Format for CanFrame {
    fn format(&self, f: defmt::Formatter<'_>) {
        defmt::write!(
            f,
            "{=u32:X}# {} {=[u8]:02X}",
            self.raw_id(),
            self.kind,
            self.data()
        );
    }
}
