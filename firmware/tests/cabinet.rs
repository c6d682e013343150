//! The pins of the cabinet, on recording pins.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use core::convert::Infallible;
use std::cell::Cell;

use embedded_hal::digital::{Error, ErrorKind, ErrorType, InputPin, OutputPin};
use firmware::cabinet::pins::{Cabinet, PinFault};
use protocol::messages::{ControlWord, Mode};

struct Pin<'a>(&'a Cell<bool>);

impl ErrorType for Pin<'_> {
    type Error = Infallible;
}

impl OutputPin for Pin<'_> {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.set(false);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.set(true);
        Ok(())
    }
}

impl InputPin for Pin<'_> {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(self.0.get())
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(!self.0.get())
    }
}

/// A pin that is torn off.
struct Broken;

#[derive(Debug)]
struct Torn;

impl Error for Torn {
    fn kind(&self) -> ErrorKind {
        ErrorKind::Other
    }
}

impl ErrorType for Broken {
    type Error = Torn;
}

impl OutputPin for Broken {
    fn set_low(&mut self) -> Result<(), Torn> {
        Err(Torn)
    }

    fn set_high(&mut self) -> Result<(), Torn> {
        Err(Torn)
    }
}

impl InputPin for Broken {
    fn is_high(&mut self) -> Result<bool, Torn> {
        Err(Torn)
    }

    fn is_low(&mut self) -> Result<bool, Torn> {
        Err(Torn)
    }
}

#[test]
fn pins_show_the_mode() {
    let [brake, torque, green, red, estop] = [const { Cell::new(true) }; 5];
    let mut cabinet = Cabinet {
        brake: Pin(&brake),
        torque: Pin(&torque),
        green: Pin(&green),
        red: Pin(&red),
        estop: Pin(&estop),
    };
    let holding = ControlWord::TORQUE_ENABLE;
    let free = holding | ControlWord::BRAKE_RELEASE;
    let off = ControlWord::EMPTY;
    // mode, control word, then brake, torque, green, red
    for (mode, control, expected) in [
        (Mode::SelfTest, off, [false, false, true, false]),
        (Mode::Ready, off, [false, false, true, false]),
        (Mode::Enabled, free, [true, true, true, false]),
        // Braking: closed, but torque still holds the load.
        (Mode::Disabling, holding, [false, true, true, false]),
        (Mode::FaultReaction, free, [true, true, false, true]),
        (Mode::FaultReaction, holding, [false, true, false, true]),
        (Mode::Fault, off, [false, false, false, true]),
        (Mode::EStop, off, [false, false, false, true]),
    ] {
        assert_eq!(cabinet.show(mode, control), Ok(()));
        let shown = [&brake, &torque, &green, &red].map(Cell::get);
        assert_eq!(shown, expected, "{mode:?}");
    }
    assert!(!cabinet.estop_pressed());
    estop.set(false);
    assert!(cabinet.estop_pressed());
}

#[test]
fn a_broken_pin_is_reported_and_the_others_are_written() {
    let [brake, torque, red] = [const { Cell::new(true) }; 3];
    let mut cabinet = Cabinet {
        brake: Pin(&brake),
        torque: Pin(&torque),
        green: Broken,
        red: Pin(&red),
        estop: Broken,
    };
    assert_eq!(cabinet.show(Mode::Ready, ControlWord::EMPTY), Err(PinFault));
    assert_eq!([&brake, &torque, &red].map(Cell::get), [false; 3]);
    assert!(
        cabinet.estop_pressed(),
        "a pin that cannot be read counts as pressed"
    );
}
