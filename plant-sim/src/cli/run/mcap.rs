//! The run as MCAP: the file that an option names.

use std::io;
use std::path::{Path, PathBuf};

use plant_sim::mcap::Recorder;
use plant_sim::output::File;
use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use sim::observer::{Observer, Truth};
use sim::setup::RunConfig;
use trace::ErrorFrame;

use crate::cli::Failure;

/// The file while the run goes on. Dropped, it leaves no trace.
pub(super) struct McapFile {
    recorder: Recorder<File>,
    path: PathBuf,
}

impl McapFile {
    /// Begins it, before the run: what cannot be written is refused first.
    pub(super) fn create(path: &Path, config: &RunConfig) -> Result<Self, Failure> {
        let file = File::create(path)?;
        let recorder = Recorder::new(file, &config.nominal).map_err(|error| named(path, error));
        Ok(Self {
            recorder: recorder.map_err(|error| error.to_string())?,
            path: path.into(),
        })
    }

    pub(super) fn finish(self) -> Result<(), Failure> {
        let Self { recorder, path } = self;
        let file = recorder.finish().map_err(|error| named(&path, error));
        Ok(file.map_err(|error| error.to_string())?.persist()?)
    }
}

impl Observer for McapFile {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        let written = self.recorder.frame(time, frame);
        written.map_err(|error| named(&self.path, error))
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, busy: Duration) -> io::Result<()> {
        let written = self.recorder.error(time, error, busy);
        written.map_err(|error| named(&self.path, error))
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let written = self.recorder.sample(truth);
        written.map_err(|error| named(&self.path, error))
    }
}

/// The error with the file that it is about: of a run, other files may fail as well.
fn named(path: &Path, error: io::Error) -> io::Error {
    io::Error::new(
        error.kind(),
        format!("cannot write to {}: {error}", path.display()),
    )
}
