//! What becomes of an attempt to send a frame: who sees an error, who destroys the frame, who counts what.
//!
//! ```text
//! error                    the flag begins after    dominant bits    transmitter    receivers
//! bit                      the bit                  12               c              a
//! stuff, form              the bit                  6                c (or none)    a
//! CRC, of some             acknowledge delimiter    7                c              a; those who saw it also b
//! no acknowledgement       acknowledge slot         7 (alone: 6)     c              a
//! ```
//!
//! A passive receiver does not destroy a frame that it alone has read wrong, and a passive transmitter without
//! acknowledgement destroys nothing: receivers take its frame, which it then repeats.

use super::anatomy::Field;
use super::counters::{Counters, Rule, State};
use super::disturbance::{ErrorKind, Hit};

/// Bits of an error flag.
const FLAG: u32 = 6;
/// Dominant bits where one node has seen the error a whole flag before the others: the most that the standard allows.
pub(super) const LONGEST_FLAGS: u32 = 2 * FLAG;
/// Dominant bits where the others see an error in the first bit of the flag.
const FOLLOWED_FLAG: u32 = 1 + FLAG;

/// A node that reads the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Reader {
    /// Its state before the frame.
    pub(super) state: State,
    /// Whether it reads a wrong CRC.
    pub(super) misreads: bool,
}

/// After which bit an error flag begins.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Flagged {
    /// After the bit of this number.
    Bit(usize),
    /// After the first bit of this field.
    Field(Field),
}

/// What becomes of an attempt.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Course {
    /// Where the frame ends early, and the bits of the flags there; `None` where it is on the bus to its end.
    pub(super) destroyed: Option<(Flagged, u32)>,
    /// Whether the transmitter takes it for sent. Otherwise it repeats the frame.
    pub(super) sent: bool,
    /// Whether the transmitter is busy with an error flag of its own, which nobody sees.
    pub(super) passive_flag: bool,
    /// What the transmitter counts, in turn.
    pub(super) transmitter: Vec<Rule>,
    /// What each reader counts, in turn, and whether it receives the frame.
    pub(super) readers: Vec<(Vec<Rule>, bool)>,
    /// What is wrong, as the one that sees it first reports it: the transmitter, or the first reader that misreads.
    pub(super) error: Option<ErrorKind>,
}

/// The course of a frame from a transmitter in `state` to `readers`, with this error on the wire or in what the transmitter
/// reads.
pub(super) fn course(state: State, readers: &[Reader], hit: Option<Hit>) -> Course {
    let wire = hit.filter(|hit| hit.kind != ErrorKind::Ack);
    let is_acknowledged = readers.iter().any(|reader| !reader.misreads);
    let is_missing = hit.is_some() || !is_acknowledged;
    let unread = readers.iter().any(|reader| reader.misreads);
    let is_flagged = (readers.iter()).any(|reader| reader.misreads && reader.state.is_active());
    let destroyed = |flagged, flags, transmitter: Option<Rule>, error| Course {
        destroyed: Some((flagged, flags)),
        sent: false,
        passive_flag: false,
        transmitter: transmitter.into_iter().collect(),
        readers: vec![(vec![Rule::ReceiverError], false); readers.len()],
        error: Some(error),
    };
    let unacknowledged = if hit.is_some() || readers.is_empty() {
        ErrorKind::Ack
    } else {
        ErrorKind::Crc
    };
    let flag = Some(Rule::TransmitterFlag);
    if let Some(Hit { kind, index, bit }) = wire {
        let flags = match kind {
            ErrorKind::Bit if !readers.is_empty() => LONGEST_FLAGS,
            _ => FLAG,
        };
        let is_excepted = kind == ErrorKind::Stuff && bit.is_excepted();
        destroyed(
            Flagged::Bit(index),
            flags,
            flag.filter(|_| !is_excepted),
            kind,
        )
    } else if is_missing && state.is_active() {
        let flags = if readers.is_empty() {
            FLAG
        } else {
            FOLLOWED_FLAG
        };
        let place = Flagged::Field(Field::AckSlot);
        destroyed(place, flags, flag, unacknowledged)
    } else if is_flagged {
        let flags = if is_acknowledged { FOLLOWED_FLAG } else { FLAG };
        let place = Flagged::Field(Field::AckDelimiter);
        let mut course = destroyed(place, flags, flag, ErrorKind::Crc);
        for (reader, (rules, _)) in readers.iter().zip(&mut course.readers) {
            if reader.misreads && is_acknowledged {
                rules.push(Rule::DominantAfterFlag);
            }
        }
        course
    } else {
        // Nobody disturbs the frame: exception 1 of rule c, or a passive reader that has to do without it.
        let read = |reader: &Reader| match reader.misreads {
            true => (vec![Rule::ReceiverError], false),
            false => (vec![Rule::Received], true),
        };
        Course {
            destroyed: None,
            sent: !is_missing,
            passive_flag: is_missing,
            transmitter: (!is_missing).then_some(Rule::Sent).into_iter().collect(),
            readers: readers.iter().map(read).collect(),
            error: match (is_missing, unread) {
                (true, _) => Some(unacknowledged),
                (false, true) => Some(ErrorKind::Crc),
                (false, false) => None,
            },
        }
    }
}

/// The course of a frame in which the transmitter reads recessive bits that it sends dominant: so are those of its error flag,
/// each of which is an error in turn and begins a new flag, until it is passive or `bits` have passed. Receivers that have read the
/// beginning of the frame are in the same situation.
pub(super) fn shorted(
    transmitter: Counters,
    readers: &[Counters],
    hit: Hit,
    read: bool,
    bits: u32,
) -> Course {
    let in_vain = |mut counters: Counters, first, each, bits: u32| {
        let mut rules = vec![first];
        counters.count(first);
        while counters.state().is_active() && (rules.len() as u32) <= bits {
            rules.push(each);
            counters.count(each);
        }
        rules
    };
    let transmitter = in_vain(
        transmitter,
        Rule::TransmitterFlag,
        Rule::TransmitterFlagBit,
        bits,
    );
    let reader = |counters: &Counters| match read {
        // They notice by six equal bits.
        true => in_vain(
            *counters,
            Rule::ReceiverError,
            Rule::ReceiverFlagBit,
            bits.saturating_sub(FLAG - 1),
        ),
        false => Vec::new(),
    };
    let readers: Vec<Vec<Rule>> = readers.iter().map(reader).collect();
    let longest = readers.iter().map(|rules| rules.len() + FLAG as usize);
    let longest = longest
        .max()
        .filter(|_| read)
        .unwrap_or(0)
        .max(transmitter.len());
    Course {
        destroyed: Some((Flagged::Bit(hit.index), longest as u32 - 1 + FLAG)),
        sent: false,
        passive_flag: false,
        transmitter,
        readers: readers.into_iter().map(|rules| (rules, false)).collect(),
        error: Some(hit.kind),
    }
}

/// The course of frames of one identifier that differ in this bit, which some nodes send recessive and read dominant. One of those
/// is active and destroys all of them.
pub(super) fn clash(hit: Hit, readers: usize) -> Course {
    Course {
        destroyed: Some((Flagged::Bit(hit.index), LONGEST_FLAGS)),
        sent: false,
        passive_flag: false,
        transmitter: vec![Rule::TransmitterFlag],
        readers: vec![(vec![Rule::ReceiverError], false); readers],
        // The loser reports it.
        error: None,
    }
}
