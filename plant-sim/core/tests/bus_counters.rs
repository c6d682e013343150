//! Error counters against a table worked out by hand from ISO 11898-1.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use sim::bus::{Counters, Rule, State};

fn counted(rules: &[(Rule, u32)]) -> Counters {
    let mut counters = Counters::default();
    for (rule, times) in rules {
        (0..*times).for_each(|_| counters.count(*rule));
    }
    counters
}

/// What happens, what was before, the event, the counters afterwards, the state.
type Row = (
    &'static str,
    &'static [(Rule, u32)],
    Rule,
    (u16, u16),
    State,
);

/// Rules of fault confinement, a row for each: letter, what happened before, the event, counters afterwards, state. Worked out by
/// hand from the text of the standard.
#[rustfmt::skip]
const RULES: [Row; 27] = {
    use Rule::{DominantAfterFlag as B, Received as H, ReceiverError as A, Sent as G, TransmitterFlag as C};
    use Rule::{ReceiverFlagBit as E, ReceiverHeld as FR, TransmitterFlagBit as D, TransmitterHeld as FT};
    use State::{BusOff, ErrorActive, ErrorPassive, Warning};
    [
        ("a: a receiver counts an error by 1", &[], A, (0, 1), ErrorActive),
        ("a: and an error more by 1 more", &[(A, 10)], A, (0, 11), ErrorActive),
        ("b: who was first to see it counts 8", &[(A, 1)], B, (0, 9), ErrorActive),
        ("c: a transmitter counts an error flag by 8", &[], C, (8, 0), ErrorActive),
        ("c: the counters do not mix", &[(A, 3)], C, (8, 3), ErrorActive),
        ("d: an error in its flag counts 8 more", &[(C, 1)], D, (16, 0), ErrorActive),
        ("e: that of a receiver as well", &[(A, 1)], E, (0, 9), ErrorActive),
        ("f: 14 dominant bits after the beginning of its flag count 8", &[(C, 1)], FT, (16, 0), ErrorActive),
        ("f: for a receiver as well", &[(A, 1), (B, 1)], FR, (0, 17), ErrorActive),
        ("f: and every 8 more, until bus-off", &[(C, 1), (FT, 30)], FT, (256, 0), BusOff),
        ("g: a frame sent takes 1 back", &[(C, 1)], G, (7, 0), ErrorActive),
        ("g: but not below 0", &[], G, (0, 0), ErrorActive),
        ("g: and nothing from the other counter", &[(A, 5)], G, (0, 5), ErrorActive),
        ("h: a frame received takes 1 back", &[(A, 5)], H, (0, 4), ErrorActive),
        ("h: but not below 0", &[], H, (0, 0), ErrorActive),
        ("h: from 127 as well", &[(B, 15), (A, 7)], H, (0, 126), Warning),
        ("h: from above 127 to between 119 and 127", &[(B, 31)], H, (0, 127), Warning),
        ("warning: not at 95", &[(B, 11), (A, 6)], A, (0, 95), ErrorActive),
        ("warning: at 96", &[(B, 11), (A, 7)], A, (0, 96), Warning),
        ("warning: of the transmitter as well", &[(C, 11)], C, (96, 0), Warning),
        ("passive: not at 127", &[(B, 15), (A, 6)], A, (0, 127), Warning),
        ("passive: at 128", &[(B, 15), (A, 7)], A, (0, 128), ErrorPassive),
        ("passive: of the transmitter as well", &[(C, 15)], C, (128, 0), ErrorPassive),
        ("passive: no more at 127", &[(C, 16)], G, (127, 0), Warning),
        ("passive: while either counter says so", &[(C, 16), (B, 16)], G, (127, 128), ErrorPassive),
        ("bus-off: not at 255", &[(C, 31), (G, 1)], C, (255, 0), ErrorPassive),
        ("bus-off: at 256", &[(C, 31)], C, (256, 0), BusOff),
    ]
};

#[test]
fn counters_follow_the_table() {
    for (row, before, rule, (transmit, receive), state) in RULES {
        let mut counters = counted(before);
        counters.count(rule);
        let found = (counters.transmit(), counters.receive());
        assert_eq!(
            (found, counters.state()),
            ((transmit, receive), state),
            "{row}"
        );
    }
}

/// However often, a receiver is never bus-off.
#[test]
fn receive_errors_alone_never_lead_to_bus_off() {
    let counters = counted(&[(Rule::DominantAfterFlag, 100)]);
    assert_eq!(
        (counters.receive(), counters.state()),
        (255, State::ErrorPassive)
    );
}
