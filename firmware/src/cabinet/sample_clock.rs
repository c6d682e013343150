//! Time counted in samples of the drives, for lock-step.
//!
//! In lock-step the drives wait for each command, so a sample takes as long as the slowest participant needs, and no
//! clock of the real world tells the time of the run. This one does: every feedback frame moves it on by the samples
//! that its number says have passed. Two controllers that are given the same frames then send the same frames, on any
//! machine and at any speed.

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::Message;

/// Most samples that one feedback frame may move the clock on, 1000 s at 1 kHz: more is not a gap but another run.
const MAX_STEP: u32 = 1_000_000;

/// The clock of a controller in lock-step.
#[derive(Clone, Copy, Debug)]
pub struct SampleClock {
    period_ns: u64,
    now_ns: u64,
    sample: Option<u32>,
}

impl SampleClock {
    /// A clock at 0 for samples every `period_ns` ns.
    pub const fn new(period_ns: u64) -> Self {
        Self {
            period_ns,
            now_ns: 0,
            sample: None,
        }
    }

    /// Present time, us: what [`Node::poll`](crate::node::Node::poll) takes.
    pub const fn now(&self) -> u64 {
        self.now_ns / 1000
    }

    /// Looks at a frame that has just come, before the node does. A feedback frame that is older than the last, or from
    /// drives that have started again, does not turn the clock back.
    pub fn observe(&mut self, frame: &CanFrame) {
        if let Ok(received) = codec::decode(frame)
            && let Message::Feedback(feedback) = received.message
        {
            let last = self.sample.replace(feedback.sample);
            let step = last.map_or(0, |last| feedback.sample.wrapping_sub(last));
            if step <= MAX_STEP {
                self.elapse(u64::from(step).saturating_mul(self.period_ns));
            }
        }
    }

    /// Lets time pass without a sample: the drives are silent, and a watchdog must notice.
    pub const fn elapse(&mut self, ns: u64) {
        self.now_ns = self.now_ns.saturating_add(ns);
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
        let mut clock = SampleClock::new(1_000_000);
        // Sample seen, time expected in samples: gaps count, old samples and a restart do not.
        for (sample, expected) in [(7, 0), (8, 1), (11, 4), (10, 4), (12, 6), (0, 6), (1, 7)] {
            clock.observe(&feedback(sample));
            assert_eq!(clock.now(), expected * 1000, "sample {sample}");
        }
        clock.elapse(2_500_000);
        assert_eq!(clock.now(), 9_500);
        clock.observe(&feedback(u32::MAX));
        clock.observe(&feedback(0));
        assert_eq!(clock.now(), 10_500, "sample numbers wrap");
    }

    #[test]
    fn other_frames_and_bad_feedback_do_not_move_it() {
        let mut clock = SampleClock::new(1000);
        clock.observe(&feedback(1));
        let mut bytes = [0; 48];
        bytes.copy_from_slice(feedback(2).data());
        bytes[0] ^= 1;
        let id = protocol::frame::StandardId::new(0x1C0).unwrap();
        clock.observe(&CanFrame::fd(id, &bytes, true).unwrap());
        assert_eq!(clock.now(), 0);
    }
}
