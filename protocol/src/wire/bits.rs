//! Exact length of a CAN frame in bits, dynamic and fixed stuff bits included (ISO 11898-1:2015, clause 10).
//!
//! A classical frame is bit-stuffed from start of frame to the end of the CRC sequence, so its length depends on the
//! CRC. An FD frame is bit-stuffed to the end of the data field; its CRC field holds fixed stuff bits at fixed places,
//! so neither stuff count nor CRC-17 / CRC-21 have to be computed to know how long it is.

#![expect(
    clippy::indexing_slicing,
    reason = "tables of runs by byte, indexed by what their own types bound; the controller has no use for lengths in bits"
)]

use crate::frame::{CanFrame, FrameKind, Id};

/// Bits after the CRC delimiter: acknowledge slot and delimiter, end of frame, intermission.
const TRAILER: u32 = 1 + 1 + 7 + INTERMISSION;
/// Bits of the gap between two frames.
pub const INTERMISSION: u32 = 3;

/// Length of a frame on the wire, from start of frame to the end of the intermission that follows it.
///
/// With bit rate switch, the BRS bit counts as nominal and the CRC delimiter as data. Both are sent partly at either
/// rate, since the switch is at their sample points: BRS is nominal up to its sample point, the CRC delimiter after its
/// own. The two errors cancel, so the sum is exact for any sample point.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameBits {
    /// Bits at the nominal bit rate; all of them in a frame without bit rate switch.
    pub nominal: u32,
    /// Bits at the data bit rate.
    pub data: u32,
}

impl FrameBits {
    /// Length of exactly this frame.
    #[must_use]
    pub fn exact(frame: &CanFrame) -> Self {
        let mut stuffing = Stuffing::default();
        let (arbitration, width) = arbitration_field(frame);
        let dlc = u64::from(frame.dlc());
        // Start of frame is the dominant bit before the arbitration field.
        let arbitration = u64::from(arbitration >> (32 - width));
        match frame.kind() {
            FrameKind::Classical { .. } => {
                // Reserved bits and data length code.
                let control = control_bits(frame);
                let header = arbitration << control | dlc;
                let mut crc = Crc15::default();
                crc.push(header, 1 + width + control);
                for &byte in frame.data() {
                    crc.push(u64::from(byte), 8);
                }
                stuffing.push(header, 1 + width + control);
                stuffing.push_bytes(frame.data());
                stuffing.push(u64::from(crc.0), 15);
                Layout::of(frame).length(stuffing.with_last(), 0)
            }
            FrameKind::Fd { brs, esi } => {
                // FDF recessive, reserved bit dominant, BRS.
                let control = 0b100 | u64::from(brs);
                stuffing.push(arbitration << 3 | control, 1 + width + 3);
                let head = stuffing.inserted;
                stuffing.push(u64::from(esi) << 4 | dlc, 5);
                stuffing.push_bytes(frame.data());
                // A run that ends with the data field gets no stuff bit: the first fixed one is already there.
                Layout::of(frame).length(head, stuffing.inserted - head)
            }
        }
    }

    /// Shortest frame of this identifier width, kind and length: no dynamic stuff bits.
    #[must_use]
    pub fn without_stuffing(frame: &CanFrame) -> Self {
        Layout::of(frame).length(0, 0)
    }

    /// Upper bound for frames of this identifier width, kind and length, whatever they carry.
    ///
    /// The textbook bound: a stuff bit after the first five bits, then after every four, as the stuff bit opens the
    /// next run. It neglects that some header bits are constant and is therefore safe; stuff bits go to the nominal
    /// phase first, where they last longest.
    #[must_use]
    pub fn worst_case(frame: &CanFrame) -> Self {
        let layout = Layout::of(frame);
        let most = |bits: u32| (bits - 1) / 4;
        let head = most(layout.head);
        layout.length(head, most(layout.head + layout.body) - head)
    }
}

/// Bits of a frame's parts, before dynamic stuffing.
struct Layout {
    /// Stuffed, nominal: start of frame to BRS, or to the end of the CRC sequence in a classical frame.
    head: u32,
    /// Stuffed, after the rate switch: ESI to the end of the data field. None in a classical frame.
    body: u32,
    /// Not dynamically stuffed, after the rate switch: CRC field of an FD frame with its fixed stuff bits, delimiter.
    check: u32,
    switched: bool,
}

impl Layout {
    fn of(frame: &CanFrame) -> Self {
        let width = arbitration_field(frame).1;
        let data = 8 * frame.data().len() as u32;
        match frame.kind() {
            FrameKind::Classical { .. } => Self {
                head: 1 + width + control_bits(frame) + data + 15,
                body: 0,
                check: 1,
                switched: false,
            },
            FrameKind::Fd { brs, .. } => {
                let crc = if data <= 8 * 16 { 17 } else { 21 };
                // Stuff count with its parity, then CRC; a fixed stuff bit before it and after every fourth bit.
                let field = 4 + crc;
                Self {
                    head: 1 + width + 3,
                    body: 5 + data,
                    check: 1 + field / 4 + field + 1,
                    switched: brs,
                }
            }
        }
    }

    fn length(&self, head_stuff: u32, body_stuff: u32) -> FrameBits {
        let nominal = self.head + head_stuff + TRAILER;
        let data = self.body + body_stuff + self.check;
        if self.switched {
            FrameBits { nominal, data }
        } else {
            FrameBits {
                nominal: nominal + data,
                data: 0,
            }
        }
    }
}

/// Bits between arbitration field and data of a classical frame: r0 (r1 and r0 when extended), data length code.
fn control_bits(frame: &CanFrame) -> u32 {
    if frame.is_extended() { 6 } else { 5 }
}

/// The bits that arbitration compares, the first one as the most significant bit of the word, and their number.
///
/// Base identifier, RTR (SRR, recessive, in an extended frame), IDE; in an extended frame then identifier extension and
/// RTR. Two standard words never differ beyond their width, and a standard and an extended one differ at IDE or before:
/// so comparing the words is arbitration, and the lowest wins.
#[must_use]
pub fn arbitration_field(frame: &CanFrame) -> (u32, u32) {
    let remote = u32::from(frame.is_remote());
    match frame.id() {
        Id::Standard(id) => (u32::from(id.as_raw()) << 21 | remote << 20, 13),
        Id::Extended(id) => {
            let (base, extension) = (id.as_raw() >> 18, id.as_raw() & 0x3_FFFF);
            (base << 21 | 0b11 << 19 | extension << 1 | remote, 32)
        }
    }
}

/// Counts dynamic stuff bits: a complementary bit after five equal ones, which itself opens the next run.
///
/// A stuff bit is inserted when the bit after it is sent, because the end of the stuffed region decides whether its
/// last bit is followed by one.
#[derive(Default)]
struct Stuffing {
    run: Run,
    inserted: u32,
}

impl Stuffing {
    /// Sends the low `count` bits, highest first.
    fn push(&mut self, bits: u64, count: u32) {
        let bytes = count / 8;
        for shift in (8 * bytes..count).rev() {
            let stuffed = self.run.push((bits >> shift & 1) as u8);
            self.inserted += u32::from(stuffed);
        }
        self.push_bytes(&bits.to_be_bytes()[8 - bytes as usize..]);
    }

    /// Sends whole bytes, highest bit first.
    fn push_bytes(&mut self, bytes: &[u8]) {
        let mut row = self.run.row();
        for &byte in bytes {
            let entry = BYTES[usize::from(row | u16::from(byte)) % BYTES.len()];
            row = entry & ROW;
            self.inserted += u32::from(entry & !ROW);
        }
        self.run = Run::of_row(row);
    }

    /// Stuff bits, including one required after the last bit sent.
    fn with_last(&self) -> u32 {
        self.inserted + u32::from(self.run.length == 5)
    }
}

/// The run of equal bits sent last.
#[derive(Clone, Copy, Default)]
struct Run {
    bit: u8,
    /// 0 before the first bit, then 1 to 5.
    length: u8,
}

impl Run {
    /// Sends one bit; returns whether a stuff bit had to go before it.
    const fn push(&mut self, bit: u8) -> bool {
        let stuff = self.length == 5;
        if stuff {
            self.bit ^= 1;
            self.length = 1;
        }
        self.length = if bit == self.bit { self.length + 1 } else { 1 };
        self.bit = bit;
        stuff
    }

    /// Its row of [`BYTES`]: the place of the first entry.
    const fn row(self) -> u16 {
        (2 * self.length as u16 + self.bit as u16) << 8
    }

    const fn of_row(row: u16) -> Self {
        let index = (row >> 8) as u8;
        Self {
            bit: index % 2,
            length: index / 2,
        }
    }
}

/// The part of an entry of [`BYTES`] that is the next row.
const ROW: u16 = 0xFF00;

/// By [`Run::row`] and byte: the row after this byte, and the stuff bits that it took. Nothing uses the last rows; they make the
/// length a power of two.
///
/// Bit by bit, a 64-byte payload would cost more than everything else that the bus does for a frame. Each byte has to wait for
/// the row that the one before it leads to, so that an entry is one number, and found without arithmetic.
static BYTES: [u16; 16 << 8] = {
    let mut table = [0; 16 << 8];
    let mut place = 0;
    while place < 12 << 8 {
        let mut run = Run::of_row(place & ROW);
        let mut inserted = 0;
        let mut shift = 8;
        while shift > 0 {
            shift -= 1;
            inserted += run.push((place >> shift & 1) as u8) as u16;
        }
        table[place as usize] = run.row() | inserted;
        place += 1;
    }
    table
};

/// CRC-15/CAN over single bits: x^15 + x^14 + x^10 + x^8 + x^7 + x^4 + x^3 + 1, start value 0.
#[derive(Default)]
struct Crc15(u16);

impl Crc15 {
    const POLYNOMIAL: u16 = 0x4599;

    fn push(&mut self, bits: u64, count: u32) {
        for shift in (0..count).rev() {
            let feedback = (self.0 >> 14) & 1 != (bits >> shift & 1) as u16;
            self.0 = self.0 << 1 & 0x7FFF;
            if feedback {
                self.0 ^= Self::POLYNOMIAL;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Check value of CRC-15/CAN in the catalogue of parametrised CRC algorithms.
    #[test]
    fn crc15_gives_the_published_check_value() {
        let mut crc = Crc15::default();
        b"123456789"
            .iter()
            .for_each(|&byte| crc.push(u64::from(byte), 8));
        assert_eq!(crc.0, 0x059E);
    }
}
