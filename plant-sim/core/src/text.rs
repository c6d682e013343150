//! Input text: its origin, and places and words in it for messages.

/// Text of a scenario or a model, and its origin.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Source {
    /// File, or the name of one that comes with the program.
    pub origin: String,
    /// All of it.
    pub text: String,
}

/// What a name may hold: it is shown on terminals, which obey control characters.
pub(crate) const IN_A_NAME: &str = "a text without control characters";

/// Line and column of a byte in `text`, counted from 1; columns count characters.
pub(crate) fn place(text: &str, at: usize) -> (usize, usize) {
    let before = text.get(..at).unwrap_or(text);
    let line = before.matches('\n').count() + 1;
    let start = before.rfind('\n').map_or(0, |newline| newline + 1);
    (line, before[start..].chars().count() + 1)
}

/// The known word most likely meant, if one is near enough.
pub fn nearest<'a>(word: &str, known: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    known
        .map(|known| (strsim::jaro_winkler(word, known), known))
        .filter(|(likeness, _)| *likeness > 0.8)
        .max_by(|a, b| a.0.total_cmp(&b.0))
        .map(|(_, known)| known)
}

/// Words that are allowed where `word` is not, and the one most likely meant.
pub(crate) fn allowed(word: &str, known: &[&str]) -> String {
    let list = known.join(", ");
    match nearest(word, known.iter().copied()) {
        Some(near) => format!("{list}; did you mean {near}?"),
        None => list,
    }
}

/// Several messages, one on a line.
pub(crate) fn lines(messages: &[impl ToString]) -> String {
    let lines: Vec<String> = messages.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

/// A number in a message: very large and very small ones with an exponent.
pub fn number(number: f64) -> String {
    let size = number.abs();
    if size != 0.0 && size.is_finite() && !(1e-9..1e15).contains(&size) {
        format!("{number:e}")
    } else {
        number.to_string()
    }
}
