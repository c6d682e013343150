//! Decoded traces: a line of text per frame, a CSV row per field, or a JSON object per frame.

mod line;
mod template;

use std::io::{self, Write};

use protocol::codec::DecodeError;
use protocol::frame::CanFrame;
use protocol::table;

use super::fields::Decoded;
use super::text::Line;
use super::{Entry, ErrorFrame, Record};
use template::Template;

pub use line::{JsonField, JsonLine, JsonValue};

/// Format of a decoded trace.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Format {
    /// A line of text per frame.
    Text,
    /// `time_s,interface,id,message,counter,field,value,unit`: one row per field. A frame that is refused,
    /// foreign or an error frame has the fields `error` and `raw`.
    Csv,
    /// One object per frame.
    JsonLines,
}

/// Writes decoded records, one by one.
pub struct Decoder<W: Write> {
    sink: W,
    format: Format,
    /// Those of the frames so far.
    templates: Vec<Template>,
    line: Line,
    /// How each row of a record begins, in CSV.
    row: Line,
}

impl<W: Write> Decoder<W> {
    /// Begins a decoded trace; CSV begins with its header.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn new(mut sink: W, format: Format) -> io::Result<Self> {
        if format == Format::Csv {
            sink.write_all(b"time_s,interface,id,message,counter,field,value,unit\n")?;
        }
        Ok(Self {
            sink,
            format,
            templates: Vec::new(),
            line: Line::default(),
            row: Line::default(),
        })
    }

    /// Appends one record.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn record(&mut self, record: &Record) -> io::Result<()> {
        let content = Content::new(record);
        self.line.clear();
        match self.format {
            Format::Text => self.text(record, &content),
            Format::Csv => self.csv(record, &content),
            Format::JsonLines => self.json(record, &content),
        }
        self.sink.write_all(self.line.bytes())
    }

    /// Flushes the sink, so that a reader at the other end of a pipe sees everything.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn flush(&mut self) -> io::Result<()> {
        self.sink.flush()
    }

    /// Flushes and returns the sink.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn finish(mut self) -> io::Result<W> {
        self.sink.flush()?;
        Ok(self.sink)
    }

    /// The fields of a frame.
    fn fields(&mut self, decoded: &Decoded) {
        let known = self.templates.iter().position(|it| it.fits(decoded));
        let place = known.unwrap_or_else(|| {
            self.templates.push(Template::new(self.format, decoded));
            self.templates.len() - 1
        });
        self.templates[place].fill(decoded, &self.row, &mut self.line);
    }

    fn text(&mut self, record: &Record, content: &Content) {
        let line = &mut self.line;
        line.seconds(record.time_us);
        line.byte(b' ');
        line.extend(record.interface.as_bytes());
        line.byte(b' ');
        content.id(line);
        line.byte(b' ');
        line.word(content.name());
        line.byte(b' ');
        content.words(line);
        if let Content::Message(_, decoded) = content {
            self.fields(decoded);
        }
        self.line.byte(b'\n');
    }

    fn csv(&mut self, record: &Record, content: &Content) {
        let (line, row) = (&mut self.line, &mut self.row);
        row.clear();
        row.seconds(record.time_us);
        row.byte(b',');
        let interface = record.interface.as_bytes();
        if interface.iter().any(|byte| b",\"".contains(byte)) {
            row.word(&csv_text(&record.interface.to_string()));
        } else {
            row.extend(interface);
        }
        row.byte(b',');
        content.id(row);
        row.byte(b',');
        row.word(content.name());
        row.byte(b',');
        match content {
            Content::Message(_, decoded) => {
                if let Some(counter) = decoded.counter {
                    row.integer(counter);
                }
                self.fields(decoded);
            }
            _ => {
                line.extend(row.bytes());
                line.word(",error,");
                line.word(&csv_text(&content.error()));
                line.word(",\n");
                line.extend(row.bytes());
                line.word(",raw,");
                line.word(&content.raw());
                line.word(",\n");
            }
        }
    }

    fn json(&mut self, record: &Record, content: &Content) {
        let line = &mut self.line;
        line.word(r#"{"time_s":"#);
        line.seconds(record.time_us);
        line.word(r#","interface":""#);
        for &byte in record.interface.as_bytes() {
            // Printable ASCII, of which JSON escapes these.
            if b"\"\\".contains(&byte) {
                line.byte(b'\\');
            }
            line.byte(byte);
        }
        line.word(r#"","id":""#);
        content.id(line);
        line.word(r#"","message":""#);
        line.word(content.name());
        line.byte(b'"');
        if let Some(direction) = record.direction {
            line.word(r#","direction":""#);
            line.word(direction.name());
            line.byte(b'"');
        }
        match content {
            Content::Message(_, decoded) => {
                if let Some(counter) = decoded.counter {
                    line.word(r#","counter":"#);
                    line.integer(counter);
                }
                self.fields(decoded);
            }
            _ => {
                line.word(r#","error":""#);
                line.word(&content.error());
                line.word(r#"","raw":""#);
                line.word(&content.raw());
                line.byte(b'"');
            }
        }
        self.line.word("}\n");
    }
}

/// Counter and fields of a record as text, without time, interface and identifier.
#[must_use]
pub fn describe(record: &Record) -> String {
    let content = Content::new(record);
    let mut line = Line::default();
    content.words(&mut line);
    if let Content::Message(_, decoded) = &content {
        Template::new(Format::Text, decoded).fill(decoded, &Line::default(), &mut line);
    }
    String::from_utf8_lossy(line.bytes()).into_owned()
}

/// Decoded content of a record.
enum Content<'a> {
    Message(&'a CanFrame, Decoded),
    Refused(&'a CanFrame, DecodeError),
    ErrorFrame(&'a ErrorFrame),
}

impl<'a> Content<'a> {
    fn new(record: &'a Record) -> Self {
        match &record.entry {
            Entry::Frame(frame) => match Decoded::new(frame) {
                Ok(decoded) => Self::Message(frame, decoded),
                Err(error) => Self::Refused(frame, error),
            },
            Entry::Error(error) => Self::ErrorFrame(error),
        }
    }

    /// What comes before the fields: the counter. If there are none, the error and the bytes.
    fn words(&self, line: &mut Line) {
        match self {
            Self::Message(_, decoded) => {
                if let Some(counter) = decoded.counter {
                    line.byte(b'#');
                    line.integer(counter);
                }
            }
            _ => {
                line.word(&self.error());
                line.word(": ");
                line.word(&self.raw());
            }
        }
    }

    fn id(&self, line: &mut Line) {
        match self {
            Self::Message(frame, _) | Self::Refused(frame, _) => {
                line.hex(frame.raw_id(), if frame.is_extended() { 8 } else { 3 });
            }
            Self::ErrorFrame(error) => line.hex(super::ERROR_FLAG | error.class, 8),
        }
    }

    fn name(&self) -> &'static str {
        match self {
            Self::Message(_, decoded) => decoded.info.name,
            Self::Refused(frame, _) => table::of_frame(frame).map_or("-", |info| info.name),
            Self::ErrorFrame(_) => "ErrorFrame",
        }
    }

    fn error(&self) -> String {
        match self {
            Self::Message(..) => String::new(),
            Self::Refused(_, error) => error.to_string(),
            Self::ErrorFrame(error) => error.to_string(),
        }
    }

    fn raw(&self) -> String {
        match self {
            Self::Message(frame, _) | Self::Refused(frame, _) => frame.to_string(),
            Self::ErrorFrame(error) => error
                .data()
                .iter()
                .map(|byte| format!("{byte:02X}"))
                .collect(),
        }
    }
}

/// Identifier as candump writes it: three or eight digits.
pub(super) fn id(frame: &CanFrame) -> String {
    if frame.is_extended() {
        format!("{:08X}", frame.raw_id())
    } else {
        format!("{:03X}", frame.raw_id())
    }
}

/// Quoted if it has to be (RFC 4180).
fn csv_text(text: &str) -> String {
    if text.contains([',', '"']) {
        format!("\"{}\"", text.replace('"', "\"\""))
    } else {
        text.to_owned()
    }
}
