//! State that the peers of a run share besides the bus.

use firmware::node::Node;
use protocol::messages::{Fault, Mode, Refusal};
use protocol::time::{Duration, Instant};

use crate::model::Payload;
use crate::plant::Plant;

/// State that peers share besides the bus: the robot, used by drives and operator, and what each peer reports to the
/// run.
pub struct World {
    /// The robot, as of the last time somebody advanced it.
    pub plant: Plant,
    /// The controller's intention.
    pub mind: Mind,
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
}

impl Mind {
    /// Before a controller has started.
    pub const BLANK: Self = Self {
        q: [0.0; 4],
        qd: [0.0; 4],
        mode: Mode::Boot,
    };

    /// The intention of this node.
    pub fn of(node: &Node) -> Self {
        let controller = node.controller();
        let four = |v: &nalgebra::Vector4<f32>| [v.x, v.y, v.z, v.w].map(f64::from);
        Self {
            q: four(&controller.reference().q),
            qd: four(&controller.reference().qd),
            mode: controller.mode(),
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

/// Why a run ended early.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum OperatorError {
    /// The controller refused a request.
    #[error("{request} refused: {}", sentence(refusal))]
    Refused {
        /// Name of the request.
        request: &'static str,
        /// Why.
        refusal: Refusal,
    },
    /// Something expected did not arrive in time.
    #[error("the controller is late: no {what} within {:.1} s", limit.seconds())]
    Late {
        /// What was expected.
        what: String,
        /// Longest wait.
        limit: Duration,
    },
    /// The controller sends nothing any more.
    #[error("the controller has been silent since {:.3} s", since.seconds())]
    Silent {
        /// Time of its last frame.
        since: Instant,
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

fn sentence(refusal: &Refusal) -> String {
    let axis = match refusal.axis {
        0 => " (shoulder)",
        1 => " (elbow)",
        2 => " (lift)",
        3 => " (wrist)",
        _ => "",
    };
    format!(
        "{}{axis}; value {}, limit {}",
        refusal.reason.describe(),
        refusal.value,
        refusal.limit
    )
}
