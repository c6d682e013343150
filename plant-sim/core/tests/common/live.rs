//! A run that goes on, for some time.

use protocol::time::Duration;
use sim::live::Live;
use sim::observer::Observer;
use sim::operator::Answer;

/// Lives for this long; returns what was answered.
pub(crate) fn live(run: &mut Live<'_>, seen: &mut impl Observer, seconds: f64) -> Vec<Answer> {
    let until = run.now() + Duration::from_seconds(seconds);
    let mut answers = Vec::new();
    while run.now() < until {
        run.step(&mut (), seen).unwrap();
        answers.extend(run.answers());
    }
    answers
}
