//! Two nodes that make the same motion. Where one receives a bad frame, the other is called without one; whatever they send has
//! to be equal, but for the number of frames dropped, and so has the state of the controller.

use protocol::codec::decode;
use protocol::counters::Counters;
use protocol::frame::{CanFrame, FD_MAX};
use protocol::messages::{Cause, Message, MotionRequest};
use protocol::table;

use crate::bench::{Bench, PERIOD};

/// Bad frames between two samples, 1 ms: four times what the bus can carry.
const FLOOD: u32 = 32;
/// Bad frames for one node, which counts no further than 65535.
pub(crate) const MOST: u32 = 60_000;
/// One bad feedback more in a row stops the arm: the fault table, not this test.
const BAD_FEEDBACK: u32 = 2;

pub(crate) type Count = fn(&mut Counters) -> &mut u16;

/// A node that receives bad frames, and one that does not.
pub(crate) struct Pair {
    clean: Bench,
    pub dirty: Bench,
    /// What the dirty one is to have counted.
    expected: Counters,
    /// Bad frames since the last sample, and those of them that are feedback.
    since: u32,
    feedback: u32,
    /// Bad frames for these nodes, and in all.
    pub frames: u32,
    total: u32,
    moves: u32,
}

impl Pair {
    pub(crate) fn new() -> Self {
        let dirty = Bench::moving();
        Self {
            expected: *dirty.node.received(),
            clean: Bench::moving(),
            dirty,
            since: 0,
            feedback: 0,
            frames: 0,
            total: 0,
            moves: 0,
        }
    }

    /// A frame that is to be dropped and counted here.
    pub(crate) fn bad(&mut self, frame: &CanFrame, count: Count) {
        *count(&mut self.expected) += 1;
        self.pass(frame);
        assert_eq!(*self.dirty.node.received(), self.expected, "{frame}");
    }

    /// A frame that is to change nothing, whatever it is counted as.
    pub(crate) fn pass(&mut self, frame: &CanFrame) {
        let Bench {
            node, wire, now, ..
        } = &mut self.clean;
        node.poll(*now, None, wire);
        let Bench {
            node, wire, now, ..
        } = &mut self.dirty;
        node.poll(*now, Some(frame), wire);
        self.since += 1;
        self.frames += 1;
        self.total += 1;
        self.feedback += u32::from(table::FEEDBACK.identifies(frame));
        if self.since == FLOOD || self.feedback == BAD_FEEDBACK {
            self.sample();
        }
        if self.frames == MOST {
            self.compare_state();
            *self = Self {
                total: self.total,
                ..Self::new()
            };
        }
    }

    fn sample(&mut self) {
        (self.since, self.feedback) = (0, 0);
        let arrived = self.clean.node.controller().queued() == 0;
        self.moves += u32::from(arrived);
        for bench in [&mut self.clean, &mut self.dirty] {
            if arrived {
                let side = if self.moves.is_multiple_of(2) {
                    1.0
                } else {
                    -1.0
                };
                let target = [-side, 0.5 * side, 0.1 + 0.05 * side, 2.0 * side];
                let frame = bench.motion(MotionRequest::MoveJoint {
                    target,
                    speed: 1.0,
                    zone: 0.0,
                });
                bench.node.poll(bench.now, Some(&frame), &mut bench.wire);
            }
            bench.now += PERIOD.duration();
            let frame = bench.next_feedback();
            bench.node.poll(bench.now, Some(&frame), &mut bench.wire);
        }
        self.compare();
    }

    /// Everything sent is equal: torques, reports, answers.
    fn compare(&mut self) {
        let clean = std::mem::take(&mut self.clean.wire.from_node);
        let dirty = std::mem::take(&mut self.dirty.wire.from_node);
        assert_eq!(clean.len(), dirty.len(), "{clean:?} {dirty:?}");
        for (clean, dirty) in clean.iter().zip(&dirty) {
            match decode(dirty).map(|received| received.message) {
                Ok(Message::State(mut state)) => {
                    state.rejected = 0;
                    let clean = decode(clean).map(|received| received.message);
                    assert_eq!(clean, Ok(Message::State(state)));
                }
                _ => assert_eq!(clean, dirty),
            }
        }
    }

    fn compare_state(&mut self) {
        self.sample();
        assert_eq!(self.dirty.node.controller().cause(), Cause::None);
        let state = |bench: &Bench| format!("{:?}", bench.node.controller());
        assert!(state(&self.clean) == state(&self.dirty));
    }

    /// Bad frames in all.
    pub(crate) fn finish(mut self) -> u32 {
        self.compare_state();
        self.total
    }
}

/// A small reproducible source of bytes (xorshift64).
pub(crate) struct Bytes(pub u64);

impl Bytes {
    pub(crate) fn word(&mut self) -> u32 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 32) as u32
    }

    pub(crate) fn data(&mut self) -> [u8; FD_MAX] {
        std::array::from_fn(|_| self.word() as u8)
    }
}
