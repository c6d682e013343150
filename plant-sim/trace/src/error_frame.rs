//! Error frames of SocketCAN, in the terms of can-utils.

use std::fmt;

/// Error frame of SocketCAN: a state or an error reported by a controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ErrorFrame {
    /// Error classes, a bit set of 29 bits (`linux/can/error.h`).
    pub class: u32,
    data: [u8; 8],
    len: u8,
}

/// Error classes from bit 0 on.
const CLASSES: [&str; 10] = [
    "tx-timeout",
    "lost-arbitration",
    "controller-problem",
    "protocol-violation",
    "transceiver-status",
    "no-acknowledgement-on-tx",
    "bus-off",
    "bus-error",
    "restarted-after-bus-off",
    "error-counter-tx-rx",
];
const LOST_ARBITRATION: u32 = 1 << 1;
const CONTROLLER: u32 = 1 << 2;
const PROTOCOL: u32 = 1 << 3;
const TRANSCEIVER: u32 = 1 << 4;
const COUNTERS: u32 = 1 << 9;

/// Byte 1, by bit.
const CONTROLLER_PROBLEMS: [&str; 7] = [
    "rx-overflow",
    "tx-overflow",
    "rx-error-warning",
    "tx-error-warning",
    "rx-error-passive",
    "tx-error-passive",
    "back-to-error-active",
];
/// Byte 2, by bit.
const VIOLATIONS: [&str; 8] = [
    "single-bit-error",
    "frame-format-error",
    "bit-stuffing-error",
    "tx-dominant-bit-error",
    "tx-recessive-bit-error",
    "bus-overload",
    "active-error-announcement",
    "error-on-tx",
];

impl ErrorFrame {
    /// An error frame of these classes and details, or `None` if it has more than 8 bytes.
    #[must_use]
    pub fn new(class: u32, details: &[u8]) -> Option<Self> {
        let mut data = [0; 8];
        data.get_mut(..details.len())?.copy_from_slice(details);
        Some(Self {
            class: class & (super::ERROR_FLAG - 1),
            data,
            len: details.len() as u8,
        })
    }

    /// Details, as defined by the classes; missing ones are zero.
    #[must_use]
    pub fn data(&self) -> &[u8] {
        &self.data[..usize::from(self.len)]
    }

    /// Names of its classes; a bit without a name is `class-N`, no bit at all `unspecified`.
    #[must_use]
    pub fn classes(&self) -> Vec<String> {
        let names: Vec<String> = bits(self.class)
            .map(|bit| {
                CLASSES
                    .get(bit)
                    .map_or_else(|| format!("class-{bit}"), |&name| name.to_owned())
            })
            .collect();
        if names.is_empty() {
            vec!["unspecified".into()]
        } else {
            names
        }
    }

    /// Details of one class.
    fn details(&self, class: u32) -> String {
        let [bit, controller, violation, place, transceiver, _, tx, rx] = self.data;
        let text = match class {
            LOST_ARBITRATION if bit == 0 => "at an unknown bit".into(),
            LOST_ARBITRATION => format!("at bit {bit}"),
            CONTROLLER => names(controller, &CONTROLLER_PROBLEMS),
            PROTOCOL => {
                let mut text = names(violation, &VIOLATIONS);
                if place != 0 {
                    text += if text.is_empty() { "" } else { ", " };
                    text += &format!("at {}", location(place));
                }
                text
            }
            TRANSCEIVER => wires(transceiver),
            COUNTERS => format!("tx {tx}, rx {rx}"),
            _ => String::new(),
        };
        if text.is_empty() {
            text
        } else {
            format!(" ({text})")
        }
    }
}

/// `controller-problem (tx-error-passive), bus-off`.
impl fmt::Display for ErrorFrame {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let mut separator = "";
        let mut known = bits(self.class);
        for name in self.classes() {
            let details = known
                .next()
                .map_or(String::new(), |bit| self.details(1 << bit));
            write!(f, "{separator}{name}{details}")?;
            separator = ", ";
        }
        // Before Linux 6.0 counters had no class.
        if self.class & COUNTERS == 0 && self.data[6..] != [0, 0] {
            write!(f, ", {}{}", CLASSES[9], self.details(COUNTERS))?;
        }
        Ok(())
    }
}

fn bits(set: u32) -> impl Iterator<Item = usize> {
    (0..u32::BITS as usize).filter(move |bit| set >> bit & 1 == 1)
}

/// Names of the set bits; a bit without a name by its number.
fn names(set: u8, all: &[&str]) -> String {
    let words: Vec<String> = bits(set.into())
        .map(|bit| {
            all.get(bit)
                .map_or_else(|| format!("bit-{bit}"), |&name| name.to_owned())
        })
        .collect();
    words.join(", ")
}

/// State of the wires (`CAN_ERR_TRX_*`): CANH in the low half of the byte, CANL in the high one.
fn wires(status: u8) -> String {
    let fault = |half| match half {
        0x4 => "no-wire",
        0x5 => "short-to-battery",
        0x6 => "short-to-vcc",
        0x7 => "short-to-ground",
        0x8 => "short-to-canh",
        _ => "unknown-fault",
    };
    let mut words = Vec::new();
    for (wire, half) in [("canh", status & 0x0F), ("canl", status >> 4)] {
        if half != 0 {
            words.push(format!("{wire}-{}", fault(half)));
        }
    }
    words.join(", ")
}

/// Place within a frame (`CAN_ERR_PROT_LOC_*`).
fn location(place: u8) -> &'static str {
    match place {
        0x02 => "id.28-to-id.21",
        0x03 => "start-of-frame",
        0x04 => "bit-srtr",
        0x05 => "bit-ide",
        0x06 => "id.20-to-id.18",
        0x07 => "id.17-to-id.13",
        0x08 => "crc-sequence",
        0x09 => "reserved-bit-0",
        0x0A => "data-field",
        0x0B => "data-length-code",
        0x0C => "bit-rtr",
        0x0D => "reserved-bit-1",
        0x0E => "id.4-to-id.0",
        0x0F => "id.12-to-id.5",
        0x12 => "intermission",
        0x18 => "crc-delimiter",
        0x19 => "acknowledge-slot",
        0x1A => "end-of-frame",
        0x1B => "acknowledge-delimiter",
        _ => "an unknown place",
    }
}
