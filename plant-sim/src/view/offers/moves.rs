//! Moves to a pose.

use sim::model::RobotModel;
use sim::scenario::{Scenario, Step};

use super::{Group, button, number};

pub(super) fn moves(scenario: &Scenario, robot: &RobotModel) -> Group {
    // The first target of the scenario is one that can be reached.
    let target = scenario.cycle.iter().find_map(|step| match step {
        Step::Jump(jump) => Some((jump.to, jump.top, jump.clearance)),
        Step::Line(line) => Some((line.to, line.to[2], 0.0)),
        Step::Arc(arc) => Some((arc.to, arc.to[2], 0.0)),
        _ => None,
    });
    let start = scenario.start;
    let (to, top, clearance) = target.unwrap_or((start, start[2], 0.0));
    let millimetres = |metres: f64| (metres * 1e4).round() / 10.0;
    let (geometry, limits) = (&robot.geometry, &robot.limits);
    let reach = millimetres(geometry.a1 + geometry.a2);
    let height = |lift: f64| millimetres(geometry.d1 + geometry.d2 - geometry.d4 - lift);
    let heights = [height(limits.upper[2]), height(limits.lower[2])];
    let yaw = (to[3].to_degrees() * 10.0).round() / 10.0;
    let across = |key, label, metres: f64| {
        number(key, label, [-reach, reach], 1.0, millimetres(metres), "mm")
    };
    let via = beside(&start, &to);
    Group {
        title: "Move",
        hint: None,
        fields: vec![
            across("x", "x", to[0]),
            across("y", "y", to[1]),
            number("z", "z", heights, 1.0, millimetres(to[2]), "mm"),
            number("yaw", "Yaw", [-360.0, 360.0], 1.0, yaw, "°"),
            number("top", "Top of a jump", heights, 1.0, millimetres(top), "mm"),
            number(
                "clearance",
                "Clearance",
                [0.0, 300.0],
                1.0,
                millimetres(clearance),
                "mm",
            ),
            across("via_x", "x on the way", via[0]),
            across("via_y", "y on the way", via[1]),
            number(
                "via_z",
                "z on the way",
                heights,
                1.0,
                millimetres(via[2]),
                "mm",
            ),
            number("speed", "Speed", [1.0, 100.0], 1.0, 50.0, "%"),
            number(
                "tool_speed",
                "Tool speed (0: any)",
                [0.0, 5000.0],
                10.0,
                0.0,
                "mm/s",
            ),
            number(
                "zone",
                "Zone at the end (0: stop)",
                [0.0, 300.0],
                1.0,
                0.0,
                "mm",
            ),
        ],
        buttons: vec![
            button(
                "Jump",
                "jump",
                &["x", "y", "z", "yaw", "top", "clearance", "speed", "zone"],
            ),
            button(
                "Line",
                "line",
                &["x", "y", "z", "yaw", "speed", "tool_speed", "zone"],
            ),
            button(
                "Arc",
                "arc",
                &[
                    "via_x",
                    "via_y",
                    "via_z",
                    "x",
                    "y",
                    "z",
                    "yaw",
                    "speed",
                    "tool_speed",
                    "zone",
                ],
            ),
        ],
    }
}

/// A point on the way of an arc from one pose to another: half way, and a quarter of the way to the left.
fn beside(from: &[f64; 4], to: &[f64; 4]) -> [f64; 3] {
    let (x, y) = (to[0] - from[0], to[1] - from[1]);
    let half = |place: usize| 0.5 * (from[place] + to[place]);
    [half(0) - 0.25 * y, half(1) + 0.25 * x, half(2)]
}
