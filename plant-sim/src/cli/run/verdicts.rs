//! What became of the requirements, for other programs: the options that name the files.

use std::path::{Path, PathBuf};

use clap::Args;
use plant_sim::output::{self, File};
use plant_sim::run::Results;
use plant_sim::verdicts::{junit, markdown, needs};

use crate::cli::Failure;

/// Options that name files for other programs.
#[derive(Args)]
pub(super) struct VerdictArgs {
    /// Write the verdicts to this file as JUnit XML, for CI: a test case for the end of the run and for each requirement.
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Write the requirements with their verdicts to this file as needs.json, for sphinx-needs.
    #[arg(long, value_name = "FILE")]
    needs: Option<PathBuf>,
    /// Write the verdicts to this file as Markdown, for a pull request.
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
}

/// Writes results in the format of another program.
type Format = fn(&Results) -> String;

/// The files, before the run: what cannot be written is refused first.
pub(super) struct Files(Vec<(File, Format)>);

impl VerdictArgs {
    pub(super) fn paths(&self) -> impl Iterator<Item = &Path> {
        let paths = [&self.junit, &self.needs, &self.markdown];
        paths.into_iter().flatten().map(PathBuf::as_path)
    }

    pub(super) fn create(&self) -> Result<Files, Failure> {
        let wanted: [(&Option<PathBuf>, Format); 3] = [
            (&self.junit, junit),
            (&self.needs, needs),
            (&self.markdown, markdown),
        ];
        let mut files = Vec::new();
        for (path, text) in wanted {
            if let Some(path) = path {
                files.push((File::create(path)?, text));
            }
        }
        Ok(Files(files))
    }
}

impl Files {
    /// Writes them.
    pub(super) fn write(self, results: &Results) -> Result<(), Failure> {
        for (file, text) in self.0 {
            output::finish(file, &text(results))?;
        }
        Ok(())
    }
}
