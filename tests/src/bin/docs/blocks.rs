//! Output of programs in documents:
//!
//! ```text
//! <!-- from: COMMAND -->
//! its output, in a fence or as plain text
//! <!-- end -->
//! ```
//!
//! `from` compares every character. `about` is for figures that depend on the compiler, such as instructions: words
//! must be the same, numbers within 10 %, or 16 where that is more, as in `tests/board/budget.py`.

use crate::Problem;
use crate::commands::Programs;
use crate::markdown::Document;

/// Relative tolerance of a number in an `about` block.
const TOLERANCE: f64 = 0.1;
/// Absolute tolerance of a small one.
const SLACK: f64 = 16.0;

/// Runs the command of each block and compares its content with the output, or with `update` replaces it.
pub(crate) fn check(document: &mut Document, programs: &Programs, update: bool) -> Vec<Problem> {
    let mut problems = Vec::new();
    let mut from = 0;
    while let Some(start) = next_marker(document.raw(), from) {
        let block = match Block::at(document.raw(), start) {
            Ok(block) => block,
            Err(problem) => {
                problems.push(problem);
                return problems;
            }
        };
        from = block.end;
        match programs.output(&block.command) {
            Err(message) => problems.push(Problem::new(start + 1, message)),
            Ok(output) => {
                let new: Vec<String> = output.lines().map(|line| line.trim_end().into()).collect();
                let old = &document.raw()[block.content.clone()];
                if let Some(difference) = difference(old, &new, block.exact) {
                    if update {
                        from = from + new.len() - old.len();
                        document.raw().splice(block.content, new);
                    } else {
                        let command = &block.command;
                        problems.push(Problem::new(
                            start + 1,
                            format!(
                                "differs from the output of `{command}`; docs --update replaces it\
{difference}"
                            ),
                        ));
                    }
                }
            }
        }
    }
    problems
}

struct Block {
    command: String,
    exact: bool,
    /// Lines of the output, without the fence.
    content: std::ops::Range<usize>,
    /// Line of the end marker.
    end: usize,
}

fn next_marker(lines: &[String], from: usize) -> Option<usize> {
    (from..lines.len()).find(|&line| marker(&lines[line]).is_some())
}

/// Kind and command of a block's first line.
fn marker(line: &str) -> Option<(&str, &str)> {
    let (kind, command) = line
        .strip_prefix("<!-- ")?
        .strip_suffix(" -->")?
        .split_once(": ")?;
    matches!(kind, "from" | "about").then_some((kind, command))
}

impl Block {
    fn at(lines: &[String], start: usize) -> Result<Self, Problem> {
        let (kind, command) = marker(&lines[start]).unwrap_or_default();
        let end = (start + 1..lines.len())
            .take_while(|&line| marker(&lines[line]).is_none())
            .find(|&line| lines[line] == "<!-- end -->")
            .ok_or_else(|| Problem::new(start + 1, "no <!-- end --> after this"))?;
        let fenced = end - start > 2 && lines[start + 1].starts_with("```");
        let fence = usize::from(fenced);
        Ok(Self {
            command: command.into(),
            exact: kind == "from",
            content: start + 1 + fence..end - fence,
            end,
        })
    }
}

/// The lines that differ, `-` in the document and `+` printed, including those missing at the end.
fn difference(old: &[String], new: &[String], exact: bool) -> Option<String> {
    let same = |old: &String, new: &String| if exact { old == new } else { near(old, new) };
    let mut lines = Vec::new();
    for index in 0..old.len().max(new.len()) {
        match (old.get(index), new.get(index)) {
            (Some(old), Some(new)) if same(old, new) => {}
            (old, new) => {
                lines.extend(old.map(|line| format!("  - {line}")));
                lines.extend(new.map(|line| format!("  + {line}")));
            }
        }
    }
    (!lines.is_empty()).then(|| lines.join("\n"))
}

/// Whether words are the same and numbers close.
fn near(old: &str, new: &str) -> bool {
    let mut old = old.split_whitespace();
    let mut new = new.split_whitespace();
    loop {
        match (old.next(), new.next()) {
            (None, None) => return true,
            (Some(old), Some(new)) if old == new => {}
            (Some(old), Some(new)) => match (old.parse::<f64>(), new.parse::<f64>()) {
                (Ok(old), Ok(new)) if (old - new).abs() <= SLACK.max(TOLERANCE * old.abs()) => {}
                _ => return false,
            },
            _ => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn lines(text: &str) -> Vec<String> {
        text.lines().map(str::to_owned).collect()
    }

    #[test]
    fn a_block_is_what_is_between_its_markers_and_in_its_fence() {
        let text = lines(
            "a\n<!-- from: echo 1 -->\n```text\n1\n```\n<!-- end -->\n<!-- about: echo 2 -->\n2\n<!-- end -->",
        );
        let first = Block::at(&text, next_marker(&text, 0).unwrap()).unwrap();
        assert_eq!((first.command.as_str(), first.exact), ("echo 1", true));
        assert_eq!((first.content, first.end), (3..4, 5));
        let second = Block::at(&text, next_marker(&text, first.end).unwrap()).unwrap();
        assert_eq!((second.command.as_str(), second.exact), ("echo 2", false));
        assert_eq!((second.content, second.end), (7..8, 8));
        let open = lines("<!-- from: a -->\n<!-- from: b -->\n<!-- end -->");
        assert!(Block::at(&open, 0).is_err());
    }

    #[test]
    fn every_character_counts_and_about_forgives_a_tenth_of_a_number() {
        let kept = lines("call  max\nsample  1000");
        let cases = [
            ("call  max\nsample  1000", true, true),
            ("call  max\nsample   1099", false, true),
            ("call  max\nsample   1101", false, false),
            ("call  max\nsample  x1000", false, false),
            ("call  max\nsamples  1000", false, false),
            ("call  max", false, false),
            ("call  max\nsample  1000\nmore", false, false),
            ("call  max\nsample  1000 1", false, false),
        ];
        for (printed, exact, about) in cases {
            let printed = lines(printed);
            assert_eq!(
                difference(&kept, &printed, true).is_none(),
                exact,
                "{printed:?}"
            );
            assert_eq!(
                difference(&kept, &printed, false).is_none(),
                about,
                "{printed:?}"
            );
        }
    }
}
