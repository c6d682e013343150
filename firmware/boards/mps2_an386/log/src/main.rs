//! `board-log IMAGE < LOG`: the board's log as text, to standard output. defmt sends message numbers; the texts are in the
//! image.
//!
//! A program of its own, since those who never emulate a board need not compile its many libraries.

use std::fmt::Write as _;
use std::io::{self, Read as _, Write as _};
use std::process::ExitCode;

use defmt_decoder::{DecodeError, Table};

fn main() -> ExitCode {
    let mut arguments = std::env::args_os().skip(1);
    let (Some(image), None) = (arguments.next(), arguments.next()) else {
        eprintln!("usage: board-log IMAGE < LOG");
        return ExitCode::from(64);
    };
    let text = std::fs::read(&image)
        .map_err(|error| format!("{}: {error}", image.display()))
        .and_then(|image| {
            let mut log = Vec::new();
            let read = io::stdin().read_to_end(&mut log);
            read.map_err(|error| error.to_string())?;
            decode(&image, &log)
        })
        .and_then(|text| {
            let written = io::stdout().write_all(text.as_bytes());
            written.map_err(|error| error.to_string())
        });
    match text {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("board-log: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Every message as a line: time in s, level, text. An unreadable one becomes an error line.
///
/// # Errors
/// The image has no messages, or those of another version of defmt.
fn decode(image: &[u8], log: &[u8]) -> Result<String, String> {
    let table = Table::parse(image)
        .map_err(|error| error.to_string())?
        .ok_or("the image has no messages (no section .defmt)")?;
    Ok(lines(&table, log))
}

fn lines(table: &Table, log: &[u8]) -> String {
    let mut decoder = table.new_stream_decoder();
    decoder.received(log);
    let mut text = String::new();
    loop {
        let line = match decoder.decode() {
            Ok(message) => message.display(false).to_string(),
            Err(DecodeError::Malformed) => "ERROR damaged, or a message of another image".into(),
            Err(DecodeError::UnexpectedEof) => break,
        };
        let _ = writeln!(text, "{line}");
    }
    // A message ends with a zero.
    if log.last().is_some_and(|last| *last != 0) {
        text.push_str("ERROR cut off in the middle of a message\n");
    }
    text
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use serde_json::json;

    use super::*;

    /// One message with a number, preceded by a time in milliseconds.
    fn table() -> Table {
        let entry = |tag, text| json!({"string": {"tag": tag, "string": text}, "raw_symbol": ""});
        let table = json!({
            "timestamp": entry("Timestamp", "{=u32:ms}"),
            "entries": {
                "1": entry("Info", "worst {=u8}"),
                "2": entry("Warn", "{=str} {=[u8]} {=?} {=bool} {=f32} {=0..3}"),
            },
            "bitflags": {},
            "encoding": "Rzcobs",
        });
        serde_json::from_value(table).unwrap()
    }

    /// Message 1 at 0x0102 ms with 9, by hand: the zeros are left out; the last byte before the end marks their places
    /// (rzCOBS, bit n for byte n of seven).
    const MESSAGE: [u8; 6] = [1, 2, 1, 9, 0b0011_0010, 0];

    #[test]
    fn a_message_is_a_line() {
        let twice = [&[0], &MESSAGE[..], &MESSAGE[..]].concat();
        assert_eq!(
            lines(&table(), &twice),
            "0.258 INFO worst 9\n0.258 INFO worst 9\n"
        );
        assert_eq!(lines(&table(), &[]), "");
    }

    #[test]
    fn a_log_that_was_cut_or_is_of_another_image_says_so() {
        let cut = [&MESSAGE[..], &MESSAGE[..3]].concat();
        assert_eq!(
            lines(&table(), &cut),
            "0.258 INFO worst 9\nERROR cut off in the middle of a message\n"
        );
        let mut other = MESSAGE;
        other[0] = 7;
        assert_eq!(
            lines(&table(), &[&other[..], &MESSAGE[..]].concat()),
            "ERROR damaged, or a message of another image\n0.258 INFO worst 9\n"
        );
        assert!(decode(b"no image", &MESSAGE).is_err());
    }

    proptest! {
        #[test]
        fn no_garbage_is_a_panic(log in proptest::collection::vec(any::<u8>(), 0..200)) {
            lines(&table(), &log);
        }

        /// A message with a valid number and nothing else valid.
        #[test]
        fn no_damage_is_a_panic(rest in proptest::collection::vec(any::<u8>(), 0..60)) {
            if let Ok((message, _)) = table().decode(&[&[2, 0][..], &rest[..]].concat()) {
                message.display(false).to_string();
            }
        }
    }
}
