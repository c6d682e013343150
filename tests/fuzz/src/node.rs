//! The controller on a bus on which anything may be sent.

use firmware::mechanics::arm::ArmModel;
use protocol::codec;
use protocol::e2e::Sender;
use protocol::frame::CanFrame;
use protocol::table::{self, TABLE};
use protocol::time::{Duration, Instant, Period};
use protocol::wire::BitTiming;
use sim::controller::InProcess;
use sim::model::RobotModel;
use sim::rig::RigConfig;

use crate::Bytes;
use crate::frame::{of_any_kind, of_message};

/// The counter of the frame stays where it is, as if the frame came twice.
const AGAIN: u8 = 0x80;
/// Nothing comes for a while.
const SILENCE: u8 = 0x40;
/// The feedback before comes again, as often as the next byte says, with the samples that follow it.
const STANDING: u8 = 0x20;
/// Least time between two frames.
const SHORT: Duration = Duration::from_micros(50);

/// A byte chooses a message of the table, whose body follows; its counter and CRC are right, so that the node looks into
/// it. Whatever it answers are frames that everybody accepts.
pub(crate) fn node(bytes: &[u8]) {
    drive(bytes);
}

/// A node, and the time on its bus.
struct Bench {
    controller: InProcess,
    senders: Vec<(Sender, u8)>,
    now: Instant,
    period: Duration,
}

impl Bench {
    fn new() -> Self {
        let model = RobotModel::irb_930_22_105();
        let rig = RigConfig {
            nominal: ArmModel::from(&model),
            actual: model,
            period: Period::of_rate(1000.0),
            start: [0.0; 4],
            timing: BitTiming::default(),
        };
        Self {
            controller: InProcess::new(rig.controller()),
            senders: TABLE.iter().map(|_| (Sender::default(), 0)).collect(),
            now: Instant::ORIGIN,
            period: rig.period.duration(),
        }
    }

    fn message(&mut self, message: usize, again: bool, body: &mut Bytes) {
        let (sender, counter) = &mut self.senders[message];
        if !again {
            *counter = sender.next();
        }
        let frame = of_message(TABLE[message], *counter, body);
        self.frame(&frame);
    }

    fn frame(&mut self, frame: &CanFrame) {
        self.now += if table::FEEDBACK.identifies(frame) {
            self.period
        } else {
            SHORT
        };
        self.call(Some(frame));
    }

    fn call(&mut self, frame: Option<&CanFrame>) {
        let mut sent = Vec::new();
        self.controller.call(self.now, frame, &mut sent);
        for answer in sent {
            codec::decode(&answer).expect("the node sends what can be received");
        }
    }
}

fn drive(bytes: &[u8]) -> InProcess {
    let feedback = TABLE
        .iter()
        .position(|info| info.id == table::FEEDBACK.id)
        .expect("it is in the table");
    let mut bench = Bench::new();
    let mut standing = Vec::new();
    let mut bytes = Bytes(bytes);
    while !bytes.is_empty() {
        let choice = bytes.byte();
        let message = usize::from(choice & !(AGAIN | SILENCE | STANDING));
        if choice & SILENCE != 0 {
            bench.now += Duration::from_millis(u64::from(choice & !SILENCE));
            bench.call(None);
        } else if choice & STANDING != 0 {
            for _ in 0..bytes.byte() {
                // The sample number is the first field.
                if let Some(number) = standing.first_chunk_mut() {
                    *number = u32::from_le_bytes(*number).wrapping_add(1).to_le_bytes();
                }
                bench.message(feedback, false, &mut Bytes(&standing));
            }
        } else if message < TABLE.len() {
            let mut body = vec![0; TABLE[message].body_len()];
            bytes.fill(&mut body);
            bench.message(message, choice & AGAIN != 0, &mut Bytes(&body));
            if message == feedback {
                standing = body;
            }
        } else if let Some(frame) = of_any_kind(&mut bytes) {
            bench.frame(&frame);
        }
    }
    bench.controller
}

#[cfg(test)]
mod tests {
    use protocol::messages::Mode;

    use super::*;

    /// A search that never switches the drives on sees little of the node.
    #[test]
    fn the_seed_moves_the_arm() {
        let controller = drive(include_bytes!("../corpus/node/start-of-a-run"));
        assert_eq!(controller.node().controller().mode(), Mode::Moving);
    }
}
