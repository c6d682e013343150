//! The loop: a run that goes on, wishes in, frames and words out.

use std::collections::VecDeque;
use std::sync::mpsc::Receiver;

use firmware::control::controller::Config;
use sim::live::Live;
use sim::observer::{Observer, Pace};
use sim::operator::Answer;
use sim::peer::{Peer, PeerError};
use sim::rig::RunError;
use sim::run::Failure;
use sim::setup::RunConfig;

use super::wish::{Wish, at};
use super::{Ear, Word};

/// Most faults that are kept for the end.
const FAULTS: usize = 100;

/// What was done, for the end.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Done {
    /// Simulated time, s.
    pub time_s: f64,
    /// Orders and scenarios that went as asked, and others.
    pub good: u64,
    /// The others.
    pub bad: u64,
    /// Faults that were planted, as an option of a run has them.
    pub faults: Vec<String>,
    /// Faults that were planted besides those.
    pub more_faults: u64,
}

/// A run that goes on.
pub struct Session<'p> {
    live: Live<'p>,
    wishes: Receiver<Wish>,
    ear: Ear,
    done: Done,
    words: VecDeque<Word>,
}

impl<'p> Session<'p> {
    /// The run of a scenario with the controller that `connect` starts, before its first sample.
    ///
    /// # Errors
    /// See [`Failure`].
    pub fn new<C: Peer + 'p>(
        config: &RunConfig,
        connect: impl FnOnce(Config) -> Result<C, PeerError>,
        wishes: Receiver<Wish>,
        ear: Ear,
    ) -> Result<Self, Failure> {
        Ok(Self {
            live: Live::new(config, connect)?,
            wishes,
            ear,
            done: Done::default(),
            words: VecDeque::new(),
        })
    }

    /// Lives until `pace` ends it.
    ///
    /// # Errors
    /// Output failed, or the controller.
    pub fn run<P: Pace, O: Observer>(
        mut self,
        pace: &mut P,
        observer: &mut O,
    ) -> Result<Done, RunError> {
        loop {
            while let Ok(wish) = self.wishes.try_recv() {
                self.grant(wish);
            }
            match self.live.step(pace, &mut (&mut self.ear, &mut *observer)) {
                Ok(()) => {}
                Err(RunError::Pace(_)) => break,
                Err(error) => return Err(error),
            }
            for answer in self.live.answers() {
                self.say(&answer);
            }
            self.words.drain(..).for_each(|word| self.ear.say(word));
            self.ear.deliver();
        }
        self.done.time_s = self.live.now().seconds();
        Ok(self.done)
    }

    fn grant(&mut self, wish: Wish) {
        let now = self.live.now();
        match wish {
            Wish::Order(order) => self.live.order(order),
            Wish::Break(text, event, seconds) => {
                let answer = match at(&text, event, now.seconds(), seconds) {
                    Ok(fault) => {
                        self.live.plant(&fault);
                        let text = format!("fault planted: {}", fault.text);
                        if self.done.faults.len() < FAULTS {
                            self.done.faults.push(fault.text);
                        } else {
                            self.done.more_faults += 1;
                        }
                        Answer {
                            at: now,
                            text,
                            good: true,
                        }
                    }
                    Err(error) => Answer {
                        at: now,
                        text: error.to_string(),
                        good: false,
                    },
                };
                self.say(&answer);
            }
        }
    }

    fn say(&mut self, answer: &Answer) {
        if answer.good {
            self.done.good += 1;
        } else {
            self.done.bad += 1;
        }
        self.words.push_back(Word {
            time_us: answer.at.micros(),
            text: answer.text.clone(),
            good: answer.good,
            scripted: self.live.is_scripted(),
        });
    }
}
