//! Time counted in samples of the drives, for lock-step.
//!
//! In lock-step the drives wait for each command, so a sample takes as long as the slowest participant needs, and no
//! real clock gives the time of the run. This one does: every feedback frame advances it by the samples that have
//! passed according to its number. Two controllers that receive the same frames thus send the same frames, on any
//! machine and at any speed.

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::Message;
use protocol::table;
use protocol::time::{Duration, Instant, Period};

/// Most samples by which one feedback frame may advance the clock, 1000 s at 1 kHz: more is not a gap but another run.
const MAX_STEP: u32 = 1_000_000;
/// Frames in a row, older than the newest sample and each newer than the one before, that are those of restarted drives: fewer are late
/// ones, after which the numbers go on where they were.
const RESTART_FRAMES: u8 = 3;

/// The clock of a controller in lock-step.
#[derive(Clone, Copy, Debug)]
pub struct SampleClock {
    period: Period,
    now: Instant,
    /// Number of the newest sample, and its time.
    newest: Option<(u32, Instant)>,
    /// The same of the last frame, where that was older.
    older: Option<(u32, Instant)>,
    /// Such frames in a row.
    run: u8,
}

impl SampleClock {
    /// A clock at the origin for samples every `period`.
    pub const fn new(period: Period) -> Self {
        Self {
            period,
            now: Instant::ORIGIN,
            newest: None,
            older: None,
            run: 0,
        }
    }

    /// Present time, for [`Node::poll`](crate::node::Node::poll).
    pub const fn now(&self) -> Instant {
        self.now
    }

    /// Looks at a frame that has just arrived, before the node does; `true` if it has advanced the time. The node is
    /// then first called without the frame, for whatever is due, so that no call does both. A feedback frame that is
    /// older than the last, or from restarted drives, does not turn the clock back.
    pub fn observe(&mut self, frame: &CanFrame) -> bool {
        let before = self.now;
        if table::FEEDBACK.identifies(frame)
            && let Ok(received) = codec::decode(frame)
            && let Message::Feedback(feedback) = received.message
        {
            self.count(feedback.sample);
        }
        self.now > before
    }

    fn count(&mut self, sample: u32) {
        if self.newest.is_none_or(|newest| self.pass(sample, newest)) {
            self.adopt(sample);
            return;
        }
        let follows = self.older.is_some_and(|older| self.pass(sample, older));
        self.run = if follows { self.run + 1 } else { 1 };
        self.older = Some((sample, self.now));
        if self.run == RESTART_FRAMES {
            self.adopt(sample);
        }
    }

    fn adopt(&mut self, sample: u32) {
        (self.newest, self.older, self.run) = (Some((sample, self.now)), None, 0);
    }

    /// Advances to a sample, if it is newer than the one at that time. Time already elapsed without a sample is not counted twice.
    fn pass(&mut self, sample: u32, (last, at): (u32, Instant)) -> bool {
        let step = sample.wrapping_sub(last);
        let is_newer = (1..=MAX_STEP).contains(&step);
        if is_newer {
            self.now = self.now.max(at + self.period.duration() * step);
        }
        is_newer
    }

    /// Lets time pass without a sample: the drives are silent, and a watchdog must notice.
    pub fn elapse(&mut self, time: Duration) {
        self.now += time;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use protocol::messages::{DriveStatus, Feedback};

    fn feedback(sample: u32) -> CanFrame {
        let feedback = Feedback {
            sample,
            status: DriveStatus::READY,
            position: [0; 4],
            velocity: [0.0; 4],
            torque: [0; 4],
        };
        codec::encode(&Message::Feedback(feedback), 0).unwrap()
    }

    #[test]
    fn time_is_the_number_of_samples_and_never_runs_backwards() {
        let mut clock = SampleClock::new(Period::of_rate(1000.0));
        // Sample number, expected time in samples: gaps count, an old sample and the first of a restart do not.
        for (sample, expected) in [(7, 0), (8, 1), (11, 4), (10, 4), (12, 5), (0, 5), (1, 6)] {
            clock.observe(&feedback(sample));
            assert_eq!(
                clock.now(),
                Instant::from_micros(expected * 1000),
                "sample {sample}"
            );
        }
        // Two late ones are no restart, a third would be.
        for (sample, expected) in [
            (13, 6),
            (3, 6),
            (4, 7),
            (15, 8),
            (2, 8),
            (3, 9),
            (4, 10),
            (5, 11),
        ] {
            clock.observe(&feedback(sample));
            assert_eq!(
                clock.now(),
                Instant::from_micros(expected * 1000),
                "sample {sample}"
            );
        }
        clock.elapse(Duration::from_micros(2_500));
        assert_eq!(clock.now(), Instant::from_micros(13_500));
        clock.observe(&feedback(u32::MAX));
        clock.observe(&feedback(0));
        assert_eq!(
            clock.now(),
            Instant::from_micros(14_500),
            "sample numbers wrap"
        );
        // 2.5 ms of silence, and then the fourth sample since the last: 4 ms have passed, not 6.5.
        clock.elapse(Duration::from_micros(2_500));
        clock.observe(&feedback(4));
        assert_eq!(clock.now(), Instant::from_micros(18_500));
    }

    #[test]
    fn other_frames_and_bad_feedback_do_not_move_it() {
        let mut clock = SampleClock::new(Period::of_rate(1e6));
        clock.observe(&feedback(1));
        let mut bytes = [0; 48];
        bytes.copy_from_slice(feedback(2).data());
        bytes[0] ^= 1;
        let id = protocol::frame::StandardId::new(0x1C0).unwrap();
        clock.observe(&CanFrame::fd(id, &bytes, true).unwrap());
        assert_eq!(clock.now(), Instant::ORIGIN);
    }
}
