//! The host's end of the board's UART: slcan, in lock-step.

use std::io::{self, ErrorKind, Read, Write};

use protocol::frame::CanFrame;
use protocol::slcan::{Line, MAX_LINE, Parser, Text};

/// A line to a board that acknowledges every line by an empty one, after its answers.
#[derive(Debug)]
pub(super) struct Serial<S> {
    stream: S,
    parser: Parser,
    /// Bytes of the last read, and the number of those not yet processed.
    buffer: [u8; MAX_LINE],
    unread: std::ops::Range<usize>,
}

impl<S: Read + Write> Serial<S> {
    /// A line before its first use.
    pub(super) fn new(stream: S) -> Self {
        Self {
            stream,
            parser: Parser::new(),
            buffer: [0; MAX_LINE],
            unread: 0..0,
        }
    }

    /// Opens the bus: 1 Mbit/s, data phase 5 Mbit/s. Frames that the board then sends are appended to
    /// `sent`.
    pub(super) fn open(&mut self, sent: &mut Vec<CanFrame>) -> io::Result<()> {
        // An empty line first, to end an unfinished one.
        for line in [
            Line::Empty,
            Line::Bitrate(8),
            Line::DataBitrate(5),
            Line::Open,
        ] {
            self.say(line)?;
            self.answer(sent)?;
        }
        Ok(())
    }

    /// Sends a frame.
    pub(super) fn send(&mut self, frame: &CanFrame) -> io::Result<()> {
        self.say(Line::Frame(*frame))
    }

    /// Closes the bus. There is no answer.
    pub(super) fn close(&mut self) -> io::Result<()> {
        self.say(Line::Close)
    }

    fn say(&mut self, line: Line) -> io::Result<()> {
        self.stream.write_all(Text::from(line).as_bytes())
    }

    /// Appends the frames that the board sends before it acknowledges the oldest line.
    pub(super) fn answer(&mut self, sent: &mut Vec<CanFrame>) -> io::Result<()> {
        loop {
            let byte = self.byte()?;
            let line = match self.parser.push(byte) {
                None => continue,
                Some(Ok(Line::Empty)) => return Ok(()),
                Some(Ok(Line::Frame(frame))) => {
                    sent.push(frame);
                    continue;
                }
                Some(Ok(Line::Refused)) => "the board refused a line".to_string(),
                Some(Ok(line)) => format!("not an answer: {line:?}"),
                Some(Err(error)) => format!("not slcan: {error}"),
            };
            return Err(io::Error::new(ErrorKind::InvalidData, line));
        }
    }

    fn byte(&mut self) -> io::Result<u8> {
        if self.unread.is_empty() {
            self.unread = 0..self.stream.read(&mut self.buffer)?;
        }
        let place = self.unread.next().ok_or(ErrorKind::UnexpectedEof)?;
        Ok(self.buffer[place])
    }
}

#[cfg(test)]
mod tests {
    use protocol::frame::StandardId;

    use super::*;

    /// Output of a board, and what was sent to it.
    struct Script(io::Cursor<Vec<u8>>, Vec<u8>);

    impl Read for Script {
        fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
            // One byte at a time: a line may arrive in any pieces.
            self.0.read(&mut buffer[..1])
        }
    }

    impl Write for Script {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.1.write(bytes)
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    fn ask(answer: &[u8]) -> (io::Result<()>, Vec<CanFrame>, Vec<u8>) {
        let mut serial = Serial::new(Script(io::Cursor::new(answer.to_vec()), Vec::new()));
        let frame = CanFrame::fd(StandardId::new(0x1C0).unwrap(), &[1, 2], true).unwrap();
        let mut sent = Vec::new();
        let result = serial.send(&frame).and_then(|()| serial.answer(&mut sent));
        (result, sent, serial.stream.1)
    }

    #[test]
    fn frames_up_to_the_empty_line_are_the_answer() {
        let (result, sent, told) = ask(b"b24010A\rt3000\r\rt3001FF\r");
        result.unwrap();
        let sent: Vec<String> = sent.iter().map(ToString::to_string).collect();
        assert_eq!(sent, ["240##10A", "300#"]);
        assert_eq!(told, b"b1C020102\r");
    }

    #[test]
    fn whatever_is_no_answer_is_an_error() {
        for (answer, says) in [
            (&b"\x07"[..], "refused"),
            (b"xyz\r", "not slcan"),
            (b"V\r", "not an answer"),
            (b"t3000\r", "end of file"),
        ] {
            let error = ask(answer).0.unwrap_err().to_string();
            assert!(error.contains(says), "{answer:?}: {error}");
        }
    }
}
