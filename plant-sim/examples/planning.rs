//! Time from a move's request to its answer, which is the time of planning, for docs/motion.md.

#![allow(
    clippy::expect_used,
    clippy::indexing_slicing,
    clippy::panic,
    clippy::unwrap_used,
    reason = "an example or a benchmark of the built-in files"
)]

use std::collections::BTreeMap;

use protocol::codec;
use protocol::frame::CanFrame;
use protocol::messages::{Message, MotionRequest};
use protocol::time::Instant;
use sim::observer::Observer;
use sim::run::in_process;
use sim::scenario::Scenario;
use sim::setup::RunConfig;

/// Requests without an answer yet, and the delays of answers by kind of move.
#[derive(Default)]
struct Answers {
    asked: BTreeMap<u8, (Instant, &'static str)>,
    delays_ms: BTreeMap<&'static str, Vec<f64>>,
}

impl Observer for Answers {
    fn frame(&mut self, time: Instant, frame: &CanFrame) -> std::io::Result<()> {
        match codec::decode(frame).expect("our own frames decode").message {
            Message::Motion(motion) if is_move(&motion.request) => {
                let name = motion.request.name();
                self.asked.insert(motion.sequence, (time, name));
            }
            Message::MotionReply(reply) => {
                if let Some((asked, name)) = self.asked.remove(&reply.sequence) {
                    let delay = time.since(asked).nanos() as f64 * 1e-6;
                    self.delays_ms.entry(name).or_default().push(delay);
                }
            }
            _ => {}
        }
        Ok(())
    }
}

fn is_move(request: &MotionRequest) -> bool {
    matches!(
        request,
        MotionRequest::Jump { .. }
            | MotionRequest::MoveLine { .. }
            | MotionRequest::MoveArc { .. }
            | MotionRequest::MoveJoint { .. }
    )
}

fn main() {
    println!("| scenario | move | answered after ms |");
    println!("|---|---|---|");
    for name in ["gate", "square", "arc", "pick-place"] {
        let mut answers = Answers::default();
        let config = RunConfig::new(Scenario::built_in(name).expect("built in"));
        in_process(&config, &mut answers).expect("a scenario that comes with the program runs");
        for (kind, delays) in answers.delays_ms {
            let least = delays.iter().copied().fold(f64::INFINITY, f64::min);
            let most = delays.iter().copied().fold(0.0, f64::max);
            println!("| {name} | {kind} | {least:.0} to {most:.0} |");
        }
    }
}
