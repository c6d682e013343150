//! The message table as a DBC file, the format in which CAN tools exchange the meaning of frames (Vector, DBC 1.0).
//!
//! It is written from the same table that the codec reads, so the two cannot drift apart. FD frames are marked by the
//! attributes `VFrameFormat` and `CANFD_BRS`, real numbers by `SIG_VALTYPE_`; a set of flags becomes one signal per
//! bit.

use std::fmt::Write as _;

use protocol::e2e::Profile;
use protocol::messages::{Node, Server};
use protocol::parameters;
use protocol::schema::{Content, Kind, MessageInfo, Rate, Signal};
use protocol::table::{self, TABLE};

use crate::fields::full_name;

/// No node, or any node.
const ANYBODY: &str = "Vector__XXX";
/// Cycle time of messages sent every sample, ms: the default rate of 1 kHz.
const SAMPLE_MS: u32 = 1;
/// Frame formats, by their numbers in the attribute `VFrameFormat`.
const FRAME_FORMATS: [&str; 16] = [
    "StandardCAN",
    "ExtendedCAN",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "reserved",
    "StandardCAN_FD",
    "ExtendedCAN_FD",
];
const STANDARD_CAN_FD: u32 = 14;

/// A line of text; writing to a string cannot fail.
macro_rules! line {
    ($text:expr) => {{
        let _ = writeln!($text);
    }};
    ($text:expr, $($arg:tt)*) => {{
        let _ = writeln!($text, $($arg)*);
    }};
}

/// The whole file.
#[must_use]
pub fn generate() -> String {
    let mut text = String::new();
    line!(
        text,
        "VERSION \"SCARA drive cabinet, schema {:08x}\"",
        table::HASH
    );
    line!(text, "\nNS_ :\n\nBS_:\n");
    let nodes: Vec<&str> = Node::ALL.iter().copied().map(node_name).collect();
    line!(text, "BU_: {}", nodes.join(" "));
    for info in TABLE {
        line!(text);
        message(&mut text, info);
    }
    line!(text);
    for info in TABLE.iter().filter(|info| info.sender.is_none()) {
        line!(text, "BO_TX_BU_ {} : {};", info.id, nodes.join(","));
    }
    comments(&mut text);
    attributes(&mut text);
    for info in TABLE {
        for signal in info.signals {
            if let Kind::Code(codes) | Kind::Selector(codes) = signal.kind {
                values(&mut text, info, signal, codes);
            }
        }
    }
    for info in TABLE {
        for cell in cells(info).iter().filter(|cell| cell.float) {
            line!(text, "SIG_VALTYPE_ {} {} : 1;", info.id, cell.name);
        }
    }
    text
}

fn node_name(node: Node) -> &'static str {
    match node {
        Node::Drives => "Drives",
        Node::Controller => "Controller",
        Node::Operator => "Operator",
    }
}

/// One signal of the DBC: an element of a signal of the table, a flag of it, the counter or the CRC.
struct Cell {
    name: String,
    /// `M`, `m3` or nothing.
    multiplex: String,
    /// Start bit, length and byte order, as `SG_` has them.
    layout: String,
    signed: bool,
    float: bool,
    min: f64,
    max: f64,
    unit: &'static str,
    comment: Option<String>,
}

impl Cell {
    /// An unsigned little-endian number without unit.
    fn unsigned(name: String, start: usize, bits: usize) -> Self {
        Self {
            name,
            multiplex: String::new(),
            layout: format!("{start}|{bits}@1"),
            signed: false,
            float: false,
            min: 0.0,
            max: ((1_u64 << bits) - 1) as f64,
            unit: "",
            comment: None,
        }
    }
}

fn cells(info: &MessageInfo) -> Vec<Cell> {
    let mut cells: Vec<Cell> = info.signals.iter().flat_map(cells_of).collect();
    cells.extend(protection(info));
    cells
}

fn cells_of(signal: &Signal) -> Vec<Cell> {
    let multiplex = match (signal.kind, signal.when) {
        (Kind::Selector(_), _) => " M".to_owned(),
        (_, Some(tag)) => format!(" m{tag}"),
        _ => String::new(),
    };
    if let Kind::Flags8(names) | Kind::Flags16(names) = signal.kind {
        let flag = |(bit, name): (usize, &&str)| Cell {
            multiplex: multiplex.clone(),
            ..Cell::unsigned(
                full_name(signal.name, &name.replace('-', "_")),
                8 * signal.offset + bit,
                1,
            )
        };
        return names.iter().enumerate().map(flag).collect();
    }
    let size = signal.kind.size();
    let element = |(index, &(element, unit)): (usize, &(&str, &'static str))| {
        let mut cell = Cell::unsigned(
            full_name(signal.name, element),
            8 * (signal.offset + index * size),
            8 * size,
        );
        cell.multiplex.clone_from(&multiplex);
        cell.unit = unit;
        match signal.kind {
            Kind::I16 => (cell.signed, cell.min, cell.max) = (true, -32768.0, 32767.0),
            Kind::I32 => {
                (cell.signed, cell.min, cell.max) = (true, -2_147_483_648.0, 2_147_483_647.0);
            }
            Kind::F32 { min, max } => {
                // A real number is signed by definition.
                (cell.signed, cell.float) = (true, true);
                (cell.min, cell.max) = (shortest(min), shortest(max));
            }
            _ => {}
        }
        cell
    };
    signal.elements.iter().enumerate().map(element).collect()
}

/// The double with the same shortest decimal form as this float, not the equal one: 0.1 instead of 0.10000000149.
fn shortest(value: f32) -> f64 {
    value.to_string().parse().unwrap_or(f64::from(value))
}

/// Counter and CRC: the last bytes of a protected frame.
fn protection(info: &MessageInfo) -> Vec<Cell> {
    let Some(profile) = info.protection else {
        return Vec::new();
    };
    let counter_byte = info.body_len();
    let crc_byte = counter_byte + 1;
    let (bits, crc, algorithm) = match profile {
        Profile::Classical => (
            4,
            Cell::unsigned("crc".into(), 8 * crc_byte, 8),
            "CRC_8_AUTOSAR",
        ),
        // Big-endian: the start bit is the most significant one.
        Profile::Fd => (
            8,
            Cell {
                layout: format!("{}|16@0", 8 * crc_byte + 7),
                ..Cell::unsigned("crc".into(), 8 * crc_byte, 16)
            },
            "CRC_16_IBM_3740",
        ),
    };
    vec![
        Cell {
            comment: Some("End-to-end counter: one more in each frame of this identifier.".into()),
            ..Cell::unsigned("counter".into(), 8 * counter_byte, bits)
        },
        Cell {
            comment: Some(format!(
                "{algorithm} of the identifier (two bytes, big-endian) and of all bytes before the CRC."
            )),
            ..crc
        },
    ]
}

fn message(text: &mut String, info: &MessageInfo) {
    let sender = info.sender.map_or(ANYBODY, node_name);
    line!(text, "BO_ {} {}: {} {sender}", info.id, info.name, info.len);
    let receivers = receivers(info);
    for cell in cells(info) {
        let sign = if cell.signed { '-' } else { '+' };
        line!(
            text,
            " SG_ {}{} : {}{sign} (1,0) [{}|{}] \"{}\" {receivers}",
            cell.name,
            cell.multiplex,
            cell.layout,
            number(cell.min),
            number(cell.max),
            cell.unit
        );
    }
}

/// Receivers: the one named, or all but the sender.
fn receivers(info: &MessageInfo) -> String {
    let listens = |node: &Node| match info.receiver {
        Some(receiver) => *node == receiver,
        None => info.sender != Some(*node),
    };
    let names: Vec<&str> = Node::ALL
        .iter()
        .copied()
        .filter(listens)
        .map(node_name)
        .collect();
    names.join(",")
}

/// A number in short form.
fn number(value: f64) -> String {
    if value.abs() < 1e15 {
        value.to_string()
    } else {
        format!("{value:E}").replace("E", "E+")
    }
}

fn comments(text: &mut String) {
    line!(
        text,
        "CM_ \"Generated from the message table. Axis order: shoulder, elbow, lift, wrist.\";"
    );
    for info in TABLE {
        line!(text, "CM_ BO_ {} \"{}\";", info.id, describe(info));
        for cell in cells(info) {
            if let Some(comment) = cell.comment {
                line!(text, "CM_ SG_ {} {} \"{comment}\";", info.id, cell.name);
            }
        }
        let index = match info.content {
            Content::ParameterReply(server) => Some(("value_index", server)),
            Content::ParameterRequest(server) => Some(("set_index", server)),
            _ => None,
        };
        if let Some((signal, server)) = index {
            let numbers = numbers(server);
            line!(text, "CM_ SG_ {} {signal} \"{numbers}\";", info.id);
        }
    }
}

/// Parameters of a server; the controller also answers for the drives.
fn numbers(server: Server) -> String {
    let rows: Vec<String> = parameters::all()
        .filter(|parameter| server == Server::Controller || parameter.server() == server)
        .map(|parameter| {
            let rule = &parameter.rule;
            let unit = match parameter.unit {
                "" => String::new(),
                unit => format!(" {unit}"),
            };
            format!(
                "{} {}: {} to {}{unit}, settable {}",
                rule.number,
                parameter.name,
                rule.lower,
                rule.upper,
                rule.settable.name()
            )
        })
        .collect();
    rows.join("; ")
}

fn describe(info: &MessageInfo) -> String {
    let sender = info.sender.map_or("any node", Node::name);
    let receiver = info.receiver.map_or("all", Node::name);
    let rate = match info.rate {
        Rate::EverySample => "every sample".to_owned(),
        Rate::Hertz(hertz) => format!("at {hertz} Hz"),
        Rate::Event => "when there is a reason".to_owned(),
    };
    format!("From {sender} to {receiver}, {rate}.")
}

fn attributes(text: &mut String) {
    let formats: Vec<String> = FRAME_FORMATS
        .iter()
        .map(|name| format!("\"{name}\""))
        .collect();
    line!(text, "BA_DEF_ \"BusType\" STRING ;");
    line!(
        text,
        "BA_DEF_ BO_ \"VFrameFormat\" ENUM {};",
        formats.join(",")
    );
    line!(text, "BA_DEF_ BO_ \"CANFD_BRS\" ENUM \"0\",\"1\";");
    line!(text, "BA_DEF_ BO_ \"GenMsgCycleTime\" INT 0 65535;");
    line!(text, "BA_DEF_DEF_ \"BusType\" \"CAN FD\";");
    line!(text, "BA_DEF_DEF_ \"VFrameFormat\" \"StandardCAN\";");
    line!(text, "BA_DEF_DEF_ \"CANFD_BRS\" \"0\";");
    line!(text, "BA_DEF_DEF_ \"GenMsgCycleTime\" 0;");
    line!(text, "BA_ \"BusType\" \"CAN FD\";");
    for info in TABLE {
        let id = info.id;
        if info.is_fd() {
            line!(text, "BA_ \"VFrameFormat\" BO_ {id} {STANDARD_CAN_FD};");
            line!(text, "BA_ \"CANFD_BRS\" BO_ {id} 1;");
        }
        let cycle = match info.rate {
            Rate::EverySample => SAMPLE_MS,
            Rate::Hertz(hertz) => 1000 / u32::from(hertz),
            Rate::Event => continue,
        };
        line!(text, "BA_ \"GenMsgCycleTime\" BO_ {id} {cycle};");
    }
}

fn values(text: &mut String, info: &MessageInfo, signal: &Signal, codes: &[(u8, &str)]) {
    let codes: String = codes
        .iter()
        .map(|(code, name)| format!("{code} \"{name}\" "))
        .collect();
    line!(text, "VAL_ {} {} {codes};", info.id, signal.name);
}
