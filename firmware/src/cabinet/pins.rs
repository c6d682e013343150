//! Pins of the drive cabinet, through embedded-hal: brake, safe torque off, stack light, e-stop.
//!
//! The pins show mode and control word and nothing else. Every output is written on every call, so that
//! a glitch lasts one sample. The wiring is fail-safe: a low pin brakes and switches torque off.

use embedded_hal::digital::{InputPin, OutputPin};
use protocol::messages::{ControlWord, Mode};

/// Outputs of a failed controller: brake, torque, green, red, from bit 0 on.
pub const TORQUE_OFF: u8 = 0b1000;
/// Outputs of a controller that moves the arm.
pub const RUNNING: u8 = 0b0111;

/// Outputs and inputs of the cabinet.
#[derive(Debug)]
pub struct Cabinet<Brake, Torque, Green, Red, EStop> {
    /// High opens the brake.
    pub brake: Brake,
    /// High permits torque (the STO input of the drives).
    pub torque: Torque,
    /// Stack light: ready or running.
    pub green: Green,
    /// Stack light: fault or emergency stop.
    pub red: Red,
    /// High while the emergency-stop chain is closed.
    pub estop: EStop,
}

/// A pin did not take the level that was set.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct PinFault;

impl<Brake, Torque, Green, Red, EStop> Cabinet<Brake, Torque, Green, Red, EStop>
where
    Brake: OutputPin,
    Torque: OutputPin,
    Green: OutputPin,
    Red: OutputPin,
    EStop: InputPin,
{
    /// Writes all outputs for `mode` and the controller's control word. Torque follows the control
    /// word, not the mode: while the brake closes after a fault, torque still holds the load.
    ///
    /// # Errors
    /// [`PinFault`] if any pin failed; the others are written anyway.
    pub fn show(&mut self, mode: Mode, control: ControlWord) -> Result<(), PinFault> {
        let alarm = matches!(mode, Mode::FaultReaction | Mode::Fault | Mode::EStop);
        let brake_open = control.contains(ControlWord::BRAKE_RELEASE);
        let torque = control.contains(ControlWord::TORQUE_ENABLE);
        let results = [
            self.brake.set_state(brake_open.into()).is_ok(),
            self.torque.set_state(torque.into()).is_ok(),
            self.green.set_state((!alarm).into()).is_ok(),
            self.red.set_state(alarm.into()).is_ok(),
        ];
        if results.into_iter().all(|ok| ok) {
            Ok(())
        } else {
            Err(PinFault)
        }
    }

    /// Whether the emergency-stop chain is open. A pin that cannot be read counts as open.
    pub fn estop_pressed(&mut self) -> bool {
        !self.estop.is_high().unwrap_or(false)
    }
}
