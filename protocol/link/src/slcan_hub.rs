//! A bus of serial lines: a TCP server that looks like an adapter ([`slcan`](protocol::slcan)) to each client.
//!
//! Frames of one client go to every other client and to this node. It needs no CAN in the kernel and so connects two
//! processes, or a program such as python-can, on any machine. It has no bit timing and no arbitration. The hub stops
//! reading a client that sends faster than its frames are taken or than it reads its answers: memory is bounded, and
//! TCP holds the client back.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use rustix::event::{PollFd, PollFlags};

use super::{LinkError, Stamped, poll_all};
use protocol::bus::TransmitError;
use protocol::frame::CanFrame;
use protocol::slcan::{Line, MAX_LINE, Parser, SlcanError, Text};

/// Most clients; more are refused.
const CLIENTS: usize = 16;
/// Bytes that may wait for a client. One that does not read loses frames, as on a real bus, without affecting the
/// others.
const QUEUE: usize = 4096 * MAX_LINE;
/// Frames that may wait for this node, plus at most one buffer per client; with more, no client is read.
const RECEIVED: usize = 4096;
/// Hardware and software version reported to clients.
const VERSION: Line = Line::VersionIs([0x10, 0x10]);
/// Serial number reported to clients.
const SERIAL_NUMBER: Line = Line::SerialNumberIs(*b"0001");
/// Milliseconds after which timestamps wrap (CAN232).
const MINUTE: u128 = 60_000;

/// How a client takes part in the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Part {
    /// Not at all, as before `O` or `L` and after `C`.
    Closed,
    /// Receiving only.
    Listening,
    /// Receiving and sending.
    Open,
}

#[derive(Debug)]
struct Client {
    stream: TcpStream,
    parser: Parser,
    output: VecDeque<u8>,
    part: Part,
    /// Frames sent to it carry a timestamp.
    stamps: bool,
    gone: bool,
}

/// What clients may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Clients {
    /// Take part in the bus.
    TakePart,
    /// Watch: their frames are refused.
    Watch,
}

/// A listening port with its clients.
#[derive(Debug)]
pub struct SlcanHub {
    listener: TcpListener,
    may: Clients,
    clients: Vec<Client>,
    received: VecDeque<Stamped>,
    lost: u64,
}

impl SlcanHub {
    /// Listens on `HOST:PORT`.
    ///
    /// # Errors
    /// The port is in use, or the address is not one of this machine.
    pub fn bind(server: &str, may: Clients) -> Result<Self, LinkError> {
        let listener = TcpListener::bind(server)
            .and_then(|listener| {
                listener.set_nonblocking(true)?;
                Ok(listener)
            })
            .map_err(|source| LinkError::io(format!("listen on {server}"), source))?;
        Ok(Self {
            listener,
            may,
            clients: Vec::new(),
            received: VecDeque::new(),
            lost: 0,
        })
    }

    /// Local address, with the port assigned when 0 was requested.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Whether a client takes part in the bus.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.clients
            .iter()
            .any(|client| client.part != Part::Closed)
    }

    /// Frames dropped for slow readers.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Moves bytes both ways and accepts new clients, without waiting.
    pub fn exchange(&mut self) {
        // No more at once than clients are allowed: a flood of connections must not stall the bus.
        for _ in 0..CLIENTS {
            let Ok((stream, _)) = self.listener.accept() else {
                break;
            };
            // Short lines must not be held back and sent together. A client that cannot be configured is refused.
            if self.clients.len() < CLIENTS
                && stream.set_nonblocking(true).is_ok()
                && stream.set_nodelay(true).is_ok()
            {
                self.clients.push(Client {
                    stream,
                    parser: Parser::new(),
                    output: VecDeque::new(),
                    part: Part::Closed,
                    stamps: false,
                    gone: false,
                });
            }
        }
        let mut frames = Vec::new();
        if self.received.len() < RECEIVED {
            for (index, client) in self.clients.iter_mut().enumerate() {
                client.read(self.may, |frame| frames.push((index, frame)));
            }
        }
        for (from, frame) in frames {
            self.spread(&frame, Some(from));
            let at = SystemTime::now();
            self.received.push_back(Stamped { frame, at });
        }
        for client in &mut self.clients {
            client.flush();
        }
        self.clients.retain(|client| !client.gone);
    }

    pub(super) fn unsent(&self) -> usize {
        self.clients.iter().map(|client| client.output.len()).sum()
    }

    pub(super) fn ready(&mut self, timeout: Duration) -> Result<bool, LinkError> {
        self.exchange();
        if self.received.is_empty() {
            let mut descriptors: Vec<PollFd<'_>> = self
                .clients
                .iter()
                .map(|client| {
                    let mut events = PollFlags::empty();
                    if client.has_room() {
                        events |= PollFlags::IN;
                    }
                    if !client.output.is_empty() {
                        events |= PollFlags::OUT;
                    }
                    PollFd::new(&client.stream, events)
                })
                .collect();
            descriptors.push(PollFd::new(&self.listener, PollFlags::IN));
            poll_all(&mut descriptors, timeout)
                .map_err(|source| LinkError::io("wait for serial-line clients", source))?;
            self.exchange();
        }
        Ok(!self.received.is_empty())
    }

    /// The oldest frame of the last exchange. A caller that empties the queue finishes, however fast clients send.
    pub(super) fn take(&mut self) -> Option<Stamped> {
        self.received.pop_front()
    }

    /// Sends to every client that takes part.
    ///
    /// # Errors
    /// None: a bus without listeners accepts frames too.
    pub fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.spread(frame, None);
        for client in &mut self.clients {
            client.flush();
        }
        Ok(())
    }

    fn spread(&mut self, frame: &CanFrame, from: Option<usize>) {
        let plain = Text::from(Line::Frame(*frame));
        let now = SystemTime::now()
            .duration_since(UNIX_EPOCH)
            .unwrap_or_default();
        let stamped = Text::stamped(frame, (now.as_millis() % MINUTE) as u16);
        for (index, client) in self.clients.iter_mut().enumerate() {
            if client.part == Part::Closed || Some(index) == from {
                continue;
            }
            let text = if client.stamps { stamped } else { plain };
            if client.output.len() + text.as_bytes().len() > QUEUE {
                self.lost += 1;
            } else {
                client.output.extend(text.as_bytes());
            }
        }
    }
}

impl Client {
    /// Whether it may be read: there is room for its answers.
    fn has_room(&self) -> bool {
        self.output.len() < QUEUE
    }

    /// Reads one buffer at most, so that every client gets its turn.
    fn read(&mut self, may: Clients, mut frame: impl FnMut(CanFrame)) {
        if !self.has_room() {
            return;
        }
        let mut buffer = [0; 4096];
        match self.stream.read(&mut buffer) {
            Ok(0) => self.gone = true,
            Ok(count) => {
                for &byte in buffer.get(..count).unwrap_or_default() {
                    if let Some(line) = self.parser.push(byte) {
                        self.answer(line, may, &mut frame);
                    }
                }
            }
            Err(error) => self.classify(&error),
        }
    }

    /// Executes a line as an adapter would.
    fn answer(
        &mut self,
        line: Result<Line, SlcanError>,
        may: Clients,
        frame: &mut impl FnMut(CanFrame),
    ) {
        let reply = match line {
            Ok(Line::Frame(sent)) if self.part == Part::Open && may == Clients::TakePart => {
                frame(sent);
                Line::Empty
            }
            Ok(Line::Open) => self.takes(Part::Open),
            Ok(Line::Listen) => self.takes(Part::Listening),
            Ok(Line::Close) => self.takes(Part::Closed),
            Ok(Line::Timestamps(on)) => {
                self.stamps = on;
                Line::Empty
            }
            // This bus has no bit rates, so any are accepted. A filter is accepted if it lets everything pass (its code
            // then means nothing), and frames are always sent without polling.
            Ok(
                Line::Empty
                | Line::Bitrate(_)
                | Line::DataBitrate(_)
                | Line::Timing
                | Line::AcceptanceCode(_)
                | Line::AcceptanceMask(u32::MAX)
                | Line::AutoPoll(true),
            ) => Line::Empty,
            Ok(Line::Version) => VERSION,
            Ok(Line::SerialNumber) => SERIAL_NUMBER,
            Ok(Line::Status) => Line::StatusIs(0),
            Ok(Line::Refused) => return,
            _ => Line::Refused,
        };
        self.output.extend(Text::from(reply).as_bytes());
    }

    fn takes(&mut self, part: Part) -> Line {
        self.part = part;
        Line::Empty
    }

    fn flush(&mut self) {
        while !self.output.is_empty() {
            let (front, _) = self.output.as_slices();
            match self.stream.write(front) {
                Ok(0) => return,
                Ok(count) => drop(self.output.drain(..count)),
                Err(error) => return self.classify(&error),
            }
        }
    }

    fn classify(&mut self, error: &io::Error) {
        use io::ErrorKind::{Interrupted, WouldBlock};
        if !matches!(error.kind(), WouldBlock | Interrupted) {
            self.gone = true;
        }
    }
}
