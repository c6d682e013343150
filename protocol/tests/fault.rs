//! Faults as text, and how much of them an emergency keeps.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use protocol::messages::*;

/// Expected sentences written by hand.
#[test]
fn a_fault_reads_as_a_sentence_with_axis_and_unit() {
    let of_axis = |cause, axis, value, limit| Fault {
        cause,
        axis,
        value,
        limit,
    };
    use FaultAxis::{Elbow, Lift, Shoulder, Tool, Wrist};
    let status = DriveStatus::READY | DriveStatus::FAULT;
    for (fault, sentence) in [
        (
            of_axis(Cause::FollowingError, Lift, 0.0021, 0.002),
            "following error, axis 3 (lift): 2.1 mm, limit 2.0 mm",
        ),
        (
            of_axis(Cause::FollowingError, Shoulder, -0.0613, 0.05),
            "following error, axis 1 (shoulder): -0.061 rad, limit 0.050 rad",
        ),
        (
            of_axis(Cause::OverSpeed, Elbow, 13.5, 13.439),
            "over speed, axis 2 (elbow): 13.50 rad/s, limit 13.44 rad/s",
        ),
        (
            of_axis(Cause::OverSpeed, Lift, -2.5, 2.42),
            "over speed, axis 3 (lift): -2.50 m/s, limit 2.42 m/s",
        ),
        (
            of_axis(Cause::OverSpeed, Tool, 0.262, 0.25),
            "over speed, tool: 0.26 m/s, limit 0.25 m/s",
        ),
        // More digits only where it takes them to tell value and limit apart.
        (
            of_axis(Cause::OverSpeed, Tool, 0.2523, 0.25),
            "over speed, tool: 0.252 m/s, limit 0.250 m/s",
        ),
        (
            of_axis(Cause::OverSpeed, Tool, 0.250_02, 0.25),
            "over speed, tool: 0.25002 m/s, limit 0.25000 m/s",
        ),
        (
            of_axis(Cause::FollowingError, Lift, -0.002_01, 0.002),
            "following error, axis 3 (lift): -2.01 mm, limit 2.00 mm",
        ),
        (
            Fault::value(Cause::Overrun, 5.0, 5.0),
            "overrun: 5 samples in a row, limit 5 samples in a row",
        ),
        (
            of_axis(Cause::SoftLimit, Wrist, 7.1, 7.0313),
            "soft limit, axis 4 (wrist): 7.100 rad, limit 7.031 rad",
        ),
        (
            of_axis(Cause::EncoderFault, Lift, 0.2, 0.0342),
            "encoder fault, axis 3 (lift): 200.0 mm, limit 34.2 mm",
        ),
        (
            Fault::value(Cause::EncoderFault, f32::from(status.bits()), 0.0),
            "encoder fault: drive status ready fault",
        ),
        (
            Fault::value(Cause::DriveFault, f32::from(status.bits()), 0.0),
            "drive fault: drive status ready fault",
        ),
        (
            Fault::value(
                Cause::DriveFault,
                f32::from(status.bits()),
                f32::from((DriveStatus::BRAKE_RELEASED | DriveStatus::TORQUE_ON).bits()),
            ),
            "drive fault: drive status ready fault, not torque-on brake-released",
        ),
        (
            Fault::value(Cause::FeedbackLost, 6.0, 5.0),
            "feedback lost: 6.0 ms, limit 5.0 ms",
        ),
        (
            Fault::value(Cause::Corrupted, 3.0, 0.0),
            "corrupted: 3 frames in a row",
        ),
        (
            Fault::value(Cause::SelfTest, f32::from(KnownAnswer::Crc.code()), 0.0),
            "self test: crc",
        ),
        (Fault::because(Cause::EStop), "estop"),
        (Fault::NONE, "none"),
    ] {
        assert_eq!(fault.to_string(), sentence);
    }
}

/// Eight bytes have no room for the axis, so the unit is ambiguous where it depends on the axis.
#[test]
fn an_emergency_keeps_the_value() {
    let emergency = Emergency::new(Cause::FollowingError, 0.0021f32.to_bits());
    assert_eq!(emergency.value(), 0.0021);
    assert_eq!(
        emergency.fault().to_string(),
        "following error: 0.0021 rad or m"
    );
    let jump = Emergency::new(Cause::EncoderFault, (-0.0126f32).to_bits());
    assert_eq!(jump.fault().to_string(), "encoder fault: -0.0126 rad or m");
    let nonsense = Emergency::new(Cause::OverSpeed, f32::NAN.to_bits());
    assert_eq!(nonsense.value(), 0.0);
    assert_eq!(nonsense.fault().to_string(), "over speed");
}

#[test]
fn names_of_codes_are_found_again() {
    for &law in Law::ALL {
        assert_eq!(Law::from_name(law.name()), Some(law));
        assert_eq!(Law::try_from(law.code()), Ok(law));
    }
    for &compensation in Compensation::ALL {
        assert_eq!(
            Compensation::from_name(compensation.name()),
            Some(compensation)
        );
    }
    assert_eq!(Law::from_name("PID"), None);
    let unknown = Law::try_from(Law::ALL.len() as u8).unwrap_err();
    assert_eq!(unknown.to_string(), "unknown code 6");
    for &cause in Cause::ALL {
        assert!(cause.describe().ends_with('.'), "{cause}");
    }
    for &reason in RefusalReason::ALL {
        assert!(reason.describe().ends_with('.'), "{reason}");
    }
}
