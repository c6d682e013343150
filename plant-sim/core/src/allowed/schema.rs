//! Ranges as a JSON schema says them.

use protocol::parameters::ControllerParameter;
use schemars::Schema;
use schemars::transform::Transform;
use serde_json::{Value, json};

use super::Allowed;

/// Keyword for the unit of a number. JSON Schema lets readers skip keywords that they do not know.
const UNIT: &str = "unit";

impl Allowed {
    fn describe(self, schema: &mut Schema) {
        if self.low != f64::MIN {
            let keyword = if self.above {
                "exclusiveMinimum"
            } else {
                "minimum"
            };
            schema.insert(keyword.into(), self.low.into());
        }
        if self.high != f64::MAX {
            schema.insert("maximum".into(), self.high.into());
        }
        if !self.unit.is_empty() {
            schema.insert(UNIT.into(), self.unit.into());
        }
    }
}

/// A transform that an attribute can name: those take calls, and no constants.
pub(crate) fn by<T: Transform>(transform: T) -> T {
    transform
}

/// Of a number, or of each number in an array.
impl Transform for Allowed {
    fn transform(&mut self, schema: &mut Schema) {
        match schema.get_mut("items").and_then(Value::as_object_mut) {
            Some(items) => {
                let mut element = Schema::from(std::mem::take(items));
                self.describe(&mut element);
                *items = std::mem::take(element.ensure_object());
            }
            None => self.describe(schema),
        }
    }
}

/// What each number of an array may be.
pub(crate) struct Each<const N: usize>(pub(crate) [Allowed; N]);

impl<const N: usize> Transform for Each<N> {
    fn transform(&mut self, schema: &mut Schema) {
        let elements = self.0.map(|allowed| {
            let mut element = schemars::json_schema!({ "type": "number" });
            allowed.describe(&mut element);
            Value::from(element)
        });
        schema.insert("prefixItems".into(), elements.to_vec().into());
        schema.insert("items".into(), false.into());
    }
}

/// What an array must be, number by number; where there is none, the element is as it was.
pub(crate) struct Exactly<const N: usize>(pub(crate) [Option<f64>; N]);

impl<const N: usize> Transform for Exactly<N> {
    fn transform(&mut self, schema: &mut Schema) {
        let usual = schema.get("items").cloned().unwrap_or_default();
        let elements = self.0.map(|number| match number {
            Some(number) => json!({ "const": number }),
            None => usual.clone(),
        });
        schema.insert("prefixItems".into(), elements.to_vec().into());
        schema.insert("items".into(), false.into());
    }
}

/// What a gain may be, at any rate.
pub(crate) struct Gain(pub(crate) ControllerParameter);

impl Transform for Gain {
    fn transform(&mut self, schema: &mut Schema) {
        let rule = self.0.rule();
        schema.insert("minimum".into(), rule.lower.into());
        // At the highest rate a corner is bounded by its own range alone.
        schema.insert("maximum".into(), rule.upper_at(1e-4).into());
    }
}

/// Keys that other programs put into the same object.
pub(crate) struct Unused(pub(crate) &'static [&'static str]);

impl Transform for Unused {
    fn transform(&mut self, schema: &mut Schema) {
        let object = schema.ensure_object();
        if let Some(Value::Object(properties)) = object.get_mut("properties") {
            for key in self.0 {
                let about = json!({ "description": "Not used." });
                properties.insert((*key).into(), about);
            }
        }
    }
}
