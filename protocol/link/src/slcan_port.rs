//! Serial-line CAN: a USB adapter, a pseudo-terminal, or a TCP server that speaks [`slcan`](protocol::slcan).

use std::collections::VecDeque;
use std::fs::{File, OpenOptions};
use std::io::{self, Read, Write};
use std::net::{TcpStream, ToSocketAddrs};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::OpenOptionsExt;
use std::path::Path;
use std::time::{Duration, SystemTime};

use rustix::fs::OFlags;
use rustix::termios::{OptionalActions, tcgetattr, tcsetattr};

use super::{LinkError, SlcanPeer, Stamped, poll_for};
use protocol::bus::TransmitError;
use protocol::frame::CanFrame;
use protocol::slcan::{Line, MAX_LINE, Parser, Text};

/// Bytes that may wait for the line: some 30 of the longest frames. If more wait, the bus is slower than its senders.
const QUEUE: usize = 32 * MAX_LINE;
/// Frames that may wait for this node; with more, the line is read no further.
const RECEIVED: usize = 4096;
/// Longest wait for a TCP server.
const CONNECT_LIMIT: Duration = Duration::from_secs(3);

/// Opens an adapter: 1 and 5 Mbit/s, no timestamps. The empty line first ends whatever a previous program left
/// unfinished.
const OPENING: [Line; 6] = [
    Line::Empty,
    Line::Close,
    Line::Bitrate(8),
    Line::DataBitrate(5),
    Line::Timestamps(false),
    Line::Open,
];

#[derive(Debug)]
enum Port {
    Terminal(File),
    Tcp(TcpStream),
}

impl Port {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        match self {
            Self::Terminal(file) => file.read(buffer),
            Self::Tcp(stream) => stream.read(buffer),
        }
    }

    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self {
            Self::Terminal(file) => file.write(bytes),
            Self::Tcp(stream) => stream.write(bytes),
        }
    }
}

impl AsFd for Port {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Terminal(file) => file.as_fd(),
            Self::Tcp(stream) => stream.as_fd(),
        }
    }
}

/// An open adapter. The bus behind it runs at 1 Mbit/s nominal and 5 Mbit/s data bit rate.
///
/// Acknowledgements of single frames are not waited for: an adapter refuses a frame by BEL, which is counted
/// ([`Self::refused`]). Unreadable lines are counted too, and reported on standard error when the link is closed, since
/// frames among them are lost.
#[derive(Debug)]
pub struct SlcanPort {
    port: Port,
    peer: String,
    parser: Parser,
    received: VecDeque<Stamped>,
    output: VecDeque<u8>,
    /// Answers to the opening still expected: an adapter may refuse the commands that it does not know.
    opening: usize,
    refused: u64,
    unreadable: u64,
    pub(super) failure: Option<LinkError>,
}

impl SlcanPort {
    /// Opens the line and the bus of the adapter at its other end.
    ///
    /// # Errors
    /// The line cannot be opened; the adapter's answers are not waited for.
    pub fn open(peer: &SlcanPeer) -> Result<Self, LinkError> {
        let opened = match peer {
            SlcanPeer::Terminal(path) => open_terminal(path).map(Port::Terminal),
            SlcanPeer::Tcp(server) | SlcanPeer::Listen(server) => connect(server).map(Port::Tcp),
        };
        let port = opened.map_err(|source| LinkError::io(format!("open slcan:{peer}"), source))?;
        let mut link = Self {
            port,
            peer: peer.to_string(),
            parser: Parser::new(),
            received: VecDeque::new(),
            output: VecDeque::new(),
            opening: OPENING.len(),
            refused: 0,
            unreadable: 0,
            failure: None,
        };
        for line in OPENING {
            link.output.extend(Text::from(line).as_bytes());
        }
        link.flush();
        Ok(link)
    }

    /// Number of frames refused by the adapter.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// Number of unreadable lines from the adapter.
    #[must_use]
    pub fn unreadable(&self) -> u64 {
        self.unreadable
    }

    pub(super) fn unsent(&self) -> usize {
        self.output.len()
    }

    pub(super) fn ready(&mut self, timeout: Duration) -> Result<bool, LinkError> {
        self.exchange();
        if !self.received.is_empty() {
            return Ok(true);
        }
        poll_for(&self.port, !self.output.is_empty(), timeout)
            .map_err(|source| LinkError::io(format!("wait for {}", self.peer), source))?;
        self.exchange();
        Ok(!self.received.is_empty())
    }

    pub(super) fn take(&mut self) -> Option<Stamped> {
        if self.received.is_empty() {
            self.exchange();
        }
        self.received.pop_front()
    }

    pub(super) fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        if self.failure.is_some() {
            return Err(TransmitError::Offline);
        }
        let text = Text::from(Line::Frame(*frame));
        if self.output.len() + text.as_bytes().len() > QUEUE {
            self.flush();
        }
        if self.output.len() + text.as_bytes().len() > QUEUE {
            return Err(TransmitError::QueueFull);
        }
        self.output.extend(text.as_bytes());
        self.flush();
        Ok(())
    }

    /// Moves bytes both ways as far as possible without waiting.
    fn exchange(&mut self) {
        self.flush();
        if self.received.len() >= RECEIVED {
            return;
        }
        let mut buffer = [0; 4096];
        match self.port.read(&mut buffer) {
            // End of file: a TCP peer is gone, or a terminal hung up.
            Ok(0) => self.fail_closed(),
            Ok(count) => {
                let at = SystemTime::now();
                for &byte in buffer.get(..count).unwrap_or_default() {
                    match self.parser.push(byte) {
                        Some(Ok(Line::Frame(frame))) => {
                            self.received.push_back(Stamped { frame, at });
                        }
                        Some(Ok(Line::Refused | Line::Empty)) if self.opening > 0 => {
                            self.opening -= 1;
                        }
                        Some(Ok(Line::Refused)) => self.refused += 1,
                        Some(Err(_)) => self.unreadable += 1,
                        // Acknowledgements and answers.
                        Some(Ok(_)) | None => {}
                    }
                }
            }
            Err(error) => self.classify(error, "read from"),
        }
    }

    fn flush(&mut self) {
        while !self.output.is_empty() {
            let (front, _) = self.output.as_slices();
            match self.port.write(front) {
                Ok(0) => return,
                Ok(count) => drop(self.output.drain(..count)),
                Err(error) => return self.classify(error, "write to"),
            }
        }
    }

    fn fail_closed(&mut self) {
        self.failure = Some(LinkError::Closed {
            peer: self.peer.clone(),
        });
    }

    fn classify(&mut self, error: io::Error, what: &str) {
        use io::ErrorKind::{BrokenPipe, ConnectionReset, Interrupted, WouldBlock};
        match error.kind() {
            WouldBlock | Interrupted => {}
            ConnectionReset | BrokenPipe => self.fail_closed(),
            // A terminal without its other end (unplugged, pseudo-terminal closed) returns EIO.
            _ if error.raw_os_error() == Some(rustix::io::Errno::IO.raw_os_error()) => {
                self.fail_closed();
            }
            _ => self.failure = Some(LinkError::io(format!("{what} {}", self.peer), error)),
        }
    }
}

impl Drop for SlcanPort {
    fn drop(&mut self) {
        if self.unreadable > 0 {
            eprintln!(
                "slcan:{}: {} lines from the adapter could not be read; any frames among them are lost",
                self.peer, self.unreadable
            );
        }
    }
}

/// Opens a terminal without line editing. Its speed is left alone: USB adapters have none, and others are set up with
/// `stty`.
fn open_terminal(path: &Path) -> io::Result<File> {
    let flags = OFlags::NOCTTY | OFlags::NONBLOCK;
    let file = OpenOptions::new()
        .read(true)
        .write(true)
        .custom_flags(flags.bits() as i32)
        .open(path)?;
    let mut settings = tcgetattr(&file)?;
    settings.make_raw();
    tcsetattr(&file, OptionalActions::Now, &settings)?;
    Ok(file)
}

fn connect(server: &str) -> io::Result<TcpStream> {
    let mut last = io::Error::from(io::ErrorKind::AddrNotAvailable);
    for address in server.to_socket_addrs()? {
        match TcpStream::connect_timeout(&address, CONNECT_LIMIT) {
            Ok(stream) => {
                // Short lines must not be held back and sent together.
                stream.set_nodelay(true)?;
                stream.set_nonblocking(true)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(last)
}
