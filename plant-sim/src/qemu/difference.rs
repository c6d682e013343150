//! The first difference between what the board sent and what its twin would have sent.

use protocol::frame::CanFrame;
use protocol::messages::Message;

use trace::fields::{Decoded, full_name};

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

#[cfg(test)]
mod tests {
    use protocol::codec::encode;
    use protocol::frame::StandardId;
    use protocol::messages::{Command, ControlWord};

    use super::*;

    fn command(sample: u32, torque: [f32; 4]) -> CanFrame {
        let command = Command {
            sample,
            control: ControlWord::TORQUE_ENABLE,
            torque,
        };
        encode(&Message::Command(command), 0).unwrap()
    }

    #[test]
    fn equal_frames_do_not_differ() {
        let frames = [command(7, [1.0; 4]), command(8, [2.0; 4])];
        assert_eq!(first(&frames, &frames, 0), None);
    }

    /// One bit of one torque, in the second of two frames.
    #[test]
    fn a_flipped_bit_is_named_by_sample_and_field() {
        let due = [
            command(4710, [1.0, 2.0, 3.0, 4.0]),
            command(4711, [1.0, 2.0, 3.0, 4.0]),
        ];
        let flipped = f32::from_bits(3.0_f32.to_bits() ^ 1);
        let came = [due[0], command(4711, [1.0, 2.0, flipped, 4.0])];
        assert_eq!(
            first(&due, &came, 4_711_000).unwrap(),
            "differs from this process in sample 4711: Command.torque_lift: Float(3.0) expected, Float(3.0000002) sent"
        );
    }

    /// A field is the first that differs, and the frame is named by what was due.
    #[test]
    fn another_sample_is_named_before_its_torque() {
        let says = first(&[command(7, [1.0; 4])], &[command(8, [2.0; 4])], 0).unwrap();
        assert!(
            says.starts_with("differs from this process in sample 7: Command.sample: "),
            "{says}"
        );
    }

    /// What no field shows: a frame that the codec refuses, or a counter.
    #[test]
    fn what_shows_in_no_field_is_shown_whole() {
        let due = command(7, [1.0; 4]);
        let mut data: Vec<u8> = due.data().to_vec();
        data[10] ^= 1;
        let id = StandardId::new(protocol::table::COMMAND.id).unwrap();
        let corrupted = CanFrame::fd(id, &data, due.brs()).unwrap();
        let says = first(&[due], &[corrupted], 0).unwrap();
        assert!(
            says.contains(&format!("{due} expected, {corrupted} sent")),
            "{says}"
        );
    }

    #[test]
    fn a_frame_too_few_or_too_many_is_named() {
        let frames = [command(7, [1.0; 4]), command(8, [1.0; 4])];
        let missing = first(&frames, &frames[..1], 0).unwrap();
        assert_eq!(missing, format!("did not send {} in sample 8", frames[1]));
        let extra = first(&frames[..1], &frames, 0).unwrap();
        assert_eq!(extra, format!("sent {} too much in sample 8", frames[1]));
    }
}
