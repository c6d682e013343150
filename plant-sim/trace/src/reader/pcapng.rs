//! pcapng (draft-ietf-opsawg-pcapng) with packets of link type `LINKTYPE_CAN_SOCKETCAN`, of either byte order.

use std::io::{self, BufRead, Read};

use protocol::frame::{CLASSICAL_MAX, CanFrame};

use crate::convert::pcapng::{
    BYTE_ORDER_MAGIC, DIRECTION_IN, DIRECTION_OUT, ENHANCED_PACKET, EXTENDED_FLAG, IF_NAME,
    INTERFACE_DESCRIPTION, LINKTYPE_CAN_SOCKETCAN, PACKET_FLAGS, REMOTE_FLAG, SECTION_HEADER,
};
use crate::line::{Problem, fd, id};
use crate::{
    Direction, ERROR_FLAG, Entry, ErrorFrame, FLAG_BRS, FLAG_ESI, FLAG_FDF, Interface, Record,
};

const SIMPLE_PACKET: u32 = 3;
/// Options of an interface: resolution and offset of its times.
const IF_TSRESOL: u16 = 9;
const IF_TSOFFSET: u16 = 14;
/// CAN XL mark in the byte of the FD flags.
const XL_FLAG: u8 = 0x80;
/// Longest plausible block; a packet of CAN has fewer than 200 bytes.
const MAX_BLOCK: usize = 1 << 20;
/// Most interfaces; a machine has fewer.
const MAX_INTERFACES: usize = 1 << 12;

/// Whether a file begins as pcapng.
pub(super) fn begins(bytes: &[u8]) -> bool {
    bytes == SECTION_HEADER.to_le_bytes()
}

/// Whether a file begins as the older pcap, in either byte order and resolution.
pub(super) fn begins_classic(bytes: &[u8]) -> bool {
    matches!(
        bytes,
        [0xA1, 0xB2, 0xC3, 0xD4]
            | [0xD4, 0xC3, 0xB2, 0xA1]
            | [0xA1, 0xB2, 0x3C, 0x4D]
            | [0x4D, 0x3C, 0xB2, 0xA1]
    )
}

/// State between two packets.
#[derive(Default)]
pub(super) struct Pcapng {
    big_endian: bool,
    interfaces: Vec<Described>,
    block: Vec<u8>,
}

/// An interface of the section.
struct Described {
    name: Interface,
    link_type: u16,
    /// Ticks per second.
    resolution: u64,
    offset_s: i64,
}

impl Pcapng {
    /// The next packet; `packets` counts them.
    pub(super) fn read(
        &mut self,
        source: &mut impl BufRead,
        packets: &mut u64,
    ) -> io::Result<Option<Result<Record, Problem>>> {
        loop {
            let Some(kind) = self.next_block(source)? else {
                return Ok(None);
            };
            match kind {
                SECTION_HEADER => self.interfaces.clear(),
                INTERFACE_DESCRIPTION => {
                    if self.interfaces.len() == MAX_INTERFACES {
                        return Err(broken("too many interfaces"));
                    }
                    let described = self.interface().ok_or_else(|| broken("short interface"))?;
                    self.interfaces.push(described);
                }
                ENHANCED_PACKET => {
                    *packets += 1;
                    return Ok(Some(self.packet()));
                }
                SIMPLE_PACKET => {
                    *packets += 1;
                    return Ok(Some(Err(Problem::Packet("a packet without time"))));
                }
                _ => {}
            }
        }
    }

    /// Reads a block; its body is left in `block`.
    fn next_block(&mut self, source: &mut impl BufRead) -> io::Result<Option<u32>> {
        if source.fill_buf()?.is_empty() {
            return Ok(None);
        }
        let mut head = [0; 8];
        source.read_exact(&mut head).map_err(cut)?;
        let [a, b, c, d, length @ ..] = head;
        let mut begun = Vec::new();
        if [a, b, c, d] == SECTION_HEADER.to_le_bytes() {
            let mut magic = [0; 4];
            source.read_exact(&mut magic).map_err(cut)?;
            self.big_endian = magic == BYTE_ORDER_MAGIC.to_be_bytes();
            if !self.big_endian && magic != BYTE_ORDER_MAGIC.to_le_bytes() {
                return Err(broken("wrong byte order mark"));
            }
            begun = magic.to_vec();
        }
        let kind = self.number([a, b, c, d]);
        let body = (self.number(length) as usize)
            .checked_sub(12 + begun.len())
            .filter(|body| *body <= MAX_BLOCK && body.is_multiple_of(4))
            .ok_or_else(|| broken("wrong length of a block"))?;
        self.block.clear();
        let read = source.take(body as u64 + 4).read_to_end(&mut self.block)?;
        if read < body + 4 {
            return Err(io::Error::new(
                io::ErrorKind::UnexpectedEof,
                "the file was cut off within a packet",
            ));
        }
        self.block.truncate(body);
        Ok(Some(kind))
    }

    fn number(&self, bytes: [u8; 4]) -> u32 {
        if self.big_endian {
            u32::from_be_bytes(bytes)
        } else {
            u32::from_le_bytes(bytes)
        }
    }

    fn word(&self, at: usize) -> Option<u32> {
        let bytes = self.block.get(at..)?.first_chunk()?;
        Some(self.number(*bytes))
    }

    fn half(&self, at: usize) -> Option<u16> {
        let bytes = *self.block.get(at..)?.first_chunk()?;
        Some(if self.big_endian {
            u16::from_be_bytes(bytes)
        } else {
            u16::from_le_bytes(bytes)
        })
    }

    /// Code and value of the options from `at` on.
    fn options(&self, mut at: usize) -> impl Iterator<Item = (u16, &[u8])> {
        std::iter::from_fn(move || {
            let (code, len) = (self.half(at)?, usize::from(self.half(at + 2)?));
            let value = self.block.get(at + 4..)?.get(..len)?;
            at += 4 + len.next_multiple_of(4);
            (code != 0).then_some((code, value))
        })
    }

    fn interface(&self) -> Option<Described> {
        let mut described = Described {
            name: Interface::numbered(self.interfaces.len()),
            link_type: self.half(0)?,
            resolution: 1_000_000,
            offset_s: 0,
        };
        for (code, value) in self.options(8) {
            match (code, value) {
                (IF_NAME, name) => {
                    let name = name.split(|&byte| byte == 0).next().unwrap_or_default();
                    described.name = Interface::from_bytes(name).unwrap_or(described.name);
                }
                // A power of ten, or with the highest bit set, of two.
                (IF_TSRESOL, &[power]) => {
                    let base: u64 = if power & 0x80 == 0 { 10 } else { 2 };
                    described.resolution = base.checked_pow(u32::from(power & 0x7F))?;
                }
                (IF_TSOFFSET, value) => {
                    let bytes = *value.first_chunk::<8>()?;
                    described.offset_s = if self.big_endian {
                        i64::from_be_bytes(bytes)
                    } else {
                        i64::from_le_bytes(bytes)
                    };
                }
                _ => {}
            }
        }
        Some(described)
    }

    fn packet(&self) -> Result<Record, Problem> {
        let short = Problem::Packet("a packet shorter than its header");
        let [number, high, low, captured, original] =
            [0, 4, 8, 12, 16].map(|at| self.word(at).unwrap_or(0));
        let interface = self.interfaces.get(number as usize).ok_or(Problem::Packet(
            "a packet of an interface that is not described",
        ))?;
        if interface.link_type != LINKTYPE_CAN_SOCKETCAN {
            return Err(Problem::Packet(
                "a packet of another link type than SocketCAN (227); capture the CAN interface itself",
            ));
        }
        if captured < original {
            return Err(Problem::Packet("a packet that the capture cut off"));
        }
        let bytes = self
            .block
            .get(20..)
            .and_then(|rest| rest.get(..captured as usize));
        let bytes = bytes.ok_or(short)?;
        let ticks = u64::from(high) << 32 | u64::from(low);
        let time = i128::from(ticks) * 1_000_000 / i128::from(interface.resolution)
            + i128::from(interface.offset_s) * 1_000_000;
        let flags = self
            .options(20 + bytes.len().next_multiple_of(4))
            .find(|(code, _)| *code == PACKET_FLAGS)
            .and_then(|(_, value)| Some(self.number(*value.first_chunk()?)));
        Ok(Record {
            time_us: u64::try_from(time).map_err(|_| Problem::TimestampRange)?,
            interface: interface.name,
            direction: match flags.map(|flags| flags & 3) {
                Some(DIRECTION_IN) => Some(Direction::Received),
                Some(DIRECTION_OUT) => Some(Direction::Transmitted),
                _ => None,
            },
            entry: entry(bytes).ok_or(short)??,
        })
    }
}

/// SocketCAN packet: identifier with its flags, big-endian; length; FD flags; two reserved bytes; data.
fn entry(bytes: &[u8]) -> Option<Result<Entry, Problem>> {
    let (head, data) = bytes.split_first_chunk::<8>()?;
    let [a, b, c, d, len, flags, ..] = *head;
    if len & XL_FLAG != 0 {
        return Some(Err(Problem::CanXl));
    }
    let raw = u32::from_be_bytes([a, b, c, d]);
    let len = usize::from(len);
    // Without the mark it is a frame of an older kernel: then the room for its data decides.
    let is_fd = flags & FLAG_FDF != 0 || len > CLASSICAL_MAX || data.len() > CLASSICAL_MAX;
    if raw & ERROR_FLAG != 0 {
        let details = data.get(..len)?;
        let error = ErrorFrame::new(raw, details).map(Entry::Error);
        return Some(error.ok_or(Problem::Packet("an error frame of more than 8 bytes")));
    }
    let extended = raw & EXTENDED_FLAG != 0;
    let id = match id(raw & (ERROR_FLAG - 1), extended) {
        Ok(id) => id,
        Err(problem) => return Some(Err(problem)),
    };
    let frame = if raw & REMOTE_FLAG != 0 {
        CanFrame::remote(id, len).ok_or(Problem::Remote)
    } else if is_fd {
        fd(
            id,
            data.get(..len)?,
            flags & FLAG_BRS != 0,
            flags & FLAG_ESI != 0,
        )
    } else {
        CanFrame::classical(id, data.get(..len)?).ok_or(Problem::Packet("too many bytes"))
    };
    Some(frame.map(Entry::Frame))
}

/// Says in words that the file ends too early.
fn cut(error: io::Error) -> io::Error {
    match error.kind() {
        io::ErrorKind::UnexpectedEof => {
            io::Error::new(error.kind(), "the file was cut off within a block")
        }
        _ => error,
    }
}

fn broken(what: &'static str) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, format!("not pcapng: {what}"))
}
