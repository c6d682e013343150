//! What manual operation asks of a scenario.

use firmware::trajectory::tool_speed::LEAST_RATE;

use super::Findings;
use crate::scenario::{Release, Step};
use crate::text;

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
            return;
        }
        // What a controller refuses.
        let least = f64::from(LEAST_RATE);
        if scenario.rate_hz < least {
            let allowed = format!(
                "{least} Hz and more with operation = \"manual\": a slower loop overshoots, and the tool would pass 250 mm/s"
            );
            self.wrong("rate_hz", text::number(scenario.rate_hz), allowed);
        }
        if !scenario.law.law.takes_compensation() {
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
