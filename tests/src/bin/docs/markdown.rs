//! The part of Markdown that the checks need.

/// A document by lines.
pub(crate) struct Document {
    lines: Vec<String>,
}

/// A line of a document, and whether it is inside a fence.
pub(crate) struct Line<'a> {
    /// From 1.
    pub(crate) number: usize,
    pub(crate) text: &'a str,
    /// Language of the fence around it, such as `sh`; the fence's own lines are left out.
    pub(crate) fence: Option<&'a str>,
}

impl Document {
    pub(crate) fn new(text: &str) -> Self {
        Self {
            lines: text.lines().map(str::to_owned).collect(),
        }
    }

    pub(crate) fn text(&self) -> String {
        self.lines.join("\n") + "\n"
    }

    pub(crate) fn raw(&mut self) -> &mut Vec<String> {
        &mut self.lines
    }

    /// Every line but those of fences.
    pub(crate) fn lines(&self) -> impl Iterator<Item = Line<'_>> {
        let mut fence = None;
        self.lines
            .iter()
            .enumerate()
            .filter_map(move |(index, text)| {
                if let Some(kind) = text.trim_start().strip_prefix("```") {
                    fence = match fence {
                        None => Some(kind),
                        Some(_) => None,
                    };
                    return None;
                }
                Some(Line {
                    number: index + 1,
                    text,
                    fence,
                })
            })
    }

    /// Text between backquotes, with the number of its first line. A span ends at the latest with its paragraph.
    pub(crate) fn code_spans(&self) -> Vec<(usize, String)> {
        let mut spans = Vec::new();
        let mut open: Option<(usize, String)> = None;
        let mut last = 0;
        for line in self.lines() {
            if line.fence.is_some() || line.text.is_empty() || line.number > last + 1 {
                open = None;
            }
            last = line.number;
            if line.fence.is_some() {
                continue;
            }
            for (index, part) in line.text.split('`').enumerate() {
                if index > 0 {
                    match open.take() {
                        Some(span) => spans.push(span),
                        None => open = Some((line.number, String::new())),
                    }
                }
                if let Some((_, span)) = &mut open {
                    span.push_str(part.trim_start());
                }
            }
            if let Some((_, span)) = &mut open {
                span.push(' ');
            }
        }
        spans
    }

    /// Targets of `[text](target)`, with the number of their line.
    pub(crate) fn links(&self) -> impl Iterator<Item = (usize, &str)> {
        self.lines()
            .filter(|line| line.fence.is_none())
            .flat_map(|line| {
                let targets = line.text.split("](").skip(1);
                targets.filter_map(move |rest| Some((line.number, rest.split_once(')')?.0)))
            })
    }

    /// Whether a heading has this anchor, by GitHub's rule.
    pub(crate) fn has_anchor(&self, anchor: &str) -> bool {
        self.lines()
            .filter(|line| line.fence.is_none() && line.text.starts_with('#'))
            .any(|line| slug(line.text.trim_start_matches('#').trim()) == anchor)
    }
}

/// Lower case; blanks become hyphens, and anything but letters, digits, hyphens and underscores is removed.
fn slug(heading: &str) -> String {
    heading
        .to_lowercase()
        .chars()
        .filter_map(|letter| match letter {
            ' ' => Some('-'),
            '-' | '_' => Some(letter),
            _ => letter.is_alphanumeric().then_some(letter),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const TEXT: &str = "# Faults, and `resets`\nsee [a](b.md#c) and [d](e)\n```sh\n# not one\nrun `x`\n```\nuse `y\n  z`\n";

    #[test]
    fn fences_links_spans_and_headings_are_told_apart() {
        let document = Document::new(TEXT);
        assert_eq!(document.text(), TEXT);
        assert_eq!(
            document.links().collect::<Vec<_>>(),
            [(2, "b.md#c"), (2, "e")]
        );
        assert_eq!(
            document.code_spans(),
            [(1, "resets".into()), (7, "y z".into())]
        );
        let shell: Vec<_> = document
            .lines()
            .filter(|line| line.fence == Some("sh"))
            .map(|line| line.number)
            .collect();
        assert_eq!(shell, [4, 5]);
        assert!(document.has_anchor("faults-and-resets"));
        assert!(!document.has_anchor("not-one"));
    }
}
