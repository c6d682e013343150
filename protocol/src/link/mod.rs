//! Links of a host to a CAN bus: SocketCAN and serial-line adapters (feature `std`, Linux).
//!
//! A [`Link`] is a [`Bus`] that can also be waited for. Which one a program uses is text that a person types, a
//! [`LinkAddress`].

mod address;
pub mod realtime;
mod slcan_hub;
mod slcan_port;
mod socketcan;

use std::boxed::Box;
use std::fmt;
use std::io;
use std::os::fd::AsFd;
use std::string::String;
use std::time::{Duration, SystemTime};

use rustix::event::{PollFd, PollFlags, Timespec, poll};

pub use address::{AddressError, LinkAddress, SlcanPeer};
pub use slcan_hub::{Clients, SlcanHub};
pub use slcan_port::SlcanPort;
pub use socketcan::SocketCan;

use crate::bus::{Bus, TransmitError};
use crate::frame::CanFrame;

/// A frame and when it came.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamped {
    /// The frame.
    pub frame: CanFrame,
    /// When the kernel (SocketCAN) or this process (serial line) received it.
    pub at: SystemTime,
}

/// Why a link cannot be used, or not any more.
#[derive(Debug)]
pub enum LinkError {
    /// The system has no such network interface.
    NoInterface {
        /// Name asked for.
        name: String,
        /// CAN interfaces there are, separated by blanks.
        present: String,
    },
    /// The network interface is not a CAN interface.
    NotCan {
        /// Name.
        name: String,
    },
    /// The interface carries classical frames only.
    ClassicalOnly {
        /// Name.
        name: String,
        /// Its MTU, bytes: 16 for classical CAN, 72 for CAN FD.
        mtu: u32,
    },
    /// The interface is down.
    Down {
        /// Name.
        name: String,
    },
    /// The other end of the serial line has gone.
    Closed {
        /// Terminal or TCP address.
        peer: String,
    },
    /// The operating system refused something else.
    Io {
        /// What was attempted, on what.
        what: String,
        /// Its answer.
        source: io::Error,
    },
}

impl LinkError {
    fn io(what: impl Into<String>, source: impl Into<io::Error>) -> Self {
        Self::Io {
            what: what.into(),
            source: source.into(),
        }
    }
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoInterface { name, present } => {
                write!(f, "there is no interface {name}; CAN interfaces here: ")?;
                f.write_str(if present.is_empty() { "none" } else { present })?;
                if name.starts_with("vcan") {
                    write!(
                        f,
                        ". Add it with: ip link add dev {name} type vcan && ip link set {name} mtu 72 up"
                    )?;
                }
                Ok(())
            }
            Self::NotCan { name } => write!(f, "{name} is not a CAN interface"),
            Self::ClassicalOnly { name, mtu } => {
                write!(
                    f,
                    "{name} carries classical CAN only (MTU {mtu}), CAN FD needs MTU 72. "
                )?;
                if name.starts_with("vcan") {
                    write!(
                        f,
                        "Set it with: ip link set {name} down && ip link set {name} mtu 72 up"
                    )
                } else {
                    write!(
                        f,
                        "If its controller can FD: ip link set {name} type can bitrate 1000000 dbitrate 5000000 fd on"
                    )
                }
            }
            Self::Down { name } => {
                write!(f, "{name} is down; bring it up with: ip link set {name} up")
            }
            Self::Closed { peer } => write!(f, "{peer} has closed the connection"),
            Self::Io { what, source } => write!(f, "cannot {what}: {source}"),
        }
    }
}

impl core::error::Error for LinkError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}

/// An open link to a bus.
#[derive(Debug)]
pub enum Link {
    /// A network interface.
    SocketCan(SocketCan),
    /// A serial line.
    Slcan(Box<SlcanPort>),
    /// The serial lines of whoever connects.
    SlcanHub(SlcanHub),
}

impl Link {
    /// Opens the link and takes part in its bus. A node's own frames are never received.
    ///
    /// # Errors
    /// See [`LinkError`].
    pub fn open(address: &LinkAddress) -> Result<Self, LinkError> {
        match address {
            LinkAddress::SocketCan(interface) => SocketCan::open(interface).map(Self::SocketCan),
            LinkAddress::Slcan(SlcanPeer::Listen(server)) => {
                SlcanHub::bind(server, Clients::TakePart).map(Self::SlcanHub)
            }
            LinkAddress::Slcan(peer) => {
                SlcanPort::open(peer).map(|port| Self::Slcan(Box::new(port)))
            }
        }
    }

    /// Waits until a frame may be taken or `timeout` is over; `true` if there is something to take. A signal ends the
    /// wait early, as if the time were over.
    ///
    /// # Errors
    /// The link has failed and will not carry frames any more; open it again.
    pub fn wait(&mut self, timeout: Duration) -> Result<bool, LinkError> {
        if let Some(failure) = self.take_failure() {
            return Err(failure);
        }
        let ready = match self {
            Self::SocketCan(link) => link.ready(timeout)?,
            Self::Slcan(link) => link.ready(timeout)?,
            Self::SlcanHub(link) => link.ready(timeout)?,
        };
        self.take_failure().map_or(Ok(ready), Err)
    }

    /// The oldest frame received and not yet taken, with its time of arrival.
    pub fn take(&mut self) -> Option<Stamped> {
        match self {
            Self::SocketCan(link) => link.take(),
            Self::Slcan(link) => link.take(),
            Self::SlcanHub(link) => link.take(),
        }
    }

    /// Bytes of frames taken by [`transmit`](Bus::transmit) that this process still holds; what is left when the link is
    /// dropped is never sent. They go out while the link is waited for.
    #[must_use]
    pub fn unsent(&self) -> usize {
        match self {
            Self::SocketCan(_) => 0,
            Self::Slcan(link) => link.unsent(),
            Self::SlcanHub(link) => link.unsent(),
        }
    }

    fn take_failure(&mut self) -> Option<LinkError> {
        match self {
            Self::SocketCan(link) => link.failure.take(),
            Self::Slcan(link) => link.failure.take(),
            // Clients come and go.
            Self::SlcanHub(_) => None,
        }
    }
}

impl Bus for Link {
    fn receive(&mut self) -> Option<CanFrame> {
        self.take().map(|stamped| stamped.frame)
    }

    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        match self {
            Self::SocketCan(link) => link.transmit(frame),
            Self::Slcan(link) => link.transmit(frame),
            Self::SlcanHub(link) => link.transmit(frame),
        }
    }
}

/// Waits for input on a descriptor, and for room for output if asked to.
fn poll_for(descriptor: impl AsFd, output: bool, timeout: Duration) -> io::Result<bool> {
    let mut events = PollFlags::IN;
    if output {
        events |= PollFlags::OUT;
    }
    poll_all(&mut [PollFd::new(&descriptor, events)], timeout)
}

/// Waits for an event on any of the descriptors. A signal ends the wait.
fn poll_all(descriptors: &mut [PollFd<'_>], timeout: Duration) -> io::Result<bool> {
    let timeout = Timespec::try_from(timeout).unwrap_or(Timespec {
        tv_sec: 1,
        tv_nsec: 0,
    });
    match poll(descriptors, Some(&timeout)) {
        Ok(ready) => Ok(ready > 0),
        Err(rustix::io::Errno::INTR) => Ok(false),
        Err(error) => Err(error.into()),
    }
}
