//! Model files: what is accepted, and the messages of refusals.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use sim::model::{Payload, RobotModel};

const DEFAULT: &str = include_str!("../../models/irb930-22-1.05.json");

/// The default model file with one passage replaced.
fn edited(from: &str, to: &str) -> String {
    assert_eq!(
        DEFAULT.matches(from).count(),
        1,
        "{from} must occur once in the file"
    );
    DEFAULT.replace(from, to)
}

fn refusal(text: &str) -> String {
    RobotModel::from_json(text)
        .expect_err("must be refused")
        .to_string()
}

/// Line of the default file that contains `passage`, counted from 1.
fn line_of(passage: &str) -> usize {
    1 + DEFAULT
        .lines()
        .position(|line| line.contains(passage))
        .unwrap()
}

#[test]
fn every_mistake_is_named_with_its_place_and_what_is_allowed() {
    let cases = [
        (
            r#""a1": 0.56"#,
            r#""a1": -0.56"#,
            "dh.a1 is -0.56; it must be a number > 0",
        ),
        (
            r#""a2": 0.49"#,
            r#""a2": "0.49""#,
            r#"dh.a2 is "0.49"; it must be a number > 0"#,
        ),
        (
            r#""mass": 14.5"#,
            r#""mass": 0"#,
            "links[1].mass is 0; it must be a number > 0",
        ),
        (
            r#""upper": [2.6"#,
            r#""upper": [-2.7"#,
            "must be above the lower limit -2.6179938779914944",
        ),
        (
            r#""screw_hand_sign": 1.0"#,
            r#""screw_hand_sign": 0.5"#,
            "drive.screw_hand_sign is 0.5; it must be 1 or -1",
        ),
        (
            r#": 131072"#,
            r#": 131072.5"#,
            "drive.encoder_counts_per_motor_rev is 131072.5; it must be a whole number",
        ),
        (
            r#""gravity": [0.0, 0.0"#,
            r#""gravity": [0.0, 0.1"#,
            "gravity is an array of 3; it must be vertical",
        ),
        (
            r#"3.141592653589793, 0.0, 0.0]"#,
            r#"0.0, 0.0, 0.0]"#,
            "dh.alpha is an array of 4; it must be [0, pi, 0, 0]",
        ),
        (
            r#""viscous": [4.0, 1.5"#,
            r#""viscous": [4.0, -1.5"#,
            "drive.viscous[1] is -1.5; it must be a number >= 0",
        ),
        (
            r#""viscous": [4.0, 1.5,"#,
            r#""viscous": [4.0,"#,
            "drive.viscous is an array of 3; it must be an array of 4",
        ),
        (
            r#""com_joint_frame": [0.2, "#,
            r#""com_joint_frame": [null, "#,
            "links[1].com_joint_frame[0] is null",
        ),
    ];
    for (from, to, expected) in cases {
        let message = refusal(&edited(from, to));
        let place = format!("line {}, column ", line_of(from));
        assert!(
            message.starts_with(&place) && message.contains(expected),
            "{message}\nshould be at {place}{expected}"
        );
    }
}

#[test]
fn what_is_missing_is_named_with_the_line_of_its_object() {
    let message = refusal(&edited(r#""screw_hand_sign""#, r#""screw_hand""#));
    let place = line_of(r#""drive": {"#);
    assert_eq!(
        message,
        format!(
            "line {place}, column 12: drive.screw_hand_sign is missing; it must be a finite number"
        )
    );
    assert_eq!(
        refusal("{}"),
        "line 1, column 1: dh is missing; it must be the Denavit-Hartenberg table"
    );
    assert_eq!(
        refusal("[]"),
        "line 1, column 1: the document is an array of 0; it must be a JSON object"
    );
    assert!(refusal("{\n\"a\": }").starts_with("line 2, column 6: not JSON: "));
    assert!(refusal("").starts_with("line 1, column 0: not JSON: "));
}

#[test]
fn the_place_survives_escapes_and_nesting() {
    // Preceded by text with quotes and brackets.
    let text = "{\"note\": \"a \\\" ] } , dh\", \"gh\": {\"a1\": [{}, 1]},\n\"dh\":\n{\"alpha\": [0, 3.141592653589793, 0, 0],\n\"a1\": true}}";
    assert_eq!(
        refusal(text),
        "line 4, column 7: dh.a1 is true; it must be a number > 0, at most 10 m"
    );
}

/// There is no way to know which of two was meant.
#[test]
fn keys_that_stand_twice_are_refused() {
    for (from, to) in [
        (r#""a1": 0.56"#, r#""a1": 0.56, "a1": 0.4"#),
        (r#""units""#, r#""drive": {}, "units""#),
    ] {
        let message = refusal(&edited(from, to));
        assert!(message.contains("occurs twice in one object"), "{message}");
    }
}

#[test]
fn unknown_keys_are_warned_of_with_the_nearest_known_one() {
    let text = edited(r#""units""#, r#""comment": {"any": [1, "thing"]}, "units""#);
    assert_eq!(
        RobotModel::from_json(&text).unwrap(),
        (RobotModel::irb_930_22_105(), vec![])
    );
    for (from, to, expected) in [
        (
            r#""units""#,
            r#""foo": 1, "units""#,
            "foo is not known and not used",
        ),
        (
            r#""viscous""#,
            r#""viskous": 1, "viscous""#,
            "drive.viskous is not known and not used; did you mean viscous?",
        ),
        (
            r#""mass": 14.5"#,
            r#""mass": 14.5, "Mass": 14"#,
            "links[1].Mass is not known and not used; did you mean mass?",
        ),
    ] {
        let (model, warnings) = RobotModel::from_json(&edited(from, to)).unwrap();
        assert_eq!(model, RobotModel::irb_930_22_105());
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].ends_with(expected), "{warnings:?}");
    }
}

#[test]
fn efforts_that_do_not_fit_each_other_are_warned_of() {
    for (from, to, expected) in [
        (
            r#""effort_peak": [640.0"#,
            r#""effort_peak": [640000.0"#,
            "joint_limits.effort_peak[0] is 640000, but the motor of the shoulder gives 640.0 through its gear",
        ),
        (
            r#""viscous": [4.0"#,
            r#""viscous": [4000.0"#,
            "of the shoulder at full speed, more than its peak, 640",
        ),
    ] {
        let (_, warnings) = RobotModel::from_json(&edited(from, to)).unwrap();
        assert_eq!(warnings.len(), 1, "{warnings:?}");
        assert!(warnings[0].ends_with(expected), "{warnings:?}");
    }
}

#[test]
fn physics_that_no_robot_has_is_refused() {
    for (from, to, expected) in [
        (
            r#""coulomb_tanh_eps": [0.01"#,
            r#""coulomb_tanh_eps": [10"#,
            "drive.coulomb_tanh_eps[0] is 10; it must be at most the axis' speed limit",
        ),
        // Moments of inertia that no body has.
        (
            r#""inertia_com_diag": [0.053, 0.53, 0.55]"#,
            r#""inertia_com_diag": [0.053, 0.53, 5.0]"#,
            "links[0].inertia_com_diag[2] is 5; it must be at most the sum of the other two moments",
        ),
        // Other units, one by one and all at once.
        (
            r#""a1": 0.56"#,
            r#""a1": 560"#,
            "dh.a1 is 560; it must be a number > 0, at most 10 m; lengths are in m: 560 mm is 0.56",
        ),
        (
            r#"0.3, 6.98"#,
            r#"300, 6.98"#,
            "joint_limits.upper[2] is 300; it must be a number from -10 to 10 m; lengths are in m",
        ),
        (
            r#"2.530727415391778, 0.3"#,
            r#"145, 0.3"#,
            "joint_limits.upper[1] is 145; it must be a number from -20 to 20 rad; angles are in rad: 145 degrees is 2.53",
        ),
        (r#""SI: m, kg"#, r#""mm, g"#, "units is "),
        (
            r#"[0.2, 0.0, 0.0902]"#,
            r#"[1e9, 0.0, 0.0902]"#,
            "links[1].com_joint_frame[0] is 1000000000; it must be a number from -10 to 10 m",
        ),
        // Links in another order than the frames.
        (
            r#""name": "link2""#,
            r#""name": "link1""#,
            "links[1].name is \"link1\"; it must be a link 2 here",
        ),
        // Peak below continuous.
        (
            r#""effort_peak": [640.0"#,
            r#""effort_peak": [200.0"#,
            "joint_limits.effort_continuous_rms[0] is 216; it must be at most the peak, 200",
        ),
        (
            r#""motor_rated_torque": [3.18"#,
            r#""motor_rated_torque": [9.0"#,
            "drive.motor_rated_torque[0] is 9; it must be at most the motor's limit, 8 N m",
        ),
        // Limits of frames.
        (
            r#""motor_max_speed_rad_s": [628.3"#,
            r#""motor_max_speed_rad_s": [6283"#,
            "drive.motor_max_speed_rad_s[0] is 6283; it must be a number > 0, at most 1600 rad/s",
        ),
        (
            r#""effort_peak": [640.0"#,
            r#""acceleration_cap": [1e7, 1, 1, 1], "effort_peak": [640.0"#,
            "joint_limits.acceleration_cap[0] is 10000000; it must be a number > 0, at most 100000 rad/s2",
        ),
        (
            r#""effort_rise_time_s": [0.010"#,
            r#""effort_rise_time_s": [10"#,
            "joint_limits.effort_rise_time_s[0] is 10; it must be a number from 0.0001 to 1 s",
        ),
        (
            r#""rotor_inertia_motor_side": [0.000384"#,
            r#""rotor_inertia_motor_side": [3.84"#,
            "drive.rotor_inertia_motor_side[0] is 3.84; it must be a number >= 0, at most 1 kg m2",
        ),
        (
            r#""a1": 0.56"#,
            r#""a1": 1e-300"#,
            "dh.a1 is 1e-300; it must be a number > 0, at most 10 m",
        ),
        (
            "IRB 930",
            r"\u001b[31m",
            "it must be a text without control characters",
        ),
        (
            r#""rated": 10.0"#,
            r#""rated": 23.0"#,
            "payload_rated_max_kg.rated is 23; it must be at most the heaviest payload, 22 kg",
        ),
        (": 131072", ": 1", "it must be a whole number from 256"),
        // 2^26 counts x 33.3 turns to the limit are more than 32 bits.
        (
            ": 131072",
            ": 67108864",
            "the motor of the shoulder makes 33.3 turns to its limit",
        ),
    ] {
        let message = refusal(&edited(from, to));
        assert!(
            message.contains(expected),
            "{message}
should contain {expected}"
        );
    }
}

#[test]
fn derived_numbers_that_contradict_are_reported_and_not_used() {
    let text = edited(
        r#""com_joint_frame": [0.2, 0.0, 0.0902]"#,
        r#""com_joint_frame": [0.2, 0.0, 0.0902], "lc": 0.3, "com_dh_frame": [-0.29, 0.0, 0.0902]"#,
    );
    let (model, warnings) = RobotModel::from_json(&text).unwrap();
    assert_eq!(model, RobotModel::irb_930_22_105());
    assert_eq!(warnings.len(), 2, "{warnings:?}");
    assert!(
        warnings[0].contains("links[1].com_dh_frame is [-0.29, 0.0, 0.0902]"),
        "{warnings:?}"
    );
    assert!(
        warnings[1]
            .contains("links[1].lc is 0.3, but links[1].com_joint_frame, which is used, gives 0.2")
    );
    let text = edited(
        r#""com_joint_frame": [0.2, 0.0, 0.0902]"#,
        r#""com_joint_frame": [0.2, 0.0, 0.0902], "lc": 0.2, "com_dh_frame": [-0.29, 0.0, -0.0902]"#,
    );
    assert_eq!(
        RobotModel::from_json(&text).unwrap().1,
        Vec::<String>::new()
    );
}

#[test]
fn the_short_robot_differs_where_it_should() {
    let (long, short) = (RobotModel::irb_930_22_105(), RobotModel::irb_930_12_085());
    assert_eq!(
        (short.geometry.a1, short.links[0].mass, short.payload_max),
        (0.36, 9.5, 12.0)
    );
    assert_eq!(
        (short.links[1], short.drive, short.limits),
        (long.links[1], long.drive, long.limits)
    );
}

#[test]
fn a_payload_may_be_a_point_but_not_less_than_nothing() {
    let text = |mass: f64| {
        format!(
            r#"{{"mass": {mass}, "com_flange_frame": [0, 0, 0.1], "inertia_com_diag": [0, 0, 0]}}"#
        )
    };
    assert_eq!(
        Payload::from_json(&text(2.0)).unwrap(),
        Payload {
            mass: 2.0,
            com: [0.0, 0.0, 0.1],
            inertia: [0.0; 3]
        }
    );
    let message = Payload::from_json(&text(-2.0)).unwrap_err().to_string();
    assert_eq!(
        message,
        "line 1, column 10: mass is -2; it must be a number >= 0, at most 100 kg"
    );
}

#[test]
fn payloads_of_no_body_are_refused() {
    for (text, expected) in [
        (
            r#"{"mass": 2, "com_flange_frame": [0, 0, 0.05], "inertia_com_diag": [0, 0, 1]}"#,
            "inertia_com_diag[2] is 1; it must be at most the sum of the other two moments, 0",
        ),
        (
            r#"{"mass": 0, "com_flange_frame": [0, 0, 0.05], "inertia_com_diag": [1, 1, 1]}"#,
            "inertia_com_diag is an array of 3; it must be zeros, since it weighs nothing",
        ),
        (
            r#"{"mass": 2, "com_flange_frame": [0, 0, 50], "inertia_com_diag": [0, 0, 0]}"#,
            "com_flange_frame[2] is 50; it must be a number from -1 to 1 m; lengths are in m: 50 mm is 0.05",
        ),
        (
            r#"{"mass": 2, "com_flange_frame": [0, 0, 0], "inertia_com_diag": [0, 0, 0], "masss": 3}"#,
            "masss is not known; did you mean mass?",
        ),
        (
            r#"{"mass": 2, "com_flange_frame": [0, 0, 0, 0], "inertia_com_diag": [0, 0, 0]}"#,
            "com_flange_frame is an array of 4; it must be an array of 3",
        ),
    ] {
        let message = Payload::from_json(text).unwrap_err().to_string();
        assert!(message.contains(expected), "{message}");
    }
}
