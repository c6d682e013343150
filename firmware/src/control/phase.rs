//! Phases of a sample, for a board that can measure the time of each.
//!
//! The marks are where one phase ends and the next begins; the board does the measuring. With `()` as the probe they
//! compile to nothing.

listed! {
    /// Part of a call of the node. They follow each other in this order; a call without a sample has the first and the last.
    pub enum Phase {
        /// Frames received, checked and decoded; requests judged.
        Decode,
        /// Readings, monitor, mode, and the reference of this sample.
        Reference,
        /// The control law, from motion and payload to joint torques: sines and cosines, inertia, Coriolis, gravity, friction and, of a
        /// law in task space, Jacobians.
        Law,
        /// What the model does not explain, and what follows from it.
        Observer,
        /// Torque limits.
        Limits,
        /// The command encoded and handed to the bus.
        Encode,
        /// Steps of planning the next move.
        Planning,
        /// Watchdogs, replies and periodic messages.
        Report,
    }
}

impl Phase {
    /// Name, as reports print it.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Decode => "decode",
            Self::Reference => "reference",
            Self::Law => "law",
            Self::Observer => "observer",
            Self::Limits => "limits",
            Self::Encode => "encode",
            Self::Planning => "planning",
            Self::Report => "report",
        }
    }
}

/// Called at the end of each phase.
pub trait Probe {
    /// `phase` has ended; the time since the previous end belongs to it.
    fn end(&mut self, phase: Phase);
}

/// Measures nothing.
impl Probe for () {
    fn end(&mut self, _: Phase) {}
}
