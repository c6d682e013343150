//! Log writer: streaming, with a hash of its output.

use std::io::{self, Write};

use protocol::frame::{CanFrame, FrameKind, Id};
use sha2::{Digest, Sha256};

use super::{
    Direction, ERROR_FLAG, Entry, ErrorFrame, FLAG_BRS, FLAG_ESI, Interface, LogHash, Record,
};

/// Longer than any line: timestamp, interface name, identifier, 64 data bytes, direction.
const CAPACITY: usize = 256;

/// Writes a log of one interface, line by line, and hashes it on the way.
///
/// Two runs wrote the same log exactly if their hashes are equal: this proves a run deterministic without keeping its
/// log. The writer makes one `write_all` per line; give it a buffered sink.
pub struct Writer<W: Write> {
    sink: W,
    interface: Interface,
    hash: Sha256,
}

impl<W: Write> Writer<W> {
    /// An empty log.
    pub fn new(sink: W, interface: Interface) -> Self {
        Self {
            sink,
            interface,
            hash: Sha256::new(),
        }
    }

    /// Appends a frame at `time_us`.
    ///
    /// # Errors
    /// Those of the sink. The hash covers whole lines only.
    pub fn frame(&mut self, time_us: u64, frame: &CanFrame) -> io::Result<()> {
        self.record(&Record {
            time_us,
            interface: self.interface,
            direction: None,
            entry: Entry::Frame(*frame),
        })
    }

    /// Appends an error frame reported at `time_us`.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn error(&mut self, time_us: u64, error: &ErrorFrame) -> io::Result<()> {
        self.record(&Record {
            time_us,
            interface: self.interface,
            direction: None,
            entry: Entry::Error(*error),
        })
    }

    /// Appends a record of any interface.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn record(&mut self, record: &Record) -> io::Result<()> {
        let mut line = Line::new(record.time_us, &record.interface);
        match &record.entry {
            Entry::Frame(frame) => line.frame(frame),
            Entry::Error(error) => {
                line.hex(error.class & (ERROR_FLAG - 1) | ERROR_FLAG, 8);
                line.byte(b'#');
                line.data(error.data());
            }
        }
        match record.direction {
            None => {}
            Some(Direction::Received) => line.extend(b" R"),
            Some(Direction::Transmitted) => line.extend(b" T"),
        }
        line.byte(b'\n');
        self.sink.write_all(line.bytes())?;
        self.hash.update(line.bytes());
        Ok(())
    }

    /// Flushes the sink.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }

    /// Flushes the sink and returns it with the hash of everything written.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<(W, LogHash)> {
        self.sink.flush()?;
        Ok((self.sink, LogHash(self.hash.finalize().into())))
    }
}

/// One line under construction. Formatted by hand: `core::fmt` would cost several times the rest of the writer.
struct Line {
    buffer: [u8; CAPACITY],
    len: usize,
}

impl Line {
    fn new(time_us: u64, interface: &Interface) -> Self {
        let mut line = Self {
            buffer: [0; CAPACITY],
            len: 0,
        };
        line.byte(b'(');
        line.decimal(time_us / 1_000_000, 10);
        line.byte(b'.');
        line.decimal(time_us % 1_000_000, 6);
        line.extend(b") ");
        line.extend(interface.as_bytes());
        line.byte(b' ');
        line
    }

    fn frame(&mut self, frame: &CanFrame) {
        match frame.id() {
            Id::Standard(id) => self.hex(id.as_raw().into(), 3),
            Id::Extended(id) => self.hex(id.as_raw(), 8),
        }
        self.byte(b'#');
        match frame.kind() {
            FrameKind::Classical { remote: false } => {}
            FrameKind::Classical { remote: true } => {
                self.byte(b'R');
                // A length of zero is left out, as can-utils does.
                if frame.dlc() > 0 {
                    self.byte(b'0' + frame.dlc());
                }
            }
            FrameKind::Fd { brs, esi } => {
                self.byte(b'#');
                let flags = (u8::from(brs) * FLAG_BRS) | (u8::from(esi) * FLAG_ESI);
                self.hex(flags.into(), 1);
            }
        }
        self.data(frame.data());
    }

    fn bytes(&self) -> &[u8] {
        &self.buffer[..self.len]
    }

    fn byte(&mut self, byte: u8) {
        self.buffer[self.len] = byte;
        self.len += 1;
    }

    fn extend(&mut self, bytes: &[u8]) {
        self.buffer[self.len..][..bytes.len()].copy_from_slice(bytes);
        self.len += bytes.len();
    }

    /// Decimal digits, padded with leading zeros to `width`; a larger number takes as many as it needs.
    fn decimal(&mut self, mut value: u64, width: usize) {
        let mut digits = [b'0'; 20];
        let mut first = digits.len();
        while value > 0 {
            first -= 1;
            digits[first] = b'0' + (value % 10) as u8;
            value /= 10;
        }
        self.extend(&digits[first.min(digits.len() - width)..]);
    }

    /// The low `digits` hexadecimal digits.
    fn hex(&mut self, value: u32, digits: u32) {
        for digit in (0..digits).rev() {
            self.byte(HEX[(value >> (4 * digit) & 0xF) as usize]);
        }
    }

    fn data(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.hex(byte.into(), 2);
        }
    }
}

const HEX: &[u8; 16] = b"0123456789ABCDEF";
