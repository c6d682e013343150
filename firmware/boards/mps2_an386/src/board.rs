//! The image: asks the host for the configuration, then polls the node whenever the host says so.

mod host;
mod stack;

use core::panic::PanicInfo;

use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{ExceptionFrame, entry, exception};
use firmware::node::Node;
use mps2_an386::{
    CONFIG_LEN, FROM_BOARD, REQUEST_LEN, Reply, Request, STACK_REPORT, TO_BOARD, config_from_bytes,
};
use protocol::bus::{Bus, TransmitError};
use protocol::frame::CanFrame;

use host::{End, File};

/// Greatest count of SysTick, which counts down.
const SYST_MAX: u32 = 0x00FF_FFFF;

#[entry]
fn main() -> ! {
    // Static, so that the stack holds calls only. The attribute hands these out once, as references.
    static mut NODE: Option<Node> = None;
    static mut REPLY: Reply = Reply::new();
    host::exit(serve(NODE, REPLY))
}

/// Answers until the host goes away.
fn serve(slot: &mut Option<Node>, reply: &mut Reply) -> Result<(), End> {
    if let Some(mut core) = cortex_m::Peripherals::take() {
        start(&mut core.SYST);
    }
    let input = File::open(TO_BOARD)?;
    let output = File::create(FROM_BOARD)?;
    let node = configure(&input, slot)?;
    let mut record = [0; REQUEST_LEN];
    while input.read(&mut record).is_ok() {
        let request = Request::from_bytes(&record).ok_or(End)?;
        reply.clear();
        let mut port = Port {
            received: request.frame,
            reply,
        };
        let before = SYST::get_current();
        node.poll(request.now, &mut port);
        let ticks = before.wrapping_sub(SYST::get_current()) & SYST_MAX;
        output.write(reply.finish(ticks))?;
    }
    File::create(STACK_REPORT)?.write(&decimal(stack::used()))
}

/// Out of line, so that the record is off the stack when the node runs.
#[inline(never)]
fn configure<'a>(input: &File, slot: &'a mut Option<Node>) -> Result<&'a mut Node, End> {
    let mut record = [0; CONFIG_LEN];
    input.read(&mut record)?;
    let config = config_from_bytes(&record).ok_or(End)?;
    Ok(slot.insert(Node::new(config)))
}

/// SysTick from the core clock. It does not interrupt: the host's records drive this board.
fn start(timer: &mut SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(SYST_MAX);
    timer.clear_current();
    timer.enable_counter();
}

fn decimal(number: usize) -> [u8; 6] {
    let mut digits = [b'0'; 6];
    let mut left = number;
    for digit in digits.iter_mut().rev() {
        *digit = b'0' + (left % 10) as u8;
        left /= 10;
    }
    digits
}

/// The node's end of the channel.
struct Port<'a> {
    received: Option<CanFrame>,
    reply: &'a mut Reply,
}

impl Bus for Port<'_> {
    fn receive(&mut self) -> Option<CanFrame> {
        self.received.take()
    }

    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.reply.push(frame)
    }
}

/// A hard fault, and with it a stack overflow, ends the emulation with an error: the host reports it.
#[exception]
unsafe fn HardFault(_: &ExceptionFrame) -> ! {
    host::exit(Err(End))
}

/// Proof, at every link, that no panic can be reached: this function exists nowhere, so an image that can panic does
/// not link.
#[panic_handler]
fn panic(_: &PanicInfo<'_>) -> ! {
    unsafe extern "C" {
        fn a_panic_can_be_reached() -> !;
    }
    // SAFETY: it is never called; the linker sees to it.
    unsafe { a_panic_can_be_reached() }
}
