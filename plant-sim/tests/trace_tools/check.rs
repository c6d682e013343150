//! Violations that `trace check` finds.

use super::*;

#[test]
fn a_good_trace_breaks_no_rule() {
    assert_eq!(check(&good()), None);
}

#[test]
fn every_rule_is_told_where_it_is_broken() {
    let torque = ControlWord::TORQUE_ENABLE;
    let mut damaged = *feedback(4).data().first_chunk::<48>().unwrap();
    damaged[10] ^= 1;
    let damaged = CanFrame::fd(StandardId::new(table::FEEDBACK.id).unwrap(), &damaged, true);
    let mut backwards = good();
    backwards[9].time_us = 3999;
    let mut twice = good();
    twice.insert(10, record(4300, command(4, 5, torque, [0.0; 4])));
    let mut late = good();
    for record in &mut late[10..] {
        record.time_us += 100_000;
    }
    let message = "Command";
    let cases = [
        (backwards, 9, Offence::Backwards { by_us: 1 }),
        (
            with(8, damaged.unwrap()),
            8,
            Offence::Refused {
                message: "Feedback",
                error: DecodeError::Crc,
            },
        ),
        (
            // The command that answers the lost feedback is the first evidence.
            without(8),
            8,
            Offence::Echo {
                found: 4,
                newest: 3,
            },
        ),
        (without(9), 9, Offence::Unanswered { sample: 4 }),
        (
            with(9, command(4, 3, torque, [0.0; 4])),
            9,
            Offence::Counter {
                message,
                counter: 3,
                verdict: Verdict::Duplicate,
            },
        ),
        (
            with(9, command(4, 2, torque, [0.0; 4])),
            9,
            Offence::Counter {
                message,
                counter: 2,
                verdict: Verdict::Stale(1),
            },
        ),
        (
            with(9, command(4, 7, torque, [0.0; 4])),
            9,
            Offence::Counter {
                message,
                counter: 7,
                verdict: Verdict::Lost(3),
            },
        ),
        (
            with(9, command(3, 4, torque, [0.0; 4])),
            9,
            Offence::Echo {
                found: 3,
                newest: 4,
            },
        ),
        (twice, 10, Offence::Twice { sample: 4 }),
        (good()[1..].to_vec(), 0, Offence::NoFeedback { found: 0 }),
        (
            late,
            10,
            Offence::Age {
                message: "Feedback",
                age_us: 101_000,
                limit_us: 100_000,
            },
        ),
        (
            with(9, command(4, 4, ControlWord::EMPTY, [0.0, 0.5, 0.0, 0.0])),
            9,
            Offence::TorqueDisabled {
                motor: 1,
                torque: 0.5,
            },
        ),
        (
            with(9, command(4, 4, torque, [0.0, 0.0, 0.0, -1.6])),
            9,
            Offence::TorqueLimit {
                motor: 3,
                torque: -1.6,
                limit: IRB_930.drive.motor_torque_limit.w,
            },
        ),
    ];
    for (records, index, offence) in cases {
        assert_eq!(check(&records), Some((index, offence)));
    }
    // A sample number that skips while the counter does not: a foreign sender.
    let skipping = Feedback {
        sample: 7,
        status: DriveStatus::READY,
        position: [0; 4],
        velocity: [0.0; 4],
        torque: [0; 4],
    };
    let skipping = codec::encode(&Message::Feedback(skipping), 4).unwrap();
    let offence = Offence::Sample {
        found: 7,
        expected: 4,
    };
    assert_eq!(check(&with(8, skipping)), Some((8, offence)));
}

#[test]
fn what_is_not_ours_is_not_judged() {
    let mut records = good();
    let foreign = CanFrame::classical(StandardId::new(0x123).unwrap(), &[1]).unwrap();
    records.insert(3, record(1100, foreign));
    let error = ErrorFrame::new(0x80, &[0; 8]).unwrap();
    records.insert(
        4,
        Record {
            entry: Entry::Error(error),
            ..record(1100, foreign)
        },
    );
    let mut checker = Checker::new(&IRB_930);
    for record in &records {
        checker.record(record).unwrap();
    }
    let counts = checker.counts();
    assert_eq!(
        (counts.judged, counts.foreign, counts.error_frames),
        (20, 1, 1)
    );
}
