//! Lines as bytes to send.

use crate::frame::{CanFrame, FrameKind};

use super::{BEL, CR, Line, MAX_LINE, MAX_STAMP};

/// One line ready to send, including its end.
#[derive(Clone, Copy, Debug)]
pub struct Text {
    buffer: [u8; MAX_LINE + MAX_STAMP],
    len: usize,
}

impl Text {
    const fn new() -> Self {
        Self {
            buffer: [0; MAX_LINE + MAX_STAMP],
            len: 0,
        }
    }

    fn byte(&mut self, byte: u8) {
        if let Some(place) = self.buffer.get_mut(self.len) {
            *place = byte;
            self.len += 1;
        }
    }

    fn hex(&mut self, number: u32, digits: u32) {
        for k in (0..digits).rev() {
            let nibble = (number >> (4 * k)) as u8 & 0x0F;
            self.byte(if nibble < 10 {
                b'0' + nibble
            } else {
                b'A' + nibble - 10
            });
        }
    }

    fn letter_and_digit(&mut self, letter: u8, digit: u8) {
        self.byte(letter);
        self.hex(u32::from(digit), 1);
    }

    fn frame(&mut self, frame: &CanFrame) {
        let letter = match frame.kind() {
            FrameKind::Classical { remote: false } => b't',
            FrameKind::Classical { remote: true } => b'r',
            FrameKind::Fd { brs: false, .. } => b'd',
            FrameKind::Fd { brs: true, .. } => b'b',
        };
        if frame.is_extended() {
            self.byte(letter.to_ascii_uppercase());
            self.hex(frame.raw_id(), 8);
        } else {
            self.byte(letter);
            self.hex(frame.raw_id(), 3);
        }
        self.hex(u32::from(frame.dlc()), 1);
        for &byte in frame.data() {
            self.hex(u32::from(byte), 2);
        }
    }

    /// A frame followed by the time of its arrival, ms within the minute, as `Z1` requests.
    #[must_use]
    pub fn stamped(frame: &CanFrame, milliseconds: u16) -> Self {
        let mut text = Self::new();
        text.frame(frame);
        text.hex(u32::from(milliseconds), 4);
        text.byte(CR);
        text
    }

    /// The bytes to send.
    #[must_use]
    pub fn as_bytes(&self) -> &[u8] {
        self.buffer.get(..self.len).unwrap_or_default()
    }
}

impl From<Line> for Text {
    fn from(line: Line) -> Self {
        let mut text = Self::new();
        match line {
            Line::Refused => {
                text.byte(BEL);
                return text;
            }
            Line::Empty => {}
            Line::Frame(frame) => text.frame(&frame),
            Line::Open => text.byte(b'O'),
            Line::Listen => text.byte(b'L'),
            Line::Close => text.byte(b'C'),
            Line::Bitrate(rate) => text.letter_and_digit(b'S', rate),
            Line::DataBitrate(rate) => text.letter_and_digit(b'Y', rate),
            Line::Version => text.byte(b'V'),
            Line::VersionIs([hardware, software]) => {
                text.byte(b'V');
                text.hex(u32::from(hardware), 2);
                text.hex(u32::from(software), 2);
            }
            Line::SerialNumber => text.byte(b'N'),
            Line::SerialNumberIs(letters) => {
                text.byte(b'N');
                letters.into_iter().for_each(|letter| text.byte(letter));
            }
            Line::Status => text.byte(b'F'),
            Line::StatusIs(flags) => {
                text.byte(b'F');
                text.hex(u32::from(flags), 2);
            }
            Line::Timestamps(on) => text.letter_and_digit(b'Z', on.into()),
            Line::AcceptanceCode(code) => {
                text.byte(b'M');
                text.hex(code, 8);
            }
            Line::AcceptanceMask(mask) => {
                text.byte(b'm');
                text.hex(mask, 8);
            }
            Line::Timing => text.byte(b's'),
            Line::AutoPoll(on) => text.letter_and_digit(b'X', on.into()),
        }
        text.byte(CR);
        text
    }
}
