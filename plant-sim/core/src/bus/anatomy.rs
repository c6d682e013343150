//! The bits of a frame, one by one, to say where in it an error is. Only frames with errors are taken apart like this.

use std::ops::Range;

use protocol::frame::{CanFrame, FrameKind, Id};
use protocol::wire::FrameBits;

/// Bits after the CRC delimiter: acknowledge slot and delimiter, end of frame.
const TRAILER: [Field; 9] = {
    let mut fields = [Field::EndOfFrame; 9];
    fields[0] = Field::AckSlot;
    fields[1] = Field::AckDelimiter;
    fields
};
/// Bits of the intermission, which [`FrameBits`] include.
const INTERMISSION: u32 = 3;

/// Part of a frame, by its code in SocketCAN (`CAN_ERR_PROT_LOC_*` of `linux/can/error.h`).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Field {
    /// Identifier, first eight bits.
    Id28To21 = 0x02,
    /// Start of frame.
    StartOfFrame = 0x03,
    /// RTR of a standard frame, SRR of an extended one.
    Rtr = 0x04,
    /// Identifier extension bit.
    Ide = 0x05,
    /// Identifier, the rest of a standard one.
    Id20To18 = 0x06,
    /// Identifier extension.
    Id17To13 = 0x07,
    /// CRC, in an FD frame with its stuff count.
    Crc = 0x08,
    /// Reserved bit; in an FD frame also BRS and ESI, which have no code.
    Reserved0 = 0x09,
    /// Data.
    Data = 0x0A,
    /// Length code.
    Length = 0x0B,
    /// RTR of an extended frame.
    ExtendedRtr = 0x0C,
    /// The first reserved bit of an extended frame, FDF of an FD frame.
    Reserved1 = 0x0D,
    /// Identifier extension, its end.
    Id4To0 = 0x0E,
    /// Identifier extension, its middle.
    Id12To5 = 0x0F,
    /// CRC delimiter.
    CrcDelimiter = 0x18,
    /// Acknowledge slot.
    AckSlot = 0x19,
    /// End of frame.
    EndOfFrame = 0x1A,
    /// Acknowledge delimiter.
    AckDelimiter = 0x1B,
}

impl Field {
    /// Whether a node that reads another bit than its own may just have lost arbitration.
    pub(super) fn is_arbitration(self) -> bool {
        use Field::{ExtendedRtr, Id4To0, Id12To5, Id17To13, Id20To18, Id28To21, Ide, Rtr};
        self == Self::StartOfFrame
            || [Id28To21, Id20To18, Id17To13, Id12To5, Id4To0].contains(&self)
            || [Rtr, Ide, ExtendedRtr].contains(&self)
    }
}

/// A bit of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Bit {
    /// Where it is.
    pub(super) field: Field,
    /// Whether it was inserted for its length alone, and not for its value. Those of the CRC are not told apart.
    pub(super) is_stuff: bool,
    /// Whether it is recessive; unknown in the CRC.
    pub(super) recessive: Option<bool>,
}

impl Bit {
    /// Whether an error in it leaves the transmit error counter alone: a recessive stuff bit before RTR that is read dominant
    /// (exception 2 of rule c).
    #[must_use]
    pub(super) fn is_excepted(self) -> bool {
        let in_identifier = self.field.is_arbitration() && self.field != Field::ExtendedRtr;
        self.is_stuff && self.recessive == Some(true) && in_identifier
    }
}

/// A frame, bit by bit, from its start to its end.
#[derive(Clone, Debug)]
pub(super) struct Anatomy {
    /// All of them.
    pub(super) bits: Vec<Bit>,
    /// Those that are sent at the data bit rate.
    fast: Range<usize>,
}

impl Anatomy {
    /// Takes a frame apart.
    #[must_use]
    pub(super) fn of(frame: &CanFrame) -> Self {
        let FrameBits { nominal, data } = FrameBits::exact(frame);
        let total = (nominal + data - INTERMISSION) as usize;
        let mut stuffed = Stuffed {
            bits: Vec::with_capacity(total),
            ..Stuffed::default()
        };
        stuffed.push(Field::StartOfFrame, 0, 1);
        let remote = u64::from(frame.is_remote());
        let is_fd = frame.is_fd();
        match frame.id() {
            Id::Standard(id) => {
                let id = u64::from(id.as_raw());
                stuffed.push(Field::Id28To21, id >> 3, 8);
                stuffed.push(Field::Id20To18, id, 3);
                stuffed.push(Field::Rtr, remote, 1);
                stuffed.push(Field::Ide, 0, 1);
            }
            Id::Extended(id) => {
                let id = u64::from(id.as_raw());
                stuffed.push(Field::Id28To21, id >> 21, 8);
                stuffed.push(Field::Id20To18, id >> 18, 3);
                stuffed.push(Field::Rtr, 1, 1);
                stuffed.push(Field::Ide, 1, 1);
                stuffed.push(Field::Id17To13, id >> 13, 5);
                stuffed.push(Field::Id12To5, id >> 5, 8);
                stuffed.push(Field::Id4To0, id, 5);
                stuffed.push(Field::ExtendedRtr, remote, 1);
                if !is_fd {
                    stuffed.push(Field::Reserved1, 0, 1);
                }
            }
        }
        let mut fast = false;
        if let FrameKind::Fd { brs, esi } = frame.kind() {
            stuffed.push(Field::Reserved1, 1, 1);
            stuffed.push(Field::Reserved0, 0, 1);
            stuffed.push(Field::Reserved0, u64::from(brs), 1);
            stuffed.push(Field::Reserved0, u64::from(esi), 1);
            fast = brs;
        } else {
            stuffed.push(Field::Reserved0, 0, 1);
        }
        stuffed.push(Field::Length, u64::from(frame.dlc()), 4);
        for &byte in frame.data() {
            stuffed.push(Field::Data, u64::from(byte), 8);
        }

        // What is left is known by its length alone.
        let mut bits = stuffed.bits;
        let delimiter = total - TRAILER.len() - 1;
        let plain = |field, recessive| Bit {
            field,
            is_stuff: false,
            recessive,
        };
        bits.resize(delimiter, plain(Field::Crc, None));
        bits.push(plain(Field::CrcDelimiter, Some(true)));
        bits.extend(TRAILER.map(|field| plain(field, Some(field != Field::AckSlot))));
        let fast = if fast {
            delimiter + 1 - data as usize..delimiter + 1
        } else {
            0..0
        };
        Self { bits, fast }
    }

    /// Length of the frame up to this bit and with it.
    #[must_use]
    pub(super) fn until(&self, index: usize) -> FrameBits {
        let Range { start, end } = self.fast;
        let fast = (index + 1).clamp(start, end) - start;
        FrameBits {
            nominal: (index + 1 - fast) as u32,
            data: fast as u32,
        }
    }

    /// Length of the frame before each bit.
    pub(super) fn starts(&self) -> impl Iterator<Item = FrameBits> {
        let mut before = FrameBits {
            nominal: 0,
            data: 0,
        };
        (0..self.bits.len()).map(move |bit| {
            let start = before;
            let fast = self.fast.contains(&bit);
            before.nominal += u32::from(!fast);
            before.data += u32::from(fast);
            start
        })
    }

    /// The first bit of a field.
    #[must_use]
    pub(super) fn first(&self, field: Field) -> usize {
        let first = self.bits.iter().position(|bit| bit.field == field);
        first.unwrap_or(self.bits.len() - 1)
    }

    /// Bits in which the transmitter can read another one than it sends: from the end of arbitration to the CRC.
    pub(super) fn written(&self) -> impl Iterator<Item = usize> {
        let end = self.first(Field::CrcDelimiter);
        (0..end).filter(|&index| !self.bits[index].field.is_arbitration())
    }

    /// Bits that are there for their length: an error in one of them is six equal bits in a row. In a frame without them, those
    /// that a sixth equal one can be.
    #[must_use]
    pub(super) fn stuffing(&self) -> Vec<usize> {
        let end = self.first(Field::CrcDelimiter);
        let stuff: Vec<_> = (0..end).filter(|&bit| self.bits[bit].is_stuff).collect();
        if stuff.is_empty() {
            (5..self.first(Field::Crc)).collect()
        } else {
            stuff
        }
    }

    /// Bits of fixed form. The last one is left out: receivers have accepted the frame by then.
    pub(super) fn fixed(&self) -> impl Iterator<Item = usize> {
        let delimiter = self.first(Field::CrcDelimiter);
        let ack = self.first(Field::AckSlot);
        (delimiter..self.bits.len() - 1).filter(move |&index| index != ack)
    }
}

/// Bits with the stuff bits between them.
#[derive(Default)]
struct Stuffed {
    bits: Vec<Bit>,
    /// How many of the last bits are equal.
    run: u32,
    last: Option<bool>,
}

impl Stuffed {
    /// Sends the low `count` bits, highest first. A stuff bit belongs to the field of the bit before it.
    fn push(&mut self, field: Field, value: u64, count: u32) {
        for shift in (0..count).rev() {
            if let (5, Some(last)) = (self.run, self.last) {
                let before = self.bits.last().map_or(field, |bit| bit.field);
                self.send(before, !last, true);
            }
            self.send(field, value >> shift & 1 == 1, false);
        }
    }

    fn send(&mut self, field: Field, recessive: bool, is_stuff: bool) {
        self.run = if self.last == Some(recessive) {
            self.run + 1
        } else {
            1
        };
        self.last = Some(recessive);
        self.bits.push(Bit {
            field,
            is_stuff,
            recessive: Some(recessive),
        });
    }
}

#[cfg(test)]
mod tests {
    use protocol::frame::StandardId;

    use super::*;

    fn standard(raw: u16) -> Id {
        Id::Standard(StandardId::new(raw).unwrap())
    }

    /// Written out by hand: 0x240 is 010 0100 0000, with a stuff bit after five of its last six zeros.
    #[test]
    fn a_frame_by_hand() {
        let frame = CanFrame::fd(standard(0x240), &[0xA5], true).unwrap();
        let anatomy = Anatomy::of(&frame);
        let text: String = anatomy.bits[..27]
            .iter()
            .map(|bit| match (bit.recessive, bit.is_stuff) {
                (Some(true), false) => '1',
                (Some(false), false) => '0',
                (Some(true), true) => 'I',
                (Some(false), true) => 'O',
                (None, _) => '?',
            })
            .collect();
        // SOF, identifier, RRS, IDE, FDF, res, BRS, ESI, length, first bits of the data.
        assert_eq!(
            text,
            [
                "0",
                "0100100000",
                "I",
                "0",
                "0",
                "0",
                "1",
                "0",
                "1",
                "0",
                "0001",
                "1010"
            ]
            .concat()
        );
        let excepted = |index: &usize| anatomy.bits[*index].is_excepted();
        assert_eq!((0..27).filter(excepted).collect::<Vec<_>>(), [11]);
        // BRS is the last bit at the nominal rate.
        assert_eq!(anatomy.fast.start, 18);
    }
}
