//! Keeps the documents correct: the program output that they show, the commands that they give, the files that they
//! link.
//!
//! ```text
//! cargo run --release -p tests --bin docs -- [--update] [FILE...]
//! ```
//!
//! Without files it takes every Markdown file at the root and in `docs`. Programs are those in `target/release`: build
//! them first. `tests/ci/40-docs.sh` does all of this.

#![allow(
    clippy::indexing_slicing,
    reason = "an index names an invariant; a check of documents that breaks one fails"
)]

mod blocks;
mod commands;
mod markdown;
mod references;

use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};

use markdown::Document;

/// A problem in a document.
#[derive(Debug)]
struct Problem {
    /// Its line, from 1.
    line: usize,
    /// What is wrong, and what to do about it.
    text: String,
}

impl Problem {
    fn new(line: usize, text: impl Into<String>) -> Self {
        Self {
            line,
            text: text.into(),
        }
    }
}

fn main() -> ExitCode {
    let mut files: Vec<PathBuf> = Vec::new();
    let mut update = false;
    for argument in env::args().skip(1) {
        match argument.as_str() {
            "--update" => update = true,
            option if option.starts_with('-') => {
                eprintln!("docs: unknown option '{option}'\nusage: docs [--update] [FILE...]");
                return ExitCode::FAILURE;
            }
            file => files.push(file.into()),
        }
    }
    match check(&files, update) {
        Ok(0) => ExitCode::SUCCESS,
        Ok(problems) => {
            eprintln!("docs: {problems} problems");
            ExitCode::FAILURE
        }
        Err(message) => {
            eprintln!("docs: {message}");
            ExitCode::FAILURE
        }
    }
}

/// Prints all problems in the files and returns their number.
fn check(files: &[PathBuf], update: bool) -> Result<usize, String> {
    let root = root();
    let files = if files.is_empty() {
        every_document(&root)?
    } else {
        files.to_vec()
    };
    let programs = commands::Programs::new(&root)?;
    let mut count = 0;
    for file in files {
        let path = root.join(&file);
        let text = fs::read_to_string(&path)
            .map_err(|error| format!("cannot read {}: {error}", path.display()))?;
        let mut document = Document::new(&text);
        let mut problems = blocks::check(&mut document, &programs, update);
        if document.text() != text {
            fs::write(&path, document.text())
                .map_err(|error| format!("cannot write {}: {error}", path.display()))?;
            println!("{}: updated", file.display());
        }
        problems.extend(references::check(&document, &path, &root));
        problems.extend(commands::check(&document, &programs));
        problems.sort_by_key(|problem| problem.line);
        for problem in &problems {
            eprintln!("{}:{}: {}", file.display(), problem.line, problem.text);
        }
        count += problems.len();
    }
    Ok(count)
}

/// The root of the repository.
fn root() -> PathBuf {
    let tests = Path::new(env!("CARGO_MANIFEST_DIR"));
    tests.parent().unwrap_or(tests).to_path_buf()
}

/// Markdown at the root and in `docs`, relative to the root.
fn every_document(root: &Path) -> Result<Vec<PathBuf>, String> {
    let mut files = Vec::new();
    for folder in ["", "docs"] {
        let entries = fs::read_dir(root.join(folder))
            .map_err(|error| format!("cannot list {}: {error}", root.join(folder).display()))?;
        for entry in entries.flatten() {
            let file = Path::new(folder).join(entry.file_name());
            if file.extension().is_some_and(|extension| extension == "md") {
                files.push(file);
            }
        }
    }
    files.sort();
    Ok(files)
}
