//! Checked values from JSON text, with the place of every error.
//!
//! `serde_json` knows lines only while parsing; a missing key or a mass of zero is noticed later. The reader therefore
//! keeps the path of every value it returns, and looks up the line only to report an error.

use std::collections::BTreeSet;
use std::fmt;

use serde::de::{Deserialize, Deserializer, Error as _, MapAccess, SeqAccess, Visitor};
use serde_json::Value;

use super::{ModelError, ModelErrorKind};
use crate::allowed::Allowed;
use crate::text::nearest;

#[derive(Clone)]
enum Segment {
    Key(String),
    Index(usize),
}

/// A value inside a document, with its place.
#[derive(Clone)]
pub(super) struct Node<'a> {
    text: &'a str,
    value: &'a Value,
    path: Vec<Segment>,
}

/// Parses `text`; an error names its place. A duplicate key in an object is an error: there is no way to know which one
/// was meant.
pub(super) fn parse(text: &str) -> Result<Value, ModelError> {
    let refused = |error: serde_json::Error| {
        let text = error.to_string();
        // Its own words for the place say the same once more.
        let (what, _) = text.rsplit_once(" at line ").unwrap_or((&text, ""));
        ModelError {
            place: Some((error.line(), error.column())),
            cause: ModelErrorKind::Syntax(what.into()),
        }
    };
    serde_json::from_str::<NoDoubles>(text).map_err(refused)?;
    serde_json::from_str(text).map_err(refused)
}

/// Any JSON without duplicate keys.
struct NoDoubles;

impl<'de> Deserialize<'de> for NoDoubles {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_any(Self)
    }
}

macro_rules! accept {
    ($($visit:ident: $of:ty),*) => {
        $(fn $visit<E>(self, _: $of) -> Result<Self, E> {
            Ok(self)
        })*
    };
}

impl<'de> Visitor<'de> for NoDoubles {
    type Value = Self;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("JSON")
    }

    accept!(visit_bool: bool, visit_i64: i64, visit_u64: u64, visit_f64: f64, visit_str: &str);

    fn visit_unit<E>(self) -> Result<Self, E> {
        Ok(self)
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Self, A::Error> {
        while sequence.next_element::<Self>()?.is_some() {}
        Ok(self)
    }

    fn visit_map<A: MapAccess<'de>>(self, mut map: A) -> Result<Self, A::Error> {
        let mut keys = BTreeSet::new();
        while let Some(key) = map.next_key::<String>()? {
            if keys.contains(&key) {
                return Err(A::Error::custom(format!(
                    "{key} occurs twice in one object; allowed: once"
                )));
            }
            keys.insert(key);
            map.next_value::<Self>()?;
        }
        Ok(self)
    }
}

impl<'a> Node<'a> {
    pub(super) fn root(text: &'a str, value: &'a Value) -> Self {
        Self {
            text,
            value,
            path: Vec::new(),
        }
    }

    /// The value under `key`, or `None`. A node that is not an object has no keys.
    pub(super) fn optional(&self, key: &str) -> Option<Node<'a>> {
        self.value
            .get(key)
            .map(|value| self.child(value, Segment::Key(key.to_owned())))
    }

    /// The value under `key`; `expected` describes what belongs there.
    pub(super) fn get(
        &self,
        key: &str,
        expected: impl fmt::Display,
    ) -> Result<Node<'a>, ModelError> {
        if !self.value.is_object() {
            return Err(self.wrong("a JSON object"));
        }
        self.optional(key).ok_or_else(|| {
            let mut path = self.path.clone();
            path.push(Segment::Key(key.to_owned()));
            let cause = ModelErrorKind::Missing {
                path: display(&path),
                expected: expected.to_string(),
            };
            ModelError {
                place: Some(place_of(self.text, &self.path)),
                cause,
            }
        })
    }

    /// The elements of an array of exactly `N`.
    pub(super) fn elements<const N: usize>(
        &self,
        of: impl fmt::Display,
    ) -> Result<[Node<'a>; N], ModelError> {
        let nodes: Option<Vec<_>> = self.value.as_array().map(|values| {
            values
                .iter()
                .enumerate()
                .map(|(i, value)| self.child(value, Segment::Index(i)))
                .collect()
        });
        nodes
            .and_then(|nodes| nodes.try_into().ok())
            .ok_or_else(|| self.wrong(format!("an array of {N}: {of}")))
    }

    /// This value as a number.
    pub(super) fn as_number(&self, allowed: Allowed) -> Result<f64, ModelError> {
        match self.value.as_f64() {
            Some(number) => allowed
                .check(number)
                .map_err(|expected| self.wrong(expected)),
            None => Err(self.wrong(allowed)),
        }
    }

    /// This value as a text, if it is one.
    pub(super) fn as_str(&self) -> Option<&'a str> {
        self.value.as_str()
    }

    /// Warns of unknown keys, with the nearest known one.
    pub(super) fn warn_of_unknown(&self, known: &[String], warnings: &mut Vec<String>) {
        for (node, hint) in self.unknown(known) {
            warnings.push(format!(
                "line {}: {} is not known and not used{hint}",
                node.line(),
                node.path()
            ));
        }
    }

    /// Refuses unknown keys.
    pub(super) fn refuse_unknown(&self, known: &[String]) -> Result<(), ModelError> {
        match self.unknown(known).next() {
            Some((node, hint)) => Err(ModelError {
                place: Some(place_of(self.text, &node.path)),
                cause: ModelErrorKind::Unknown {
                    path: node.path(),
                    hint,
                },
            }),
            None => Ok(()),
        }
    }

    fn unknown<'b>(
        &self,
        known: &'b [String],
    ) -> impl Iterator<Item = (Node<'a>, String)> + use<'_, 'a, 'b> {
        let object = self.value.as_object().into_iter().flatten();
        object
            .filter(|(key, _)| !known.contains(key))
            .map(move |(key, value)| {
                let hint = nearest(key, known.iter().map(String::as_str))
                    .map_or_else(String::new, |near| format!("; did you mean {near}?"));
                (self.child(value, Segment::Key(key.clone())), hint)
            })
    }

    pub(super) fn number(&self, key: &str, allowed: Allowed) -> Result<f64, ModelError> {
        self.get(key, allowed)?.as_number(allowed)
    }

    pub(super) fn numbers<const N: usize>(
        &self,
        key: &str,
        allowed: Allowed,
    ) -> Result<[f64; N], ModelError> {
        self.get(key, format!("an array of {N}: {allowed}"))?
            .as_numbers(allowed)
    }

    pub(super) fn as_numbers<const N: usize>(
        &self,
        allowed: Allowed,
    ) -> Result<[f64; N], ModelError> {
        let nodes = self.elements::<N>(allowed)?;
        let mut numbers = [0.0; N];
        for (number, node) in numbers.iter_mut().zip(&nodes) {
            *number = node.as_number(allowed)?;
        }
        Ok(numbers)
    }

    pub(super) fn string(&self, key: &str) -> Result<&'a str, ModelError> {
        let node = self.get(key, "a string")?;
        node.value.as_str().ok_or_else(|| node.wrong("a string"))
    }

    /// The error that this value is not allowed.
    pub(super) fn wrong(&self, expected: impl fmt::Display) -> ModelError {
        let found = match self.value {
            Value::Array(values) => format!("an array of {}", values.len()),
            Value::Object(_) => "an object".to_owned(),
            Value::Number(number) => number
                .as_f64()
                .map_or_else(|| number.to_string(), crate::text::number),
            scalar => scalar.to_string(),
        };
        let cause = ModelErrorKind::Wrong {
            path: display(&self.path),
            found,
            expected: expected.to_string(),
        };
        ModelError {
            place: Some(place_of(self.text, &self.path)),
            cause,
        }
    }

    /// Line of this value, counted from 1.
    pub(super) fn line(&self) -> usize {
        place_of(self.text, &self.path).0
    }

    /// Path of this value, as in `links[2].mass`.
    pub(super) fn path(&self) -> String {
        display(&self.path)
    }

    fn child(&self, value: &'a Value, segment: Segment) -> Self {
        let mut path = self.path.clone();
        path.push(segment);
        Self {
            text: self.text,
            value,
            path,
        }
    }
}

fn display(path: &[Segment]) -> String {
    let mut text = String::new();
    for segment in path {
        match segment {
            Segment::Key(key) if text.is_empty() => text.push_str(key),
            Segment::Key(key) => text.extend([".", key]),
            Segment::Index(index) => text.push_str(&format!("[{index}]")),
        }
    }
    if text.is_empty() {
        "the document".to_owned()
    } else {
        text
    }
}

/// Line and column of the value under `path`, counted from 1.
fn place_of(text: &str, path: &[Segment]) -> (usize, usize) {
    let mut cursor = Cursor {
        bytes: text.as_bytes(),
        at: 0,
    };
    cursor.skip_space();
    for segment in path {
        cursor.enter(segment);
    }
    crate::text::place(text, cursor.at)
}

/// Walks text known to be valid JSON.
struct Cursor<'a> {
    bytes: &'a [u8],
    at: usize,
}

impl<'a> Cursor<'a> {
    fn peek(&self) -> u8 {
        self.bytes.get(self.at).copied().unwrap_or(b'}')
    }

    fn skip_space(&mut self) {
        while self.peek().is_ascii_whitespace() {
            self.at += 1;
        }
    }

    /// Moves from the start of a container to the start of one of its values. Of a duplicate key
    /// the last occurrence counts, as for the parser.
    fn enter(&mut self, segment: &Segment) {
        let keyed = self.peek() == b'{';
        let mut found = self.at;
        self.at += 1;
        self.skip_space();
        for index in 0.. {
            if matches!(self.peek(), b'}' | b']') {
                break;
            }
            let mut key: &[u8] = &[];
            if keyed {
                key = self.string();
                self.skip_space();
                self.at += 1; // ':'
                self.skip_space();
            }
            match segment {
                Segment::Key(wanted) if wanted.as_bytes() == key => found = self.at,
                Segment::Index(wanted) if *wanted == index => found = self.at,
                _ => {}
            }
            self.value();
            self.skip_space();
            if self.peek() == b',' {
                self.at += 1;
                self.skip_space();
            }
        }
        self.at = found;
    }

    fn string(&mut self) -> &'a [u8] {
        let start = self.at + 1;
        self.at = start;
        while self.at < self.bytes.len() && self.peek() != b'"' {
            self.at += if self.peek() == b'\\' { 2 } else { 1 };
        }
        let end = self.at.min(self.bytes.len());
        self.at += 1;
        &self.bytes[start..end]
    }

    fn value(&mut self) {
        let mut depth = 0;
        while self.at < self.bytes.len() {
            match self.peek() {
                b'"' => {
                    self.string();
                    if depth == 0 {
                        return;
                    }
                    continue;
                }
                b'{' | b'[' => depth += 1,
                b'}' | b']' if depth == 0 => return,
                b'}' | b']' => {
                    depth -= 1;
                    if depth == 0 {
                        self.at += 1;
                        return;
                    }
                }
                b',' if depth == 0 => return,
                _ => {}
            }
            self.at += 1;
        }
    }
}
