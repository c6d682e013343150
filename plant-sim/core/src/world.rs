//! State that the peers of a run share besides the bus.

use std::fmt;

use firmware::node::Node;
use protocol::codec::DecodeError;
use protocol::messages::{Fault, Mode, MotionRequest, Refusal};
use protocol::time::{Duration, Instant};

use crate::clock::Clock;
use crate::model::Payload;
use crate::plant::Plant;
use crate::refusal::sentence;

/// State that peers share besides the bus: the robot, used by drives and operator, and what each peer reports to the
/// run.
#[derive(Clone)]
pub struct World {
    /// The robot, as of the last time somebody advanced it.
    pub plant: Plant,
    /// The controller's intention.
    pub mind: Mind,
    /// Number of the sample that the drives have taken in the present one of the rig; `None` if they have not.
    pub sample: Option<u32>,
    /// The clock by which the drives take their samples.
    pub clock: Clock,
    /// Events in the cell during this call.
    pub cell_events: Vec<CellEvent>,
    /// Outcome of the operator's scenario, once it has ended.
    pub outcome: Option<Result<(), OperatorError>>,
}

/// A controller's intention after answering a sample.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mind {
    /// Reference: joint positions, rad and m.
    pub q: [f64; 4],
    /// Reference: joint speeds, rad/s and m/s.
    pub qd: [f64; 4],
    /// State of the cabinet.
    pub mode: Mode,
    /// Sequence number of the move under way.
    pub under_way: Option<u8>,
    /// Number of the sample that it answers; `None` before the first one, and in a [`Truth`](crate::observer::Truth) of another sample.
    pub sample: Option<u32>,
}

impl Mind {
    /// Before a controller has started.
    pub const BLANK: Self = Self {
        q: [0.0; 4],
        qd: [0.0; 4],
        mode: Mode::Boot,
        under_way: None,
        sample: None,
    };

    /// Whether there is a reference: a controller that has just started has none.
    pub fn knows_where(&self) -> bool {
        !matches!(
            self.mode,
            Mode::Boot | Mode::SelfTest | Mode::PreOperational
        )
    }

    /// The intention of this node, which has last answered the sample of this number.
    pub(crate) fn of(node: &Node, sample: Option<u32>) -> Self {
        let controller = node.controller();
        let four = |v: &nalgebra::Vector4<f32>| [v.x, v.y, v.z, v.w].map(f64::from);
        Self {
            q: four(&controller.reference().q),
            qd: four(&controller.reference().qd),
            mode: controller.mode(),
            under_way: controller.under_way(),
            sample,
        }
    }
}

/// Events in the cell apart from the bus: the gripper takes or releases a payload, a cycle begins or ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum CellEvent {
    /// Put this into the gripper.
    Attach(Payload),
    /// Open the gripper.
    Release,
    /// A cycle begins.
    BeginCycle,
    /// A cycle has ended, dwell included.
    EndCycle,
}

/// A step of a scenario while it runs. Cycle and index are counted from 0, and shown to people from 1.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Spot {
    /// Cycle of the run.
    pub cycle: u32,
    /// Step of the cycle.
    pub index: usize,
    /// Key of the step.
    pub step: &'static str,
}

impl Spot {
    /// Key of the step in the scenario.
    pub fn key(&self) -> String {
        format!("cycle[{}].{}", self.index, self.step)
    }
}

impl fmt::Display for Spot {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        // 64 bits: a run may have as many cycles as 32 bits count.
        let (number, cycle) = (self.index + 1, u64::from(self.cycle) + 1);
        write!(f, "step {number} of cycle {cycle} ({})", self.key())
    }
}

/// Frames of a kind that have come, and could not be used.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Unused {
    /// How many.
    pub frames: u32,
    /// Why the last one was refused; `None` for one that was repeated or old.
    pub why: Option<DecodeError>,
}

impl fmt::Display for Unused {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match (self.frames, self.why) {
            (0, _) => Ok(()),
            (frames, Some(why)) => write!(f, "; {frames} came and had to be refused: {why}"),
            (frames, None) => write!(f, "; {frames} came and had to be refused: repeated or old"),
        }
    }
}

fn of(spot: Option<Spot>) -> String {
    spot.map_or_else(String::new, |spot| format!("{spot}: "))
}

/// Why a run ended early.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OperatorError {
    /// The controller refused a request.
    #[error("{}{} refused: {}", of(*spot), request.name(), sentence(request, refusal))]
    Refused {
        /// Step of the scenario that made the request, if any.
        spot: Option<Spot>,
        /// Which.
        request: MotionRequest,
        /// Why.
        refusal: Refusal,
    },
    /// A move did not end in time.
    #[error("{}the move did not end within {:.0} s at {speed} of full speed", of(*spot), limit.seconds())]
    Unfinished {
        /// Step of the scenario that waited for it.
        spot: Option<Spot>,
        /// Speed of the slowest pending move, as a share of full speed.
        speed: f32,
        /// Longest wait.
        limit: Duration,
    },
    /// The scenario itself holds the arm, and waits for what only a moving arm brings.
    #[error(
        "{}no {what} within {:.1} s: an override of 0 holds the arm on its path, so that no move ends and none gets room in the \
         controller's queue; put an override above 0 before this step",
        of(*spot), limit.seconds()
    )]
    Held {
        /// Step of the scenario that waits.
        spot: Option<Spot>,
        /// What for.
        what: String,
        /// Longest wait.
        limit: Duration,
    },
    /// Something expected did not arrive in time.
    #[error("the controller is late: no {what} within {:.1} s{refused}", limit.seconds())]
    Late {
        /// What was expected.
        what: String,
        /// Longest wait.
        limit: Duration,
        /// What came instead.
        refused: Unused,
    },
    /// The controller tells nothing new any more.
    #[error("the controller has been silent since {:.3} s, when its last new state came", since.seconds())]
    Silent {
        /// Time of its last new state.
        since: Instant,
    },
    /// What the controller tells cannot be used any more.
    #[error("the controller has told nothing new since {:.3} s{refused}", since.seconds())]
    Unusable {
        /// Time of its last new state.
        since: Instant,
        /// What came instead.
        refused: Unused,
    },
    /// Not what the operator asked for was done: somebody else asks in its name.
    #[error(
        "{why}; another node sends the requests of the operator as well, and the controller cannot tell them apart"
    )]
    Imitated {
        /// What did not go on.
        why: Box<Self>,
    },
    /// The controller has started anew, and knows nothing of the move that it was asked for.
    #[error("the controller has started anew: it went to {mode} without a stop")]
    Restarted {
        /// State it is in.
        mode: Mode,
    },
    /// The peers were built from different message tables.
    #[error(
        "the controller uses schema {theirs:08x}, this program {ours:08x}; build both from the same source"
    )]
    Schema {
        /// Schema hash of the controller.
        theirs: u32,
        /// Schema hash of this program.
        ours: u32,
    },
    /// The controller stopped.
    #[error("the controller went to {mode}: {fault}")]
    Stopped {
        /// State it is in.
        mode: Mode,
        /// Latched fault.
        fault: Fault,
    },
}
