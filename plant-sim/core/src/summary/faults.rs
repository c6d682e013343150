//! Faults that the controller reports, each once: by an emergency, and by the state, which has the rest of the first of them.

use protocol::messages::{Cause, Emergency, FaultAxis, State};
use protocol::time::Instant;
use schemars::JsonSchema;
use serde::Serialize;

/// A fault that the controller reported.
#[derive(Clone, Debug, PartialEq, Serialize, JsonSchema)]
pub struct Fault {
    /// When, s.
    pub time_s: f64,
    /// Cause.
    pub cause: &'static str,
    /// Emergency error code (CiA 301, CiA 402), hexadecimal.
    pub code: String,
    /// What it means.
    pub description: &'static str,
    /// Axis, if one is concerned and known: an emergency does not say it, and the state that follows names that of the first fault
    /// alone, as long as it is latched.
    pub axis: Option<&'static str>,
    /// Value found; 0 if the fault has no number.
    pub value: f32,
    /// Limit; 0 if the fault has none.
    pub limit: f32,
    /// Unit of value and limit.
    pub unit: &'static str,
    /// All of it as text.
    pub text: String,
}

impl Fault {
    fn describe(&mut self, fault: &protocol::messages::Fault) {
        self.axis = (fault.axis != FaultAxis::None).then_some(fault.axis.name());
        self.value = fault.value;
        self.limit = fault.limit;
        self.unit = fault.unit().symbol();
        self.text = fault.to_string();
    }
}

/// The faults while a run goes.
#[derive(Default)]
pub(super) struct Faults {
    list: Vec<Fault>,
    /// How many there were when the state last had none.
    cleared: usize,
    /// Whether an emergency has arrived and no state since.
    awaits_state: bool,
    /// Cause that the state has told before its emergency, which may yet arrive.
    ahead: Option<Cause>,
}

impl Faults {
    /// An emergency has arrived; whether it tells of a fault that is not listed.
    pub(super) fn emergency(&mut self, time: Instant, emergency: &Emergency) -> bool {
        if self.ahead == Some(emergency.cause) {
            self.ahead = None;
            return false;
        }
        let is_new = self.add(time, &emergency.fault(), emergency.code);
        self.awaits_state |= is_new;
        is_new
    }

    /// A state has arrived; whether it tells of a fault that is not listed: one whose emergency was lost, or waits for the bus.
    pub(super) fn state(&mut self, time: Instant, state: &State) -> bool {
        let fault = state.fault();
        if fault.cause == Cause::None {
            // Unless it was on the bus when the fault occurred.
            if !self.awaits_state {
                (self.cleared, self.ahead) = (self.list.len(), None);
            }
            return false;
        }
        // The state that follows an emergency has the rest of it.
        let name = fault.cause.name();
        if self.awaits_state
            && let Some(last) = self.list.last_mut().filter(|last| last.cause == name)
        {
            self.awaits_state = false;
            last.describe(&fault);
        }
        let mut listed = self.list.iter().skip(self.cleared);
        let is_new =
            !listed.any(|it| it.cause == name) && self.add(time, &fault, fault.cause.error_code());
        if is_new {
            self.ahead = Some(fault.cause);
        }
        is_new
    }

    /// All of them.
    pub(super) fn finish(self) -> Vec<Fault> {
        self.list
    }

    /// Lists a fault, unless it is the last one again: while the arm stops, the controller says the same again.
    fn add(&mut self, time: Instant, fault: &protocol::messages::Fault, code: u16) -> bool {
        let cause = fault.cause;
        if self
            .list
            .last()
            .is_some_and(|last| last.cause == cause.name())
        {
            return false;
        }
        let mut listed = Fault {
            time_s: time.seconds(),
            cause: cause.name(),
            code: format!("{code:04x}"),
            description: cause.describe(),
            axis: None,
            value: 0.0,
            limit: 0.0,
            unit: "",
            text: String::new(),
        };
        listed.describe(fault);
        self.list.push(listed);
        true
    }
}
