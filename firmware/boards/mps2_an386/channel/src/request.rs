//! Requests of the host to the board.

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};

use crate::frames::{FRAME_LEN, frame_from_bytes, frame_to_bytes};
use crate::put;

/// Bytes of a request: kind (1), time in ns (8), frame.
pub const REQUEST_LEN: usize = 9 + FRAME_LEN;

/// A request of the host.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Request {
    /// Call the node. The answer has the frames that it sent and the timer ticks that it took.
    Poll {
        /// Time.
        now: Instant,
        /// The frame that has arrived, if any.
        frame: Option<CanFrame>,
    },
    /// The CAN controller has gone bus-off. There is no answer.
    BusOff,
    /// The answer to the last poll has taken so long, by the time of the host, which is all that there is. There is no answer.
    Took(Duration),
    /// Report the most stack used so far: an answer without frames, in bytes instead of ticks.
    Stack,
    /// Fail. The only answer is the greeting of the next start.
    Plant(Fault),
}

/// A fault that the image with planted faults causes on request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Fault {
    /// An instruction that does not exist.
    HardFault,
    /// A function that calls itself without end.
    StackOverflow,
    /// The same in an interrupt.
    OverflowInInterrupt,
    /// A panic.
    Panic,
}

impl Fault {
    /// Every fault.
    pub const ALL: [Self; 4] = [
        Self::HardFault,
        Self::StackOverflow,
        Self::OverflowInInterrupt,
        Self::Panic,
    ];

    /// Name, lower case with hyphens.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::HardFault => "hard-fault",
            Self::StackOverflow => "stack-overflow",
            Self::OverflowInInterrupt => "overflow-in-interrupt",
            Self::Panic => "panic",
        }
    }
}

/// First byte of a request.
const POLL: u8 = 0;
const POLL_WITH_FRAME: u8 = 1;
const STACK: u8 = 2;
const PLANT: u8 = 3;
const BUS_OFF: u8 = 4;
const TOOK: u8 = 5;

impl Request {
    /// The record.
    #[must_use]
    pub fn to_bytes(&self) -> [u8; REQUEST_LEN] {
        let mut bytes = [0; REQUEST_LEN];
        match self {
            Self::Poll { now, frame: None } => {
                put(&mut bytes, 0, &[POLL]);
                put(&mut bytes, 1, &now.nanos().to_le_bytes());
            }
            Self::Poll {
                now,
                frame: Some(frame),
            } => {
                put(&mut bytes, 0, &[POLL_WITH_FRAME]);
                put(&mut bytes, 1, &now.nanos().to_le_bytes());
                put(&mut bytes, 9, &frame_to_bytes(frame));
            }
            Self::BusOff => put(&mut bytes, 0, &[BUS_OFF]),
            Self::Took(time) => {
                put(&mut bytes, 0, &[TOOK]);
                put(&mut bytes, 1, &time.nanos().to_le_bytes());
            }
            Self::Stack => put(&mut bytes, 0, &[STACK]),
            Self::Plant(fault) => put(&mut bytes, 0, &[PLANT, *fault as u8]),
        }
        bytes
    }

    /// The request in a record, or `None` if it holds none.
    #[must_use]
    pub fn from_bytes(bytes: &[u8; REQUEST_LEN]) -> Option<Self> {
        let (&kind, rest) = bytes.split_first()?;
        let (now, record) = rest.split_first_chunk()?;
        let nanos = u64::from_le_bytes(*now);
        let now = Instant::from_nanos(nanos);
        match kind {
            POLL => Some(Self::Poll { now, frame: None }),
            POLL_WITH_FRAME => {
                let frame = Some(frame_from_bytes(record.first_chunk()?)?);
                Some(Self::Poll { now, frame })
            }
            STACK => Some(Self::Stack),
            BUS_OFF => Some(Self::BusOff),
            TOOK => Some(Self::Took(Duration::from_nanos(nanos))),
            PLANT => {
                let (&fault, _) = rest.split_first()?;
                let fault = Fault::ALL.get(usize::from(fault))?;
                Some(Self::Plant(*fault))
            }
            _ => None,
        }
    }
}
