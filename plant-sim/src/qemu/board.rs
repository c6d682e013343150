//! The emulator as a child process, and the channel to it.
//!
//! It ends with this process, however that ends: the channel is closed then, and the board ends the emulation when it
//! reads the end of the channel, or on its UART, after 20 s of silence. A thread supervises a child that does not get
//! that far.

use std::fs::{self, File};
use std::io::{self, BufReader, BufWriter, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::os::unix::process::CommandExt as _;
use std::path::{Path, PathBuf};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};
use std::thread::{self, JoinHandle};

use channel::{
    Channel, FRAME_LEN, GREETING_LEN, Measured, REPLY_HEADER, Request, SETUP_LEN, Setup,
    frame_from_bytes, greeted, is_greeting, reply_header,
};
use firmware::cabinet::reset::Stop;
use protocol::frame::CanFrame;

use super::failure;
use super::image::{EMULATOR, no_emulator};
use super::serial::Serial;
use super::supervise::{Ended, Watch, supervise};
use sim::peer::PeerError;

/// With `-icount shift=N` an instruction takes 2^N ns of emulated time; at 10, calls of up to 655 000 instructions fit
/// SysTick's 24 bits.
const ICOUNT_SHIFT: u32 = 10;
/// Period of SysTick on the emulated board, ns: 25 MHz.
const TICK_NS: u64 = 40;

/// Instructions in this many SysTick counts, while instructions are counted.
pub(super) fn instructions(ticks: u32) -> u32 {
    (u64::from(ticks) * TICK_NS).div_ceil(1 << ICOUNT_SHIFT) as u32
}

/// Names of the socket at the other end of UART 0, and of the file for UART 1.
const UART: &str = "uart";
const LOG: &str = "log";

/// A running board.
#[derive(Debug)]
pub(super) struct Board {
    /// Setup record, sent at every start.
    setup: [u8; SETUP_LEN],
    /// Sent together when there is an answer to wait for. `None` once the channel is closed.
    requests: Option<BufWriter<ChildStdin>>,
    replies: BufReader<ChildStdout>,
    /// The serial line for frames, unless they use the FIFOs.
    serial: Option<Serial<UnixStream>>,
    /// The raw log.
    log: File,
    watch: Arc<Watch>,
    watcher: Option<JoinHandle<Ended>>,
}

impl Board {
    /// Starts the emulator; with `count` its clock counts instructions. Frames that the board sends once its bus is
    /// open are appended to `sent`.
    pub(super) fn start(
        image: &Path,
        setup: &Setup,
        count: bool,
        sent: &mut Vec<CanFrame>,
    ) -> Result<Self, PeerError> {
        if !image.is_file() {
            return Err(failure(format!("has no image at {}", image.display())));
        }
        let image = fs::canonicalize(image).map_err(|error| unusable(image, &error))?;
        let record = setup
            .to_bytes()
            .ok_or_else(|| failure("cannot be configured: the record is too short"))?;
        let place = Place::new()?;
        let path = place.0.join(LOG);
        let log = File::create_new(&path)
            .and_then(|_| File::open(&path))
            .map_err(|error| unusable(&path, &error))?;

        let mut command = Command::new(EMULATOR);
        command
            .current_dir(&place.0)
            .args(["-machine", "mps2-an386", "-display", "none"])
            .args(["-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&image)
            // A Ctrl-C on the terminal is for the run, which ends the emulation when it is through.
            .process_group(0)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        if count {
            command.args(["-icount", &format!("shift={ICOUNT_SHIFT}")]);
        }
        let socket = match setup.channel {
            Channel::Fifo => {
                command.args(["-serial", "null"]);
                None
            }
            Channel::Uart => {
                let path = place.0.join(UART);
                let socket = UnixListener::bind(&path).map_err(|error| unusable(&path, &error))?;
                // The emulator moves bytes of a multiplexed device in larger pieces; -echr puts its escape character
                // outside the range of bytes.
                command
                    .args(["-chardev", &format!("socket,id=uart,path={UART},mux=on")])
                    .args(["-serial", "chardev:uart", "-echr", "0x100"]);
                Some(socket)
            }
        };
        command.args(["-serial", &format!("file:{LOG}")]);
        let mut child = command.spawn().map_err(|error| no_emulator(&error))?;
        let requests = child.stdin.take().map(BufWriter::new);
        let replies = child
            .stdout
            .take()
            .ok_or_else(|| failure("has no output"))?;
        let watch = Arc::new(Watch::default());
        let watched = Arc::clone(&watch);
        let watcher = thread::spawn(move || supervise(child, &watched));
        let mut board = Self {
            setup: record,
            requests,
            replies: BufReader::new(replies),
            serial: None,
            log,
            watch,
            watcher: Some(watcher),
        };
        // The emulator has opened all of its ends before the board sends anything: the names may be removed when
        // this function ends.
        board.set_up()?;
        if let Some(socket) = socket {
            let (line, _) = socket
                .accept()
                .map_err(|error| failure(format!("has no UART: {error}")))?;
            board.serial = Some(Serial::new(line));
            board.serial(|serial| serial.open(sent))?;
        }
        Ok(board)
    }

    /// Follows a restarting board until it is ready; returns how it ended before. Frames that it sends once its bus is
    /// open are appended to `sent`.
    pub(super) fn restart(&mut self, sent: &mut Vec<CanFrame>) -> Result<Stop, PeerError> {
        let stop = self.set_up()?;
        if self.serial.is_some() {
            self.serial(|serial| serial.open(sent))?;
        }
        Ok(stop)
    }

    /// Takes the greeting, sends the board its setup, and waits until it is ready.
    fn set_up(&mut self) -> Result<Stop, PeerError> {
        let said = self.wait(|board| listen(&mut board.replies, &mut Vec::new()))?;
        let Said::Greeting(stop) = said else {
            return Err(failure("did not restart when requested"));
        };
        let record = self.setup;
        self.say(&record)?;
        self.answer(&mut Vec::new())?;
        Ok(stop)
    }

    /// Sends a frame over the UART.
    pub(super) fn send(&mut self, frame: &CanFrame) -> Result<(), PeerError> {
        self.serial(|serial| serial.send(frame))
    }

    /// Waits for the answer to a frame sent over the UART, and appends its frames to `sent`.
    pub(super) fn answer_line(&mut self, sent: &mut Vec<CanFrame>) -> Result<(), PeerError> {
        self.serial(|serial| serial.answer(sent))
    }

    /// Closes the bus on the UART; returns the number of bytes that the board's receiver has lost.
    pub(super) fn close_bus(&mut self) -> Result<u32, PeerError> {
        self.serial(Serial::close)?;
        Ok(self.answer(&mut Vec::new())?.number)
    }

    fn serial<T>(
        &mut self,
        what: impl FnOnce(&mut Serial<UnixStream>) -> io::Result<T>,
    ) -> Result<T, PeerError> {
        self.wait(|board| match &mut board.serial {
            Some(serial) => what(serial),
            None => Err(io::ErrorKind::NotConnected.into()),
        })
    }

    /// Sends a request and waits for the answer: appends its frames to `sent` and returns the measurements.
    pub(super) fn ask(
        &mut self,
        request: &Request,
        sent: &mut Vec<CanFrame>,
    ) -> Result<Measured, PeerError> {
        self.send_request(request)?;
        self.answer(sent)
    }

    /// Queues a request; it goes out with the next wait for an answer.
    pub(super) fn send_request(&mut self, request: &Request) -> Result<(), PeerError> {
        self.say(&request.to_bytes())
    }

    /// Waits for the answer to a request: appends its frames to `sent` and returns the measurements.
    pub(super) fn answer(&mut self, sent: &mut Vec<CanFrame>) -> Result<Measured, PeerError> {
        match self.wait(|board| listen(&mut board.replies, sent))? {
            Said::Reply(measured) => Ok(measured),
            Said::Greeting(stop) => Err(failure(format!(
                "restarted by itself: {} at {:#010x}, fault status {:#010x}; arm-none-eabi-addr2line -ife IMAGE \
                 ADDRESS names the place",
                stop.reason, stop.at, stop.status
            ))),
        }
    }

    /// Waits for the board, supervised by the thread.
    fn wait<T>(&mut self, what: impl FnOnce(&mut Self) -> io::Result<T>) -> Result<T, PeerError> {
        self.watch.waiting.store(true, Ordering::Relaxed);
        let answer = match &mut self.requests {
            Some(requests) => requests.flush().and_then(|()| what(self)),
            None => what(self),
        };
        self.watch.waiting.store(false, Ordering::Relaxed);
        self.watch.answers.fetch_add(1, Ordering::Relaxed);
        answer.map_err(|error| self.ended(&error))
    }

    fn say(&mut self, record: &[u8]) -> Result<(), PeerError> {
        let Some(requests) = &mut self.requests else {
            return Err(failure("has ended"));
        };
        requests
            .write_all(record)
            .map_err(|error| self.ended(&error))
    }

    /// The reason for a missing answer.
    fn ended(&mut self, error: &io::Error) -> PeerError {
        if error.kind() == io::ErrorKind::InvalidData {
            return failure(format!("uses another protocol: {error}"));
        }
        match self.close() {
            Some(Ended::Hung) => failure("did not answer for 20 s"),
            Some(Ended::ByItself(Ok(status), stderr)) => failure(format!(
                "ended ({status}) instead of answering; {EMULATOR} says: {}",
                match stderr.trim() {
                    "" => "nothing",
                    text => text,
                }
            )),
            Some(Ended::ByItself(Err(error), _)) => failure(format!("was lost: {error}")),
            None => failure(format!("does not answer: {error}")),
        }
    }

    /// Ends the emulation; returns the raw log.
    pub(super) fn take_log(&mut self) -> io::Result<Vec<u8>> {
        self.close();
        let mut log = Vec::new();
        self.log.read_to_end(&mut log)?;
        Ok(log)
    }

    /// Closes the channel and waits for the end.
    fn close(&mut self) -> Option<Ended> {
        self.requests = None;
        self.watch.closing.store(true, Ordering::Relaxed);
        let watcher = self.watcher.take()?;
        watcher.thread().unpark();
        watcher.join().ok()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.close();
    }
}

/// A record from the board's FIFO.
enum Said {
    /// An answer, with its measurements.
    Reply(Measured),
    /// The greeting at its start: how it ended before.
    Greeting(Stop),
}

/// Reads the next record from the board.
fn listen(replies: &mut impl Read, sent: &mut Vec<CanFrame>) -> io::Result<Said> {
    let mut header = [0; REPLY_HEADER];
    replies.read_exact(&mut header)?;
    if is_greeting(&header) {
        let mut rest = [0; GREETING_LEN - REPLY_HEADER];
        replies.read_exact(&mut rest)?;
        return greeted(&rest)
            .map(Said::Greeting)
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "no reason for its start"));
    }
    let (count, measured) = reply_header(&header);
    for _ in 0..count {
        let mut record = [0; FRAME_LEN];
        replies.read_exact(&mut record)?;
        let frame = frame_from_bytes(&record)
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "no frame"))?;
        sent.push(frame);
    }
    Ok(Said::Reply(measured))
}

/// A directory for the names that the emulator opens.
struct Place(PathBuf);

impl Place {
    fn new() -> Result<Self, PeerError> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("plant-sim-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir(&path).map_err(|error| unusable(&path, &error))?;
        Ok(Self(path))
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn unusable(path: &Path, error: &io::Error) -> PeerError {
    failure(format!("cannot be reached: {}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use channel::{Reply, greeting};
    use protocol::messages::ResetReason;

    use super::*;

    /// A restarted board is noticed in place of an answer.
    #[test]
    fn a_greeting_is_no_answer() {
        let stop = Stop::without_fault(ResetReason::Watchdog);
        let mut said = &[Reply::new().finish(&7.into()), &greeting(&stop)].concat()[..];
        let mut listen = || listen(&mut said, &mut Vec::new());
        assert!(matches!(
            listen(),
            Ok(Said::Reply(Measured { number: 7, .. }))
        ));
        assert!(matches!(listen(), Ok(Said::Greeting(last)) if last == stop));
        assert!(listen().is_err());
    }
}
