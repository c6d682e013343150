//! Log reader: line by line, in bounded memory.

use std::io::{self, BufRead, Read};

use super::{
    Record,
    line::{self, MAX_LINE, Problem},
};

/// A line that could not be read.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The line is not one of a candump log. Reading on continues with the next line.
    #[error("line {line}: {problem}")]
    Line {
        /// Counted from 1.
        line: u64,
        /// What is wrong, and what is allowed.
        problem: Problem,
    },
    /// The source failed.
    #[error("line {line}: {source}")]
    Io {
        /// Counted from 1.
        line: u64,
        /// The failure.
        source: io::Error,
    },
}

/// Reads a log; an iterator over its lines.
pub struct Reader<R> {
    source: R,
    line: u64,
    buffer: Vec<u8>,
}

impl<R: BufRead> Reader<R> {
    /// Starts at the first line.
    pub fn new(source: R) -> Self {
        Self {
            source,
            line: 0,
            buffer: Vec::with_capacity(MAX_LINE + 1),
        }
    }

    /// Number of the line read last, counted from 1; 0 before the first.
    pub fn line(&self) -> u64 {
        self.line
    }

    /// Fills the buffer with the next line, or with as much of it as any good line has; its line feed included.
    fn fill(&mut self) -> io::Result<()> {
        self.buffer.clear();
        let limit = MAX_LINE as u64 + 1;
        Read::take(&mut self.source, limit).read_until(b'\n', &mut self.buffer)?;
        Ok(())
    }

    /// Skips the rest of an overlong line.
    fn skip_line(&mut self) -> io::Result<()> {
        self.source.skip_until(b'\n').map(|_| ())
    }

    fn read(&mut self) -> io::Result<Option<Result<Record, Problem>>> {
        self.fill()?;
        Ok(match self.buffer.strip_suffix(b"\n") {
            Some(line) => Some(line::parse(line)),
            None if self.buffer.is_empty() => None,
            None if self.buffer.len() > MAX_LINE => {
                self.skip_line()?;
                Some(Err(Problem::TooLong))
            }
            None => Some(Err(Problem::Unterminated)),
        })
    }
}

impl<R: BufRead> Iterator for Reader<R> {
    type Item = Result<Record, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.line += 1;
        let line = self.line;
        match self.read() {
            Ok(read) => {
                read.map(|record| record.map_err(|problem| ReadError::Line { line, problem }))
            }
            Err(source) => Some(Err(ReadError::Io { line, source })),
        }
    }
}
