//! The UARTs of the board: Arm's CMSDK APB UART (*Cortex-M System Design Kit*, DDI 0479, 4.3).
//!
//! Received bytes raise an interrupt; sending waits for room in the one-byte transmit buffer.

use core::ptr;

use channel::ring::{CAPACITY, Ring};

/// UART 0, which carries frames.
pub(crate) const FRAMES: Uart = Uart(0x4000_4000);
/// UART 1, which carries the log. Transmit only.
pub(crate) const LOG: Uart = Uart(0x4000_5000);

/// Interrupt raised by a byte that UART 0 has received.
pub(crate) const RECEIVE_IRQ: i16 = 0;

// Registers, as offsets from the first.
const DATA: usize = 0x0;
const STATE: usize = 0x4;
const CTRL: usize = 0x8;
const INTCLEAR: usize = 0xC;
const BAUDDIV: usize = 0x10;

const STATE_TX_FULL: u32 = 1 << 0;
const STATE_RX_FULL: u32 = 1 << 1;
const STATE_RX_OVERRUN: u32 = 1 << 3;
const CTRL_TX: u32 = 1 << 0;
const CTRL_RX: u32 = 1 << 1;
const CTRL_RX_INTERRUPT: u32 = 1 << 3;
const INT_RX: u32 = 1 << 1;

/// Smallest divider: 25 MHz / 16.
const FASTEST: u32 = 16;

/// Bytes received by UART 0 and not yet taken.
pub(crate) static RECEIVED: Ring = Ring::new();

/// A UART, by its address. Only the two above exist.
pub(crate) struct Uart(usize);

impl Uart {
    fn read(&self, register: usize) -> u32 {
        // SAFETY: a register of a UART. Reading DATA takes a byte, which only the receive interrupt does.
        unsafe { ptr::read_volatile((self.0 + register) as *const u32) }
    }

    fn write(&self, register: usize, value: u32) {
        // SAFETY: a register of a UART; no value of it touches memory.
        unsafe { ptr::write_volatile((self.0 + register) as *mut u32, value) }
    }

    /// Starts the transmitter.
    pub(crate) fn start(&self) {
        self.write(BAUDDIV, FASTEST);
        self.write(CTRL, CTRL_TX);
    }

    /// Starts receiver and transmitter with the receive interrupt.
    pub(crate) fn start_receiving(&self) {
        self.write(BAUDDIV, FASTEST);
        self.write(CTRL, CTRL_TX | CTRL_RX | CTRL_RX_INTERRUPT);
        // SAFETY: the interrupt has no priority to change and shares nothing but atomics.
        unsafe { (*cortex_m::peripheral::NVIC::PTR).iser[0].write(1 << RECEIVE_IRQ) };
    }

    /// Sends bytes, each as soon as there is room.
    pub(crate) fn send(&self, bytes: &[u8]) {
        for &byte in bytes {
            while self.read(STATE) & STATE_TX_FULL != 0 {}
            self.write(DATA, u32::from(byte));
        }
    }
}

/// The receive interrupt of UART 0: takes bytes until there are none, at most as many as the ring holds. STATE and INTCLEAR clear what is written as 1.
pub(crate) fn receive() {
    FRAMES.write(INTCLEAR, INT_RX);
    for _ in 0..CAPACITY {
        let state = FRAMES.read(STATE);
        if state & STATE_RX_OVERRUN != 0 {
            FRAMES.write(STATE, STATE_RX_OVERRUN);
            RECEIVED.lose();
        }
        if state & STATE_RX_FULL == 0 {
            return;
        }
        RECEIVED.push(FRAMES.read(DATA) as u8);
    }
}
