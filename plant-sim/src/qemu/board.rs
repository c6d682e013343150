//! The emulator as a child process, and the channel to it.
//!
//! It ends with this process, however that ends: the channel is closed by then, and the board ends the emulation when it
//! reads the end of it, or, on its UART, when nothing has come for 20 s. A thread watches over a child that does not get
//! that far.

use std::fs::{self, File};
use std::io::{self, BufReader, Read, Write};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use mps2_an386::{
    Channel, FRAME_LEN, FROM_BOARD, REPLY_HEADER, Request, Setup, TO_BOARD, frame_from_bytes,
    reply_header,
};
use protocol::frame::CanFrame;
use rustix::fs::{CWD, FileType, Mode, OFlags, mknodat};

use super::failure;
use super::serial::Serial;
use crate::endpoint::EndpointError;

const EMULATOR: &str = "qemu-system-arm";
/// How often the child is looked at.
const LOOK: Duration = Duration::from_millis(20);
/// Looks without an answer after which the board counts as hung: 20 s. An answer takes microseconds.
const PATIENCE: u32 = 1000;
/// Looks that a child has to end by itself once the channel is closed: 2 s.
const FAREWELL: u32 = 100;

/// With `-icount shift=N` an instruction takes 2^N ns of emulated time; at 10, calls of up to 655 000 instructions fit
/// SysTick's 24 bits.
const ICOUNT_SHIFT: u32 = 10;
/// Period of SysTick on the emulated board, ns: 25 MHz.
const TICK_NS: u64 = 40;

/// Instructions that this many SysTick counts stand for, while they are counted.
pub fn instructions(ticks: u32) -> u32 {
    (u64::from(ticks) * TICK_NS).div_ceil(1 << ICOUNT_SHIFT) as u32
}

/// Name of the socket that is the other end of UART 0.
const UART: &str = "uart";

/// A running board.
#[derive(Debug)]
pub struct Board {
    /// `None` once the channel is closed.
    requests: Option<File>,
    replies: BufReader<File>,
    /// What the frames travel on, unless it is the FIFOs.
    serial: Option<Serial<UnixStream>>,
    watch: Arc<Watch>,
    watcher: Option<JoinHandle<Ended>>,
}

/// What the watching thread has to know.
#[derive(Debug, Default)]
struct Watch {
    waiting: AtomicBool,
    answers: AtomicU64,
    closing: AtomicBool,
}

/// How the emulation ended.
#[derive(Debug)]
enum Ended {
    ByItself(io::Result<ExitStatus>, String),
    Hung,
}

impl Board {
    /// Starts the emulator; `count` makes its clock that of instructions.
    pub fn start(image: &Path, setup: &Setup, count: bool) -> Result<Self, EndpointError> {
        if !image.is_file() {
            return Err(failure(format!("has no image at {}", image.display())));
        }
        let image = fs::canonicalize(image).map_err(|error| unusable(image, &error))?;
        let record = setup
            .to_bytes()
            .ok_or_else(|| failure("cannot be configured: the record is too short"))?;
        let place = Place::new()?;
        let requests = place.fifo(TO_BOARD, OFlags::RDWR)?;
        // Keeps the FIFO open for writing until the board has done so, or the child has ended: only then is there an
        // end to be read.
        let door = place.fifo(FROM_BOARD, OFlags::RDWR)?;
        let replies = place.open(FROM_BOARD, OFlags::RDONLY)?;

        let mut command = Command::new(EMULATOR);
        command
            .current_dir(&place.0)
            .args(["-machine", "mps2-an386", "-display", "none"])
            .args(["-monitor", "none"])
            .args(["-semihosting-config", "enable=on,target=native"])
            .arg("-kernel")
            .arg(&image)
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped());
        if count {
            command.args(["-icount", &format!("shift={ICOUNT_SHIFT}")]);
        }
        let socket = match setup.channel {
            Channel::Fifo => {
                command.args(["-serial", "none"]);
                None
            }
            Channel::Uart => {
                let path = place.0.join(UART);
                let socket = UnixListener::bind(&path).map_err(|error| unusable(&path, &error))?;
                // The emulator moves bytes of a multiplexed device in larger pieces; -echr takes its escape character
                // out of the range of bytes.
                command
                    .args(["-chardev", &format!("socket,id=uart,path={UART},mux=on")])
                    .args(["-serial", "chardev:uart", "-echr", "0x100"]);
                Some(socket)
            }
        };
        let child = command.spawn().map_err(|error| {
            failure(if error.kind() == io::ErrorKind::NotFound {
                format!("needs {EMULATOR}; install it: apt-get install qemu-system-arm")
            } else {
                format!("cannot be started: {EMULATOR}: {error}")
            })
        })?;
        let watch = Arc::new(Watch::default());
        let watched = Arc::clone(&watch);
        let watcher = thread::spawn(move || supervise(child, &watched, door));
        let mut board = Self {
            requests: Some(requests),
            replies: BufReader::new(replies),
            serial: None,
            watch,
            watcher: Some(watcher),
        };
        board.say(&record)?;
        // The first answer tells that both ends are open, and the socket since before the board started: their names may
        // go.
        board.wait(|board| listen(&mut board.replies, &mut Vec::new()))?;
        if let Some(socket) = socket {
            let (line, _) = socket
                .accept()
                .map_err(|error| failure(format!("has no UART: {error}")))?;
            board.serial = Some(Serial::new(line));
            board.serial(Serial::open)?;
        }
        Ok(board)
    }

    /// Hands a frame over on the UART, and appends what comes back to `sent`.
    pub fn exchange(
        &mut self,
        frame: &CanFrame,
        sent: &mut Vec<CanFrame>,
    ) -> Result<(), EndpointError> {
        self.serial(|serial| serial.exchange(frame, sent))
    }

    /// Closes the bus on the UART; returns how many bytes the board's receiver has lost.
    pub fn close_bus(&mut self) -> Result<u32, EndpointError> {
        self.serial(Serial::close)?;
        self.wait(|board| listen(&mut board.replies, &mut Vec::new()))
    }

    fn serial<T>(
        &mut self,
        what: impl FnOnce(&mut Serial<UnixStream>) -> io::Result<T>,
    ) -> Result<T, EndpointError> {
        self.wait(|board| match &mut board.serial {
            Some(serial) => what(serial),
            None => Err(io::ErrorKind::NotConnected.into()),
        })
    }

    /// Asks and waits for the answer: appends its frames to `sent` and returns its number.
    pub fn ask(
        &mut self,
        request: &Request,
        sent: &mut Vec<CanFrame>,
    ) -> Result<u32, EndpointError> {
        self.say(&request.to_bytes())?;
        self.wait(|board| listen(&mut board.replies, sent))
    }

    /// Waits for the board, under the eyes of the watching thread.
    fn wait<T>(
        &mut self,
        what: impl FnOnce(&mut Self) -> io::Result<T>,
    ) -> Result<T, EndpointError> {
        self.watch.waiting.store(true, Ordering::Relaxed);
        let answer = what(self);
        self.watch.waiting.store(false, Ordering::Relaxed);
        self.watch.answers.fetch_add(1, Ordering::Relaxed);
        answer.map_err(|error| self.ended(&error))
    }

    fn say(&mut self, record: &[u8]) -> Result<(), EndpointError> {
        let Some(requests) = &mut self.requests else {
            return Err(failure("has ended"));
        };
        requests
            .write_all(record)
            .map_err(|error| self.ended(&error))
    }

    /// Why there is no answer.
    fn ended(&mut self, error: &io::Error) -> EndpointError {
        if error.kind() == io::ErrorKind::InvalidData {
            return failure(format!("does not speak our language: {error}"));
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

    /// Closes the channel and waits for the end.
    fn close(&mut self) -> Option<Ended> {
        self.requests = None;
        self.watch.closing.store(true, Ordering::Relaxed);
        self.watcher.take()?.join().ok()
    }
}

impl Drop for Board {
    fn drop(&mut self) {
        self.close();
    }
}

/// Reads one answer.
fn listen(replies: &mut impl Read, sent: &mut Vec<CanFrame>) -> io::Result<u32> {
    let mut header = [0; REPLY_HEADER];
    replies.read_exact(&mut header)?;
    let (count, measured) = reply_header(header);
    for _ in 0..count {
        let mut record = [0; FRAME_LEN];
        replies.read_exact(&mut record)?;
        let frame = frame_from_bytes(&record)
            .ok_or_else(|| io::Error::new(io::ErrorKind::InvalidData, "no frame"))?;
        sent.push(frame);
    }
    Ok(measured)
}

/// Waits for the child to end, and sees to it that it does. `door` closes with it.
fn supervise(mut child: Child, watch: &Watch, door: File) -> Ended {
    let mut seen = (0, 0);
    let mut farewell = 0;
    let ended = loop {
        match child.try_wait() {
            Ok(None) => {}
            Ok(Some(status)) => break Ended::ByItself(Ok(status), said(&mut child)),
            Err(error) => break Ended::ByItself(Err(error), String::new()),
        }
        let answers = watch.answers.load(Ordering::Relaxed);
        seen = match seen {
            (last, looks) if last == answers && watch.waiting.load(Ordering::Relaxed) => {
                (last, looks + 1)
            }
            _ => (answers, 0),
        };
        farewell += u32::from(watch.closing.load(Ordering::Relaxed));
        if seen.1 > PATIENCE || farewell > FAREWELL {
            // SIGKILL: a blocked emulator does not listen to less.
            let _ = child.kill();
            let _ = child.wait();
            break Ended::Hung;
        }
        thread::sleep(LOOK);
    };
    drop(door);
    ended
}

/// What a child that has ended has written to standard error.
fn said(child: &mut Child) -> String {
    let mut text = String::new();
    if let Some(stderr) = &mut child.stderr {
        let _ = stderr.read_to_string(&mut text);
    }
    text
}

/// A directory for the two FIFOs, which goes when the board has opened them.
struct Place(PathBuf);

impl Place {
    fn new() -> Result<Self, EndpointError> {
        static NEXT: AtomicU64 = AtomicU64::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let name = format!("plant-sim-{}-{number}", std::process::id());
        let path = std::env::temp_dir().join(name);
        fs::create_dir(&path).map_err(|error| unusable(&path, &error))?;
        Ok(Self(path))
    }

    /// Makes a FIFO and opens it.
    fn fifo(&self, name: &std::ffi::CStr, flags: OFlags) -> Result<File, EndpointError> {
        let path = self.path(name);
        mknodat(CWD, &path, FileType::Fifo, Mode::RUSR | Mode::WUSR, 0)
            .map_err(|error| unusable(&path, &error.into()))?;
        self.open(name, flags)
    }

    fn open(&self, name: &std::ffi::CStr, flags: OFlags) -> Result<File, EndpointError> {
        let path = self.path(name);
        rustix::fs::open(&path, flags | OFlags::CLOEXEC, Mode::empty())
            .map(File::from)
            .map_err(|error| unusable(&path, &error.into()))
    }

    fn path(&self, name: &std::ffi::CStr) -> PathBuf {
        self.0.join(name.to_string_lossy().as_ref())
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn unusable(path: &Path, error: &io::Error) -> EndpointError {
    failure(format!("cannot be reached: {}: {error}", path.display()))
}
