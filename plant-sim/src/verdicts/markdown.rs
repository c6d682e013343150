//! Markdown: how a run ended and a table of its requirements, for a pull request.

use super::{ending, finding, limit};
use crate::run::Results;

/// The results as Markdown.
pub fn markdown(results: &Results) -> String {
    let summary = &results.summary;
    let verdict = if summary.passed { "passed" } else { "failed" };
    let (Ok(end) | Err(end)) = ending(summary);
    let mut text = format!(
        "## {}: {verdict}\n\nIn the end {}.\n",
        escaped(&summary.recipe.scenario),
        escaped(&end)
    );
    if !summary.requirements.is_empty() {
        text += "\n| requirement | verdict | limit | found |\n|---|---|---|---|\n";
    }
    for verdict in &summary.requirements {
        let requirement = &verdict.requirement;
        text += &format!(
            "| {}: {} | {} | {} | {} |\n",
            escaped(&requirement.id),
            escaped(&requirement.text),
            if verdict.met { "met" } else { "**missed**" },
            escaped(&limit(requirement)),
            finding(verdict)
        );
    }
    text
}

/// Text that stays in its cell and means nothing to Markdown.
fn escaped(text: &str) -> String {
    let mut escaped = String::new();
    for letter in text.chars() {
        match letter {
            '\n' | '\r' => escaped.push(' '),
            '|' | '\\' | '`' | '*' | '_' | '<' | '[' | ']' | '#' => {
                escaped.push('\\');
                escaped.push(letter);
            }
            letter => escaped.push(letter),
        }
    }
    escaped
}
