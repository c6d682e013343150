//! The controller on a bus on which anything may be sent.

use firmware::mechanics::arm::ArmModel;
use protocol::codec;
use protocol::e2e::Sender;
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
/// Least time between two frames.
const SHORT: Duration = Duration::from_micros(50);

/// A byte chooses a message of the table, whose body follows; its counter and CRC are right, so that the node looks into
/// it. Whatever it answers are frames that everybody accepts.
pub(crate) fn node(bytes: &[u8]) {
    let model = RobotModel::irb_930_22_105();
    let rig = RigConfig {
        nominal: ArmModel::from(&model),
        actual: model,
        period: Period::of_rate(1000.0),
        start: [0.0; 4],
        timing: BitTiming::default(),
    };
    let mut controller = InProcess::new(rig.controller());
    let mut senders: Vec<(Sender, u8)> = TABLE.iter().map(|_| (Sender::default(), 0)).collect();
    let mut now = Instant::ORIGIN;
    let mut sent = Vec::new();
    let mut bytes = Bytes(bytes);
    while !bytes.is_empty() {
        let choice = bytes.byte();
        if choice & SILENCE != 0 {
            now += Duration::from_millis(u64::from(choice & !SILENCE));
            controller.call(now, None, &mut sent);
            continue;
        }
        let message = usize::from(choice & !AGAIN);
        let frame = match TABLE.get(message) {
            Some(info) => {
                let (sender, counter) = &mut senders[message];
                if choice & AGAIN == 0 {
                    *counter = sender.next();
                }
                Some(of_message(info, *counter, &mut bytes))
            }
            None => of_any_kind(&mut bytes),
        };
        let Some(frame) = frame else {
            continue;
        };
        now += if table::FEEDBACK.identifies(&frame) {
            rig.period.duration()
        } else {
            SHORT
        };
        controller.call(now, Some(&frame), &mut sent);
        for answer in sent.drain(..) {
            codec::decode(&answer).expect("the node sends what can be received");
        }
    }
}
