//! Decoded traces: a line of text per frame, a CSV row per field, or a JSON object per frame.

mod line;

use std::io::{self, Write};

use protocol::codec::DecodeError;
use protocol::frame::CanFrame;
use protocol::table;
use serde_json::Value as Json;

use super::fields::{Decoded, Field, Value, full_name};
use super::{Entry, ErrorFrame, Record};

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
        Ok(Self { sink, format })
    }

    /// Appends one record.
    ///
    /// # Errors
    /// Those of the sink.
    pub fn record(&mut self, record: &Record) -> io::Result<()> {
        let content = Content::new(record);
        match self.format {
            Format::Text => self.text(record, &content),
            Format::Csv => self.csv(record, &content),
            Format::JsonLines => self.json(record, &content),
        }
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

    fn text(&mut self, record: &Record, content: &Content) -> io::Result<()> {
        let sink = &mut self.sink;
        write!(
            sink,
            "{} {} {} {}",
            Seconds(record.time_us),
            record.interface,
            content.id(),
            content.name()
        )?;
        write!(sink, " ")?;
        content.words(sink)?;
        writeln!(sink)
    }

    fn csv(&mut self, record: &Record, content: &Content) -> io::Result<()> {
        let counter = match content {
            Content::Message(_, decoded) => decoded.counter,
            _ => None,
        };
        let start = format!(
            "{},{},{},{},{}",
            Seconds(record.time_us),
            csv_text(&record.interface.to_string()),
            content.id(),
            content.name(),
            counter.map_or(String::new(), |counter| counter.to_string())
        );
        let Content::Message(_, decoded) = content else {
            writeln!(self.sink, "{start},error,{},", csv_text(&content.error()))?;
            return writeln!(self.sink, "{start},raw,{},", content.raw());
        };
        for field in decoded.fields() {
            for (element, unit, value) in field.elements() {
                write!(
                    self.sink,
                    "{start},{},",
                    full_name(field.signal.name, element)
                )?;
                writeln!(self.sink, "{value},{unit}")?;
            }
        }
        Ok(())
    }

    /// Written by hand: names, units and messages come from tables and contain nothing that JSON has to escape.
    fn json(&mut self, record: &Record, content: &Content) -> io::Result<()> {
        let sink = &mut self.sink;
        write!(
            sink,
            r#"{{"time_s":{},"interface":{},"id":"{}","message":"{}""#,
            Seconds(record.time_us),
            // An interface may have any name.
            Json::from(record.interface.to_string()),
            content.id(),
            content.name()
        )?;
        if let Some(direction) = record.direction {
            write!(sink, r#","direction":"{}""#, direction.name())?;
        }
        match content {
            Content::Message(_, decoded) => {
                if let Some(counter) = decoded.counter {
                    write!(sink, r#","counter":{counter}"#)?;
                }
                sink.write_all(br#","fields":{"#)?;
                let mut separator = "";
                for field in decoded.fields() {
                    for element in field.elements() {
                        sink.write_all(separator.as_bytes())?;
                        separator = ",";
                        json_element(sink, field.signal.name, element)?;
                    }
                }
                sink.write_all(b"}}\n")
            }
            _ => writeln!(
                sink,
                r#","error":"{}","raw":"{}"}}"#,
                content.error(),
                content.raw()
            ),
        }
    }
}

/// Counter and fields of a record as text, without time, interface and identifier.
#[must_use]
pub fn describe(record: &Record) -> String {
    let mut text = Vec::new();
    // Writing to a vector cannot fail, and everything written is text.
    let _ = Content::new(record).words(&mut text);
    String::from_utf8_lossy(&text).into_owned()
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

    /// Counter and fields, or the error and the bytes.
    fn words(&self, sink: &mut impl Write) -> io::Result<()> {
        let Self::Message(_, decoded) = self else {
            return write!(sink, "{}: {}", self.error(), self.raw());
        };
        let mut separator = "";
        if let Some(counter) = decoded.counter {
            write!(sink, "#{counter}")?;
            separator = "  ";
        }
        for field in decoded.fields() {
            sink.write_all(separator.as_bytes())?;
            separator = "  ";
            text_field(sink, field)?;
        }
        Ok(())
    }

    fn id(&self) -> String {
        match self {
            Self::Message(frame, _) | Self::Refused(frame, _) => id(frame),
            Self::ErrorFrame(error) => format!("{:08X}", super::ERROR_FLAG | error.class),
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

/// A time with all its microseconds, exact.
pub(super) struct Seconds(pub u64);

impl std::fmt::Display for Seconds {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}.{:06}", self.0 / 1_000_000, self.0 % 1_000_000)
    }
}

/// `name=value unit`, or `name=(value, value) unit` if all elements share the unit.
fn text_field(sink: &mut impl Write, field: Field) -> io::Result<()> {
    write!(sink, "{}=", field.signal.name)?;
    let elements = field.signal.elements;
    let common = elements
        .first()
        .filter(|(_, first)| elements.iter().all(|(_, unit)| unit == first));
    if elements.len() > 1 {
        sink.write_all(b"(")?;
    }
    for (index, (_, unit, value)) in field.elements().enumerate() {
        if index > 0 {
            sink.write_all(b", ")?;
        }
        write!(sink, "{value}")?;
        if common.is_none() {
            write!(sink, " {unit}")?;
        }
    }
    if elements.len() > 1 {
        sink.write_all(b")")?;
    }
    match common {
        Some((_, unit)) if !unit.is_empty() => write!(sink, " {unit}"),
        _ => Ok(()),
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

/// `"name":{"value":1.5,"unit":"rad"}`; flags are a list of the names set.
fn json_element(
    sink: &mut impl Write,
    signal: &str,
    (element, unit, value): (&str, &str, Value),
) -> io::Result<()> {
    write!(sink, r#""{}":{{"value":"#, full_name(signal, element))?;
    match value {
        Value::Code(name) => write!(sink, r#""{name}""#)?,
        Value::Flags(..) => {
            let names: Vec<String> = value.flags().map(|name| format!("\"{name}\"")).collect();
            write!(sink, "[{}]", names.join(","))?;
        }
        // Enough digits to distinguish this float from every other.
        Value::Unsigned(_) | Value::Signed(_) | Value::Float(_) => write!(sink, "{value}")?,
    }
    if !unit.is_empty() {
        write!(sink, r#","unit":"{unit}""#)?;
    }
    sink.write_all(b"}")
}
