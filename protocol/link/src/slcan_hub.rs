//! A bus of serial lines: a TCP server that each client takes for an adapter ([`slcan`](protocol::slcan)).
//!
//! What one client sends, every other one and this node receive. It needs no CAN in the kernel, so it is the way to two
//! processes, or to a program such as python-can, on any machine. It has no bit timing and no arbitration.

use std::collections::VecDeque;
use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::time::{Duration, SystemTime};

use rustix::event::{PollFd, PollFlags};

use super::{LinkError, Stamped, poll_all};
use protocol::bus::TransmitError;
use protocol::frame::CanFrame;
use protocol::slcan::{Line, MAX_LINE, Parser, SlcanError, Text};

/// Most clients; more are turned away.
const CLIENTS: usize = 16;
/// Bytes that may wait for a client. One that does not read loses frames, as on a real bus; the others do not notice.
const QUEUE: usize = 4096 * MAX_LINE;
/// Hardware and software version that clients are told.
const VERSION: Line = Line::VersionIs([0x10, 0x10]);

#[derive(Debug)]
struct Client {
    stream: TcpStream,
    parser: Parser,
    output: VecDeque<u8>,
    /// Takes part in the bus, between `O` and `C`.
    open: bool,
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

/// A listening port, with all who came.
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
    /// The port is taken or not this machine's.
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

    /// Where it listens: the port that was given when 0 was asked for.
    ///
    /// # Errors
    /// Those of the operating system.
    pub fn local_address(&self) -> io::Result<SocketAddr> {
        self.listener.local_addr()
    }

    /// Whether a client takes part in the bus.
    #[must_use]
    pub fn is_open(&self) -> bool {
        self.clients.iter().any(|client| client.open)
    }

    /// Frames that clients who did not read have lost.
    #[must_use]
    pub fn lost(&self) -> u64 {
        self.lost
    }

    /// Moves bytes both ways, and greets who has come, without waiting.
    pub fn exchange(&mut self) {
        while let Ok((stream, _)) = self.listener.accept() {
            // Small lines must not wait for each other. Who cannot be set up so is turned away.
            if self.clients.len() < CLIENTS
                && stream.set_nonblocking(true).is_ok()
                && stream.set_nodelay(true).is_ok()
            {
                self.clients.push(Client {
                    stream,
                    parser: Parser::new(),
                    output: VecDeque::new(),
                    open: false,
                    gone: false,
                });
            }
        }
        let mut frames = Vec::new();
        for (index, client) in self.clients.iter_mut().enumerate() {
            client.read(self.may, |frame| frames.push((index, frame)));
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
                    let mut events = PollFlags::IN;
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

    pub(super) fn take(&mut self) -> Option<Stamped> {
        if self.received.is_empty() {
            self.exchange();
        }
        self.received.pop_front()
    }

    /// Sends to every client that takes part.
    ///
    /// # Errors
    /// None: a bus without listeners takes frames as well.
    pub fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.spread(frame, None);
        for client in &mut self.clients {
            client.flush();
        }
        Ok(())
    }

    fn spread(&mut self, frame: &CanFrame, from: Option<usize>) {
        let text = Text::from(Line::Frame(*frame));
        for (index, client) in self.clients.iter_mut().enumerate() {
            if !client.open || Some(index) == from {
                continue;
            }
            if client.output.len() + text.as_bytes().len() > QUEUE {
                self.lost += 1;
            } else {
                client.output.extend(text.as_bytes());
            }
        }
    }
}

impl Client {
    fn read(&mut self, may: Clients, mut frame: impl FnMut(CanFrame)) {
        let mut buffer = [0; 4096];
        loop {
            match self.stream.read(&mut buffer) {
                Ok(0) => self.gone = true,
                Ok(count) => {
                    for &byte in buffer.get(..count).unwrap_or_default() {
                        if let Some(line) = self.parser.push(byte) {
                            self.answer(line, may, &mut frame);
                        }
                    }
                    continue;
                }
                Err(error) => self.judge(&error),
            }
            return;
        }
    }

    /// Does what a line says, as an adapter would.
    fn answer(
        &mut self,
        line: Result<Line, SlcanError>,
        may: Clients,
        frame: &mut impl FnMut(CanFrame),
    ) {
        let reply = match line {
            Ok(Line::Frame(sent)) if self.open && may == Clients::TakePart => {
                frame(sent);
                Line::Empty
            }
            Ok(Line::Open | Line::Listen) => {
                self.open = true;
                Line::Empty
            }
            Ok(Line::Close) => {
                self.open = false;
                Line::Empty
            }
            // The bit rates are not of this bus, and nobody is to be kept away by them.
            Ok(Line::Empty | Line::Bitrate(_) | Line::DataBitrate(_)) => Line::Empty,
            Ok(Line::Version) => VERSION,
            Ok(Line::Refused) => return,
            _ => Line::Refused,
        };
        self.output.extend(Text::from(reply).as_bytes());
    }

    fn flush(&mut self) {
        while !self.output.is_empty() {
            let (front, _) = self.output.as_slices();
            match self.stream.write(front) {
                Ok(0) => return,
                Ok(count) => drop(self.output.drain(..count)),
                Err(error) => return self.judge(&error),
            }
        }
    }

    fn judge(&mut self, error: &io::Error) {
        use io::ErrorKind::{Interrupted, WouldBlock};
        if !matches!(error.kind(), WouldBlock | Interrupted) {
            self.gone = true;
        }
    }
}
