//! What `eval` accepts and prints, and its refusals.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use plant_sim::eval::{By, Elbow, Posture, Table, eval};
use sim::model::RobotModel;

fn run(table: Table, by: By, input: &str) -> Result<String, String> {
    run_in(table, Posture::default(), by, input)
}

fn run_in(table: Table, posture: Posture, by: By, input: &str) -> Result<String, String> {
    let mut output = Vec::new();
    eval(
        table,
        posture,
        by,
        &RobotModel::irb_930_22_105(),
        None,
        input.as_bytes(),
        &mut output,
    )
    .map_err(|e| e.to_string())?;
    Ok(String::from_utf8(output).unwrap())
}

fn refusal(input: &str) -> String {
    run(Table::Ik, By::Plant, input).expect_err("must be refused")
}

#[test]
fn labels_come_through_in_front_and_columns_may_stand_in_any_order() {
    let output = run(
        Table::Ik,
        By::Plant,
        "yaw,kind,z , y,x,id\n0, mine ,-0.2,0,9,a 1\n",
    )
    .unwrap();
    let mut lines = output.lines();
    assert!(lines.next().unwrap().starts_with("id,kind,reason,a_q1,"));
    assert_eq!(
        lines.next().unwrap(),
        "a 1,mine,too_far,nan,nan,nan,nan,0,nan,nan,nan,nan,0,nan,nan"
    );
    assert_eq!(lines.next(), None);
}

#[test]
fn labels_are_optional() {
    let output = run(Table::Ik, By::Lagrange, "x,y,z,yaw\n9,0,-0.2,0\n").unwrap();
    assert!(output.starts_with("reason,a_q1,") && output.contains("\ntoo_far,nan,"));
}

#[test]
fn lengths_that_can_only_be_millimetres_are_named_as_such() {
    let joints = |lift: f64| {
        run(
            Table::Kinematics,
            By::Lagrange,
            &format!("q1,q2,q3,q4,qd1,qd2,qd3,qd4\n0,0,{lift},0,0,0,0,0\n"),
        )
    };
    let message = refusal("x,y,z,yaw\n0.6,0.1,-0.2,0\n600,0.1,-0.2,0\n");
    assert!(
        message.contains("line 3, column x") && message.contains("600 mm is 0.6"),
        "{message}"
    );
    assert!(refusal("x,y,z,yaw\n0.6,0.1,-200,0\n").contains("-200 mm is -0.2"));
    let message = joints(150.0).unwrap_err();
    assert!(
        message.contains("column q3") && message.contains("150 mm is 0.15"),
        "{message}"
    );
    // Out of reach, and no number of millimetres either; an angle is none.
    for (far, lift) in [("9", 0.15), ("1e9", 9.0)] {
        let output = run(Table::Ik, By::Plant, &format!("x,y,z,yaw\n{far},0,0,90\n"));
        assert!(output.unwrap().contains("too_far"), "{far}");
        assert!(joints(lift).is_ok(), "{lift}");
    }
}

#[test]
fn an_input_without_rows_gives_a_header() {
    assert_eq!(
        run(Table::Ik, By::Plant, "x,y,z,yaw\n")
            .unwrap()
            .lines()
            .count(),
        1
    );
}

#[test]
fn numbers_print_in_the_precision_of_the_side_that_computed_them() {
    let input = "q1,q2,q3,q4,qd1,qd2,qd3,qd4\n0.1,0.2,0.3,0.4,1,2,3,4\n";
    for by in [By::Plant, By::Lagrange] {
        let output = run(Table::Kinematics, by, input).unwrap();
        for cell in output.lines().nth(1).unwrap().split(',') {
            let (double, single): (f64, f32) = (cell.parse().unwrap(), cell.parse().unwrap());
            let again = if by == By::Plant {
                format!("{double:?}")
            } else {
                format!("{single:?}")
            };
            assert_eq!(cell, again);
        }
    }
}

#[test]
fn a_bad_header_is_told_with_what_is_allowed() {
    assert_eq!(
        refusal("x,y,z,yaw,w\n"),
        "line 1: unknown column \"w\"; allowed: id, kind, x, y, z, yaw, reason, a_q1, a_q2, a_q3, a_q4, a_in_limits, \
         b_q1, b_q2, b_q3, b_q4, b_in_limits, detJ_a, tol_theta2"
    );
    assert_eq!(
        refusal("x,y,z\n"),
        "line 1: column yaw is missing; required are x, y, z, yaw"
    );
    assert_eq!(
        refusal(""),
        "line 1: column x is missing; required are x, y, z, yaw"
    );
    assert_eq!(
        refusal("x,y,x,z,yaw\n"),
        "line 1: column x occurs twice; allowed: once"
    );
}

#[test]
fn a_bad_cell_is_told_with_its_line_and_column() {
    let allowed = "allowed: a finite number of magnitude up to 1.7976931348623157e308";
    for (cell, found) in [
        ("1,5", None),
        ("", Some("")),
        ("abc", Some("abc")),
        ("nan", Some("nan")),
        ("-inf", Some("-inf")),
    ] {
        let message = refusal(&format!("x,y,z,yaw\n1,0,0,0\n\n1,{cell},0,0\n"));
        match found {
            Some(found) => assert_eq!(
                message,
                format!("line 4, column y: found {found:?}; {allowed}")
            ),
            None => assert_eq!(message, "line 4: 5 values; allowed: the header's 4"),
        }
    }
    assert_eq!(
        refusal("x,y,z,yaw\n1,0\n"),
        format!("line 2, column z: found \"\"; {allowed}")
    );
}

#[test]
fn the_controller_is_not_asked_for_what_it_cannot_represent() {
    let input = "x,y,z,yaw\n1e300,0,0,0\n";
    assert!(
        run(Table::Ik, By::Plant, input)
            .unwrap()
            .contains("too_far")
    );
    let message = run(Table::Ik, By::Lagrange, input).unwrap_err();
    assert_eq!(
        message,
        "line 2, column x: found \"1e300\"; allowed: a finite number of magnitude up to 3.4028234663852886e38"
    );
    assert!(
        run(Table::Ik, By::Lagrange, "x,y,z,yaw\n1e38,1e38,0,0\n")
            .unwrap()
            .contains("too_far")
    );
}

#[test]
fn the_controller_may_refuse_a_model_that_the_plant_takes() {
    let mut model = RobotModel::irb_930_22_105();
    model.gravity = -9.81;
    let message = eval(
        Table::Ik,
        Posture::default(),
        By::Lagrange,
        &model,
        None,
        "x,y,z,yaw\n".as_bytes(),
        std::io::sink(),
    )
    .unwrap_err();
    assert!(
        message
            .to_string()
            .starts_with("the controller refuses the model: gravity is -9.81"),
        "{message}"
    );
}

#[test]
fn the_easier_solution_decides_the_reason() {
    // Straight behind the robot the shoulder is within limits for one elbow and not for the other; above and behind,
    // one fails for its shoulder, and both fail for their height.
    let row = |x: f64, y: f64, z: f64| {
        let output = run(Table::Ik, By::Plant, &format!("x,y,z,yaw\n{x},{y},{z},0\n")).unwrap();
        let cells: Vec<_> = output
            .lines()
            .nth(1)
            .unwrap()
            .split(',')
            .map(str::to_owned)
            .collect();
        [cells[0].clone(), cells[5].clone(), cells[10].clone()]
    };
    assert_eq!(row(-0.478774, 0.711316, -0.33), ["ok", "1", "0"]);
    assert_eq!(row(-1.003, 0.003, -0.33), ["joint1_limit", "0", "0"]);
    assert_eq!(row(0.8, 0.3, 0.0), ["z_high", "0", "0"]);
    assert_eq!(row(0.8, 0.3, -0.5), ["z_low", "0", "0"]);
    assert_eq!(row(0.15, 0.1, -0.2), ["joint2_limit", "0", "0"]);
    assert_eq!(row(0.05, 0.0, -0.2), ["inside_hole", "0", "0"]);
}

#[test]
fn the_elbow_asked_for_decides_the_reason_and_the_turn_is_added_to_the_wrist() {
    let row = |elbow, turn, by, pose: &str| -> Vec<String> {
        let input = format!("x,y,z,yaw\n{pose}\n");
        let output = run_in(Table::Ik, Posture { elbow, turn }, by, &input).unwrap();
        let cells = output.lines().nth(1).unwrap().split(',');
        cells.map(str::to_owned).collect()
    };
    for by in [By::Plant, By::Lagrange] {
        // Behind the base on the right: only the left arm reaches it.
        let reason = |elbow| row(elbow, None, by, "-0.6,-0.75,-0.2,0")[0].clone();
        assert_eq!(reason(None), "ok");
        assert_eq!(reason(Some(Elbow::Negative)), "ok");
        assert_eq!(reason(Some(Elbow::Positive)), "joint1_limit");

        let wrist = |turn| row(None, turn, by, "0.5,0.1,-0.2,0");
        let (plain, next) = (wrist(None), wrist(Some(1)));
        for column in [4, 9] {
            let number = |row: &[String]| row[column].parse::<f64>().unwrap();
            let turned = number(&next) - number(&plain);
            assert!((turned - std::f64::consts::TAU).abs() < 1e-6, "{turned}");
        }
        // The wrist turns by 400 degrees either way.
        assert_eq!(plain[0], "ok");
        assert_eq!(wrist(Some(0)), plain);
        assert_eq!(wrist(Some(2))[0], "joint4_limit");
    }
}
