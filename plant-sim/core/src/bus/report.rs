//! What a node's CAN controller reports about errors, and its error frame as SocketCAN writes it (`linux/can/error.h`).

use protocol::time::{Duration, Instant};
use trace::ErrorFrame;

use super::anatomy::Field;
use super::counters::{Counters, State};
use super::disturbance::ErrorKind;
use super::nodes::NodeId;

const CONTROLLER: u32 = 1 << 2;
const PROTOCOL: u32 = 1 << 3;
const NO_ACKNOWLEDGEMENT: u32 = 1 << 5;
const BUS_OFF: u32 = 1 << 6;
const BUS_ERROR: u32 = 1 << 7;
const RESTARTED: u32 = 1 << 8;

/// Byte 1.
const RX_WARNING: u8 = 1 << 2;
const TX_WARNING: u8 = 1 << 3;
const RX_PASSIVE: u8 = 1 << 4;
const TX_PASSIVE: u8 = 1 << 5;
const ACTIVE: u8 = 1 << 6;
/// Byte 2.
const SINGLE_BIT: u8 = 1;
const FORM: u8 = 1 << 1;
const STUFF: u8 = 1 << 2;
const DOMINANT_BIT: u8 = 1 << 3;
const RECESSIVE_BIT: u8 = 1 << 4;
const ON_TRANSMISSION: u8 = 1 << 7;

/// What a node has noticed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Noticed {
    /// An error in a frame.
    Error {
        /// What is wrong.
        kind: ErrorKind,
        /// Where.
        field: Field,
        /// Whether the bit there is recessive, if known.
        recessive: Option<bool>,
        /// Whether the node was sending.
        sending: bool,
    },
    /// Its state has changed.
    State(State),
    /// It takes part again after bus-off.
    Recovered,
}

/// A report of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Report {
    /// When.
    pub time: Instant,
    /// Whose.
    pub node: NodeId,
    /// What it has noticed.
    pub what: Noticed,
    /// Its counters then.
    pub counters: Counters,
    /// How long the bus is busy with an attempt that was in vain; no time in other reports.
    pub busy: Duration,
}

impl Report {
    /// The error frame: byte 5, which is left to controllers, is `node`; bytes 6 and 7 are the counters.
    #[must_use]
    pub fn error_frame(&self, node: u8) -> ErrorFrame {
        let mut data = [0; 8];
        data[5] = node;
        let class = match self.what {
            Noticed::Error {
                kind,
                field,
                recessive,
                sending,
            } => {
                let (class, violation) = match (kind, recessive) {
                    (ErrorKind::Bit, Some(true)) => (0, RECESSIVE_BIT),
                    (ErrorKind::Bit, Some(false)) => (0, DOMINANT_BIT),
                    (ErrorKind::Bit, None) | (ErrorKind::Crc, _) => (0, SINGLE_BIT),
                    (ErrorKind::Stuff, _) => (0, STUFF),
                    (ErrorKind::Form, _) => (0, FORM),
                    (ErrorKind::Ack, _) => (NO_ACKNOWLEDGEMENT, 0),
                };
                data[2] = violation | if sending { ON_TRANSMISSION } else { 0 };
                data[3] = field as u8;
                PROTOCOL | BUS_ERROR | class
            }
            Noticed::State(State::BusOff) => BUS_OFF,
            Noticed::State(state) => {
                let of = |own, warning, passive| match state {
                    State::Warning if own == state => warning,
                    State::ErrorPassive if own == state => passive,
                    _ => 0,
                };
                data[1] = of(self.counters.transmitter(), TX_WARNING, TX_PASSIVE)
                    | of(self.counters.receiver(), RX_WARNING, RX_PASSIVE);
                if state == State::ErrorActive {
                    data[1] = ACTIVE;
                }
                CONTROLLER
            }
            Noticed::Recovered => RESTARTED,
        };
        // A counter of 256 fits no byte. Their class (CAN_ERR_CNT, Linux 6.0) is left out: can-utils of before call the whole frame invalid for it,
        // and those of today show counters without it as well, unless both are 0.
        if let (Ok(transmit), Ok(receive)) = (
            u8::try_from(self.counters.transmit()),
            u8::try_from(self.counters.receive()),
        ) {
            data[6..].copy_from_slice(&[transmit, receive]);
        }
        ErrorFrame::new(class, &data).expect("eight bytes")
    }
}
