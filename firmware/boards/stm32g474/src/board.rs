//! The image: frames come by interrupt, a 1 kHz timer guards, and one loop runs the node and shows its state on the pins.

mod can;
mod clock;
mod safe;

use core::mem::MaybeUninit;

use core::sync::atomic::Ordering;

use cortex_m::peripheral::DWT;
use cortex_m_rt::entry;
use defmt_rtt as _;
use embassy_stm32::gpio::{Input, Level, Output, Pull, Speed};
use embassy_stm32::wdg::IndependentWatchdog;
use firmware::cabinet::journal::Journal;
use firmware::cabinet::pins::Cabinet;
use firmware::cabinet::rejoin::Rejoin;
use firmware::control::controller::Config;
use firmware::mechanics::arm::IRB_930;
use firmware::node::Node;
use protocol::bus::Bus as _;
use protocol::messages::ResetReason;
use protocol::time::Instant;

use can::{Can, Port, Received, ToSend};
use clock::{CYCLES_PER_TICK, Clock, TICK};

/// Time without a pass of the loop after which the watchdog resets the board, us: ten samples.
const WATCHDOG_US: u32 = 10_000;

defmt::timestamp!("{=u32:ms}", clock::TICKS.load(Ordering::Relaxed));

#[entry]
fn main() -> ! {
    // Static, so that the stack holds calls only. The attribute hands these out once, as references. Not an `Option`:
    // its `None` may not be all zeros and would then take its full size in flash.
    static mut NODE: MaybeUninit<Node> = MaybeUninit::uninit();
    static mut TO_SEND: ToSend = ToSend::new();
    static mut RECEIVED: Received = Received::new();

    cortex_m4::guard();
    let board = embassy_stm32::init(clock::config());
    // First of all: any hang from here on ends in a reset, and a reset releases every pin.
    let mut watchdog = IndependentWatchdog::new(board.IWDG, WATCHDOG_US);
    watchdog.unleash();
    let last = safe::last_stop();
    let mut journal = Journal::begin(&last);

    let mut cabinet = Cabinet {
        brake: Output::new(board.PC0, Level::Low, Speed::Low),
        torque: Output::new(board.PC1, Level::Low, Speed::Low),
        green: Output::new(board.PC2, Level::Low, Speed::Low),
        red: Output::new(board.PC3, Level::Low, Speed::Low),
        // A torn wire reads as an open chain.
        estop: Input::new(board.PC4, Pull::Down),
    };
    let can = Can::start(board.FDCAN1, board.PA11, board.PA12, TO_SEND, RECEIVED);
    let node = NODE.write(Node::new(Config::new(IRB_930, TICK), last.reason));
    let mut clock = Clock::start();
    let mut port = Port::new(can);
    let mut rejoin = Rejoin::default();
    // When the CAN controller is told to recover.
    let mut back: Option<Instant> = None;
    let mut worst = 0;
    loop {
        let ticked = clock.advance();
        if ticked {
            port.set_estop(cabinet.estop_pressed());
            let now = clock.now();
            if port.has_gone_off() {
                node.bus_off();
                back = Some(now + rejoin.after_bus_off(now));
            }
            if back.take_if(|due| *due <= now).is_some() {
                port.rejoin();
            }
        }
        if ticked || port.has_frames() {
            let before = DWT::cycle_count();
            let received = port.receive();
            node.poll(clock.now(), received.as_ref(), &mut port);
            let cycles = DWT::cycle_count().wrapping_sub(before);
            node.note_tick(cycles);
            if cycles > CYCLES_PER_TICK {
                node.count_overrun();
            }
            if cycles > worst {
                worst = cycles;
                defmt::info!("worst call of the node so far: {} cycles", worst);
            }
            if node.reset_asked() {
                cortex_m4::restart(ResetReason::Software);
            }
            let controller = node.controller();
            journal.note(controller);
            if cabinet
                .show(controller.mode(), controller.control_word())
                .is_err()
            {
                defmt::error!("a pin does not take the level it is set to");
            }
        }
        if ticked {
            watchdog.pet();
        }
        // With interrupts masked: one that arrives after the check still ends the sleep, and is handled after it.
        cortex_m::interrupt::free(|_| {
            if !clock.is_due() && !port.has_frames() {
                cortex_m::asm::wfi();
            }
        });
    }
}
