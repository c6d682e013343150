//! JSON schemas of what the program reads and writes, and the same as tables for people.

use std::fmt::Write as _;

use schemars::generate::SchemaSettings;
use schemars::transform::RecursiveTransform;
use schemars::{JsonSchema, Schema};
use serde_json::{Map, Value};

/// Description of a key that only other programs use.
const UNUSED: &str = "Not used.";

/// The schema of a file that is read.
pub fn of_input<T: JsonSchema>() -> Schema {
    SchemaSettings::draft2020_12()
        .for_deserialize()
        .with_transform(RecursiveTransform(without_null))
        .into_generator()
        .into_root_schema_for::<T>()
}

/// Takes `null` from the types: what a person has nothing to say of is left out.
fn without_null(schema: &mut Schema) {
    let null = Value::from("null");
    if let Some(Value::Array(kinds)) = schema.get_mut("type") {
        kinds.retain(|kind| *kind != null);
        if let [kind] = kinds.as_slice() {
            let kind = kind.clone();
            schema.insert("type".into(), kind);
        }
    }
    if let Some(Value::Array(choices)) = schema.get_mut("anyOf") {
        choices.retain(|choice| choice["type"] != null);
        if let [Value::Object(choice)] = choices.as_slice() {
            let choice = choice.clone();
            schema.remove("anyOf");
            schema.ensure_object().extend(choice);
        }
    }
    if schema.get("default") == Some(&Value::Null) {
        schema.remove("default");
    }
}

/// The schema of what is written.
pub fn of_output<T: JsonSchema>() -> Schema {
    SchemaSettings::draft2020_12()
        .for_serialize()
        .into_generator()
        .into_root_schema_for::<T>()
}

/// A schema as Markdown: what it is, and a table for each kind of object in it.
pub fn markdown(schema: &Schema) -> String {
    let mut page = Page {
        root: schema.as_value(),
        sections: Vec::new(),
        text: String::new(),
    };
    let root = page.root;
    page.object(root);
    let mut next = 0;
    while let Some(name) = page.sections.get(next).cloned() {
        let _ = write!(page.text, "\n## {name}\n\n");
        page.object(&root["$defs"][name.as_str()]);
        next += 1;
    }
    page.text
}

struct Page<'a> {
    root: &'a Value,
    /// Names of definitions in the order in which they are named.
    sections: Vec<String>,
    text: String,
}

impl Page<'_> {
    fn object(&mut self, schema: &Value) {
        if let Some(about) = schema["description"].as_str() {
            let _ = write!(self.text, "{about}\n\n");
        }
        if let Some(element) = schema.get("items") {
            let kind = self.kind(element);
            let _ = writeln!(self.text, "An array; its elements are {kind}.");
        } else if let Some(names) = documented(schema) {
            self.text += "One of these names:\n\n| name | meaning |\n|---|---|\n";
            for (name, about) in names {
                let _ = writeln!(self.text, "| `{name}` | {} |", about.replace('\n', " "));
            }
        } else if let Some(variants) = schema["oneOf"].as_array() {
            self.text += "One of these keys, with its value:\n\n";
            self.table(variants.iter().filter_map(|variant| {
                let (key, value) = properties(variant)?.iter().next()?;
                Some((key.as_str(), value, &variant["description"], true))
            }));
        } else if let Some(keys) = properties(schema) {
            let required = schema["required"].as_array();
            self.table(keys.iter().map(|(key, value)| {
                let needed = required.is_some_and(|keys| keys.iter().any(|name| name == key));
                (key.as_str(), value, &value["description"], needed)
            }));
        }
    }

    /// Rows of key, schema, what it means, and whether it has to be there.
    fn table<'b>(&mut self, rows: impl Iterator<Item = (&'b str, &'b Value, &'b Value, bool)>) {
        self.text += "| key | type | allowed | meaning |\n|---|---|---|---|\n";
        let mut unused = Vec::new();
        for (key, schema, about, needed) in rows {
            let about = about.as_str().unwrap_or_default().replace('\n', " ");
            if about == UNUSED {
                unused.push(format!("`{key}`"));
                continue;
            }
            let mut kind = self.kind(schema);
            if !needed {
                kind += &match &schema["default"] {
                    Value::Null | Value::Object(_) => ", optional".into(),
                    default => format!(", {default} if left out"),
                };
            }
            let _ = writeln!(
                self.text,
                "| `{key}` | {kind} | {} | {} |",
                self.allowed(schema),
                about.replace('|', "\\|")
            );
        }
        if !unused.is_empty() {
            let _ = writeln!(self.text, "\nAllowed and not used: {}.", unused.join(", "));
        }
    }

    /// The type, in words.
    fn kind(&mut self, schema: &Value) -> String {
        if let Some(name) = definition(schema) {
            return self.named(name);
        }
        if let Some(choices) = schema["anyOf"].as_array() {
            let kinds: Vec<String> = choices.iter().map(|choice| self.kind(choice)).collect();
            return kinds.join(" or ");
        }
        match &schema["type"] {
            Value::String(kind) => self.one_kind(kind, schema),
            Value::Array(kinds) => {
                let kinds = kinds.iter().filter_map(Value::as_str);
                let kinds: Vec<String> = kinds.map(|kind| self.one_kind(kind, schema)).collect();
                kinds.join(" or ")
            }
            _ => "any".into(),
        }
    }

    fn one_kind(&mut self, kind: &str, schema: &Value) -> String {
        match kind {
            "array" => {
                // A plural: "array of 4 numbers", "array of strings".
                let items = match schema.get("items") {
                    Some(items @ Value::Object(_)) => self.kind(items),
                    _ => "number".into(),
                };
                let plural = if items.ends_with(char::is_alphabetic) {
                    "s"
                } else {
                    ""
                };
                let count = &schema["minItems"];
                if !count.is_null() && *count == schema["maxItems"] {
                    format!("array of {count} {items}{plural}")
                } else {
                    format!("array of {items}{plural}")
                }
            }
            "object" => match schema.get("additionalProperties") {
                Some(value @ Value::Object(_)) => format!("object of {}", self.kind(value)),
                _ => "object".into(),
            },
            kind => kind.into(),
        }
    }

    /// A definition: objects have a section of their own.
    fn named(&mut self, name: &str) -> String {
        let schema = &self.root["$defs"][name];
        if properties(schema).is_none() && schema.get("oneOf").is_none() {
            return self.kind(schema);
        }
        if !self.sections.iter().any(|known| known == name) {
            self.sections.push(name.into());
        }
        format!("[{name}](#{})", name.to_lowercase())
    }

    /// Range and unit of a number or of the numbers of an array, or the names to choose from.
    fn allowed(&self, schema: &Value) -> String {
        if let Some(name) = definition(schema) {
            return self.allowed(&self.root["$defs"][name]);
        }
        if let Some(elements) = schema["prefixItems"].as_array() {
            let ranges: Vec<String> = elements.iter().map(range).collect();
            return by_element(&ranges);
        }
        if let Some(names) = schema["enum"].as_array() {
            let name = |name: &Value| {
                name.as_str()
                    .map_or(name.to_string(), |text| format!("`{text}`"))
            };
            let names: Vec<String> = names.iter().map(name).collect();
            return names.join(", ");
        }
        match schema.get("items") {
            Some(element @ Value::Object(_)) => range(element),
            _ => range(schema),
        }
    }
}

/// The name of the definition that a schema refers to.
fn definition(schema: &Value) -> Option<&str> {
    schema["$ref"].as_str()?.strip_prefix("#/$defs/")
}

/// Names of an enumeration, each with its description.
fn documented(schema: &Value) -> Option<Vec<(&str, &str)>> {
    let variants = schema["oneOf"].as_array()?.iter();
    variants
        .map(|variant| Some((variant["const"].as_str()?, variant["description"].as_str()?)))
        .collect()
}

fn properties(schema: &Value) -> Option<&Map<String, Value>> {
    schema["properties"].as_object()
}

/// The range of most elements, then those of the others with their places.
fn by_element(ranges: &[String]) -> String {
    let count = |range: &String| ranges.iter().filter(|other| *other == range).count();
    let Some(usual) = ranges.iter().rev().max_by_key(|range| count(range)) else {
        return String::new();
    };
    let others = ranges
        .iter()
        .enumerate()
        .filter(|(_, range)| *range != usual);
    let others = others.map(|(place, range)| format!("; `[{place}]`: {range}"));
    usual.clone() + &others.collect::<String>()
}

fn range(schema: &Value) -> String {
    if let Some(only) = schema["const"].as_f64() {
        return number(only);
    }
    let bound = |key: &str| schema[key].as_f64().map(number);
    let mut text = match (
        bound("minimum"),
        bound("exclusiveMinimum"),
        bound("maximum"),
    ) {
        (Some(least), _, Some(most)) => format!("{least} to {most}"),
        (_, Some(below), Some(most)) => format!("above {below}, at most {most}"),
        (Some(least), ..) => format!("at least {least}"),
        _ => return String::new(),
    };
    if let Some(unit) = schema["unit"].as_str() {
        text += &format!(" {unit}");
    }
    text
}

/// As few digits as the number has, and no more than six behind the point.
fn number(number: f64) -> String {
    let text = format!("{number:.6}");
    text.trim_end_matches('0').trim_end_matches('.').into()
}
