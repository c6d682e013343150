//! The pins of the cabinet, on the LEDs of the board: register CFG1 of its configuration controller (AN386, SCC), bits 0
//! to 3. Written values can be read back, in QEMU as on the board.

use core::convert::Infallible;
use core::ptr;

use embedded_hal::digital::{ErrorType, InputPin, OutputPin};
use firmware::cabinet::pins::{Cabinet, TORQUE_OFF};

const LEDS: *mut u32 = 0x4002_F004 as *mut u32;

/// The cabinet of this board.
pub(crate) type Pins = Cabinet<Led, Led, Led, Led, Closed>;

/// The pins, all low. Call it once.
pub(crate) fn cabinet() -> Pins {
    write(0);
    Cabinet {
        brake: Led(1 << 0),
        torque: Led(1 << 1),
        green: Led(1 << 2),
        red: Led(1 << 3),
        estop: Closed,
    }
}

/// For the fault handlers of `cortex_m4`.
#[unsafe(no_mangle)]
fn board_torque_off() -> [u8; 2] {
    let found = read();
    write(u32::from(TORQUE_OFF));
    [found, read()].map(|pins| pins as u8)
}

/// One output.
pub(crate) struct Led(u32);

impl ErrorType for Led {
    type Error = Infallible;
}

impl OutputPin for Led {
    fn set_low(&mut self) -> Result<(), Infallible> {
        write(read() & !self.0);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        write(read() | self.0);
        Ok(())
    }
}

/// The emergency-stop chain: QEMU models no button of the board, so it is always closed.
pub(crate) struct Closed;

impl ErrorType for Closed {
    type Error = Infallible;
}

impl InputPin for Closed {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }
}

fn read() -> u32 {
    // SAFETY: a register of the board that nothing else uses; reading it changes nothing.
    unsafe { ptr::read_volatile(LEDS) }
}

fn write(leds: u32) {
    // SAFETY: a register of the board that nothing else uses. It is written by the main loop, and by the fault
    // handlers that end it for good.
    unsafe { ptr::write_volatile(LEDS, leds) }
}
