//! The first difference between an expected frame and the one received, for a person to read.

use std::fmt;

use protocol::codec::{self, DecodeError};
use protocol::frame::CanFrame;
use protocol::messages::Message;
use protocol::table;

use crate::fields::{Decoded, full_name};

/// A difference between two controllers that should do the same.
#[derive(Clone, Debug, PartialEq)]
pub enum Difference {
    /// A field has another value.
    Field {
        /// The expected frame.
        due: Box<CanFrame>,
        /// Field, or "counter".
        field: String,
        /// Value expected.
        expected: String,
        /// Value received.
        found: String,
    },
    /// The frame received is damaged.
    Damaged {
        /// The expected frame.
        due: Box<CanFrame>,
        /// What is wrong with the received one.
        error: DecodeError,
    },
    /// Another message was received.
    Other {
        /// The expected frame.
        due: Box<CanFrame>,
        /// The received frame.
        found: Box<CanFrame>,
    },
    /// Nothing was received.
    Missing {
        /// The expected frame.
        due: Box<CanFrame>,
    },
    /// An unexpected frame was received.
    Surplus {
        /// The frame.
        found: Box<CanFrame>,
    },
}

impl Difference {
    /// The first difference; `None` if the frames have one identifier and the same bytes. Bit rate switch and error state
    /// indicator belong to the link and do not count.
    #[must_use]
    pub fn between(due: Option<&CanFrame>, found: Option<&CanFrame>) -> Option<Self> {
        let boxed = |frame: Option<&CanFrame>| frame.map(|frame| Box::new(*frame));
        match (boxed(due), boxed(found)) {
            (None, None) => None,
            (Some(due), None) => Some(Self::Missing { due }),
            (None, Some(found)) => Some(Self::Surplus { found }),
            (Some(due), Some(found)) if due.id() != found.id() || due.is_fd() != found.is_fd() => {
                Some(Self::Other { due, found })
            }
            (Some(due), Some(found)) if due.data() == found.data() => None,
            (Some(due), Some(found)) => Some(Self::within(due, found)),
        }
    }

    /// The difference between two frames of one message.
    fn within(due: Box<CanFrame>, found: Box<CanFrame>) -> Self {
        let (expected, came) = match (Decoded::new(&due), Decoded::new(&found)) {
            (Ok(expected), Ok(came)) => (expected, came),
            (Ok(_), Err(error)) => return Self::Damaged { due, error },
            (Err(_), _) => return Self::Other { due, found },
        };
        let field = |field, expected, found| Self::Field {
            due,
            field,
            expected,
            found,
        };
        for (one, other) in expected.fields().zip(came.fields()) {
            for ((element, _, one_value), (_, _, other_value)) in
                one.elements().zip(other.elements())
            {
                // As text, which distinguishes 0 from -0.
                let (one_value, other_value) = (one_value.to_string(), other_value.to_string());
                if one_value != other_value {
                    let name = full_name(one.signal.name, element);
                    return field(name, one_value, other_value);
                }
            }
        }
        // The content is equal, so it is the counter, the only other part of a valid frame.
        let counter = |decoded: &Decoded| decoded.counter.unwrap_or(0).to_string();
        field("counter".into(), counter(&expected), counter(&came))
    }
}

impl fmt::Display for Difference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Field {
                due,
                field,
                expected,
                found,
            } => write!(f, "{}.{field} is {found} instead of {expected}", name(due)),
            Self::Damaged { due, error } => write!(f, "{} is damaged: {error}", name(due)),
            Self::Other { due, found } => write!(
                f,
                "{} instead of {} ({found} instead of {due})",
                name(found),
                name(due)
            ),
            Self::Missing { due } => write!(f, "{} is missing ({due})", name(due)),
            Self::Surplus { found } => write!(f, "{} is not expected ({found})", name(found)),
        }
    }
}

impl std::error::Error for Difference {}

/// Message of a frame, with its sample if the frame has it.
fn name(frame: &CanFrame) -> String {
    let name = table::of_frame(frame).map_or("an unknown frame", |info| info.name);
    match codec::decode(frame).map(|received| received.message) {
        Ok(Message::Command(command)) => format!("sample {}: {name}", command.sample),
        _ => name.into(),
    }
}

#[cfg(test)]
mod tests {
    use protocol::codec::encode;
    use protocol::frame::StandardId;
    use protocol::messages::{Command, ControlWord};

    use super::*;

    fn command(sample: u32, torque: [f32; 4], counter: u8) -> CanFrame {
        let command = Command {
            sample,
            control: ControlWord::TORQUE_ENABLE,
            torque,
        };
        encode(&Message::Command(command), counter).unwrap()
    }

    fn says(due: Option<&CanFrame>, found: Option<&CanFrame>) -> String {
        Difference::between(due, found).unwrap().to_string()
    }

    #[test]
    fn equal_frames_do_not_differ_whatever_the_link_makes_of_them() {
        let due = command(7, [1.0; 4], 0);
        assert_eq!(Difference::between(Some(&due), Some(&due)), None);
        let slow = CanFrame::fd(due.id(), due.data(), false).unwrap();
        assert_eq!(Difference::between(Some(&due), Some(&slow)), None);
        assert_eq!(Difference::between(None, None), None);
    }

    /// One bit of one torque; the sample before its torque; the sign of zero; the counter last.
    #[test]
    fn the_first_field_that_differs_is_named() {
        let due = command(4711, [1.0, 2.0, 3.0, 0.0], 5);
        let flipped = f32::from_bits(3.0_f32.to_bits() ^ 1);
        for (came, expected) in [
            (
                command(4711, [1.0, 2.0, flipped, 4.0], 5),
                "sample 4711: Command.torque_lift is 3.0000002 instead of 3",
            ),
            (
                command(4712, [9.0, 2.0, 3.0, 0.0], 5),
                "sample 4711: Command.sample is 4712 instead of 4711",
            ),
            (
                command(4711, [1.0, 2.0, 3.0, -0.0], 5),
                "sample 4711: Command.torque_wrist is -0 instead of 0",
            ),
            (
                command(4711, [1.0, 2.0, 3.0, 0.0], 6),
                "sample 4711: Command.counter is 6 instead of 5",
            ),
        ] {
            assert_eq!(says(Some(&due), Some(&came)), expected);
        }
    }

    #[test]
    fn other_missing_surplus_and_damaged_frames_are_named() {
        let due = command(8, [1.0; 4], 0);
        assert_eq!(
            says(Some(&due), None),
            format!("sample 8: Command is missing ({due})")
        );
        assert_eq!(
            says(None, Some(&due)),
            format!("sample 8: Command is not expected ({due})")
        );
        let heartbeat = CanFrame::classical(StandardId::new(0x741).unwrap(), &[]).unwrap();
        assert!(
            says(Some(&due), Some(&heartbeat))
                .starts_with("ControllerHeartbeat instead of sample 8: Command (741#")
        );
        let mut data = due.data().to_vec();
        data[10] ^= 1;
        let damaged = CanFrame::fd(due.id(), &data, true).unwrap();
        assert!(
            says(Some(&due), Some(&damaged)).starts_with("sample 8: Command is damaged: "),
            "{}",
            says(Some(&due), Some(&damaged))
        );
    }
}
