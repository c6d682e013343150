//! What a step of planning takes, so that a sample takes as many of them as fit into it.

use super::{Planner, Stage};
use crate::trajectory::path::Path;
use crate::trajectory::request::Target;

/// Of a step that leaves no room for another one; none takes more.
const ALONE: u16 = 1_400;

impl Planner {
    /// Instructions of a Cortex-M4F that the next step takes at the most. They are stated here, and not measured while it runs: whatever
    /// the machine, the same samples take the same steps.
    // Out of line, for the size of one copy.
    #[inline(never)]
    pub(in crate::trajectory) fn cost(&self) -> u16 {
        let straight = matches!(self.draft.path, Path::Joint { .. });
        match &self.stage {
            Stage::Idle => 80,
            Stage::Aim { .. } => 970,
            Stage::Locate {
                target: Target::Joints(_) | Target::Jump { .. },
                ..
            } => 550,
            // Curves of the tool: each of their steps solves for the joints.
            Stage::Locate { .. } | Stage::Blend(_) | Stage::Weigh { .. } => ALONE,
            _ if !straight => ALONE,
            Stage::Survey { point: 0, .. } => 470,
            Stage::Survey { .. } => 730,
            Stage::Cruise { .. } => ALONE,
            Stage::Rest { .. } => 700,
            Stage::Compose { .. } => 805,
            Stage::Balance { .. } => 760,
            Stage::Raise { .. } => 940,
            Stage::Stroke { .. } => 990,
            Stage::Lead { chamfer: None, .. } => 650,
            Stage::Lead { .. } => 1_280,
            Stage::Overlay => 210,
            Stage::Verify => 530,
            Stage::Load { .. } if self.caps => 750,
            Stage::Load { .. } => 520,
            Stage::Solve { .. } => 555,
            Stage::Finish => 420,
        }
    }
}
