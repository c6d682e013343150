//! Holding brake of the lift, closed by a spring when not energised.
//!
//! Dry friction with true sticking (Karnopp 1985): a closed brake at rest is a constraint, not a stiff law, so that a
//! braked lift neither creeps nor needs small steps. It slips only while the effort on it exceeds its capacity.

use super::friction::{coulomb, coulomb_secant};

/// The brake with its mechanical delays.
///
/// ```text
///            release, 50 ms              engage, 30 ms
///  Closed --------------------> Open --------------------> Closed
///  (sticking <-> slipping)
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct Brake {
    capacity: f64,
    engaged: bool,
    closed: bool,
    due: Option<u64>,
    sticking: bool,
    /// What it takes longer than it should, ns.
    delay: u64,
}

impl Brake {
    /// From the command to the closed brake, ns. An estimate, as for every time and mass that no data sheet of this robot
    /// gives; the controller waits for its own parameter `brake-delay`, which has a margin over both times.
    pub const ENGAGE_NS: u64 = 30_000_000;
    /// From the command to the open brake, ns.
    pub const RELEASE_NS: u64 = 50_000_000;

    /// Force held, relative to the peak effort of the axis: a runaway motor must not overcome it, even downwards with a
    /// heavy payload.
    const MARGIN: f64 = 1.5;
    /// Slower than this (m/s) a slipping brake grips; also the speed over which sliding friction builds up.
    const GRIP_SPEED: f64 = 1e-3;

    /// A closed brake for an axis with this peak effort (N).
    pub fn new(effort: f64) -> Self {
        Self {
            capacity: Self::MARGIN * effort,
            engaged: true,
            closed: true,
            due: None,
            sticking: true,
            delay: 0,
        }
    }

    /// Commands the brake at time `now` (ns).
    pub fn command(&mut self, engaged: bool, now: u64) {
        if engaged != self.engaged {
            self.engaged = engaged;
            let takes = if engaged {
                Self::ENGAGE_NS
            } else {
                Self::RELEASE_NS
            };
            self.due = Some(now + takes + self.delay);
        }
    }

    /// Time of the mechanism's next change, ns.
    pub fn due(&self) -> Option<u64> {
        self.due
    }

    /// Changes the mechanism if that is due.
    pub fn update(&mut self, now: u64) {
        if self.due.is_some_and(|due| due <= now) {
            self.due = None;
            self.closed = self.engaged;
            self.sticking &= self.closed;
        }
    }

    /// Takes so much longer (ns) from the next command on.
    pub(super) fn delay(&mut self, ns: u64) {
        self.delay = ns;
    }

    /// Opens or closes at once, without having been told.
    pub(super) fn force(&mut self, closed: bool) {
        self.engaged = closed;
        self.closed = closed;
        self.due = None;
        self.sticking &= closed;
    }

    /// Whether it was last commanded to close.
    pub(super) fn is_engaged(&self) -> bool {
        self.engaged
    }

    /// Whether the brake pads touch.
    pub fn is_closed(&self) -> bool {
        self.closed
    }

    /// Whether the lift cannot move.
    pub fn is_sticking(&self) -> bool {
        self.sticking
    }

    /// Force that the brake can hold, N.
    pub fn capacity(&self) -> f64 {
        self.capacity
    }

    /// Loads a sticking brake with an effort (N): it slips beyond its capacity.
    pub(super) fn load(&mut self, effort: f64) {
        self.sticking &= effort.abs() <= self.capacity;
    }

    /// Lets a slipping brake grip when nearly at rest, at `speed` (m/s). Returns whether it has just gripped.
    pub(super) fn grip(&mut self, speed: f64) -> bool {
        let grips = self.is_sliding() && speed.abs() < Self::GRIP_SPEED;
        self.sticking |= grips;
        grips
    }

    /// Friction against a sliding lift, N.
    pub(super) fn sliding_friction(&self, speed: f64) -> f64 {
        if self.is_sliding() {
            coulomb(&[self.capacity], &[Self::GRIP_SPEED], &[speed])[0]
        } else {
            0.0
        }
    }

    /// That friction divided by speed.
    pub(super) fn sliding_secant(&self, speed: f64) -> f64 {
        if self.is_sliding() {
            coulomb_secant(&[self.capacity], &[Self::GRIP_SPEED], &[speed])[0]
        } else {
            0.0
        }
    }

    /// Whether it is closed and the lift moves all the same.
    pub(super) fn is_sliding(&self) -> bool {
        self.closed && !self.sticking
    }
}
