//! The thread that turns what is heard into texts for the viewers.

use std::sync::Arc;
use std::sync::mpsc::{Receiver, RecvTimeoutError};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant, SystemTime, UNIX_EPOCH};

use protocol::messages::{Cause, LimitFlags, Mode, State};
use protocol::wire::BitTiming;
use serde_json::{Value, json};
use sim::curves::Robot;
use sim::model::RobotModel;

use super::air::Air;
use super::offers::Group;
use super::sight::Sight;
use super::{Heard, Word};
use crate::monitor::Monitor;

/// Time between two texts about the arm.
const GLIMPSE: Duration = Duration::from_millis(40);
/// Time between two tables of frames.
const TABLE: Duration = Duration::from_millis(250);

/// What is watched.
#[derive(Clone, Debug)]
pub struct Subject {
    /// What the page is about.
    pub title: String,
    /// Name of the bus.
    pub bus: String,
    /// The robot, for positions and efforts.
    pub robot: RobotModel,
    /// Bit timing of the bus, for its load.
    pub timing: BitTiming,
    /// Time between two samples, s, where it is known.
    pub period_s: Option<f64>,
    /// Whether its time is that of the machine, and passes without frames.
    pub is_real: bool,
}

impl Subject {
    /// What a page has to know first; `offers` are what it may ask for.
    #[must_use]
    pub fn setup(&self, offers: &[Group]) -> Value {
        json!({
            "title": self.title,
            "bus": self.bus,
            "robot": Robot::from(&self.robot),
            "modes": Mode::CODES,
            "step_s": self.period_s,
            "offers": offers,
        })
    }
}

/// Writes about what is heard until nobody can be heard any more.
pub struct Scribe {
    monitor: Monitor,
    sight: Sight,
    air: Arc<Air>,
    is_real: bool,
    /// Time of the first record, us: that of the page begins there.
    origin_us: Option<u64>,
    missed: u64,
    happened: u64,
    scripted: bool,
}

impl Scribe {
    /// Starts the thread.
    #[must_use]
    pub fn start(subject: &Subject, heard: Receiver<Heard>, air: Arc<Air>) -> JoinHandle<()> {
        let mut scribe = Self {
            monitor: Monitor::new(&subject.bus, subject.timing),
            sight: Sight::new(&subject.robot, subject.timing),
            air,
            is_real: subject.is_real,
            origin_us: None,
            missed: 0,
            happened: 0,
            scripted: true,
        };
        thread::spawn(move || scribe.work(&heard))
    }

    fn work(&mut self, heard: &Receiver<Heard>) {
        let mut glimpsed = Instant::now();
        let mut tabled = Instant::now();
        loop {
            match heard.recv_timeout(GLIMPSE) {
                Ok(heard) => self.hear(heard),
                Err(RecvTimeoutError::Timeout) => {}
                Err(RecvTimeoutError::Disconnected) => {
                    self.glimpse();
                    return self.table();
                }
            }
            if glimpsed.elapsed() >= GLIMPSE {
                glimpsed = Instant::now();
                self.glimpse();
            }
            if tabled.elapsed() >= TABLE {
                tabled = Instant::now();
                self.table();
            }
        }
    }

    fn hear(&mut self, heard: Heard) {
        match heard {
            Heard::Record(record) => {
                self.origin_us.get_or_insert(record.time_us);
                self.monitor.record(&record);
                let mut own = record;
                own.time_us = self.since_origin(record.time_us);
                self.sight.record(&own);
            }
            Heard::Word(word) => self.word(&word),
            Heard::Missed(more) => {
                self.missed += more;
                self.monitor.missed(self.missed);
            }
        }
    }

    fn since_origin(&self, time_us: u64) -> u64 {
        time_us.saturating_sub(self.origin_us.unwrap_or(0))
    }

    fn word(&mut self, word: &Word) {
        self.scripted = word.scripted;
        let kind = if word.good { "good" } else { "bad" };
        self.tell(word.time_us, &word.text, kind);
    }

    fn tell(&self, time_us: u64, text: &str, kind: &str) {
        let t = self.since_origin(time_us) as f64 * 1e-6;
        self.air
            .tell(&json!({ "t": t, "text": text, "kind": kind }));
    }

    /// Where the arm is, and since when.
    fn glimpse(&mut self) {
        self.air.stand(self.sight.joints());
        self.air
            .show("glimpse", &json!({ "moments": self.sight.moments() }));
    }

    /// Frames, state and events.
    fn table(&mut self) {
        if self.is_real {
            let now = SystemTime::now().duration_since(UNIX_EPOCH);
            self.monitor
                .tick(now.map_or(0, |now| now.as_micros() as u64));
        }
        let picture = self.monitor.picture();
        for happening in picture.happenings(self.happened) {
            self.happened = happening.number;
            self.tell(happening.time_us, &happening.text, "bus");
        }
        self.air.show(
            "table",
            &json!({
                "frames": picture.frames(),
                "missed": picture.missed(),
                "rows": picture.rows(),
                "state": picture.state().map(words),
                "scripted": self.scripted,
            }),
        );
    }
}

/// A report of the controller in words.
fn words(state: &State) -> Value {
    let limits: Vec<&str> = LimitFlags::NAMES
        .iter()
        .enumerate()
        .filter(|(bit, _)| state.limits.bits() >> bit & 1 == 1)
        .map(|(_, name)| *name)
        .collect();
    json!({
        "mode": state.mode.name(),
        "fault": (state.cause != Cause::None).then(|| state.fault().to_string()),
        "law": format!("{}:{}", state.law, state.compensation),
        "queue": state.queue,
        "limits": limits,
        "overruns": state.overruns,
        "rejected": state.rejected,
    })
}
