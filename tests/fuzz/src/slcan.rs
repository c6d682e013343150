//! Lines of serial-line CAN.

use protocol::slcan::{Line, Parser, Text};

fn lines(bytes: &[u8]) -> Vec<Line> {
    let mut parser = Parser::new();
    bytes
        .iter()
        .filter_map(|&byte| parser.push(byte)?.ok())
        .collect()
}

/// A line that is understood is written as one that is understood in the same way.
pub(crate) fn slcan(bytes: &[u8]) {
    // The registers of a bit timing are another adapter's and not kept, so that they cannot be written either.
    for line in lines(bytes)
        .into_iter()
        .filter(|line| *line != Line::Timing)
    {
        assert_eq!(lines(Text::from(line).as_bytes()), [line]);
    }
}
