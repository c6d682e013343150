//! Observers of a run in progress.

use std::io;

use protocol::frame::CanFrame;
use protocol::time::{Duration, Instant};
use trace::ErrorFrame;

use crate::plant::Plant;
use crate::world::{CellEvent, Mind};

/// Joint speed up to which an axis counts as at rest, rad/s and m/s.
const RESTING: f64 = 1e-3;

/// One sample as it truly was, and as the controller intended it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Truth {
    /// The robot.
    pub plant: PlantState,
    /// The controller.
    pub mind: Mind,
}

impl Truth {
    /// Whether the intention is the answer to this sample. Where the drives took none, or the answer is late, it is an earlier one.
    pub fn is_answered(&self) -> bool {
        self.mind.sample.is_some()
    }
}

/// The robot at the instant of a sample. Joints in order: shoulder, elbow, lift, wrist (rad, m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PlantState {
    /// Time of the sample, s.
    pub t: f64,
    /// Joint positions, rad and m.
    pub q: [f64; 4],
    /// Joint speeds, rad/s and m/s.
    pub qd: [f64; 4],
    /// Efforts at the joints, N m and N.
    pub tau: [f64; 4],
    /// Flange in frame 0: x, y, z (m), yaw (rad).
    pub tool: [f64; 4],
    /// Whether the motor of the axis is at its torque limit.
    pub at_limit: [bool; 4],
}

impl PlantState {
    /// The state of a robot that has been advanced to `now`.
    pub fn of(plant: &Plant, now: Instant) -> Self {
        let pose = plant.pose();
        Self {
            t: now.seconds(),
            q: plant.q(),
            qd: plant.qd(),
            tau: plant.joint_effort(),
            tool: [pose.x, pose.y, pose.z, pose.yaw],
            at_limit: plant.at_limit(),
        }
    }

    /// Whether any axis moves.
    pub fn is_moving(&self) -> bool {
        self.qd.iter().any(|qd| qd.abs() > RESTING)
    }
}

/// Observer of a run in progress, with a method per kind of event. A pair of observers is an observer, and
/// so is an optional one.
pub trait Observer {
    /// A frame was delivered.
    ///
    /// # Errors
    /// Output failed; the run ends.
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        let _ = (time, frame);
        Ok(())
    }

    /// A frame was delivered that another node sent than the one whose message it is. Like any other, unless an observer
    /// looks behind the identifier.
    ///
    /// # Errors
    /// Output failed; the run ends.
    fn foreign_frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.frame(time, frame)
    }

    /// A node's CAN controller has reported an error, or a change of its error state; the bus is busy for so long with an
    /// attempt to send that is in vain.
    ///
    /// # Errors
    /// Output failed; the run ends.
    fn error(&mut self, time: Instant, error: &ErrorFrame, busy: Duration) -> io::Result<()> {
        let _ = (time, error, busy);
        Ok(())
    }

    /// A sample has been answered.
    ///
    /// # Errors
    /// Output failed; the run ends.
    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        let _ = truth;
        Ok(())
    }

    /// A cycle begins or ends.
    fn cell_event(&mut self, event: &CellEvent) {
        let _ = event;
    }

    /// The fault of this number, counted from 0, is in effect from then until then. Of faults whose times depend on what
    /// happens, as soon as that is known and when it changes.
    fn fault(&mut self, number: usize, from: Instant, until: Instant) {
        let _ = (number, from, until);
    }
}

impl Observer for () {}

impl<O: Observer> Observer for &mut O {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        (**self).frame(time, frame)
    }

    fn foreign_frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        (**self).foreign_frame(time, frame)
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, busy: Duration) -> io::Result<()> {
        (**self).error(time, error, busy)
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        (**self).sample(truth)
    }

    fn cell_event(&mut self, event: &CellEvent) {
        (**self).cell_event(event);
    }

    fn fault(&mut self, number: usize, from: Instant, until: Instant) {
        (**self).fault(number, from, until);
    }
}

/// An observer that may be left out.
impl<O: Observer> Observer for Option<O> {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.as_mut()
            .map_or(Ok(()), |observer| observer.frame(time, frame))
    }

    fn foreign_frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.as_mut()
            .map_or(Ok(()), |observer| observer.foreign_frame(time, frame))
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, busy: Duration) -> io::Result<()> {
        self.as_mut()
            .map_or(Ok(()), |observer| observer.error(time, error, busy))
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.as_mut()
            .map_or(Ok(()), |observer| observer.sample(truth))
    }

    fn cell_event(&mut self, event: &CellEvent) {
        if let Some(observer) = self {
            observer.cell_event(event);
        }
    }

    fn fault(&mut self, number: usize, from: Instant, until: Instant) {
        if let Some(observer) = self {
            observer.fault(number, from, until);
        }
    }
}

impl<A: Observer, B: Observer> Observer for (A, B) {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.0.frame(time, frame)?;
        self.1.frame(time, frame)
    }

    fn foreign_frame(&mut self, time: Instant, frame: &CanFrame) -> io::Result<()> {
        self.0.foreign_frame(time, frame)?;
        self.1.foreign_frame(time, frame)
    }

    fn error(&mut self, time: Instant, error: &ErrorFrame, busy: Duration) -> io::Result<()> {
        self.0.error(time, error, busy)?;
        self.1.error(time, error, busy)
    }

    fn sample(&mut self, truth: &Truth) -> io::Result<()> {
        self.0.sample(truth)?;
        self.1.sample(truth)
    }

    fn cell_event(&mut self, event: &CellEvent) {
        self.0.cell_event(event);
        self.1.cell_event(event);
    }

    fn fault(&mut self, number: usize, from: Instant, until: Instant) {
        self.0.fault(number, from, until);
        self.1.fault(number, from, until);
    }
}

/// Pace of a run; `()` is as fast as possible.
pub trait Pace {
    /// Called before the sample that is due at `now` is taken.
    ///
    /// # Errors
    /// There is nothing left to wait for; the run ends.
    fn sample(&mut self, now: Instant) -> io::Result<()>;
}

impl Pace for () {
    fn sample(&mut self, _: Instant) -> io::Result<()> {
        Ok(())
    }
}
