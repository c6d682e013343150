//! Log writer: streaming, with a hash of its output.

use std::io::{self, Write};

use protocol::frame::{CanFrame, FrameKind, Id};
use sha2::{Digest, Sha256};

use super::{
    Direction, ERROR_FLAG, Entry, ErrorFrame, FLAG_BRS, FLAG_ESI, Interface, LogHash, Record,
    text::Line,
};

/// Writes a log of one interface, line by line, and hashes it on the way.
///
/// Two runs wrote the same log exactly if their hashes are equal: this proves a run deterministic without keeping its
/// log. The writer makes one `write_all` per line; give it a buffered sink.
pub struct Writer<W: Write> {
    sink: W,
    interface: Interface,
    text: Text,
}

/// What is written, without where to: compiled once and here, whatever the sink is.
struct Text {
    hash: Sha256,
    line: Line,
}

impl<W: Write> Writer<W> {
    /// An empty log.
    pub fn new(sink: W, interface: Interface) -> Self {
        Self {
            sink,
            interface,
            text: Text {
                hash: Sha256::new(),
                line: Line::default(),
            },
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
        self.sink.write_all(self.text.line_of(record))?;
        self.text.keep();
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
        Ok((self.sink, self.text.hash()))
    }
}

impl Text {
    fn line_of(&mut self, record: &Record) -> &[u8] {
        let line = &mut self.line;
        line.clear();
        line.byte(b'(');
        line.padded(record.time_us / 1_000_000, 10, b'0');
        line.byte(b'.');
        line.padded(record.time_us % 1_000_000, 6, b'0');
        line.extend(b") ");
        line.extend(record.interface.as_bytes());
        line.byte(b' ');
        match &record.entry {
            Entry::Frame(frame) => put_frame(line, frame),
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
        line.bytes()
    }

    /// Takes the line into the hash.
    fn keep(&mut self) {
        self.hash.update(self.line.bytes());
    }

    fn hash(self) -> LogHash {
        LogHash(self.hash.finalize().into())
    }
}

/// As after the interface in a line of candump.
fn put_frame(line: &mut Line, frame: &CanFrame) {
    match frame.id() {
        Id::Standard(id) => line.hex(id.as_raw().into(), 3),
        Id::Extended(id) => line.hex(id.as_raw(), 8),
    }
    line.byte(b'#');
    match frame.kind() {
        FrameKind::Classical { remote: false } => {}
        FrameKind::Classical { remote: true } => {
            line.byte(b'R');
            // A length of zero is left out, as can-utils does.
            if frame.dlc() > 0 {
                line.byte(b'0' + frame.dlc());
            }
        }
        FrameKind::Fd { brs, esi } => {
            line.byte(b'#');
            let flags = (u8::from(brs) * FLAG_BRS) | (u8::from(esi) * FLAG_ESI);
            line.hex(flags.into(), 1);
        }
    }
    line.data(frame.data());
}
