//! Where a value is said.

use toml::de::{DeTable, DeValue};

use crate::scenario::{Place, Scenario};
use crate::text;

impl Scenario {
    /// Where the value under a key is said; the last change counts.
    pub(super) fn place(&self, key: &str) -> Place {
        let change = self.changes.iter().rev().find(|change| change.is_of(key));
        match change {
            Some(change) => Place::Change(change.said.clone()),
            None => place(&self.source.text, key)
                .map_or(Place::Default, |(line, column)| Place::Text(line, column)),
        }
    }
}

/// Line and column of the value under a key such as `cycle[2].jump.to[0]`, if it is in the text: a default is not.
fn place(toml: &str, key: &str) -> Option<(usize, usize)> {
    let document = DeTable::parse(toml).ok()?;
    let mut at = document.span();
    let mut value: Option<&DeValue<'_>> = None;
    for word in key.split(['.', '[']) {
        let next = match word.strip_suffix(']') {
            Some(index) => value?.as_array()?.get(index.parse::<usize>().ok()?),
            None => match value {
                None => document.get_ref().get(word),
                Some(value) => value.as_table()?.get(word),
            },
        };
        let next = next?;
        at = next.span();
        value = Some(next.get_ref());
    }
    Some(text::place(toml, at.start))
}
