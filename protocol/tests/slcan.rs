//! slcan against the CAN232 manual, the bytes of python-can, and garbage.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use proptest::prelude::*;
use protocol::frame::{CanFrame, ExtendedId, Id, StandardId};
use protocol::slcan::{Line, MAX_LINE, Parser, SlcanError, Text};

/// Feeds bytes one by one.
fn read(bytes: &[u8]) -> Vec<Result<Line, SlcanError>> {
    let mut parser = Parser::new();
    bytes.iter().filter_map(|&byte| parser.push(byte)).collect()
}

fn standard(raw: u16) -> Id {
    Id::Standard(StandardId::new(raw).unwrap())
}

fn extended(raw: u32) -> Id {
    Id::Extended(ExtendedId::new(raw).unwrap())
}

fn frame() -> impl Strategy<Value = CanFrame> {
    let id = prop_oneof![
        (0..0x800u16).prop_map(standard),
        (0..=0x1FFF_FFFFu32).prop_map(extended)
    ];
    let data = prop::collection::vec(any::<u8>(), 0..=64);
    (id, data, 0..4u8).prop_map(|(id, data, kind)| {
        let short = &data[..data.len().min(8)];
        match kind {
            0 => CanFrame::classical(id, short),
            1 => CanFrame::remote(id, short.len()),
            2 => CanFrame::fd(id, &data, false),
            _ => CanFrame::fd(id, &data, true),
        }
        .unwrap()
    })
}

fn line() -> impl Strategy<Value = Line> {
    prop_oneof![
        4 => frame().prop_map(Line::Frame),
        1 => (0..=8u8).prop_map(Line::Bitrate),
        1 => (0..=9u8).prop_map(Line::DataBitrate),
        1 => any::<[u8; 2]>().prop_map(Line::VersionIs),
        1 => any::<u32>().prop_map(Line::AcceptanceCode),
        1 => any::<u32>().prop_map(Line::AcceptanceMask),
        1 => any::<bool>().prop_map(Line::Timestamps),
        1 => any::<bool>().prop_map(Line::AutoPoll),
        1 => any::<u8>().prop_map(Line::StatusIs),
        1 => "[0-9A-Za-z]{4}".prop_map(|text| Line::SerialNumberIs(text.into_bytes().try_into().unwrap())),
        1 => prop::sample::select(vec![
            Line::Empty, Line::Refused, Line::Open, Line::Listen, Line::Close, Line::Version, Line::SerialNumber, Line::Status,
        ]),
    ]
}

/// Text on the left from the CAN232 manual and the Linux and CANable dialects, frames by hand.
#[test]
fn lines_are_written_and_read_as_documented() {
    let all: Vec<u8> = (0..64).collect();
    let all_hex: String = all.iter().map(|byte| format!("{byte:02X}")).collect();
    let cases = [
        (
            "t10021133\r",
            CanFrame::classical(standard(0x100), &[0x11, 0x33]),
        ),
        ("t0000\r", CanFrame::classical(standard(0), &[])),
        (
            "T0000010021133\r",
            CanFrame::classical(extended(0x100), &[0x11, 0x33]),
        ),
        ("r1002\r", CanFrame::remote(standard(0x100), 2)),
        ("R1FFFFFFF8\r", CanFrame::remote(extended(0x1FFF_FFFF), 8)),
        (
            "d1239000102030405060708090A0B\r",
            CanFrame::fd(standard(0x123), &all[..12], false),
        ),
        ("b1C0101\r", CanFrame::fd(standard(0x1C0), &[1], true)),
    ];
    for (text, frame) in cases {
        let line = Line::Frame(frame.unwrap());
        assert_eq!(Text::from(line).as_bytes(), text.as_bytes());
        assert_eq!(read(text.as_bytes()), [Ok(line)]);
    }
    let longest = format!("B1FFFFFFFF{all_hex}\r");
    assert_eq!(longest.len(), MAX_LINE);
    let line = Line::Frame(CanFrame::fd(extended(0x1FFF_FFFF), &all, true).unwrap());
    assert_eq!(Text::from(line).as_bytes(), longest.as_bytes());
    assert_eq!(read(longest.as_bytes()), [Ok(line)]);
}

/// The bytes that python-can sends when it opens a port.
#[test]
fn python_can_opens() {
    let lines = [
        Line::Close,
        Line::Bitrate(8),
        Line::Empty,
        Line::Open,
        Line::Open,
    ]
    .map(Ok);
    assert_eq!(read(b"C\rS8\r\rO\rO\r"), lines);
    assert_eq!(
        read(b"V\rV1013\r\x07"),
        [
            Ok(Line::Version),
            Ok(Line::VersionIs([0x10, 0x13])),
            Ok(Line::Refused)
        ]
    );
}

/// Registers of the CAN232's controller, and a rate in the dialect of others.
#[test]
fn bit_timing_is_read_in_any_dialect() {
    assert_eq!(read(b"s031C\rs8\r"), [Ok(Line::Timing); 2]);
}

#[test]
fn errors_say_what_is_wrong_and_the_next_line_is_read() {
    use SlcanError::{IdOutOfRange, NotHex, OutOfRange, TooLong, UnknownCommand, WrongLength};
    let cases: [(&[u8], SlcanError); 26] = [
        (b"x", UnknownCommand(b'x')),
        (b"Z2", OutOfRange(2)),
        (b"m1234567", WrongLength),
        (b"F0", WrongLength),
        (b"N12345", WrongLength),
        (b"s", UnknownCommand(b's')),
        (b"t1232ABCD123", WrongLength),
        (b"\0", UnknownCommand(0)),
        (b"o", UnknownCommand(b'o')),
        (b"t", WrongLength),
        (b"t12", WrongLength),
        (b"t123", WrongLength),
        (b"t1232AB", WrongLength),
        (b"t1232ABCDE", WrongLength),
        (b"r1232AB", WrongLength),
        (b"t8000", IdOutOfRange(0x800)),
        (b"T200000000", IdOutOfRange(0x2000_0000)),
        (b"t1239", OutOfRange(9)),
        (b"r123F", OutOfRange(15)),
        (b"S9", OutOfRange(9)),
        (b"t1g30", NotHex { at: 2 }),
        (b"t1231-0", NotHex { at: 5 }),
        (b"t12310-", NotHex { at: 6 }),
        (b"O1", WrongLength),
        (b"V101", WrongLength),
        (&[b'D'; MAX_LINE + 8], TooLong),
    ];
    for (text, error) in cases {
        let bytes = [text, b"\rO\r"].concat();
        assert_eq!(
            read(&bytes),
            [Err(error), Ok(Line::Open)],
            "{}",
            text.escape_ascii()
        );
    }
}

/// Adapters that timestamp their frames (4 digits of ms, 8 of us), and hosts that end their lines with CR LF.
#[test]
fn timestamps_and_line_feeds_are_read_over() {
    let data = CanFrame::classical(standard(0x123), &[0xAB, 0xCD]).unwrap();
    let remote = CanFrame::remote(extended(0x123), 8).unwrap();
    let fd = CanFrame::fd(standard(0x1C0), &[1; 12], true).unwrap();
    let bytes = b"C\r\nt1232ABCD0FA1\r\nt1232abcd000f4240\r\nR000001238EA5F\r\n\nb1C090101010101010101010101011234\r";
    let frames = [data, data, remote, fd].map(|frame| Ok(Line::Frame(frame)));
    assert_eq!(read(bytes), [&[Ok(Line::Close)], &frames[..]].concat());
    assert_eq!(Text::stamped(&data, 4001).as_bytes(), b"t1232ABCD0FA1\r");
    assert_eq!(read(b"t1230000G\r"), [Err(SlcanError::NotHex { at: 8 })]);
    // Some adapters answer a sent frame with z or Z instead of nothing.
    assert_eq!(read(b"z\rZ\r"), [Ok(Line::Empty), Ok(Line::Empty)]);
}

/// A reader that starts in mid-line, or a sender that never ends its line, costs one line.
#[test]
fn a_line_without_end_is_one_error() {
    let mut bytes = vec![b'0'; 10 * 1024];
    bytes.extend(b"\rt1230\r");
    let frame = CanFrame::classical(standard(0x123), &[]).unwrap();
    assert_eq!(
        read(&bytes),
        [Err(SlcanError::TooLong), Ok(Line::Frame(frame))]
    );
    // A refusal cuts a line off: anything before it is not part of the next.
    assert_eq!(
        read(b"t12\x07t1230\r"),
        [Ok(Line::Refused), Ok(Line::Frame(frame))]
    );
}

proptest! {
    #[test]
    fn what_is_written_is_read(lines in prop::collection::vec(line(), 0..8)) {
        let bytes: Vec<u8> = lines.iter().flat_map(|&line| Text::from(line).as_bytes().to_vec()).collect();
        let expected: Vec<_> = lines.iter().map(|&line| Ok(line)).collect();
        prop_assert_eq!(read(&bytes), expected);
    }

    /// Whatever its timestamp, the frame is the same.
    #[test]
    fn stamped_frames_are_read(frame in frame(), milliseconds in any::<u16>()) {
        prop_assert_eq!(read(Text::stamped(&frame, milliseconds).as_bytes()), [Ok(Line::Frame(frame))]);
    }

    /// Digits of either case; the letters of the command have a meaning by their case.
    #[test]
    fn small_hex_digits_are_read(frame in frame()) {
        let mut bytes = Text::from(Line::Frame(frame)).as_bytes().to_vec();
        bytes[1..].make_ascii_lowercase();
        prop_assert_eq!(read(&bytes), [Ok(Line::Frame(frame))]);
    }

    /// One result per line end, whatever comes between, and the parser works afterwards.
    #[test]
    fn garbage_does_no_harm(bytes in prop::collection::vec(any::<u8>(), 0..2000), line in line()) {
        let ends = bytes.iter().filter(|&&byte| byte == b'\r' || byte == 0x07).count();
        prop_assert_eq!(read(&bytes).len(), ends);
        let mut bytes = bytes;
        bytes.push(b'\r');
        bytes.extend(Text::from(line).as_bytes());
        prop_assert_eq!(read(&bytes).last().copied(), Some(Ok(line)));
    }

    /// Garbage of the right letters: whatever parses is written back the same.
    #[test]
    fn near_misses_are_read_as_what_they_are(text in "[tTrRdDbB][0-9A-F]{4,12}") {
        if let [Ok(line)] = read(format!("{text}\r").as_bytes())[..] {
            let written = Text::from(line).as_bytes().to_vec();
            let frame = written.strip_suffix(b"\r").unwrap();
            let stamp = text.as_bytes().strip_prefix(frame).unwrap();
            prop_assert!(matches!(stamp.len(), 0 | 4 | 8));
        }
    }
}
