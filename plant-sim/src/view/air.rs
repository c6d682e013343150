//! What viewers see, between the thread that writes it and the one that sends it to them.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use axum::body::Bytes;
use serde_json::Value;
use tokio::sync::broadcast::{self, Receiver, Sender};

use super::wish::Stand;

/// Texts that a viewer may be behind: two seconds. One that is slower misses some.
const BACKLOG: usize = 64;
/// Sentences that a new viewer gets.
const PAST: usize = 200;
/// Most viewers at a time.
pub(super) const VIEWERS: usize = 64;

/// What viewers see, from the thread that writes it to those that read it.
pub struct Air {
    texts: Sender<Bytes>,
    past: Mutex<VecDeque<Bytes>>,
    stand: Mutex<Stand>,
    viewers: AtomicUsize,
    /// Most viewers at a time so far.
    most: AtomicUsize,
    seen: AtomicBool,
}

impl Default for Air {
    fn default() -> Self {
        Self {
            texts: broadcast::channel(BACKLOG).0,
            past: Mutex::default(),
            stand: Mutex::default(),
            viewers: AtomicUsize::new(0),
            most: AtomicUsize::new(0),
            seen: AtomicBool::new(false),
        }
    }
}

impl Air {
    /// Shows every viewer something of this kind.
    pub(super) fn show(&self, kind: &str, what: &Value) {
        // Nobody may be looking.
        let _ = self.texts.send(event(kind, what));
    }

    /// Tells every viewer a sentence, also those to come.
    pub(super) fn tell(&self, what: &Value) {
        let text = event("word", what);
        let mut past = lock(&self.past);
        if past.len() == PAST {
            past.pop_front();
        }
        past.push_back(text.clone());
        let _ = self.texts.send(text);
    }

    /// Notes where the arm is.
    pub(super) fn stand(&self, stand: Stand) {
        *lock(&self.stand) = stand;
    }

    /// Where the arm is.
    pub(super) fn stands(&self) -> Stand {
        *lock(&self.stand)
    }

    /// Sentences so far, and everything from now on.
    pub(super) fn tune_in(&self) -> (VecDeque<Bytes>, Receiver<Bytes>) {
        // While nobody can tell anything: no sentence is missing, and none comes twice.
        let past = lock(&self.past);
        self.seen.store(true, Ordering::Relaxed);
        (past.clone(), self.texts.subscribe())
    }

    /// Whether somebody has ever looked.
    pub fn is_seen(&self) -> bool {
        self.seen.load(Ordering::Relaxed)
    }

    /// Most viewers at a time so far.
    pub fn most_viewers(&self) -> usize {
        self.most.load(Ordering::Relaxed)
    }
}

/// A thread that panics while it holds one of these has left nothing half done in it.
pub(super) fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

/// An event of a stream.
pub(super) fn event(kind: &str, what: &Value) -> Bytes {
    format!("event: {kind}\ndata: {what}\n\n").into()
}

/// Counts a viewer for as long as it is one.
pub(super) struct Seat(Arc<Air>);

impl Seat {
    /// A seat, if one is free.
    pub(super) fn take(air: &Arc<Air>) -> Option<Self> {
        let number = air.viewers.fetch_add(1, Ordering::Relaxed) + 1;
        let seat = Self(Arc::clone(air));
        air.most.fetch_max(number.min(VIEWERS), Ordering::Relaxed);
        (number <= VIEWERS).then_some(seat)
    }
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.0.viewers.fetch_sub(1, Ordering::Relaxed);
    }
}
