//! Output of a subcommand.

use std::io::{self, BufWriter, Write};
use std::path::Path;

use plant_sim::output;
use trace::Record;

use crate::cli::Failure;

use super::source::Source;

/// Writes every selected record as it arrives.
pub(super) trait Records {
    fn record(&mut self, record: &Record) -> io::Result<()>;
    fn flush(&mut self) -> io::Result<()>;
}

/// Passes every record on, and flushes whenever the input is drained, so that the reader of a pipe sees everything so
/// far.
pub(super) fn each(source: &mut Source, sink: &mut impl Records) -> io::Result<()> {
    while let Some(record) = source.record() {
        sink.record(&record)?;
        if source.is_drained() {
            sink.flush()?;
        }
    }
    Ok(())
}

/// Refuses an output that is the input.
pub(super) fn refuse_same(file: &Path, out: Option<&Path>) -> Result<(), Failure> {
    let input = match file {
        file if file == Path::new("-") => Path::new("/dev/stdin"),
        file => file,
    };
    Ok(output::distinct([input], out)?)
}

/// Writes to the file or to standard output. A reader of standard output that has closed the pipe (`| head`) is not an
/// error.
pub(super) fn written(
    out: Option<&Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), Failure> {
    let Some(path) = out else {
        let mut sink = BufWriter::with_capacity(1 << 16, io::stdout().lock());
        return match write(&mut sink).and_then(|()| sink.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(format!("cannot write to standard output: {error}").into())
            }
            _ => {
                // What is left in the buffer has no reader any more.
                let _ = sink.into_parts();
                Ok(())
            }
        };
    };
    let mut file = output::File::create(path)?;
    write(&mut file).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    Ok(file.persist()?)
}
