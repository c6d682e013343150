//! The image: reads configuration and channel from the host, then runs the node on that channel.

mod adapter;
mod host;
mod log;
mod pins;
mod stack;
mod uart;

use core::mem::MaybeUninit;
use core::sync::atomic::Ordering;

use channel::{
    Channel, FROM_BOARD, Fault, Measured, REQUEST_LEN, Reply, Request, SETUP_LEN, Setup, TO_BOARD,
    greeting,
};
use cortex_m::peripheral::SYST;
use cortex_m::peripheral::syst::SystClkSource;
use cortex_m_rt::{entry, exception};
use firmware::cabinet::journal::Journal;
use firmware::cabinet::reset::Stop;
use firmware::control::controller::Config;
use firmware::control::phase::Probe;
use firmware::node::Node;
use protocol::bus::{Transmit, TransmitError};
use protocol::frame::CanFrame;
use protocol::messages::ResetReason;
use protocol::time::{Instant, Period};

pub(crate) use host::End;
use host::File;
use pins::Pins;

/// What an image adds to the board, implemented at the root of each.
pub(crate) trait Image {
    /// Measures the phases of a call of the node.
    type Meter: Probe + Default + Into<Measured>;

    /// Plants a fault. An error in images without planted faults: the host has mistaken it for another.
    fn plant(_: Fault) -> Result<(), End> {
        Err(End)
    }
}

/// Greatest count of SysTick, which counts down.
const SYST_MAX: u32 = 0x00FF_FFFF;

#[entry]
fn main() -> ! {
    // Static, so that the stack holds calls only. The attribute hands these out once, as references. Not an `Option`:
    // its `None` may not be all zeros and would then take its full size in flash.
    static mut SETUP: MaybeUninit<Setup> = MaybeUninit::uninit();
    static mut NODE: MaybeUninit<Node> = MaybeUninit::uninit();
    static mut REPLY: Reply = Reply::new();
    cortex_m4::guard();
    uart::LOG.start();
    host::exit(start(SETUP, NODE, REPLY))
}

// Inlined: what `main` keeps lies below the deepest call.
#[inline(always)]
fn start(
    setup: &mut MaybeUninit<Setup>,
    node: &mut MaybeUninit<Node>,
    reply: &mut Reply,
) -> Result<(), End> {
    let mut core = cortex_m::Peripherals::take().ok_or(End)?;
    start_timer(&mut core.SYST);
    let input = File::open(TO_BOARD)?;
    let output = File::create(FROM_BOARD)?;
    let mut pins = pins::cabinet();
    // This board has no flag for the cause of a reset, but a program that ended here has left a record.
    let last = cortex_m4::last_stop().unwrap_or(Stop::without_fault(ResetReason::PowerOn));
    output.write(&greeting(&last))?;
    let mut journal = Journal::begin(&last);
    let setup = receive(&input, setup)?;
    let node = build(&setup.config, last.reason, node);
    if setup.channel == Channel::Uart {
        core.SYST.enable_interrupt();
        uart::FRAMES.start_receiving();
    }
    // Signals to the host that the node is ready.
    output.write(reply.finish(&Measured::default()))?;
    match setup.channel {
        Channel::Fifo => serve(
            [&input, &output],
            node,
            &mut pins,
            &mut journal,
            reply,
            setup.config.period,
        ),
        Channel::Uart => {
            adapter::serve(node, &mut pins, &mut journal, setup.config.period);
            reply.clear();
            output.write(reply.finish(&(uart::RECEIVED.lost() as u32).into()))
        }
    }
}

// Three steps out of line: each can use the stack that the previous one has released.

#[inline(never)]
fn receive<'a>(input: &File, slot: &'a mut MaybeUninit<Setup>) -> Result<&'a Setup, End> {
    let mut record = [0; SETUP_LEN];
    input.read(&mut record)?;
    Ok(slot.write(Setup::from_bytes(&record).ok_or(End)?))
}

#[inline(never)]
fn build<'a>(config: &Config, reset: ResetReason, slot: &'a mut MaybeUninit<Node>) -> &'a mut Node {
    slot.write(Node::new(*config, reset))
}

/// Answers requests until the host closes the channel.
#[inline(never)]
fn serve(
    [input, output]: [&File; 2],
    node: &mut Node,
    pins: &mut Pins,
    journal: &mut Journal,
    reply: &mut Reply,
    period: Period,
) -> Result<(), End> {
    let mut record = [0; REQUEST_LEN];
    while input.read(&mut record).is_ok() {
        reply.clear();
        let measured = match Request::from_bytes(&record).ok_or(End)? {
            Request::Poll { now, frame } => {
                let measured = poll::<crate::Image>(node, now, frame.as_ref(), reply);
                settle(node, now, pins, journal);
                measured
            }
            Request::BusOff => {
                node.bus_off();
                continue;
            }
            Request::Took(time) => {
                if time > period.duration() {
                    node.count_overrun();
                }
                continue;
            }
            Request::Stack => (stack::used() as u32).into(),
            Request::Plant(fault) => {
                crate::Image::plant(fault)?;
                Measured::default()
            }
        };
        output.write(reply.finish(&measured))?;
    }
    Ok(())
}

/// Calls the node; returns the timer ticks it took, up to 2^24.
fn poll<I: Image>(
    node: &mut Node,
    now: Instant,
    received: Option<&CanFrame>,
    reply: &mut Reply,
) -> Measured {
    let mut port = Port(reply);
    let before = SYST::get_current();
    let mut meter = I::Meter::default();
    node.poll_with(now, received, &mut port, &mut meter);
    Measured {
        number: ticks_since(before),
        ..meter.into()
    }
}

/// Timer ticks since SysTick read `before`.
pub(crate) fn ticks_since(before: u32) -> u32 {
    before.wrapping_sub(SYST::get_current()) & SYST_MAX
}

/// Follows every call of the node: a reset if requested, the pins, the log.
fn settle(node: &Node, now: Instant, pins: &mut Pins, journal: &mut Journal) {
    if node.reset_asked() {
        cortex_m4::restart(ResetReason::Software);
    }
    let controller = node.controller();
    // These pins cannot fail.
    let _ = pins.show(controller.mode(), controller.control_word());
    log::NOW.store(now.millis() as u32, Ordering::Relaxed);
    journal.note(controller);
}

/// SysTick from the core clock, over its whole range.
fn start_timer(timer: &mut SYST) {
    timer.set_clock_source(SystClkSource::Core);
    timer.set_reload(SYST_MAX);
    timer.clear_current();
    timer.enable_counter();
}

/// The node's transmit side: the reply to the host.
struct Port<'a>(&'a mut Reply);

impl Transmit for Port<'_> {
    fn transmit(&mut self, frame: &CanFrame) -> Result<(), TransmitError> {
        self.0.push(frame)
    }
}

/// SysTick has wrapped; only while the UART is in use.
#[exception]
fn SysTick() {
    adapter::wrapped();
}

/// Every interrupt of the board: only the one of the UART's receiver is enabled.
#[exception]
unsafe fn DefaultHandler(irq: i16) {
    if irq == uart::RECEIVE_IRQ {
        uart::receive();
    } else {
        cortex_m4::restart(ResetReason::HardFault);
    }
}
