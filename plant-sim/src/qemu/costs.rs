//! What a run costs on the board.

use firmware::control::phase::Phase;

/// Cost of a run on the board.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Costs {
    /// Every call of the node.
    pub polls: Vec<Poll>,
    /// Most stack used, bytes.
    pub stack: u32,
}

/// Cost of one call of the node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Poll {
    /// Instructions from frame in to frames out.
    pub instructions: u32,
    /// Instructions of each phase; zeros from an image that does not measure phases.
    pub phases: [u32; Phase::ALL.len()],
    /// Identifier of the frame received, if any.
    pub received: Option<u32>,
    /// Whether a move was being planned.
    pub planning: bool,
}
