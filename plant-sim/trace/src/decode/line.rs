//! What a line of a decoded trace in JSON holds, for its schema. The decoder writes the same by hand: names and units are
//! constants of the message table, and millions of lines are no work for a serialiser.

use std::collections::BTreeMap;

use schemars::JsonSchema;
use serde::Serialize;

/// One record of a trace: a frame, or an error frame of the interface. The format is JSON Lines, an object on a line.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Line")]
pub struct JsonLine {
    /// Time as in the trace, s.
    pub time_s: f64,
    /// Interface.
    pub interface: String,
    /// Identifier, hexadecimal: three digits of 11 bits or eight of 29.
    pub id: String,
    /// Name of the message, `ErrorFrame`, or `-` for an identifier that no message has.
    pub message: String,
    /// `Rx` or `Tx`, where the trace says it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub direction: Option<String>,
    /// End-to-end counter, where the message has one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub counter: Option<u8>,
    /// Fields by name, in the order of the message table, of a frame that is one of its messages.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub fields: Option<BTreeMap<String, JsonField>>,
    /// Why the frame has no fields, or what the interface reports.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// The frame as candump writes it, or the bytes of an error frame; where there are no fields.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub raw: Option<String>,
}

/// One field of a message.
#[derive(Serialize, JsonSchema)]
#[schemars(rename = "Field")]
pub struct JsonField {
    /// A number; the name of a code; or the names of the bits that are set.
    pub value: JsonValue,
    /// Unit, where there is one.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub unit: Option<String>,
}

/// A number, the name of a code, or the names of the bits that are set.
#[derive(Serialize, JsonSchema)]
#[serde(untagged)]
#[schemars(rename = "Value")]
pub enum JsonValue {
    /// A number.
    Number(f64),
    /// The name of a code.
    Name(String),
    /// The names of the bits that are set.
    Names(Vec<String>),
}
