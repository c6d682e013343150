//! pcapng (draft-ietf-opsawg-pcapng), little-endian, with packets of link type `LINKTYPE_CAN_SOCKETCAN`.

use std::io::{self, Write};

use protocol::frame::{CanFrame, FrameKind};

use super::Interfaces;
use crate::{Direction, ERROR_FLAG, Entry, FLAG_BRS, FLAG_ESI, FLAG_FDF, Interface, Record};

pub(crate) const SECTION_HEADER: u32 = 0x0A0D_0D0A;
pub(crate) const INTERFACE_DESCRIPTION: u32 = 1;
pub(crate) const ENHANCED_PACKET: u32 = 6;
pub(crate) const BYTE_ORDER_MAGIC: u32 = 0x1A2B_3C4D;
/// Length of a section that is written as a stream.
const UNKNOWN_LENGTH: u64 = u64::MAX;
pub(crate) const LINKTYPE_CAN_SOCKETCAN: u16 = 227;
/// Option of an interface: its name.
pub(crate) const IF_NAME: u16 = 2;
/// Option of a packet: its flags, of which the low two bits are its direction.
pub(crate) const PACKET_FLAGS: u16 = 2;
pub(crate) const DIRECTION_IN: u32 = 1;
pub(crate) const DIRECTION_OUT: u32 = 2;
/// SocketCAN identifier bits: 29 bits, remote.
pub(crate) const EXTENDED_FLAG: u32 = 0x8000_0000;
pub(crate) const REMOTE_FLAG: u32 = 0x4000_0000;

/// A pcapng file of one section. Timestamps count microseconds, the default resolution of the format.
pub(super) struct Pcapng<W> {
    pub(super) sink: W,
    interfaces: Interfaces,
    block: Vec<u8>,
}

impl<W: Write> Pcapng<W> {
    pub(super) fn new(sink: W) -> io::Result<Self> {
        let mut file = Self {
            sink,
            interfaces: Interfaces::default(),
            block: Vec::new(),
        };
        let version: [u16; 2] = [1, 0];
        file.put(BYTE_ORDER_MAGIC.to_le_bytes());
        file.put(version[0].to_le_bytes());
        file.put(version[1].to_le_bytes());
        file.put(UNKNOWN_LENGTH.to_le_bytes());
        file.end_block(SECTION_HEADER)?;
        Ok(file)
    }

    pub(super) fn record(&mut self, record: &Record) -> io::Result<()> {
        let (number, new) = self.interfaces.number(record.interface);
        if new {
            self.describe(&record.interface)?;
        }
        let packet = match &record.entry {
            Entry::Frame(frame) => frame_packet(frame),
            Entry::Error(error) => packet(
                error.class | ERROR_FLAG,
                error.data().len() as u8,
                0,
                error.data(),
            ),
        };
        let length = packet.len() as u32;
        self.put((number as u32).to_le_bytes());
        self.put(((record.time_us >> 32) as u32).to_le_bytes());
        self.put((record.time_us as u32).to_le_bytes());
        // Captured length and length on the wire.
        self.put(length.to_le_bytes());
        self.put(length.to_le_bytes());
        self.block.extend(packet);
        if let Some(direction) = record.direction {
            self.pad();
            self.put(PACKET_FLAGS.to_le_bytes());
            self.put(4_u16.to_le_bytes());
            self.put(match direction {
                Direction::Received => DIRECTION_IN.to_le_bytes(),
                Direction::Transmitted => DIRECTION_OUT.to_le_bytes(),
            });
            // End of options.
            self.put(0_u32.to_le_bytes());
        }
        self.end_block(ENHANCED_PACKET)
    }

    pub(super) fn finish(self) -> W {
        self.sink
    }

    fn describe(&mut self, interface: &Interface) -> io::Result<()> {
        let name = interface.to_string();
        self.put(LINKTYPE_CAN_SOCKETCAN.to_le_bytes());
        self.put(0_u16.to_le_bytes());
        // No limit on the length of packets.
        self.put(0_u32.to_le_bytes());
        self.put(IF_NAME.to_le_bytes());
        self.put((name.len() as u16).to_le_bytes());
        self.block.extend(name.bytes());
        self.pad();
        // End of options.
        self.put(0_u32.to_le_bytes());
        self.end_block(INTERFACE_DESCRIPTION)
    }

    fn put<const N: usize>(&mut self, bytes: [u8; N]) {
        self.block.extend(bytes);
    }

    fn pad(&mut self) {
        self.block.resize(self.block.len().next_multiple_of(4), 0);
    }

    /// Writes the body gathered so far as a block of this type: type, length, body, length.
    fn end_block(&mut self, kind: u32) -> io::Result<()> {
        self.pad();
        let length = (self.block.len() as u32 + 12).to_le_bytes();
        self.sink.write_all(&kind.to_le_bytes())?;
        self.sink.write_all(&length)?;
        self.sink.write_all(&self.block)?;
        self.sink.write_all(&length)?;
        self.block.clear();
        Ok(())
    }
}

fn frame_packet(frame: &CanFrame) -> Vec<u8> {
    let mut id = frame.raw_id();
    if frame.is_extended() {
        id |= EXTENDED_FLAG;
    }
    match frame.kind() {
        FrameKind::Classical { remote: false } => {
            packet(id, frame.data().len() as u8, 0, frame.data())
        }
        // Carries no data, only the requested length.
        FrameKind::Classical { remote: true } => packet(id | REMOTE_FLAG, frame.dlc(), 0, &[]),
        FrameKind::Fd { brs, esi } => {
            let flags = FLAG_FDF | (u8::from(brs) * FLAG_BRS) | (u8::from(esi) * FLAG_ESI);
            packet(id, frame.data().len() as u8, flags, frame.data())
        }
    }
}

/// SocketCAN packet: identifier with its flags, big-endian; length; FD flags; two reserved bytes; data.
fn packet(id: u32, length: u8, flags: u8, data: &[u8]) -> Vec<u8> {
    let mut packet = id.to_be_bytes().to_vec();
    packet.extend([length, flags, 0, 0]);
    packet.extend(data);
    packet
}
