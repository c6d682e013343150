//! What a socket gives for a frame: its bytes, its time, and how many were lost before it.
//!
//! The crate `socketcan` reads frames and times, too, but not the kernel's count of frames that found no room.

use std::io::{self, IoSliceMut};
use std::os::fd::{AsFd, AsRawFd};
use std::time::{Duration, SystemTime};

use nix::sys::socket::sockopt::RxqOvfl;
use nix::sys::socket::{ControlMessageOwned, MsgFlags, recvmsg, setsockopt};
use nix::sys::time::TimeSpec;

use super::Event;
use protocol::frame::{CLASSICAL_MAX, CanFrame, ExtendedId, FD_MAX, Id, StandardId};

/// Bytes before the data: identifier, length, flags, two reserved.
const HEADER: usize = 8;
/// `CAN_MTU` and `CANFD_MTU`: what a read gives for a classical frame and for an FD frame.
const CLASSICAL: usize = HEADER + CLASSICAL_MAX;
const FD: usize = HEADER + FD_MAX;
/// Bits of the identifier's word (`linux/can.h`).
const EXTENDED_FLAG: u32 = 0x8000_0000;
const REMOTE_FLAG: u32 = 0x4000_0000;
const ERROR_FLAG: u32 = 0x2000_0000;
const EXTENDED_MASK: u32 = 0x1FFF_FFFF;
const STANDARD_MASK: u32 = 0x7FF;
/// Flags of an FD frame.
const BRS: u8 = 1;
const ESI: u8 = 2;

/// One read.
pub(super) struct Received {
    /// `None` if the bytes are no frame of CAN or CAN FD.
    pub(super) event: Option<Event>,
    /// When the kernel had it.
    pub(super) at: SystemTime,
    /// Frames lost since the socket was opened, if any.
    pub(super) lost: Option<u32>,
}

/// Has the kernel report what finds no room in the socket.
pub(super) fn count_lost(socket: &impl AsFd) -> io::Result<()> {
    Ok(setsockopt(&socket.as_fd(), RxqOvfl, &1)?)
}

/// The oldest frame in the socket.
pub(super) fn receive(socket: &impl AsRawFd) -> io::Result<Received> {
    let mut bytes = [0; FD];
    let mut control = nix::cmsg_space!(TimeSpec, u32);
    let mut vector = [IoSliceMut::new(&mut bytes)];
    let message = recvmsg::<()>(
        socket.as_raw_fd(),
        &mut vector,
        Some(&mut control),
        MsgFlags::empty(),
    )?;
    let mut at = None;
    let mut lost = None;
    for item in message.cmsgs()? {
        match item {
            ControlMessageOwned::ScmTimestampns(time) => {
                at = SystemTime::UNIX_EPOCH.checked_add(Duration::from(time));
            }
            ControlMessageOwned::RxqOvfl(count) => lost = Some(count),
            _ => {}
        }
    }
    let count = message.bytes;
    Ok(Received {
        event: bytes.get(..count).and_then(event),
        at: at.unwrap_or_else(SystemTime::now),
        lost,
    })
}

/// Reads `can_frame` or `canfd_frame`.
fn event(bytes: &[u8]) -> Option<Event> {
    let (head, data) = bytes.split_first_chunk::<HEADER>()?;
    let [a, b, c, d, len, flags, _, _] = *head;
    let word = u32::from_ne_bytes([a, b, c, d]);
    let id = if word & EXTENDED_FLAG == 0 {
        Id::Standard(StandardId::new((word & STANDARD_MASK) as u16)?)
    } else {
        Id::Extended(ExtendedId::new(word & EXTENDED_MASK)?)
    };
    let len = usize::from(len);
    let frame = match bytes.len() {
        CLASSICAL if word & ERROR_FLAG != 0 => {
            return Some(Event::Error {
                class: word & EXTENDED_MASK,
                data: data.try_into().ok()?,
            });
        }
        CLASSICAL if word & REMOTE_FLAG != 0 => CanFrame::remote(id, len),
        CLASSICAL => CanFrame::classical(id, data.get(..len)?),
        FD => CanFrame::fd(id, data.get(..len)?, flags & BRS != 0)
            .map(|frame| frame.with_esi(flags & ESI != 0)),
        _ => None,
    };
    frame.map(Event::Frame)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `struct can_frame` and `struct canfd_frame` of `linux/can.h`.
    fn bytes(word: u32, len: u8, flags: u8, data: &[u8], size: usize) -> Vec<u8> {
        let mut bytes = [&word.to_ne_bytes()[..], &[len, flags, 0, 0], data].concat();
        bytes.resize(size, 0);
        bytes
    }

    #[test]
    fn every_kind_of_frame_is_read() {
        let standard = StandardId::new(0x123).unwrap();
        let extended = ExtendedId::new(0x18FF_1234).unwrap();
        let frame = |frame: Option<CanFrame>| frame.map(Event::Frame);
        for (bytes, expected) in [
            (
                bytes(0x123, 2, 0, &[1, 2], 16),
                frame(CanFrame::classical(standard, &[1, 2])),
            ),
            (
                bytes(0x98FF_1234, 0, 0, &[], 16),
                frame(CanFrame::classical(extended, &[])),
            ),
            (
                bytes(0x4000_0123, 4, 0, &[], 16),
                frame(CanFrame::remote(standard, 4)),
            ),
            (
                // CANFD_BRS | CANFD_ESI | CANFD_FDF
                bytes(0x123, 12, 7, &[9; 12], 72),
                frame(CanFrame::fd(standard, &[9; 12], true).map(|fd| fd.with_esi(true))),
            ),
            (
                bytes(0x2000_0088, 8, 0, &[0, 0, 4], 16),
                Some(Event::Error {
                    class: 0x88,
                    data: [0, 0, 4, 0, 0, 0, 0, 0],
                }),
            ),
            (bytes(0x123, 9, 0, &[], 16), None),
            (bytes(0x123, 65, 0, &[], 72), None),
            (bytes(0x123, 1, 0, &[], 12), None),
            (Vec::new(), None),
        ] {
            assert_eq!(event(&bytes), expected, "{bytes:?}");
        }
    }
}
