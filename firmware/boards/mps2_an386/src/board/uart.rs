//! UART 0 of the board: Arm's CMSDK APB UART (*Cortex-M System Design Kit*, DDI 0479, 4.3).
//!
//! Bytes that come interrupt; what goes out waits for room in the one-byte transmit buffer.

use core::ptr;

use mps2_an386::ring::Ring;

/// Interrupt that a received byte raises.
pub const RECEIVE_IRQ: i16 = 0;

const DATA: *mut u32 = 0x4000_4000 as *mut u32;
const STATE: *mut u32 = 0x4000_4004 as *mut u32;
const CTRL: *mut u32 = 0x4000_4008 as *mut u32;
const INTCLEAR: *mut u32 = 0x4000_400C as *mut u32;
const BAUDDIV: *mut u32 = 0x4000_4010 as *mut u32;

const STATE_TX_FULL: u32 = 1 << 0;
const STATE_RX_FULL: u32 = 1 << 1;
const STATE_RX_OVERRUN: u32 = 1 << 3;
const CTRL_TX: u32 = 1 << 0;
const CTRL_RX: u32 = 1 << 1;
const CTRL_RX_INTERRUPT: u32 = 1 << 3;
const INT_RX: u32 = 1 << 1;

/// Smallest divider: 25 MHz / 16.
const FASTEST: u32 = 16;

/// Bytes received and not yet taken.
pub static RECEIVED: Ring = Ring::new();

/// Starts the UART with its receive interrupt. Call it once.
pub fn start() {
    // SAFETY: registers of UART 0, which nothing else touches before its interrupt is enabled; the interrupt has no
    // priority to change and shares nothing but atomics.
    unsafe {
        ptr::write_volatile(BAUDDIV, FASTEST);
        ptr::write_volatile(CTRL, CTRL_TX | CTRL_RX | CTRL_RX_INTERRUPT);
        (*cortex_m::peripheral::NVIC::PTR).iser[0].write(1 << RECEIVE_IRQ);
    }
}

/// The receive interrupt.
pub fn receive() {
    // SAFETY: registers of UART 0. Reading DATA takes the byte; STATE and INTCLEAR clear what is written as 1. Nothing
    // but this interrupt reads or writes them.
    unsafe {
        ptr::write_volatile(INTCLEAR, INT_RX);
        let state = ptr::read_volatile(STATE);
        if state & STATE_RX_OVERRUN != 0 {
            ptr::write_volatile(STATE, STATE_RX_OVERRUN);
            RECEIVED.lose();
        }
        if state & STATE_RX_FULL != 0 {
            RECEIVED.push(ptr::read_volatile(DATA) as u8);
        }
    }
}

/// Sends bytes, each as soon as there is room.
pub fn send(bytes: &[u8]) {
    for &byte in bytes {
        // SAFETY: registers of UART 0; only this function, which no interrupt calls, writes DATA.
        unsafe {
            while ptr::read_volatile(STATE) & STATE_TX_FULL != 0 {}
            ptr::write_volatile(DATA, u32::from(byte));
        }
    }
}
