//! Why the program ends without having done what it was asked for: a message and an exit code (docs/exit-codes.md).

use plant_sim::input::InputError;
use plant_sim::output::OutputError;
use plant_sim::record::RecordError;
use plant_sim::run::ExecuteError;
use plant_sim::view::ServeError;
use terminal::{FAILED, USAGE};

/// There was nothing that could have been good or bad.
const NOTHING_JUDGED: u8 = 3;

/// What the person at the terminal reads, and the exit code.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    code: u8,
}

impl Failure {
    /// What was typed, or a file that it names, has to be changed.
    pub(crate) fn usage(message: impl ToString) -> Self {
        Self {
            message: message.to_string(),
            code: USAGE,
        }
    }

    /// What was asked for was tried and has failed.
    pub(crate) fn failed(message: impl ToString) -> Self {
        Self {
            message: message.to_string(),
            code: FAILED,
        }
    }

    /// There was nothing to judge.
    pub(crate) fn nothing_judged(message: impl ToString) -> Self {
        Self {
            message: message.to_string(),
            code: NOTHING_JUDGED,
        }
    }

    /// Says it and returns the exit code.
    pub(crate) fn report(&self) -> u8 {
        plant_sim::say!("plant-sim: {}", self.message);
        self.code
    }
}

impl From<String> for Failure {
    fn from(message: String) -> Self {
        Self::failed(message)
    }
}

impl From<&str> for Failure {
    fn from(message: &str) -> Self {
        Self::failed(message)
    }
}

impl From<InputError> for Failure {
    fn from(error: InputError) -> Self {
        Self::usage(error)
    }
}

impl From<OutputError> for Failure {
    fn from(error: OutputError) -> Self {
        match error {
            OutputError::Taken { .. } => Self::usage(error),
            OutputError::Write { .. } | OutputError::Locked { .. } => Self::failed(error),
        }
    }
}

impl From<RecordError> for Failure {
    fn from(error: RecordError) -> Self {
        match error {
            RecordError::Write { .. } => Self::failed(error),
            _ => Self::usage(error),
        }
    }
}

impl From<ServeError> for Failure {
    fn from(error: ServeError) -> Self {
        Self::failed(error)
    }
}

impl From<ExecuteError> for Failure {
    fn from(error: ExecuteError) -> Self {
        match error {
            ExecuteError::Setup(error) => Self::usage(error),
            ExecuteError::Controller(error) => Self::failed(error),
            ExecuteError::Output(error) => error.into(),
        }
    }
}
