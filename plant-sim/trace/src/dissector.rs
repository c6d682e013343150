//! The message table as a dissector for Wireshark and tshark, in Lua.
//!
//! What is the same for every table is in `dissector/scara.lua`; in front of it comes the table, from which the codec reads
//! too. Filters are `scara.MESSAGE.SIGNAL` in lower case, signals named as in the DBC: `scara.feedback.position_elbow`.

use std::fmt::Write as _;

use protocol::e2e::Profile;
use protocol::schema::{Content, Kind, MessageInfo, Signal};
use protocol::table::{self, TABLE};

use crate::fields::full_name;

/// The whole file.
#[must_use]
pub fn generate() -> String {
    let mut text = format!(
        "-- Dissector of the SCARA drive cabinet's messages for Wireshark, schema {:08x}. Generated from the message table.\n\n\
         local messages = {{\n",
        table::HASH
    );
    for info in TABLE {
        message(&mut text, info);
    }
    text + "}\n\n" + include_str!("dissector/scara.lua")
}

/// An entry of the table. Writing to a string cannot fail.
fn message(text: &mut String, info: &MessageInfo) {
    let _ = writeln!(
        text,
        "    [0x{:03X}] = {{ name = \"{}\", length = {}, protected = {}, fd = {}, may_be_empty = {}, signals = {{",
        info.id,
        info.name,
        info.len,
        info.protection.is_some(),
        info.protection == Some(Profile::Fd),
        info.content == Content::EStop,
    );
    for signal in info.signals {
        let size = signal.kind.size();
        for (index, (element, unit)) in signal.elements.iter().enumerate() {
            self::signal(text, signal, element, unit, signal.offset + index * size);
        }
    }
    text.push_str("    } },\n");
}

fn signal(text: &mut String, signal: &Signal, element: &str, unit: &str, at: usize) {
    let name = full_name(signal.name, element);
    let mut rest = String::new();
    if let Some(tag) = signal.when {
        let _ = write!(rest, ", tag = {tag}");
    }
    if !unit.is_empty() {
        let _ = write!(rest, ", unit = \"{unit}\"");
    }
    let kind = match signal.kind {
        Kind::U8 | Kind::Code(_) | Kind::Selector(_) | Kind::Flags8(_) => "u8",
        Kind::U16 | Kind::Flags16(_) => "u16",
        Kind::U32 => "u32",
        Kind::I16 => "i16",
        Kind::I32 => "i32",
        Kind::F32 { .. } => "f32",
    };
    let mut line = |name: &str, more: &str| {
        let _ = writeln!(
            text,
            "        {{ name = \"{name}\", at = {at}, kind = \"{kind}\"{rest}{more} }},"
        );
    };
    match signal.kind {
        Kind::Flags8(names) | Kind::Flags16(names) => {
            for (bit, flag) in names.iter().enumerate() {
                let name = full_name(&name, &flag.replace('-', "_"));
                line(&name, &format!(", bit = {bit}"));
            }
        }
        Kind::Code(codes) | Kind::Selector(codes) => {
            let names: Vec<String> = codes
                .iter()
                .map(|(code, name)| format!("[{code}] = \"{name}\""))
                .collect();
            let selects = match signal.kind {
                Kind::Selector(_) => ", selects = true",
                _ => "",
            };
            line(
                &name,
                &format!("{selects}, codes = {{ {} }}", names.join(", ")),
            );
        }
        _ => line(&name, ""),
    }
}
