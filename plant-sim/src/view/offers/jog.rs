//! Moves of one axis.

use protocol::messages::Operation;
use sim::model::{AXES, RobotModel};

use super::{Button, Group, button, number};

/// By a step of one axis.
pub(super) fn by_steps() -> Group {
    let buttons = AXES.iter().flat_map(|axis| {
        [("−", -1.0), ("+", 1.0)].map(|(sign, direction)| Button {
            with: serde_json::json!({ "axis": axis, "sign": direction }),
            ..button(&format!("{axis} {sign}"), "jog", &["step", "speed"])
        })
    });
    Group {
        title: "Jog",
        hint: Some("Small joint moves, at the speed above."),
        fields: vec![number("step", "Step", [0.1, 45.0], 0.1, 5.0, "° or mm")],
        buttons: buttons.collect(),
    }
}

/// One axis as long as a button is held.
pub(super) fn by_hand(robot: &RobotModel) -> Group {
    let choose = |operation: Operation| Button {
        with: serde_json::json!({ "operation": operation.name() }),
        ..button(&format!("{operation} operation"), "operation", &[])
    };
    let axes = AXES.iter().enumerate();
    let push = axes.flat_map(|(place, axis)| {
        let ends = [("◀", robot.limits.lower), ("▶", robot.limits.upper)];
        ends.map(|(sign, limits)| {
            let end = if place == 2 {
                limits[place] * 1000.0
            } else {
                limits[place].to_degrees()
            };
            // Of a tenth, the one inside.
            let end = (end * 10.0).trunc() / 10.0;
            Button {
                with: serde_json::json!({ "axis": axis, "end": end }),
                held: true,
                ..button(&format!("{axis} {sign}"), "push", &["speed"])
            }
        })
    });
    Group {
        title: "By hand",
        hint: Some(
            "In manual operation moves go on only while they are held, and no faster at the tool than 250 mm/s. These go on as long \
             as they are pressed; they also free an axis from beyond its range.",
        ),
        fields: Vec::new(),
        buttons: [Operation::Manual, Operation::Automatic]
            .map(choose)
            .into_iter()
            .chain(push)
            .collect(),
    }
}
