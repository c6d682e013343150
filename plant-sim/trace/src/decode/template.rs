//! What is the same in every frame of a message, put together once: names, units and whatever else is between the values.

use protocol::schema::{Kind, MessageInfo};

use super::Format;
use crate::fields::{Decoded, Field, Value, full_name};
use crate::text::Line;

/// The fields of a message, for frames of one length and, if the message has a selector, one value of it.
pub(super) struct Template {
    info: &'static MessageInfo,
    len: usize,
    /// Place of the selector, and its value.
    selected: Option<(usize, u8)>,
    format: Format,
    /// All text but the values.
    fixed: String,
    places: Vec<Place>,
}

/// Where a value goes, and where it comes from.
struct Place {
    /// Place in the fixed text where a row begins, in CSV.
    row: Option<usize>,
    /// End of the fixed text before the value.
    until: usize,
    /// First byte of the value in the frame.
    offset: usize,
    kind: Kind,
}

impl Template {
    /// The template of this frame and all like it.
    pub(super) fn new(format: Format, decoded: &Decoded) -> Self {
        let mut template = Self {
            info: decoded.info,
            len: decoded.body().len(),
            selected: None,
            format,
            fixed: String::new(),
            places: Vec::new(),
        };
        if format == Format::JsonLines {
            template.fixed += r#","fields":{"#;
        }
        for (index, field) in decoded.fields().enumerate() {
            let signal = field.signal;
            if let Kind::Selector(_) = signal.kind {
                template.selected = Some((signal.offset, decoded.body()[signal.offset]));
            }
            match format {
                Format::Text => {
                    if index > 0 || decoded.counter.is_some() {
                        template.fixed += "  ";
                    }
                    template.text(field);
                }
                Format::Csv => template.csv(field),
                Format::JsonLines => template.json(field, index == 0),
            }
        }
        template.fixed += match format {
            Format::Text | Format::Csv => "",
            Format::JsonLines => "}",
        };
        template
    }

    /// Whether this frame is one of those.
    pub(super) fn fits(&self, decoded: &Decoded) -> bool {
        let body = decoded.body();
        std::ptr::eq(self.info, decoded.info)
            && self.len == body.len()
            && (self.selected).is_none_or(|(offset, value)| body[offset] == value)
    }

    /// The text of a frame that fits. `row` is how every row of CSV begins.
    pub(super) fn fill(&self, decoded: &Decoded, row: &Line, line: &mut Line) {
        let body = decoded.body();
        let mut from = 0;
        for place in &self.places {
            if let Some(at) = place.row {
                line.word(&self.fixed[from..at]);
                line.extend(row.bytes());
                from = at;
            }
            line.word(&self.fixed[from..place.until]);
            from = place.until;
            match Value::new(place.kind, &body[place.offset..]) {
                Value::Unsigned(value) => line.integer(value),
                Value::Signed(value) => line.integer(value),
                Value::Float(value) => line.float(value),
                Value::Code(name) => line.word(name),
                value @ Value::Flags(..) => self.flags(value, line),
            }
        }
        line.word(&self.fixed[from..]);
    }

    /// Names in quotes in JSON, `ready|torque-on` or `-` elsewhere.
    fn flags(&self, value: Value, line: &mut Line) {
        let (quote, separator, none) = match self.format {
            Format::JsonLines => ("\"", "\",\"", ""),
            Format::Text | Format::Csv => ("", "|", "-"),
        };
        let mut names = value.flags();
        let Some(first) = names.next() else {
            return line.word(none);
        };
        line.word(quote);
        line.word(first);
        for name in names {
            line.word(separator);
            line.word(name);
        }
        line.word(quote);
    }

    /// Room for an element of a field.
    fn value(&mut self, field: Field<'_>, index: usize) {
        let kind = field.signal.kind;
        self.places.push(Place {
            row: None,
            until: self.fixed.len(),
            offset: field.signal.offset + index * kind.size(),
            kind,
        });
    }

    /// `name=value unit`, or `name=(value, value) unit` if all elements share the unit.
    fn text(&mut self, field: Field<'_>) {
        self.fixed += field.signal.name;
        self.fixed += "=";
        let elements = field.signal.elements;
        let common = elements
            .first()
            .filter(|(_, first)| elements.iter().all(|(_, unit)| unit == first));
        if elements.len() > 1 {
            self.fixed += "(";
        }
        for (index, (_, unit)) in elements.iter().enumerate() {
            if index > 0 {
                self.fixed += ", ";
            }
            self.value(field, index);
            if common.is_none() {
                self.fixed += " ";
                self.fixed += unit;
            }
        }
        if elements.len() > 1 {
            self.fixed += ")";
        }
        if let Some((_, unit)) = common
            && !unit.is_empty()
        {
            self.fixed += " ";
            self.fixed += unit;
        }
    }

    /// A row for each element.
    fn csv(&mut self, field: Field<'_>) {
        for (index, (element, unit)) in field.signal.elements.iter().enumerate() {
            let row = self.fixed.len();
            self.fixed += &format!(",{},", full_name(field.signal.name, element));
            self.value(field, index);
            self.places[..].last_mut().expect("just added").row = Some(row);
            self.fixed += &format!(",{unit}\n");
        }
    }

    /// `"name":{"value":1.5,"unit":"rad"}`; flags are a list of the names set. By hand: names and units come from tables and
    /// contain nothing that JSON has to escape.
    fn json(&mut self, field: Field<'_>, is_first: bool) {
        let (open, close) = match field.signal.kind {
            Kind::Code(_) | Kind::Selector(_) => ("\"", "\""),
            Kind::Flags8(_) | Kind::Flags16(_) => ("[", "]"),
            // Enough digits to distinguish a float from every other.
            _ => ("", ""),
        };
        for (index, (element, unit)) in field.signal.elements.iter().enumerate() {
            if index > 0 || !is_first {
                self.fixed += ",";
            }
            let name = full_name(field.signal.name, element);
            self.fixed += &format!(r#""{name}":{{"value":{open}"#);
            self.value(field, index);
            self.fixed += close;
            if !unit.is_empty() {
                self.fixed += &format!(r#","unit":"{unit}""#);
            }
            self.fixed += "}";
        }
    }
}
