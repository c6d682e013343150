//! Links and paths in documents: each must exist.

use std::fs;
use std::path::Path;

use crate::Problem;
use crate::markdown::Document;

/// Prefixes of the paths in backquotes that are checked. A name after one of Rust is that of a function in it.
const FOLDERS: [&str; 5] = ["docs/", "firmware/", "plant-sim/", "protocol/", "tests/"];

/// Links of the document at `path`, and paths from `root` in backquotes, that lead nowhere.
pub(crate) fn check(document: &Document, path: &Path, root: &Path) -> Vec<Problem> {
    let folder = path.parent().unwrap_or(root);
    let links = document.links().filter_map(|(line, target)| {
        let found = link_leads_somewhere(target, document, folder);
        (!found).then(|| Problem::new(line, format!("link to '{target}', which does not exist")))
    });
    let paths = document
        .code_spans()
        .into_iter()
        .filter_map(|(line, span)| {
            let mut words = span.split_whitespace();
            let word = words.next()?;
            if !FOLDERS.iter().any(|folder| word.starts_with(folder)) {
                return None;
            }
            if !exists(root, word) {
                return Some(Problem::new(
                    line,
                    format!("'{word}' is not a file or folder"),
                ));
            }
            let name = words.next().filter(|_| word.ends_with(".rs"))?;
            let has = has_function(root, word, name);
            (!has).then(|| Problem::new(line, format!("{word} has no function '{name}'")))
        });
    links.chain(paths).collect()
}

fn has_function(root: &Path, path: &str, name: &str) -> bool {
    fs::read_to_string(root.join(path)).is_ok_and(|text| text.contains(&format!("fn {name}(")))
}

fn link_leads_somewhere(target: &str, document: &Document, folder: &Path) -> bool {
    if target.contains("://") {
        return true;
    }
    let (file, anchor) = target.split_once('#').unwrap_or((target, ""));
    if file.is_empty() {
        return document.has_anchor(anchor);
    }
    let file = folder.join(file);
    if anchor.is_empty() {
        return file.exists();
    }
    fs::read_to_string(file).is_ok_and(|text| Document::new(&text).has_anchor(anchor))
}

/// Whether there is such a file. A star in the last part of the path matches anything.
fn exists(root: &Path, path: &str) -> bool {
    let Some((before, after)) = path.split_once('*') else {
        return root.join(path).exists();
    };
    let (folder, prefix) = before.rsplit_once('/').unwrap_or(("", before));
    fs::read_dir(root.join(folder)).is_ok_and(|entries| {
        entries.flatten().any(|entry| {
            let name = entry.file_name();
            let name = name.to_string_lossy();
            name.starts_with(prefix) && name.ends_with(after)
        })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_there_is_found() {
        let root = crate::root();
        let text = "# Here\n[a](README.md) [b](#here) [c](https://x.y) [d](docs/motion.md#the-control-laws)\n\
                    [e](none.md) [f](#there) [g](docs/motion.md#none)\n\
                    `tests/run rust` `tests/ci/1*.sh` `firmware/src`\n`tests/none` `tests/ci/none*.sh`\n\
                    `tests/tests/walls.rs root` `tests/tests/walls.rs none`\n";
        let lines: Vec<_> = check(&Document::new(text), &root.join("X.md"), &root)
            .into_iter()
            .map(|problem| problem.line)
            .collect();
        assert_eq!(lines, [3, 3, 3, 5, 5, 6]);
    }
}
