//! Frames as records of a fixed length.

use protocol::frame::{CanFrame, ExtendedId, FrameKind, Id, StandardId};

/// Bytes of a frame: identifier and flags (4), length (1), FD flags (1), reserved (2), data (64).
pub const FRAME_LEN: usize = 72;

const EXTENDED: u32 = 1 << 31;
const REMOTE: u32 = 1 << 30;
const BRS: u8 = 1;
const ESI: u8 = 2;
const FDF: u8 = 4;

/// A frame as `struct canfd_frame`.
#[must_use]
pub fn frame_to_bytes(frame: &CanFrame) -> [u8; FRAME_LEN] {
    let mut bytes = [0; FRAME_LEN];
    write_frame(frame, &mut bytes);
    bytes
}

/// Writes a frame as `struct canfd_frame`.
pub(crate) fn write_frame(frame: &CanFrame, record: &mut [u8; FRAME_LEN]) {
    let (remote, flags) = match frame.kind() {
        FrameKind::Classical { remote } => (remote, 0),
        FrameKind::Fd { brs, esi } => (false, FDF | (u8::from(brs) * BRS) | (u8::from(esi) * ESI)),
    };
    let id =
        frame.raw_id() | (u32::from(frame.is_extended()) * EXTENDED) | (u32::from(remote) * REMOTE);
    let len = if remote {
        usize::from(frame.dlc())
    } else {
        frame.data().len()
    };
    if let Some((header, data)) = record.split_first_chunk_mut() {
        let shape = len as u32 | u32::from(flags) << 8;
        *header = (u64::from(shape) << 32 | u64::from(id)).to_le_bytes();
        // All of it: an unknown number of bytes takes longer.
        if data.len() == frame.padded().len() {
            data.copy_from_slice(frame.padded());
        }
    }
}

/// The frame in a `struct canfd_frame`, or `None` if no controller could have sent it.
#[must_use]
pub fn frame_from_bytes(bytes: &[u8; FRAME_LEN]) -> Option<CanFrame> {
    let (&[a, b, c, d, len, flags, _, _], data) = bytes.split_first_chunk::<8>()?;
    let word = u32::from_le_bytes([a, b, c, d]);
    let raw = word & !(EXTENDED | REMOTE);
    let id = if word & EXTENDED != 0 {
        Id::Extended(ExtendedId::new(raw)?)
    } else {
        Id::Standard(StandardId::new(u16::try_from(raw).ok()?)?)
    };
    let len = usize::from(len);
    if word & REMOTE != 0 {
        return CanFrame::remote(id, len);
    }
    let data = data.get(..len)?;
    if flags & FDF == 0 {
        return CanFrame::classical(id, data);
    }
    CanFrame::fd(id, data, flags & BRS != 0).map(|frame| frame.with_esi(flags & ESI != 0))
}
