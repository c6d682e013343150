//! Zones of moves.

use super::{Findings, ZONE};
use crate::scenario::Step;
use crate::text;

impl Findings<'_> {
    /// A zone is for the way to the next move, which has to be there.
    pub(super) fn zone(&mut self, key: &str, step: &Step, next: Option<&Step>) {
        let key = format!("{key}.{}.zone", step.name());
        self.number(&key, step.zone(), ZONE);
        if step.zone() > 0.0 && !next.is_some_and(Step::is_move) {
            let allowed = "0, as the next step of the cycle is no move: the arm stops before it";
            self.wrong(&key, text::number(step.zone()), allowed);
        }
    }
}
