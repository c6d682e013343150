//! Access to a CAN bus on a Linux host: SocketCAN and serial-line adapters (slcan).
//!
//! # Contents
//!
//! A [`Link`] is a [`Bus`] with a blocking wait. Its text form is a [`LinkAddress`]; the link itself is a
//! [`SocketCan`], an [`SlcanPort`] (one serial line or TCP connection) or an [`SlcanHub`] (a server of many).
//! [`realtime`] has what a real-time process needs of Linux: priority, locked memory, a sleep until an instant.
//!
//! The crate depends on [`protocol`] alone and knows nothing of what frames mean. The controller's process and the
//! simulator's external controllers, monitor and player use it.
//!
//! # The path of one Feedback frame
//!
//! A frame that arrives on vcan0 is timestamped by the kernel, read by [`SocketCan`] ([`Stamped`]) and taken by the
//! controller's process through [`Bus::receive`]; the Command goes out through [`Transmit::transmit`].

#![forbid(unsafe_code)]

mod address;
mod error;
pub mod realtime;
mod slcan_hub;
mod slcan_port;
mod socketcan;
mod stamped;

use std::io;
use std::os::fd::AsFd;
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, Timespec, poll};

pub use address::{AddressError, LinkAddress, SlcanPeer};
pub use error::LinkError;
pub use slcan_hub::{Clients, SlcanHub};
pub use slcan_port::SlcanPort;
pub use socketcan::SocketCan;
pub use stamped::{Arrival, Event, Stamped};

use protocol::bus::{Bus, Transmit, TransmitError};
use protocol::frame::CanFrame;

/// An open link to a bus.
#[derive(Debug)]
pub enum Link {
    /// A network interface.
    SocketCan(SocketCan),
    /// A serial line.
    Slcan(Box<SlcanPort>),
    /// The serial lines of all clients.
    SlcanHub(SlcanHub),
}

impl Link {
    /// Opens the link and joins its bus. A node's own frames are never received.
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

    /// As [`Link::open`], for a program that looks at everything: [`Link::next_arrival`] also gives error frames, and
    /// bursts find room.
    ///
    /// # Errors
    /// See [`LinkError`].
    pub fn watch(address: &LinkAddress) -> Result<Self, LinkError> {
        match address {
            LinkAddress::SocketCan(interface) => SocketCan::watch(interface).map(Self::SocketCan),
            LinkAddress::Slcan(_) => Self::open(address),
        }
    }

    /// Waits until a frame can be taken or `timeout` has passed; `true` if there is a frame. A signal ends the wait
    /// early, like a timeout.
    ///
    /// # Errors
    /// The link has failed and carries no more frames; open it again.
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

    /// The oldest frame or error frame received and not yet taken.
    pub fn next_arrival(&mut self) -> Option<Arrival> {
        match self {
            Self::SocketCan(link) => link.next_arrival(),
            Self::Slcan(_) | Self::SlcanHub(_) => self.take().map(Arrival::from),
        }
    }

    /// Whether the CAN controller of the interface has gone bus-off since the last call, by what has been taken until now. Serial-line
    /// adapters do not say so.
    pub fn take_bus_off(&mut self) -> bool {
        match self {
            Self::SocketCan(link) => link.take_bus_off(),
            Self::Slcan(_) | Self::SlcanHub(_) => false,
        }
    }

    /// Frames that arrived and cannot be taken: the kernel had no room for them, or their lines could not be parsed.
    #[must_use]
    pub fn lost(&self) -> u64 {
        match self {
            Self::SocketCan(link) => link.lost(),
            Self::Slcan(link) => link.unreadable(),
            // A client is told by BEL.
            Self::SlcanHub(_) => 0,
        }
    }

    /// Bytes of frames accepted by [`transmit`](Transmit::transmit) that this process still holds. They are sent during
    /// [`wait`](Self::wait); what is left when the link is dropped is never sent.
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
}

impl Transmit for Link {
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        match self {
            Self::SocketCan(link) => link.transmit(frame),
            Self::Slcan(link) => link.transmit(frame),
            Self::SlcanHub(link) => link.transmit(frame),
        }
    }
}

/// Waits for input on a descriptor, and for room for output if `output`.
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
