//! The DBC has the contents of the table, within the limits of the format. Other tools read it in `tests/ci`.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::collections::HashSet;

use protocol::schema::Kind;
use protocol::table::TABLE;
use trace::dbc;

/// One `SG_` line: name, multiplexor mark, and the bits of the message that it covers.
struct Line {
    name: String,
    multiplex: Option<String>,
    bits: HashSet<usize>,
}

fn parse(line: &str) -> Line {
    let (head, tail) = line.split_once(" : ").unwrap();
    let mut words = head.split_whitespace().skip(1).map(str::to_owned);
    let layout = tail.split_whitespace().next().unwrap();
    let (place, order) = layout.split_once('@').unwrap();
    let (start, length) = place.split_once('|').unwrap();
    let (start, length): (usize, usize) = (start.parse().unwrap(), length.parse().unwrap());
    let bits = if order.starts_with('1') {
        (start..start + length).collect()
    } else {
        // Motorola: from the start bit down within a byte, then on from bit 7 of the next.
        (0..length)
            .scan(start, |bit, _| {
                let here = *bit;
                *bit = if here % 8 == 0 { here + 15 } else { here - 1 };
                Some(here)
            })
            .collect()
    };
    Line {
        name: words.next().unwrap(),
        multiplex: words.next(),
        bits,
    }
}

fn signals_of(text: &str, id: u16) -> Vec<Line> {
    text.lines()
        .skip_while(|line| !line.starts_with(&format!("BO_ {id} ")))
        .skip(1)
        .take_while(|line| line.starts_with(" SG_"))
        .map(parse)
        .collect()
}

/// 32 characters of letters, digits and underscores (DBC file format 1.0, C identifiers).
#[test]
fn names_are_legal_and_unique() {
    let text = dbc::generate();
    let legal = |name: &str| {
        name.len() <= 32
            && name.starts_with(|c: char| c.is_ascii_alphabetic() || c == '_')
            && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
    };
    for info in TABLE {
        assert!(legal(info.name), "{}", info.name);
        let mut seen = HashSet::new();
        for signal in signals_of(&text, info.id) {
            assert!(legal(&signal.name), "{} {}", info.name, signal.name);
            assert!(
                seen.insert(signal.name.clone()),
                "{} {}",
                info.name,
                signal.name
            );
        }
    }
    assert!(text.is_ascii());
}

/// Words that C23 and C++23 keep for themselves (ISO/IEC 9899:2024, 6.4.1; ISO/IEC 14882:2024, 5.11 and 5.12).
const KEYWORDS: &str = "
    alignas alignof and and_eq asm atomic auto bitand bitor bool break case catch char char16_t char32_t char8_t class co_await
    co_return co_yield compl concept const const_cast consteval constexpr constinit continue decltype default delete do
    double dynamic_cast else enum explicit export extern false float for friend goto if inline int long mutable namespace
    new noexcept not not_eq nullptr operator or or_eq private protected public register reinterpret_cast requires restrict
    return short signed sizeof static static_assert static_cast struct switch template this thread_local throw true try
    typedef typeid typename typeof typeof_unqual union unsigned using virtual void volatile wchar_t while xor xor_eq";

/// Generators of C and C++ make identifiers of the names, in lower case or as they are.
#[test]
fn names_are_no_keywords_of_c() {
    let text = dbc::generate();
    let is_keyword = |name: &str| {
        KEYWORDS
            .split_whitespace()
            .any(|keyword| name.eq_ignore_ascii_case(keyword))
    };
    assert!(is_keyword("Register"));
    for info in TABLE {
        assert!(!is_keyword(info.name), "{}", info.name);
        for signal in signals_of(&text, info.id) {
            assert!(!is_keyword(&signal.name), "{} {}", info.name, signal.name);
        }
    }
}

/// Signals stay inside the message, and share bits only if never present together.
#[test]
fn signals_do_not_overlap() {
    let text = dbc::generate();
    for info in TABLE {
        let signals = signals_of(&text, info.id);
        for (index, one) in signals.iter().enumerate() {
            assert!(one.bits.iter().all(|&bit| bit < 8 * info.len));
            for other in &signals[index + 1..] {
                let exclusive = one.multiplex != other.multiplex
                    && one.multiplex.is_some()
                    && other.multiplex.is_some()
                    && one.multiplex.as_deref() != Some("M")
                    && other.multiplex.as_deref() != Some("M");
                assert!(
                    exclusive || one.bits.is_disjoint(&other.bits),
                    "{} {}",
                    one.name,
                    other.name
                );
            }
        }
    }
}

/// Every element and flag of the table is a signal, and nothing else except counter and CRC.
#[test]
fn every_field_is_there() {
    let text = dbc::generate();
    for info in TABLE {
        let fields: usize = info
            .signals
            .iter()
            .map(|signal| match signal.kind {
                Kind::Flags8(names) | Kind::Flags16(names) => names.len(),
                _ => signal.elements.len(),
            })
            .sum();
        let protection = if info.protection.is_some() { 2 } else { 0 };
        assert_eq!(
            signals_of(&text, info.id).len(),
            fields + protection,
            "{}",
            info.name
        );
    }
}

/// A number seen on the bus leads to its name, unit and range in the file.
#[test]
fn parameters_are_named_where_their_numbers_are() {
    let text = dbc::generate();
    for parameter in protocol::parameters::all() {
        let row = format!("{} {}: ", parameter.rule.number, parameter.name);
        // Reply and request of the controller, and for parameters of the drives also theirs.
        let expected = match parameter.server() {
            protocol::messages::Server::Controller => 2,
            protocol::messages::Server::Drives => 4,
        };
        assert_eq!(text.matches(&row).count(), expected, "{row}");
    }
    assert!(text.contains("16 bandwidth: 1 to 1000 rad/s, settable at rest; "));
}
