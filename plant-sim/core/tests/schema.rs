//! What the schemas of files promise is what the readers do: the keys, and the ranges of every number.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use schemars::{JsonSchema, schema_for};
use serde_json::{Value, json};
use sim::model::file::{ModelFile, PayloadFile};
use sim::model::{Payload, RobotModel};
use sim::scenario::Scenario;
use sim::setup::RunConfig;

/// How a reader speaks of a number that is outside its range.
const OUT_OF_RANGE: [&str; 3] = ["it must be a", "allowed: ", "expected "];

/// What a reader says of a document, if it refuses it.
type Reader = fn(&Value) -> Result<(), String>;

fn model(document: &Value) -> Result<(), String> {
    let read = RobotModel::from_json(&document.to_string());
    read.map(|_| ()).map_err(|error| error.to_string())
}

fn payload(document: &Value) -> Result<(), String> {
    let read = Payload::from_json(&document.to_string());
    read.map(|_| ()).map_err(|error| error.to_string())
}

fn scenario(document: &Value) -> Result<(), String> {
    let text = toml::to_string(&toml(document)).unwrap();
    let scenario = Scenario::parse(&text, "test").map_err(|error| error.to_string())?;
    let rig = RunConfig::new(scenario).rig();
    rig.map(|_| ()).map_err(|error| error.to_string())
}

/// The same in TOML. Numbers of `serde_json` are its own business when another crate asks it for arbitrary precision.
fn toml(value: &Value) -> toml::Value {
    match value {
        Value::Null => panic!("TOML has no null"),
        Value::Bool(value) => (*value).into(),
        Value::Number(number) => match number.as_i64() {
            Some(whole) => whole.into(),
            None => number.as_f64().unwrap().into(),
        },
        Value::String(text) => text.as_str().into(),
        Value::Array(values) => values.iter().map(toml).collect::<Vec<_>>().into(),
        Value::Object(values) => {
            let table = values.iter().map(|(key, value)| (key.clone(), toml(value)));
            toml::Value::Table(table.collect())
        }
    }
}

/// Documents that are good, with every key that has a meaning.
fn documents() -> [(Value, Value, Reader); 3] {
    let mut robot: Value =
        serde_json::from_str(include_str!("../../models/irb930-22-1.05.json")).unwrap();
    robot["joint_limits"]["acceleration_cap"] = json!([60.0, 120.0, 60.0, 600.0]);
    robot["joint_limits"]["jerk_cap"] = json!([2500.0, 7500.0, 10000.0, 40000.0]);
    robot["links"][1]["lc"] = json!(0.2);
    robot["links"][1]["com_dh_frame"] = json!([-0.29, 0.0, -0.0902]);
    let body = json!({ "mass": 2.0, "com_flange_frame": [0.0, 0.0, 0.05], "inertia_com_diag": [0.008, 0.008, 0.01] });
    let mut nothing = body.clone();
    nothing["mass"] = json!(0.0);
    nothing["inertia_com_diag"] = json!([0.0, 0.0, 0.0]);
    let to = [0.6, 0.1, -0.2, 0.5];
    let work = json!({
        "name": "all", "about": "everything", "ends": "stopped", "faults": ["encoder:elbow:stuck@0.3s"], "seed": 1, "cycles": 1, "rate_hz": 2000.0, "law": "computed-torque:observer", "operation": "manual", "start": [0.5, 0.1, -0.2, 0.0], "start_elbow": "positive", "start_turn": 0,
        "gains": { "bandwidth": 100.0, "damping": 1.0, "observer": 100.0 },
        "payload": nothing, "mismatch": { "friction": 1.0, "payload": 1.0 },
        "cycle": [
            { "jump": { "to": to, "elbow": "positive", "turn": 0, "top": -0.1, "clearance": 0.01, "speed": 0.5, "zone": 0.01 } },
            { "line": { "to": to, "elbow": "positive", "turn": 0, "speed": 0.5, "tool_speed": 0.25, "zone": 0.01 } },
            { "arc": { "via": [0.5, 0.1, -0.2], "to": to, "elbow": "positive", "turn": 0, "speed": 0.5, "tool_speed": 0.25, "zone": 0.01 } },
            { "joints": { "to": [0.0, 1.0, 0.1, 0.0], "speed": 0.5, "zone": 0.0 } },
            { "dwell": 0.1 },
            { "stop": 0.1 },
            { "estop": 0.1 },
            { "pick": body },
            { "place": {} },
        ],
        "requirements": [
            { "id": "torque", "text": "all of it", "quantity": "torque_utilisation", "axis": "elbow", "max": 1.0, "min": 0.0, "during": [0.0, 1.0], "cycle": 1 },
            { "id": "state", "text": "all of it", "quantity": "reached_s", "state": "fault", "max": 1.0, "min": 0.0 },
        ],
    });
    [
        (of::<ModelFile>(), robot, model as Reader),
        (of::<PayloadFile>(), body, payload),
        (of::<Scenario>(), work, scenario),
    ]
}

fn of<T: JsonSchema>() -> Value {
    schema_for!(T).to_value()
}

/// A place in a document, and the schema that holds there.
struct Place {
    pointer: String,
    schema: Value,
}

/// Every place of a document that its schema speaks of, the document itself included.
fn places(root: &Value, document: &Value) -> Vec<Place> {
    let mut found = Vec::new();
    walk(root, root, document, String::new(), &mut found);
    found
}

fn walk(root: &Value, schema: &Value, value: &Value, pointer: String, found: &mut Vec<Place>) {
    if let Some(name) = schema["$ref"].as_str() {
        let target = root.pointer(name.trim_start_matches('#')).unwrap();
        return walk(root, target, value, pointer, found);
    }
    if let Some(choices) = schema["anyOf"].as_array() {
        return walk(root, &choices[0], value, pointer, found);
    }
    if let Some(variants) = schema["oneOf"].as_array() {
        let key = value.as_object().and_then(|object| object.keys().next());
        let variant = variants.iter().find(|variant| match key {
            Some(key) => !variant["properties"][key].is_null(),
            None => variant["const"] == *value,
        });
        return walk(root, variant.unwrap(), value, pointer, found);
    }
    found.push(Place {
        pointer: pointer.clone(),
        schema: schema.clone(),
    });
    for (key, value) in value.as_object().into_iter().flatten() {
        let schema = &schema["properties"][key];
        assert!(!schema.is_null(), "{pointer}/{key} is not in the schema");
        walk(root, schema, value, format!("{pointer}/{key}"), found);
    }
    for (index, value) in value.as_array().into_iter().flatten().enumerate() {
        let schema = match &schema["prefixItems"][index] {
            Value::Null => &schema["items"],
            schema => schema,
        };
        walk(root, schema, value, format!("{pointer}/{index}"), found);
    }
}

/// A pointer as the readers write it: `links[2].mass`.
fn path(pointer: &str) -> String {
    let mut path = String::new();
    for word in pointer.split('/').skip(1) {
        if word.parse::<u8>().is_ok() {
            path += &format!("[{word}]");
        } else if path.is_empty() {
            path += word;
        } else {
            path += &format!(".{word}");
        }
    }
    path
}

fn with(document: &Value, pointer: &str, value: Value) -> Value {
    let mut changed = document.clone();
    *changed.pointer_mut(pointer).unwrap() = value;
    changed
}

#[test]
fn the_documents_are_good_and_have_every_key_that_means_something() {
    for (schema, document, read) in documents() {
        assert_eq!(read(&document), Ok(()));
        let places = places(&schema, &document);
        for place in &places {
            for (key, about) in place.schema["properties"].as_object().into_iter().flatten() {
                let tried = places
                    .iter()
                    .any(|place| place.pointer.ends_with(&format!("/{key}")));
                assert!(
                    tried || about["description"] == "Not used.",
                    "{key} is not tried"
                );
            }
        }
    }
}

#[test]
fn numbers_outside_the_range_of_the_schema_are_refused_and_its_bounds_are_not() {
    let mut tried = 0;
    for (schema, document, read) in documents() {
        for Place { pointer, schema } in places(&schema, &document) {
            let whole = schema["type"] == "integer";
            let step = |bound: f64| {
                if whole {
                    1.0
                } else {
                    1e-6 * bound.abs().max(1.0)
                }
            };
            let number = |x: f64| if whole { json!(x as i64) } else { json!(x) };
            let bound = |key: &str| schema[key].as_f64();
            let inside = [bound("minimum"), bound("maximum")];
            let outside = [
                bound("minimum").map(|low| low - step(low)),
                bound("maximum").map(|high| high + step(high)),
                bound("exclusiveMinimum"),
            ];
            for value in outside.into_iter().flatten() {
                tried += 1;
                let refusal = read(&with(&document, &pointer, number(value))).unwrap_err();
                assert!(
                    OUT_OF_RANGE.iter().any(|words| refusal.contains(words)),
                    "{pointer} = {value}: {refusal}"
                );
            }
            for value in inside.into_iter().flatten() {
                // A payload may weigh nothing, but that cannot be picked.
                if pointer.ends_with("/pick/mass") && value == 0.0 {
                    continue;
                }
                // Another number may now contradict, or the robot allow less; the range itself must not be what refuses.
                if let Err(refusal) = read(&with(&document, &pointer, number(value))) {
                    let allowed = refusal
                        .rsplit_once("allowed: ")
                        .or_else(|| refusal.rsplit_once("it must be "))
                        .map_or("", |(_, allowed)| allowed);
                    // Without the slip of unit that may follow.
                    let allowed = allowed.split(';').next().unwrap_or_default();
                    let itself =
                        refusal.contains(&path(&pointer)) && allowed.contains(&value.to_string());
                    assert!(!itself, "{pointer} = {value}: {refusal}");
                }
            }
        }
    }
    assert!(tried > 200, "{tried}");
}

#[test]
fn what_the_schema_requires_is_required_and_nothing_else() {
    for (schema, document, read) in documents() {
        for place in places(&schema, &document) {
            let keys = document.pointer(&place.pointer).unwrap().as_object();
            for key in keys.into_iter().flatten().map(|(key, _)| key) {
                let mut changed = document.clone();
                let object = changed.pointer_mut(&place.pointer).unwrap();
                object.as_object_mut().unwrap().shift_remove(key);
                // Which of its keys a quantity needs, a schema does not say.
                if place.pointer.starts_with("/requirements") && key == "state" {
                    continue;
                }
                let required = place.schema["required"].as_array();
                let required = required.is_some_and(|keys| keys.contains(&json!(key)));
                let read = read(&changed);
                assert_eq!(read.is_err(), required, "{}/{key}: {read:?}", place.pointer);
            }
        }
    }
}

#[test]
fn a_law_of_the_schema_is_a_law() {
    let laws = of::<Scenario>()["$defs"]["Law"]["enum"].clone();
    let laws = laws.as_array().unwrap();
    assert!(laws.len() > 8);
    for law in laws {
        let name = law.as_str().unwrap();
        let choice: sim::selection::LawChoice = name.parse().unwrap();
        let full = choice.to_string();
        assert!(full == name || full == format!("{name}:observer"), "{name}");
    }
}
