//! What a page can ask for: the page draws what it finds here, and knows none of it by itself.

mod jog;
mod moves;

use protocol::messages::{Law, Node};
use protocol::table::TABLE;
use serde::Serialize;
use sim::faults::{KINDS, Kind};
use sim::model::{AXES, RobotModel};
use sim::scenario::Scenario;
use sim::selection::LawChoice;

use super::wish::MOMENTS;

/// Controls and buttons that belong together.
#[derive(Debug, Serialize)]
pub struct Group {
    title: &'static str,
    /// A sentence about it, where one is needed.
    hint: Option<&'static str>,
    fields: Vec<Field>,
    buttons: Vec<Button>,
}

/// A value to set.
#[derive(Debug, Serialize)]
struct Field {
    key: &'static str,
    label: &'static str,
    #[serde(flatten)]
    kind: FieldKind,
}

#[derive(Debug, Serialize)]
#[serde(untagged)]
enum FieldKind {
    Number(Number),
    Choice {
        choices: Vec<String>,
        start: String,
    },
    /// One of many, each in a group of its own name and with the value that it takes.
    Fault {
        faults: Vec<Breakage>,
    },
}

#[derive(Debug, Serialize)]
struct Number {
    least: f64,
    greatest: f64,
    step: f64,
    start: f64,
    unit: &'static str,
}

/// A kind of fault at a place.
#[derive(Debug, Serialize)]
struct Breakage {
    place: String,
    /// Without value and time.
    text: String,
    about: &'static str,
    value: Option<Number>,
}

/// Something to ask for: a press sends an object named `ask` with the values of the fields in `takes` and those in `with`.
#[derive(Debug, Serialize)]
struct Button {
    label: String,
    ask: &'static str,
    takes: &'static [&'static str],
    with: serde_json::Value,
    /// Always in sight.
    urgent: bool,
    /// As long as it is pressed, `hold` is asked for again and again, and then `stop`.
    held: bool,
}

fn button(label: &str, ask: &'static str, takes: &'static [&'static str]) -> Button {
    Button {
        label: label.into(),
        ask,
        takes,
        with: serde_json::json!({}),
        urgent: false,
        held: false,
    }
}

fn urgent(label: &str, ask: &'static str) -> Button {
    Button {
        urgent: true,
        ..button(label, ask, &[])
    }
}

const fn number(
    key: &'static str,
    label: &'static str,
    [least, greatest]: [f64; 2],
    step: f64,
    start: f64,
    unit: &'static str,
) -> Field {
    Field {
        key,
        label,
        kind: FieldKind::Number(Number {
            least,
            greatest,
            step,
            start,
            unit,
        }),
    }
}

fn choice(
    key: &'static str,
    label: &'static str,
    choices: Vec<String>,
    start: impl ToString,
) -> Field {
    Field {
        key,
        label,
        kind: FieldKind::Choice {
            choices,
            start: start.to_string(),
        },
    }
}

/// All that can be asked of a run of `scenario` with this robot.
#[must_use]
pub fn of_run(scenario: &Scenario, robot: &RobotModel) -> Vec<Group> {
    vec![
        Group {
            title: "Drives",
            hint: None,
            fields: Vec::new(),
            buttons: vec![
                urgent("Stop", "stop"),
                urgent("E-stop", "emergency-stop"),
                button("Enable", "enable", &[]),
                button("Disable", "disable", &[]),
                button("Acknowledge", "fault-reset", &[]),
                button("Run the scenario", "scenario", &[]),
            ],
        },
        moves::moves(scenario, robot),
        Group {
            title: "Speed override",
            hint: Some(
                "Also of a move under way, which stays on its path. At 0 the arm waits there.",
            ),
            fields: vec![number("pace", "Override", [0.0, 100.0], 1.0, 100.0, "%")],
            buttons: vec![button("Set", "override", &["pace"])],
        },
        jog::by_hand(robot),
        jog::by_steps(),
        Group {
            title: "Payload and law",
            hint: None,
            fields: vec![
                number(
                    "mass",
                    "Payload",
                    [0.0, robot.payload_max],
                    0.5,
                    scenario.payload.map_or(0.0, |payload| payload.mass),
                    "kg",
                ),
                choice("law", "Control law", laws(), scenario.law),
            ],
            buttons: vec![
                button("Carry", "payload", &["mass"]),
                button("Use law", "law", &["law"]),
            ],
        },
        Group {
            title: "Break it",
            hint: None,
            fields: vec![
                Field {
                    key: "fault",
                    label: "Fault",
                    kind: FieldKind::Fault { faults: faults() },
                },
                choice(
                    "when",
                    "When",
                    MOMENTS.map(|(name, _)| name.into()).into(),
                    "at once",
                ),
                number(
                    "seconds",
                    "Lasts (0: as long as that, or it stays)",
                    [0.0, 3600.0],
                    0.1,
                    0.0,
                    "s",
                ),
            ],
            buttons: vec![button(
                "Plant the fault",
                "fault",
                &["fault", "when", "seconds"],
            )],
        },
    ]
}

fn laws() -> Vec<String> {
    use protocol::messages::Compensation;
    let all = Law::ALL.iter().flat_map(|&law| {
        let compensations: &[Compensation] = if law.takes_compensation() {
            Compensation::ALL
        } else {
            &[Compensation::None]
        };
        compensations
            .iter()
            .map(move |&compensation| LawChoice { law, compensation }.to_string())
    });
    all.collect()
}

/// Every kind of fault at every place that has it.
fn faults() -> Vec<Breakage> {
    let kinds = KINDS.iter().flat_map(|kind| {
        places(kind).into_iter().map(move |place| Breakage {
            text: format!("{place}:{}", kind.name),
            place,
            about: kind.about,
            value: kind.value.map(|value| Number {
                least: value.least,
                greatest: value.greatest,
                step: value.step(),
                start: value.moderate(),
                unit: value.unit,
            }),
        })
    });
    // An operator does not start anew, and nobody but the controller has to be in time.
    let is_none = ["operator:dead", "operator:slow", "drives:slow"];
    let mut all: Vec<Breakage> = kinds
        .filter(|it| !is_none.contains(&it.text.as_str()))
        .collect();
    all.sort_by(|one, other| one.place.cmp(&other.place));
    all
}

fn places(kind: &Kind) -> Vec<String> {
    match kind.place {
        "message" => {
            let messages = TABLE.iter().filter(|info| kind.acts_on(info));
            messages.map(|info| info.name.to_lowercase()).collect()
        }
        "node" => Node::ALL.iter().map(ToString::to_string).collect(),
        part if kind.has_axis => AXES.iter().map(|axis| format!("{part}:{axis}")).collect(),
        part => vec![part.to_owned()],
    }
}

#[cfg(test)]
mod tests {
    use serde_json::{Map, Value};
    use sim::model::RobotModel;
    use sim::scenario::Scenario;

    use super::of_run;
    use crate::view::wish::Asked;

    /// What a button sends with every value as at the start; of faults, each one that can be chosen.
    fn sent(offers: &Value) -> Vec<Value> {
        let all = |key: &'static str| {
            let groups = offers.as_array().unwrap().iter();
            groups.flat_map(move |group| group[key].as_array().unwrap().clone())
        };
        let fields: Vec<Value> = all("fields").collect();
        let starts = |key: &str| {
            let field = fields.iter().find(|field| field["key"] == key).unwrap();
            match field["faults"].as_array() {
                None => vec![field["start"].clone()],
                Some(faults) => faults
                    .iter()
                    .map(|fault| match &fault["value"]["start"] {
                        Value::Null => fault["text"].clone(),
                        start => format!("{}={start}", fault["text"].as_str().unwrap()).into(),
                    })
                    .collect(),
            }
        };
        let mut sent = Vec::new();
        for button in all("buttons") {
            let mut one: Vec<Map<String, Value>> =
                vec![button["with"].as_object().unwrap().clone()];
            for key in button["takes"].as_array().unwrap() {
                let key = key.as_str().unwrap();
                let with = |start: &Value, given: &Map<String, Value>| {
                    let mut given = given.clone();
                    given.insert(key.into(), start.clone());
                    given
                };
                let starts = starts(key);
                let each = |start| one.iter().map(move |given| with(start, given));
                one = starts.iter().flat_map(each).collect();
            }
            let name = button["ask"].as_str().unwrap();
            sent.extend(
                one.into_iter()
                    .map(|given| serde_json::json!({ name: given })),
            );
        }
        sent
    }

    #[test]
    fn every_button_asks_for_something_that_is_understood() {
        for name in ["gate", "screw", "palletise", "near-singular"] {
            let scenario = Scenario::built_in(name).unwrap();
            let offers = of_run(&scenario, &RobotModel::irb_930_22_105());
            let sent = sent(&serde_json::to_value(offers).unwrap());
            // More kinds of faults than there are kinds, for every place that has one.
            assert!(sent.len() > 100, "{}", sent.len());
            for request in sent {
                let asked: Asked = serde_json::from_value(request.clone())
                    .unwrap_or_else(|error| panic!("{request}: {error}"));
                let wish = match &asked {
                    Asked::Jog { .. } | Asked::Push { .. } => {
                        asked.jog(Some([0.0; 4])).map(|(wish, _)| wish)
                    }
                    _ => asked.wish(),
                };
                assert!(wish.is_ok(), "{request}: {wish:?}");
            }
        }
    }
}
