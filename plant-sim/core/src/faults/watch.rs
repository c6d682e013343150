//! The windows of a run: which are open, by its time and by what happens in it.

use std::cell::Cell;
use std::collections::VecDeque;
use std::rc::Rc;

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, MotionRequest};
use protocol::table;
use protocol::time::{Instant, Period};

use super::window::{Activity, Episode, Moment, Window};
use super::{Fault, What};
use crate::world::{CellEvent, Mind};

/// Speed of the lift above which it goes up or down, m/s.
const MOVING: f64 = 1e-3;
/// Requests for moves that are remembered: more than a controller takes before it refuses.
const REQUESTS: usize = 64;

/// A fault of a run, with its present window: shared by all who carry it out.
#[derive(Clone, Debug)]
pub struct Planned {
    /// What breaks, and how.
    pub what: What,
    window: Rc<Cell<(Instant, Instant)>>,
    /// Whether it has changed a frame, or what becomes of one.
    has_hit: Rc<Cell<bool>>,
}

impl Planned {
    /// Whether it is in effect.
    pub fn acts(&self, now: Instant) -> bool {
        let (from, until) = self.window.get();
        from <= now && now < until
    }

    /// Whether it is the same fault of the run.
    pub(crate) fn is(&self, other: &Self) -> bool {
        Rc::ptr_eq(&self.window, &other.window)
    }

    /// It has changed a frame, or what becomes of one.
    pub(crate) fn hit(&self) {
        self.has_hit.set(true);
    }

    /// Whether it has.
    pub(crate) fn has_hit(&self) -> bool {
        self.has_hit.get()
    }

    /// Present or next window; one that does not come, or is not known yet, is at the end of time.
    pub fn window(&self) -> (Instant, Instant) {
        self.window.get()
    }
}

/// Opens and closes the window of one fault.
#[derive(Debug)]
pub(crate) struct Watch {
    pub(crate) fault: Planned,
    window: Window,
    period: Period,
    /// What went on at the last look, as [`Sense::of`] tells it.
    last: Option<u64>,
    /// How often it has begun.
    begun: u32,
}

impl Watch {
    pub(crate) fn new(fault: &Fault, period: Period) -> Self {
        let window = fault.window.fixed(period);
        Self {
            fault: Planned {
                what: fault.what,
                window: Rc::new(Cell::new(window.unwrap_or((Instant::MAX, Instant::MAX)))),
                has_hit: Rc::default(),
            },
            window: fault.window,
            period,
            last: None,
            begun: 0,
        }
    }

    /// Whether its window depends on what happens.
    pub(crate) fn waits(&self) -> bool {
        self.window.fixed(self.period).is_none()
    }

    /// Looks at what goes on at a sample; whether that changes the window.
    pub(crate) fn look(&mut self, now: Instant, sense: &Sense) -> bool {
        let (episode, moment) = match self.window {
            Window::While(episode) => (episode, None),
            Window::From(
                Moment {
                    of: Some(episode),
                    after,
                },
                end,
            ) => (episode, Some((after, end))),
            Window::From(Moment { of: None, .. }, _) => return false,
        };
        let present = sense.of(episode.what);
        if present == self.last {
            return false;
        }
        self.last = present;
        let begins = present.is_some();
        self.begun += u32::from(begins);
        let is_meant = begins && self.is_meant(episode, moment.is_some());
        let before = self.fault.window.get();
        let window = match moment {
            Some((after, end)) if is_meant => {
                let from = now + after.time(self.period);
                let until = end.of(from, self.period);
                // One that would end before it begins does not come.
                if until <= from {
                    return false;
                }
                (from, until)
            }
            Some(_) => before,
            // One that goes on is left as it is.
            None if is_meant && self.fault.acts(now) => before,
            None if is_meant => (now, Instant::MAX),
            None if before.0 == Instant::MAX => before,
            None => (before.0, before.1.min(now)),
        };
        self.fault.window.set(window);
        window != before
    }

    /// Whether the one that has just begun is the one that the window is about.
    fn is_meant(&self, Episode { number, .. }: Episode, once: bool) -> bool {
        match number {
            Some(number) => number == self.begun,
            None => !once || self.begun == 1,
        }
    }
}

/// What goes on in a run.
#[derive(Debug, Default)]
pub(crate) struct Sense {
    mind: Option<Mind>,
    /// Speed of the lift, m/s, downwards positive.
    lift: f64,
    /// Moves that have been asked for: sequence number and kind, the newest last.
    requests: VecDeque<(u8, Activity)>,
    /// The move under way, its kind, and how many began before it.
    under_way: Option<(u8, Activity)>,
    moves: u64,
    /// How many cycles have begun, and whether the last one goes on.
    cycles: u64,
    in_cycle: bool,
}

impl Sense {
    /// A sample begins.
    pub(crate) fn look(&mut self, mind: &Mind, lift_speed: f64) {
        self.lift = lift_speed;
        if mind.under_way != self.under_way.map(|(sequence, _)| sequence) {
            self.under_way = mind.under_way.map(|sequence| {
                self.moves += 1;
                let kind = self.requests.iter().rev().find(|(of, _)| *of == sequence);
                (sequence, kind.map_or(Activity::Move, |(_, kind)| *kind))
            });
        }
        self.mind = Some(*mind);
    }

    /// A frame is on the bus.
    pub(crate) fn hear(&mut self, frame: &CanFrame) {
        if !table::MOTION.identifies(frame) {
            return;
        }
        let Ok(Message::Motion(motion)) = codec::decode(frame).map(|received| received.message)
        else {
            return;
        };
        let kind = match motion.request {
            MotionRequest::Jump { .. } => Activity::Jump,
            MotionRequest::MoveLine { .. } => Activity::Line,
            MotionRequest::MoveArc { .. } => Activity::Arc,
            MotionRequest::MoveJoint { .. } => Activity::Joints,
            _ => return,
        };
        if self.requests.len() == REQUESTS {
            self.requests.pop_front();
        }
        self.requests.push_back((motion.sequence, kind));
    }

    /// Something happens in the cell.
    pub(crate) fn notice(&mut self, event: &CellEvent) {
        match event {
            CellEvent::BeginCycle => {
                self.cycles += 1;
                self.in_cycle = true;
            }
            CellEvent::EndCycle => self.in_cycle = false,
            CellEvent::Attach(_) | CellEvent::Release => {}
        }
    }

    /// What goes on of this kind: another number for each time that follows the last one without a pause.
    fn of(&self, what: Activity) -> Option<u64> {
        let present = match what {
            Activity::Mode(mode) => return self.mind.filter(|it| it.mode == mode).map(|_| 0),
            Activity::LiftDown => return (self.lift > MOVING).then_some(0),
            Activity::LiftUp => return (self.lift < -MOVING).then_some(0),
            Activity::Cycle => return self.in_cycle.then_some(self.cycles),
            Activity::Move => self.under_way.is_some(),
            kind @ (Activity::Jump | Activity::Line | Activity::Arc | Activity::Joints) => {
                self.under_way.is_some_and(|(_, of)| of == kind)
            }
        };
        present.then_some(self.moves)
    }
}
