//! Validation of models: good models pass, and every number that breaks its rule is named.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

mod common;

use common::{arm, irb_930_short, payload};
use firmware::mechanics::arm::{ArmModel, Axis, IRB_930, ModelError, Payload, Rule};
use proptest::prelude::*;

fn refused(change: impl FnOnce(&mut ArmModel)) -> ModelError {
    let mut arm = IRB_930;
    change(&mut arm);
    arm.validate().expect_err("a model that breaks a rule")
}

#[test]
fn real_arms_are_valid() {
    assert_eq!(IRB_930.validate(), Ok(()));
    assert_eq!(irb_930_short().validate(), Ok(()));
}

proptest! {
    #[test]
    fn arms_of_the_property_tests_are_valid(arm in arm(), payload in payload()) {
        prop_assert_eq!(arm.validate(), Ok(()));
        prop_assert_eq!(arm.validate_payload(&payload).is_ok(), payload.mass <= arm.payload_max);
    }
}

#[test]
fn refusal_names_field_axis_value_and_rule() {
    let error = refused(|arm| arm.links[2].mass = -1.0);
    assert_eq!(
        error,
        ModelError {
            field: "link.mass",
            axis: Some(Axis::Lift),
            value: -1.0,
            rule: Rule::Positive
        }
    );
    assert_eq!(
        error.to_string(),
        "link.mass of the Lift axis is -1, but has to be finite and greater than zero"
    );

    let error = refused(|arm| arm.limits.upper.w = -7.0);
    assert_eq!(
        (error.field, error.axis),
        ("limits.upper", Some(Axis::Wrist))
    );
    assert_eq!(error.rule, Rule::Above(IRB_930.limits.lower.w));
}

#[test]
fn numbers_that_are_none_are_refused() {
    for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        assert_eq!(refused(|arm| arm.geometry.a1 = bad).field, "geometry.a1");
        assert_eq!(refused(|arm| arm.geometry.d4 = bad).field, "geometry.d4");
        assert_eq!(refused(|arm| arm.links[0].com.y = bad).field, "link.com");
        assert_eq!(refused(|arm| arm.gravity = bad).field, "gravity");
        assert_eq!(
            refused(|arm| arm.limits.lower.x = bad).field,
            "limits.lower"
        );
        assert_eq!(
            refused(|arm| arm.limits.upper.x = bad).field,
            "limits.upper"
        );
        assert_eq!(refused(|arm| arm.payload_max = bad).field, "payload_max");
    }
}

#[test]
fn zeros_that_would_divide_are_refused() {
    assert_eq!(refused(|arm| arm.geometry.a2 = 0.0).field, "geometry.a2");
    assert_eq!(
        refused(|arm| arm.links[3].inertia.z = 0.0).field,
        "link.inertia"
    );
    assert_eq!(
        refused(|arm| arm.limits.velocity.y = 0.0).field,
        "limits.velocity"
    );
    assert_eq!(
        refused(|arm| arm.limits.acceleration.y = 0.0).field,
        "limits.acceleration"
    );
    assert_eq!(refused(|arm| arm.limits.jerk.y = 0.0).field, "limits.jerk");
    assert_eq!(
        refused(|arm| arm.limits.effort.y = 0.0).field,
        "limits.effort"
    );
    assert_eq!(
        refused(|arm| arm.limits.effort_continuous.y = 0.0).field,
        "limits.effort_continuous"
    );
    assert_eq!(
        refused(|arm| arm.drive.gear_ratio.z = 0.0).field,
        "drive.gear_ratio"
    );
    assert_eq!(
        refused(|arm| arm.drive.screw_lead = 0.0).field,
        "drive.screw_lead"
    );
    assert_eq!(refused(|arm| arm.drive.screw_hand = 0.0).rule, Rule::Sign);
    assert_eq!(
        refused(|arm| arm.drive.motor_torque_limit.x = 0.0).field,
        "drive.motor_torque_limit"
    );
    assert_eq!(
        refused(|arm| arm.drive.motor_torque_rated.x = 0.0).field,
        "drive.motor_torque_rated"
    );
    assert_eq!(
        refused(|arm| arm.drive.motor_speed_limit.x = 0.0).field,
        "drive.motor_speed_limit"
    );
    assert_eq!(
        refused(|arm| arm.drive.coulomb_eps.w = 0.0).field,
        "drive.coulomb_eps"
    );
    assert_eq!(
        refused(|arm| arm.drive.encoder_counts = 0).field,
        "drive.encoder_counts"
    );
}

#[test]
fn negatives_that_would_drive_are_refused() {
    assert_eq!(
        refused(|arm| arm.drive.rotor_inertia.x = -1.0).field,
        "drive.rotor_inertia"
    );
    assert_eq!(
        refused(|arm| arm.drive.viscous.x = -1.0).field,
        "drive.viscous"
    );
    assert_eq!(
        refused(|arm| arm.drive.coulomb.x = -1.0).field,
        "drive.coulomb"
    );
    assert_eq!(refused(|arm| arm.gravity = -9.81).rule, Rule::NotNegative);
}

#[test]
fn payload_over_the_rating_is_refused() {
    let heavy = Payload {
        mass: 22.5,
        ..Payload::NONE
    };
    let error = IRB_930
        .validate_payload(&heavy)
        .expect_err("over the rating");
    assert_eq!((error.value, error.rule), (22.5, Rule::AtMost(22.0)));
    let bent = Payload {
        inertia: nalgebra::Vector3::new(0.0, -1.0, 0.0),
        ..Payload::NONE
    };
    assert_eq!(
        IRB_930.validate_payload(&bent).expect_err("negative").field,
        "payload.inertia"
    );
}
