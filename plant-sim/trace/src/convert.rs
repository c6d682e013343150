//! Traces in the formats of other tools.

mod asc;
pub(crate) mod pcapng;

use std::io::{self, Write};

use super::{Interface, Record, Writer};

/// A format to convert to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Target {
    /// pcapng with SocketCAN packets, for Wireshark.
    Pcapng,
    /// Vector ASC.
    Asc,
    /// candump log, as this crate writes it.
    Candump,
}

/// Writes records in another format, one by one.
pub struct Converter<W: Write>(Kind<W>);

enum Kind<W: Write> {
    Pcapng(pcapng::Pcapng<W>),
    Asc(asc::Asc<W>),
    Candump(Box<Writer<W>>),
}

impl<W: Write> Converter<W> {
    /// Begins a file.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(sink: W, target: Target) -> io::Result<Self> {
        Ok(Self(match target {
            Target::Pcapng => Kind::Pcapng(pcapng::Pcapng::new(sink)?),
            Target::Asc => Kind::Asc(asc::Asc::new(sink)),
            Target::Candump => Kind::Candump(Box::new(Writer::new(sink, Interface::CAN0))),
        }))
    }

    /// Appends a record.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn record(&mut self, record: &Record) -> io::Result<()> {
        match &mut self.0 {
            Kind::Pcapng(pcapng) => pcapng.record(record),
            Kind::Asc(asc) => asc.record(record),
            Kind::Candump(writer) => writer.record(record),
        }
    }

    /// Flushes the file's own buffer, so that a reader at the other end of a pipe sees everything.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn flush(&mut self) -> io::Result<()> {
        match &mut self.0 {
            Kind::Pcapng(pcapng) => pcapng.sink.flush(),
            Kind::Asc(asc) => asc.sink.flush(),
            Kind::Candump(writer) => writer.flush(),
        }
    }

    /// Ends the file, flushes it and returns the sink.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(self) -> io::Result<W> {
        let mut sink = match self.0 {
            Kind::Pcapng(pcapng) => pcapng.finish(),
            Kind::Asc(asc) => asc.finish()?,
            Kind::Candump(writer) => writer.finish()?.0,
        };
        sink.flush()?;
        Ok(sink)
    }
}

/// The interfaces of a trace, in the order in which they appear.
#[derive(Default)]
struct Interfaces(Vec<Interface>);

impl Interfaces {
    /// Number of this interface, from 0, and whether it is new.
    fn number(&mut self, interface: Interface) -> (usize, bool) {
        match self.0.iter().position(|known| *known == interface) {
            Some(number) => (number, false),
            None => {
                self.0.push(interface);
                (self.0.len() - 1, true)
            }
        }
    }
}
