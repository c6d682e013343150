//! The energy balance.

use super::Plant;

/// Energy balance, J.
///
/// `kinetic + potential + elastic - motor_work + lost` is constant except for integration errors and for payloads
/// that are attached or released.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Energy {
    /// Of links, payload and rotors.
    pub kinetic: f64,
    /// Zero with all mass in the plane of frame 0.
    pub potential: f64,
    /// In the springs of the end stops, and in one that has caught the flange.
    pub elastic: f64,
    /// Work that the motors have done since the beginning.
    pub motor_work: f64,
    /// Energy that friction, brake and end stops have dissipated since the beginning.
    pub lost: f64,
}

impl Plant {
    /// The energy balance.
    pub fn energy(&self) -> Energy {
        let at = self.arm.at(&self.q);
        let rotors = 0.5 * self.qd.dot(&(self.drive.rotor_inertia() * self.qd));
        Energy {
            kinetic: self.arm.kinetic_energy(&at, &self.qd) + rotors,
            potential: self.arm.potential_energy(&at),
            elastic: self.stops.energy(&self.q) + self.defects.elastic(&self.arm, &at),
            motor_work: self.ledger[4],
            lost: self.ledger[5],
        }
    }
}
