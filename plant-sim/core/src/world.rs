//! What the peers of a run share besides the bus.

use firmware::node::Node;
use protocol::messages::{Fault, Mode, Refusal};
use protocol::time::{Duration, Instant};

use crate::model::Payload;
use crate::plant::Plant;

/// What peers share besides the bus: the robot between drives and operator, and what each lets the run know.
pub struct World {
    /// The robot. It stands still until somebody moves it on to the present.
    pub plant: Plant,
    /// What the controller has in mind.
    pub mind: Mind,
    /// What happened in the cell in this call.
    pub cell_events: Vec<CellEvent>,
    /// How the operator's work has ended.
    pub outcome: Option<Result<(), OperatorError>>,
}

/// What a controller has in mind when it has answered a sample.
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

    /// What this node has in mind.
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

/// What happens in the cell beside the bus: the gripper takes or drops a payload, a cycle begins or ends.
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
        /// Which.
        request: &'static str,
        /// Why.
        refusal: Refusal,
    },
    /// Nothing came in time.
    #[error("the controller is late: {what} did not come within {:.1} s", limit.seconds())]
    Late {
        /// What was waited for.
        what: String,
        /// For how long.
        limit: Duration,
    },
    /// Nothing comes any more.
    #[error("the controller is silent since {:.3} s", since.seconds())]
    Silent {
        /// When it was heard last.
        since: Instant,
    },
    /// The peers were built from different message tables.
    #[error(
        "the controller speaks schema {theirs:08x}, this program {ours:08x}; build both from one source"
    )]
    Schema {
        /// Controller's.
        theirs: u32,
        /// Ours.
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
