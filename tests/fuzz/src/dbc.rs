//! Frames decoded by the text of the DBC file alone, and by the decoder.

use std::collections::BTreeMap;
use std::sync::LazyLock;

use protocol::table::TABLE;
use trace::fields::{Decoded, Value, full_name};

use crate::Bytes;
use crate::frame::of_message;

/// A line `SG_`: ` SG_ NAME [M|mN] : START|LENGTH@ORDER SIGN ...`.
struct Signal {
    name: String,
    is_selector: bool,
    tag: Option<u64>,
    start: usize,
    length: usize,
    is_little_endian: bool,
    is_signed: bool,
}

/// Signals by identifier, as the file has them.
static MESSAGES: LazyLock<BTreeMap<u16, Vec<Signal>>> = LazyLock::new(|| {
    let mut messages: BTreeMap<u16, Vec<Signal>> = BTreeMap::new();
    let mut id = 0;
    for line in trace::dbc::generate().lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.first() {
            Some(&"BO_") => id = words[1].parse().unwrap(),
            Some(&"SG_") => messages.entry(id).or_default().push(signal(&words)),
            _ => {}
        }
    }
    messages
});

fn signal(words: &[&str]) -> Signal {
    let mark = if words[2] == ":" { "" } else { words[2] };
    let layout = words[if mark.is_empty() { 3 } else { 4 }];
    let (place, order) = layout.split_once('@').unwrap();
    let (start, length) = place.split_once('|').unwrap();
    Signal {
        name: words[1].into(),
        is_selector: mark == "M",
        tag: mark.strip_prefix('m').map(|tag| tag.parse().unwrap()),
        start: start.parse().unwrap(),
        length: length.parse().unwrap(),
        is_little_endian: order.starts_with('1'),
        is_signed: order.ends_with('-'),
    }
}

fn raw(signal: &Signal, data: &[u8]) -> u64 {
    let bit = |place: usize| u64::from(data[place / 8] >> (place % 8) & 1);
    if signal.is_little_endian {
        (0..signal.length).map(|n| bit(signal.start + n) << n).sum()
    } else {
        // From the most significant bit on, down through each byte.
        let mut place = signal.start;
        (0..signal.length).fold(0, |value, _| {
            let value = value << 1 | bit(place);
            place = if place.is_multiple_of(8) {
                place + 15
            } else {
                place - 1
            };
            value
        })
    }
}

/// Every signal that is present has the value that the decoder gives it, and there are no others.
pub(crate) fn dbc(bytes: &[u8]) {
    let mut bytes = Bytes(bytes);
    let info = TABLE[usize::from(bytes.byte()) % TABLE.len()];
    let counter = bytes.byte();
    let frame = of_message(info, counter, &mut bytes);
    let Ok(decoded) = Decoded::new(&frame) else {
        return;
    };
    let signals = &MESSAGES[&info.id];
    let selected = signals.iter().find(|signal| signal.is_selector);
    let selected = selected.map(|signal| raw(signal, frame.data()));
    let mut left: BTreeMap<&str, (u64, &Signal)> = signals
        .iter()
        .filter(|signal| signal.tag.is_none() || signal.tag == selected)
        .map(|signal| (signal.name.as_str(), (raw(signal, frame.data()), signal)))
        .collect();
    let mut take = |name: &str| {
        left.remove(name)
            .unwrap_or_else(|| panic!("{}: no {name} in the DBC", info.name))
    };
    for field in decoded.fields() {
        for (element, _, value) in field.elements() {
            let name = full_name(field.signal.name, element);
            match value {
                Value::Flags(bits, names) => {
                    for (bit, flag) in names.iter().enumerate() {
                        let (raw, _) = take(&full_name(&name, &flag.replace('-', "_")));
                        assert_eq!(raw, u64::from(bits >> bit & 1), "{name}: {flag}");
                    }
                }
                Value::Unsigned(value) => assert_eq!(take(&name).0, u64::from(value), "{name}"),
                Value::Float(value) => {
                    assert_eq!(take(&name).0, u64::from(value.to_bits()), "{name}");
                }
                Value::Signed(value) => {
                    let (raw, signal) = take(&name);
                    assert!(signal.is_signed, "{name}");
                    let shift = 64 - signal.length;
                    assert_eq!((raw << shift) as i64 >> shift, i64::from(value), "{name}");
                }
                // Names of values have lines of their own, which cantools reads in tests/ci.
                Value::Code(_) => drop(take(&name)),
            }
        }
    }
    if info.protection.is_some() {
        assert_eq!(Some(take("counter").0 as u8), decoded.counter);
        take("crc");
    }
    assert!(left.is_empty(), "{}: {:?}", info.name, left.keys());
}
