//! Parts of `docs/safety.md` that are generated from the code.

use std::path::Path;

/// Compares the part `name`, between its two marks, with `text`; with `UPDATE_DOCS` set, writes it instead.
#[track_caller]
pub(crate) fn compare(name: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/safety.md");
    let doc = std::fs::read_to_string(&path).expect("docs/safety.md can be read");
    let (begin, end) = (
        format!("<!-- begin {name} -->\n"),
        format!("<!-- end {name} -->\n"),
    );
    let (head, rest) = doc
        .split_once(&begin)
        .unwrap_or_else(|| panic!("docs/safety.md has no {begin}"));
    let (found, tail) = rest
        .split_once(&end)
        .unwrap_or_else(|| panic!("docs/safety.md has no {end}"));
    if found == text {
        return;
    }
    if std::env::var_os("UPDATE_DOCS").is_some() {
        std::fs::write(&path, format!("{head}{begin}{text}{end}{tail}"))
            .expect("docs/safety.md can be written");
        return;
    }
    let mut report = String::new();
    for line in found
        .lines()
        .filter(|line| !text.lines().any(|l| l == *line))
    {
        report += &format!("-{line}\n");
    }
    for line in text
        .lines()
        .filter(|line| !found.lines().any(|l| l == *line))
    {
        report += &format!("+{line}\n");
    }
    panic!(
        "docs/safety.md differs from the {name} of the code:\n{report}\
         UPDATE_DOCS=1 cargo test -p firmware --test states --test faults --test node writes it anew"
    );
}
