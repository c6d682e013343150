//! What manual operation asks of a scenario.

use super::Findings;
use crate::scenario::{Release, Step};

impl Findings<'_> {
    /// Moves are let go of only where they are held, and held only under a law that keeps the tool as slow as planned.
    pub(super) fn operation(&mut self) {
        let scenario = self.scenario;
        if scenario.operation.is_automatic() {
            for (index, step) in scenario.cycle.iter().enumerate() {
                if let Step::Release(Release { after, .. }) = step {
                    let key = format!("cycle[{index}].release.after");
                    self.wrong(
                        &key,
                        after,
                        "with operation = \"manual\", in which moves are held",
                    );
                }
            }
        } else if !scenario.law.law.takes_compensation() {
            // Planned are nine tenths of 250 mm/s. Over 48 draws of moves, rates, payloads and mismatches (tests/manual.rs) the laws with a
            // model of the arm stay at that; pd-gravity reaches 238 mm/s, the kinematic ones 282 and pid 313.
            self.wrong(
                "law",
                scenario.law,
                "computed-torque or computed-torque-task with operation = \"manual\": a law without a model of the arm overshoots, and the \
                 tool would pass 250 mm/s, which stops the arm",
            );
        }
    }
}
