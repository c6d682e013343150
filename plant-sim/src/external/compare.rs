//! The first difference between the frame that was due and the one that came, as a person looks for it.

use protocol::frame::CanFrame;
use protocol::table;

/// Names the first difference: message, field, and the bytes of both.
pub fn first_difference(expected: Option<&CanFrame>, found: &CanFrame) -> String {
    let Some(expected) = expected else {
        return format!("{} was not due ({found})", name(found));
    };
    if expected.id() != found.id() {
        return format!(
            "{} instead of {} ({found} instead of {expected})",
            name(found),
            name(expected)
        );
    }
    let differing = expected
        .data()
        .iter()
        .zip(found.data())
        .position(|(a, b)| a != b);
    let field = differing.map_or_else(|| "length".to_string(), |byte| field(found, byte));
    format!("{}, {field} ({found} instead of {expected})", name(found))
}

fn name(frame: &CanFrame) -> &'static str {
    table::of_frame(frame).map_or("a frame that is none of ours", |info| info.name)
}

/// Field that this byte belongs to.
fn field(frame: &CanFrame, byte: usize) -> String {
    let signal = table::of_frame(frame).and_then(|info| {
        info.signals
            .iter()
            .find(|signal| (signal.offset..signal.end()).contains(&byte))
    });
    match signal {
        Some(signal) => {
            let (element, _) = signal.elements[(byte - signal.offset) / signal.kind.size()];
            format!("{} {element}", signal.name).trim_end().to_string()
        }
        None => "counter or CRC".to_string(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::codec::encode;
    use protocol::messages::{Command, ControlWord, Message};

    fn command(torque: [f32; 4], counter: u8) -> CanFrame {
        let command = Command {
            sample: 7,
            control: ControlWord::EMPTY,
            torque,
        };
        encode(&Message::Command(command), counter).unwrap()
    }

    #[test]
    fn the_first_differing_field_is_named() {
        let due = command([1.0, 2.0, 3.0, 4.0], 0);
        let third = first_difference(Some(&due), &command([1.0, 2.0, 3.5, 5.0], 0));
        assert!(third.starts_with("Command, torque "), "{third}");
        let counter = first_difference(Some(&due), &command([1.0, 2.0, 3.0, 4.0], 1));
        assert!(counter.starts_with("Command, counter or CRC"), "{counter}");
        let none = first_difference(None, &due);
        assert!(none.starts_with("Command was not due"), "{none}");
        let heartbeat =
            CanFrame::classical(protocol::frame::StandardId::new(0x741).unwrap(), &[]).unwrap();
        let other = first_difference(Some(&due), &heartbeat);
        assert!(
            other.starts_with("ControllerHeartbeat instead of Command"),
            "{other}"
        );
    }
}
