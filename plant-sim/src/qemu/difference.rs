//! The first difference between what the board sent and what its twin would have sent.

use protocol::frame::CanFrame;
use protocol::messages::Message;

use crate::trace::fields::{Decoded, full_name};

/// What is different first, or `None` if every frame is equal, byte for byte.
pub fn first(expected: &[CanFrame], sent: &[CanFrame], now: u64) -> Option<String> {
    if let Some((expected, sent)) = expected.iter().zip(sent).find(|(e, s)| e != s) {
        return Some(format!(
            "differs from this process {}: {}",
            place(expected, now),
            field(expected, sent)
        ));
    }
    let missing = expected.get(sent.len());
    let extra = sent.get(expected.len());
    match (missing, extra) {
        (Some(frame), _) => Some(format!("did not send {frame} {}", place(frame, now))),
        (_, Some(frame)) => Some(format!("sent {frame} too much {}", place(frame, now))),
        _ => None,
    }
}

/// Where in the run: the sample of a command, the time of any other frame.
fn place(frame: &CanFrame, now: u64) -> String {
    match protocol::codec::decode(frame).map(|received| received.message) {
        Ok(Message::Command(command)) => format!("in sample {}", command.sample),
        _ => format!("at {:.6} s", now as f64 * 1e-6),
    }
}

/// The first field that is different; the whole frames if that does not show in a field.
fn field(expected: &CanFrame, sent: &CanFrame) -> String {
    let whole = format!("{expected} expected, {sent} sent");
    let (Ok(expected), Ok(sent)) = (Decoded::new(expected), Decoded::new(sent)) else {
        return whole;
    };
    let name = expected.info.name;
    if name != sent.info.name {
        return whole;
    }
    for (expected, sent) in expected.fields().zip(sent.fields()) {
        let elements = expected.elements().zip(sent.elements());
        for ((element, _, expected_value), (_, _, sent_value)) in elements {
            if expected_value != sent_value {
                let field = full_name(expected.signal.name, element);
                return format!("{name}.{field}: {expected_value:?} expected, {sent_value:?} sent");
            }
        }
    }
    whole
}
