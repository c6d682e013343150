//! Where the result of a subcommand goes.

use std::fs;
use std::io::{self, BufWriter, Write};
use std::os::unix::fs::MetadataExt;
use std::path::Path;

use plant_sim::output;
use trace::Record;

use super::source::{Source, input};

/// Writes every record that counts, as they come.
pub(super) trait Records {
    fn record(&mut self, record: &Record) -> io::Result<()>;
    fn flush(&mut self) -> io::Result<()>;
}

/// Hands every record on; when the input has nothing more to give at once, so that a person at the end of a pipe sees
/// what there is.
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
pub(super) fn refuse_same(file: &Path, out: Option<&Path>) -> Result<(), String> {
    let Some(out) = out else {
        return Ok(());
    };
    let data = (
        input(file).and_then(|file| file.metadata()),
        fs::metadata(out),
    );
    if let (Ok(file), Ok(other)) = data
        && (file.dev(), file.ino()) == (other.dev(), other.ino())
    {
        return Err(format!(
            "--out {} is the trace itself; name another file",
            out.display()
        ));
    }
    Ok(())
}

/// Does the writing, to the file or to standard output. A reader of standard output that has seen enough and gone
/// (`| head`) is no error.
pub(super) fn written(
    out: Option<&Path>,
    write: impl FnOnce(&mut dyn Write) -> io::Result<()>,
) -> Result<(), String> {
    let Some(path) = out else {
        let mut sink = BufWriter::with_capacity(1 << 16, io::stdout().lock());
        return match write(&mut sink).and_then(|()| sink.flush()) {
            Err(error) if error.kind() != io::ErrorKind::BrokenPipe => {
                Err(format!("cannot write to standard output: {error}"))
            }
            _ => {
                // What a reader that has gone left in the buffer goes nowhere.
                let _ = sink.into_parts();
                Ok(())
            }
        };
    };
    let mut file = output::File::create(path).map_err(|error| error.to_string())?;
    write(&mut file).map_err(|error| format!("cannot write {}: {error}", path.display()))?;
    file.persist().map_err(|error| error.to_string())
}
