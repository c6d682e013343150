//! SocketCAN: any CAN interface of Linux, virtual or hardware.

mod received;

use std::fs;
use std::io;
use std::time::Duration;

use ::socketcan::{CanFdFrame, CanFdSocket, EmbeddedFrame, Socket, SocketOptions};
use rustix::io::Errno;
use rustix::net::sockopt::{set_socket_recv_buffer_size, set_socket_recv_buffer_size_force};

use super::{Arrival, Event, LinkError, Stamped, poll_for};
use protocol::bus::TransmitError;
use protocol::frame::{CanFrame, FrameKind};

/// `ARPHRD_CAN`: kind of network interface, from `/sys/class/net/NAME/type`.
const ARPHRD_CAN: u32 = 280;
/// `IFF_UP`: the interface is administratively up.
const IFF_UP: u32 = 1;
/// `CANFD_MTU`: an interface with less carries classical frames only.
const CANFD_MTU: u32 = 72;
/// Error classes that report whether the controller takes part in the bus (`linux/can/error.h`).
const CAN_ERR_BUSOFF: u32 = 0x40;
const CAN_ERR_RESTARTED: u32 = 0x100;
/// All classes of errors there are.
const CAN_ERR_MASK: u32 = 0x1FFF_FFFF;
/// Room for received frames where none may be lost, bytes: a second of the fastest bus.
const BURST: usize = 16 << 20;

/// A socket on a CAN interface. Local loopback stays on, so that other programs on this machine see its frames; it
/// does not receive its own.
#[derive(Debug)]
pub struct SocketCan {
    socket: CanFdSocket,
    interface: String,
    bus_off: bool,
    /// Whether that has begun since [`Self::take_bus_off`].
    went_off: bool,
    /// Frames for which the kernel had no room, as its counter of 32 bits has it.
    lost: u32,
    pub(super) failure: Option<LinkError>,
}

impl SocketCan {
    /// Opens an interface that is up and carries FD frames.
    ///
    /// # Errors
    /// The interface is missing, down, or cannot carry FD frames: [`LinkError`] says what to do.
    pub fn open(interface: &str) -> Result<Self, LinkError> {
        let name = || interface.to_string();
        let Some(kind) = property(interface, "type") else {
            return Err(LinkError::NoInterface {
                name: name(),
                present: can_interfaces(),
            });
        };
        if kind != ARPHRD_CAN {
            return Err(LinkError::NotCan { name: name() });
        }
        let mtu = property(interface, "mtu").unwrap_or(0);
        if mtu < CANFD_MTU {
            return Err(LinkError::ClassicalOnly { name: name(), mtu });
        }
        if property(interface, "flags").unwrap_or(0) & IFF_UP == 0 {
            return Err(LinkError::Down { name: name() });
        }
        let socket = open_socket(interface)
            .map_err(|source| LinkError::io(format!("open {interface}"), source))?;
        Ok(Self {
            socket,
            interface: name(),
            bus_off: false,
            went_off: false,
            lost: 0,
            failure: None,
        })
    }

    /// As [`Self::open`], with all error frames and with room for bursts.
    pub(super) fn watch(interface: &str) -> Result<Self, LinkError> {
        let link = Self::open(interface)?;
        let failed = |source| LinkError::io(format!("open {interface}"), source);
        link.socket.set_error_filter(CAN_ERR_MASK).map_err(failed)?;
        // More than the system's limit is root's to ask for; everybody else gets the limit.
        if set_socket_recv_buffer_size_force(&link.socket, BURST).is_err() {
            set_socket_recv_buffer_size(&link.socket, BURST)
                .map_err(|error| failed(error.into()))?;
        }
        Ok(link)
    }

    pub(super) fn take_bus_off(&mut self) -> bool {
        std::mem::take(&mut self.went_off)
    }

    /// Frames for which the kernel had no room.
    pub(super) fn lost(&self) -> u64 {
        self.lost.into()
    }

    pub(super) fn ready(&mut self, timeout: Duration) -> Result<bool, LinkError> {
        poll_for(&self.socket, false, timeout)
            .map_err(|source| LinkError::io(format!("wait for {}", self.interface), source))
    }

    pub(super) fn take(&mut self) -> Option<Stamped> {
        loop {
            let Arrival { event, at } = self.next_arrival()?;
            if let Event::Frame(frame) = event {
                return Some(Stamped { frame, at });
            }
        }
    }

    pub(super) fn next_arrival(&mut self) -> Option<Arrival> {
        loop {
            let received = match received::receive(&self.socket) {
                Ok(received) => received,
                Err(error) => {
                    self.classify(&error, "read from");
                    return None;
                }
            };
            self.lost = received.lost.unwrap_or(self.lost);
            let Some(event) = received.event else {
                continue;
            };
            if let Event::Error { class, .. } = event {
                self.bus_off |= class & CAN_ERR_BUSOFF != 0;
                self.went_off |= class & CAN_ERR_BUSOFF != 0;
                self.bus_off &= class & CAN_ERR_RESTARTED == 0;
            }
            return Some(Arrival {
                event,
                at: received.at,
            });
        }
    }

    pub(super) fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        if self.bus_off || self.failure.is_some() {
            return Err(TransmitError::Offline);
        }
        let written = match frame.kind() {
            FrameKind::Classical { .. } => frame
                .to_embedded::<::socketcan::CanFrame>()
                .map(|frame| self.socket.write_frame(&frame)),
            FrameKind::Fd { brs, esi } => {
                CanFdFrame::new(frame.id(), frame.data()).map(|mut frame| {
                    frame.set_brs(brs);
                    frame.set_esi(esi);
                    self.socket.write_frame(&frame)
                })
            }
        };
        match written {
            Some(Ok(())) => Ok(()),
            Some(Err(error)) => Err(self.classify(&error, "write to")),
            // Every CanFrame has an equivalent there.
            None => Err(TransmitError::Offline),
        }
    }

    /// The transmit error for an error of the socket; one that ends the link is kept.
    fn classify(&mut self, error: &io::Error, what: &str) -> TransmitError {
        match error.raw_os_error().map(Errno::from_raw_os_error) {
            // Either the queue of the interface or the buffer of the socket is full.
            Some(Errno::NOBUFS | Errno::AGAIN) => TransmitError::QueueFull,
            Some(Errno::INTR) => TransmitError::QueueFull,
            Some(Errno::NETDOWN) => {
                self.failure = Some(LinkError::Down {
                    name: self.interface.clone(),
                });
                TransmitError::Offline
            }
            Some(Errno::NODEV | Errno::NXIO) => {
                self.failure = Some(LinkError::NoInterface {
                    name: self.interface.clone(),
                    present: can_interfaces(),
                });
                TransmitError::Offline
            }
            code => {
                let source = code.map_or_else(|| io::Error::from(error.kind()), io::Error::from);
                self.failure = Some(LinkError::io(format!("{what} {}", self.interface), source));
                TransmitError::Offline
            }
        }
    }
}

fn open_socket(interface: &str) -> io::Result<CanFdSocket> {
    let socket = CanFdSocket::open(interface)?;
    socket.set_nonblocking(true)?;
    socket.set_loopback(true)?;
    socket.set_recv_own_msgs(false)?;
    socket.set_recv_timestamp(true)?;
    received::count_lost(&socket)?;
    socket.set_error_filter(CAN_ERR_BUSOFF | CAN_ERR_RESTARTED)?;
    Ok(socket)
}

/// A numeric property of an interface, decimal or hexadecimal.
fn property(interface: &str, name: &str) -> Option<u32> {
    let text = fs::read_to_string(format!("/sys/class/net/{interface}/{name}")).ok()?;
    let text = text.trim();
    match text.strip_prefix("0x") {
        Some(digits) => u32::from_str_radix(digits, 16).ok(),
        None => text.parse().ok(),
    }
}

/// Names of all CAN interfaces.
fn can_interfaces() -> String {
    let mut names: Vec<String> = fs::read_dir("/sys/class/net")
        .into_iter()
        .flatten()
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| property(name, "type") == Some(ARPHRD_CAN))
        .collect();
    names.sort();
    names.join(" ")
}
