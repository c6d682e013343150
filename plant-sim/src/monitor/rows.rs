//! A picture as data, for those who draw it elsewhere than on a terminal.

use std::collections::BTreeMap;

use protocol::messages::State;
use serde::Serialize;
use trace::decode::describe;

use super::Picture;
use super::pages::{identifier, ids};

/// An identifier on the bus.
#[derive(Clone, Debug, Serialize)]
pub struct Row {
    /// Identifier, in hexadecimal digits.
    id: String,
    /// Message, or `-`.
    name: &'static str,
    /// Frames per second in the last second; `None` while there are none.
    rate_hz: Option<f64>,
    /// Frames that never came.
    lost: u64,
    /// Frames that the protocol refuses.
    bad: u64,
    /// Counter and fields of the newest frame.
    text: String,
}

/// Something that happened.
#[derive(Clone, Debug, Serialize)]
pub struct Happening {
    /// Number, from 1 on.
    pub number: u64,
    /// When it happened last, us.
    #[serde(skip)]
    pub time_us: u64,
    /// In words.
    pub text: String,
}

impl Picture {
    /// Every identifier, with its newest frame decoded.
    #[must_use]
    pub fn rows(&self) -> Vec<Row> {
        let recent: BTreeMap<&str, f64> = self
            .window
            .iter()
            .flat_map(ids)
            .filter_map(|line| Some((line.id.as_str(), 1e3 / line.period.as_ref()?.mean_ms)))
            .collect();
        let newest: BTreeMap<String, String> = self
            .newest
            .iter()
            .map(|(id, record)| (identifier(*id), describe(record)))
            .collect();
        ids(&self.total)
            .map(|line| Row {
                id: line.id.clone(),
                name: line.name,
                rate_hz: recent.get(line.id.as_str()).copied(),
                lost: line.lost,
                bad: line.bad(),
                text: newest.get(&line.id).cloned().unwrap_or_default(),
            })
            .collect()
    }

    /// Newest report of the controller.
    #[must_use]
    pub fn state(&self) -> Option<&State> {
        self.state.as_ref()
    }

    /// Frames since the start.
    #[must_use]
    pub fn frames(&self) -> u64 {
        self.total.frames
    }

    /// Frames that were on the bus and did not come here.
    #[must_use]
    pub fn missed(&self) -> u64 {
        self.missed
    }

    /// What has happened after the event of this number, the oldest first.
    pub fn happenings(&self, after: u64) -> impl Iterator<Item = Happening> {
        self.events
            .iter()
            .filter(move |event| event.number > after)
            .map(|event| Happening {
                number: event.number,
                time_us: event.time_us,
                text: event.text.clone(),
            })
    }
}
