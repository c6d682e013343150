//! States of the drive cabinet and every transition between them.
//!
//! [`TRANSITIONS`] is the whole machine; the test `states` makes the drawing in `docs/safety.md` from it. Only what leaves
//! [`State::Enabling`] before the first command with torque leads to the state without torque at once. A state
//! carries what it needs and determines the control word for the drives ([`State::control_word`]). Entry actions are in
//! [`controller`](super::controller).

use protocol::messages::{ControlWord, Mode};

/// State of the cabinet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum State {
    /// Nothing is known to work yet; left only by passing.
    SelfTest,
    /// Passed the self-test; waiting for the drives.
    PreOperational,
    /// Ready to be enabled.
    Ready,
    /// Torque holds the arm while the brake opens; samples left.
    Enabling(u32),
    /// Under torque, at rest.
    Enabled,
    /// Under torque, on a move.
    Moving,
    /// The operator has requested a stop on the path.
    QuickStop,
    /// Torque holds the arm while the brake closes; samples left.
    Disabling(u32),
    /// A fault is latched.
    Fault(Halt),
    /// An emergency stop is latched.
    EStop(Halt),
}

/// Progress of a latched stop.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Halt {
    /// Coming to rest on the path.
    Stopping,
    /// The brake closes. Until then, torque carries the lift and continues stopping the other axes; samples left.
    Closing(u32),
    /// Torque is off.
    Off,
}

listed! {
    /// What can change the state.
    #[cfg_attr(feature = "defmt", derive(defmt::Format))]
    pub enum Event {
        /// Known answers and the model are right.
        SelfTestPassed,
        /// The drives speak the same protocol and their encoders are valid; or their brake is open, which is told from there.
        PeerReady,
        /// Operator: switch on.
        Enable,
        /// Operator: switch off.
        Disable,
        /// The brake has had time to open.
        BrakeOpen,
        /// The brake has had time to close: torque may go.
        BrakeClosed,
        /// A planned move is waiting.
        Start,
        /// The last move has ended.
        Arrived,
        /// Operator: stop on the path.
        Stop,
        /// The stop has come to rest.
        AtRest,
        /// A fault: stop on the path, then switch off.
        FaultStop,
        /// A fault: the brake first; torque until it has closed.
        FaultBrake,
        /// A fault: brake and torque off at once.
        FaultOff,
        /// Emergency stop: stop on the path, then switch off.
        EmergencyStop,
        /// Operator: fault reset, or end of the emergency stop.
        Reset,
    }
}

/// Every transition: from, on, to. An event without a row here changes nothing. The samples left of a state are 0 here;
/// the controller sets them to the time of the brake on entering it.
pub const TRANSITIONS: [(State, Event, State); 52] = {
    use Event::{
        Arrived, AtRest, BrakeClosed, BrakeOpen, Disable, EmergencyStop, Enable, FaultBrake,
        FaultOff, FaultStop, PeerReady, Reset, SelfTestPassed, Start, Stop,
    };
    use Halt::{Closing, Off, Stopping};
    use State::{
        Disabling, EStop, Enabled, Enabling, Fault, Moving, PreOperational, QuickStop, Ready,
        SelfTest,
    };
    [
        // Nothing else leaves the self-test: an emergency stop with its reset would lead past it.
        (SelfTest, SelfTestPassed, PreOperational),
        (PreOperational, PeerReady, Ready),
        (PreOperational, EmergencyStop, EStop(Off)),
        (Ready, Enable, Enabling(0)),
        // What breaks without torque is as broken as with it. Nothing is to stop.
        (Ready, FaultBrake, Fault(Off)),
        (Ready, FaultOff, Fault(Off)),
        (Ready, EmergencyStop, EStop(Off)),
        // The arm is at rest and the brake not open yet: there is nothing to stop.
        (Enabling(0), BrakeOpen, Enabled),
        (Enabling(0), Disable, Disabling(0)),
        (Enabling(0), FaultStop, Fault(Closing(0))),
        (Enabling(0), FaultBrake, Fault(Closing(0))),
        (Enabling(0), FaultOff, Fault(Off)),
        (Enabling(0), EmergencyStop, EStop(Closing(0))),
        (Enabled, Start, Moving),
        (Enabled, Disable, Disabling(0)),
        (Enabled, FaultStop, Fault(Stopping)),
        (Enabled, FaultBrake, Fault(Closing(0))),
        (Enabled, FaultOff, Fault(Off)),
        (Enabled, EmergencyStop, EStop(Stopping)),
        (Moving, Arrived, Enabled),
        (Moving, Stop, QuickStop),
        (Moving, FaultStop, Fault(Stopping)),
        (Moving, FaultBrake, Fault(Closing(0))),
        (Moving, FaultOff, Fault(Off)),
        (Moving, EmergencyStop, EStop(Stopping)),
        (QuickStop, AtRest, Enabled),
        (QuickStop, FaultStop, Fault(Stopping)),
        (QuickStop, FaultBrake, Fault(Closing(0))),
        (QuickStop, FaultOff, Fault(Off)),
        (QuickStop, EmergencyStop, EStop(Stopping)),
        (Disabling(0), BrakeClosed, Ready),
        (Disabling(0), FaultStop, Fault(Closing(0))),
        (Disabling(0), FaultBrake, Fault(Closing(0))),
        (Disabling(0), FaultOff, Fault(Off)),
        (Disabling(0), EmergencyStop, EStop(Closing(0))),
        (Fault(Stopping), AtRest, Fault(Closing(0))),
        (Fault(Stopping), FaultBrake, Fault(Closing(0))),
        (Fault(Stopping), FaultOff, Fault(Off)),
        (Fault(Stopping), EmergencyStop, EStop(Stopping)),
        (Fault(Closing(0)), BrakeClosed, Fault(Off)),
        (Fault(Closing(0)), FaultOff, Fault(Off)),
        (Fault(Closing(0)), EmergencyStop, EStop(Closing(0))),
        // Told, though nothing more can be done.
        (Fault(Off), FaultBrake, Fault(Off)),
        (Fault(Off), EmergencyStop, EStop(Off)),
        (Fault(Off), Reset, PreOperational),
        (EStop(Stopping), AtRest, EStop(Closing(0))),
        (EStop(Stopping), FaultBrake, EStop(Closing(0))),
        (EStop(Stopping), FaultOff, EStop(Off)),
        (EStop(Closing(0)), BrakeClosed, EStop(Off)),
        (EStop(Closing(0)), FaultOff, EStop(Off)),
        (EStop(Off), FaultBrake, EStop(Off)),
        (EStop(Off), Reset, PreOperational),
    ]
};

/// Number of states, not counting what they carry.
const STATES: usize = 14;
/// No row of [`TRANSITIONS`].
const NO_ROW: u8 = u8::MAX;

/// Row of [`TRANSITIONS`] by state and event: a direct lookup, since every sample uses it.
#[allow(clippy::indexing_slicing, reason = "evaluated by the compiler")]
static ROWS: [[u8; Event::ALL.len()]; STATES] = {
    let mut rows = [[NO_ROW; Event::ALL.len()]; STATES];
    let mut row = 0;
    while row < TRANSITIONS.len() {
        let (from, event, _) = TRANSITIONS[row];
        let cell = &mut rows[from.index()][event as usize];
        assert!(*cell == NO_ROW, "one event leads to two states");
        *cell = row as u8;
        row += 1;
    }
    rows
};

impl State {
    /// State after `event`, or `None` if it means nothing in this state; `brake` is the time of the brake, samples.
    pub fn after(self, event: Event, brake: u32) -> Option<Self> {
        let row = *ROWS.get(self.index())?.get(event as usize)?;
        let (_, _, next) = TRANSITIONS.get(usize::from(row))?;
        Some(next.with_samples_left(brake))
    }

    const fn index(self) -> usize {
        match self {
            Self::SelfTest => 0,
            Self::PreOperational => 1,
            Self::Ready => 2,
            Self::Enabling(_) => 3,
            Self::Enabled => 4,
            Self::Moving => 5,
            Self::QuickStop => 6,
            Self::Disabling(_) => 7,
            Self::Fault(Halt::Stopping) => 8,
            Self::Fault(Halt::Closing(_)) => 9,
            Self::Fault(Halt::Off) => 10,
            Self::EStop(Halt::Stopping) => 11,
            Self::EStop(Halt::Closing(_)) => 12,
            Self::EStop(Halt::Off) => 13,
        }
    }

    const fn with_samples_left(self, samples: u32) -> Self {
        match self {
            Self::Enabling(_) => Self::Enabling(samples),
            Self::Disabling(_) => Self::Disabling(samples),
            Self::Fault(Halt::Closing(_)) => Self::Fault(Halt::Closing(samples)),
            Self::EStop(Halt::Closing(_)) => Self::EStop(Halt::Closing(samples)),
            other => other,
        }
    }

    /// This state, if it is entered before torque has come on: nothing has to be held then until the brake has closed, and a
    /// stop must not begin by switching on what it is to switch off.
    pub(super) const fn without_torque(self) -> Self {
        match self {
            Self::Fault(Halt::Closing(_)) => Self::Fault(Halt::Off),
            Self::EStop(Halt::Closing(_)) => Self::EStop(Halt::Off),
            Self::Disabling(_) => Self::Ready,
            other => other,
        }
    }

    /// The state `steps` samples later, and the event raised by the passing of time.
    pub(super) fn wait(self, steps: u32) -> (Self, Option<Event>) {
        let (left, event) = match self {
            Self::Enabling(left) => (left, Event::BrakeOpen),
            Self::Disabling(left)
            | Self::Fault(Halt::Closing(left))
            | Self::EStop(Halt::Closing(left)) => (left, Event::BrakeClosed),
            _ => return (self, None),
        };
        let left = left.saturating_sub(steps);
        (self.with_samples_left(left), (left == 0).then_some(event))
    }

    /// Control word for the drives in this state.
    pub const fn control_word(self) -> ControlWord {
        let (torque, brake, stop, estop) = (
            ControlWord::TORQUE_ENABLE,
            ControlWord::BRAKE_RELEASE,
            ControlWord::QUICK_STOP,
            ControlWord::ESTOP,
        );
        match self {
            Self::SelfTest | Self::PreOperational | Self::Ready | Self::Fault(Halt::Off) => {
                ControlWord::EMPTY
            }
            Self::Enabling(_) | Self::Enabled | Self::Moving => torque.with(brake, true),
            Self::QuickStop | Self::Fault(Halt::Stopping) => {
                torque.with(brake, true).with(stop, true)
            }
            Self::Disabling(_) | Self::Fault(Halt::Closing(_)) => torque,
            Self::EStop(Halt::Stopping) => {
                torque.with(brake, true).with(stop, true).with(estop, true)
            }
            Self::EStop(Halt::Closing(_)) => torque.with(estop, true),
            Self::EStop(Halt::Off) => estop,
        }
    }

    /// The mode that is reported for this state.
    pub const fn mode(self) -> Mode {
        match self {
            Self::SelfTest => Mode::SelfTest,
            Self::PreOperational => Mode::PreOperational,
            Self::Ready => Mode::Ready,
            Self::Enabling(_) => Mode::Enabling,
            Self::Enabled => Mode::Enabled,
            Self::Moving => Mode::Moving,
            Self::QuickStop => Mode::QuickStop,
            Self::Disabling(_) => Mode::Disabling,
            Self::Fault(Halt::Off) => Mode::Fault,
            Self::Fault(_) => Mode::FaultReaction,
            Self::EStop(_) => Mode::EStop,
        }
    }

    /// Progress of a latched stop; `None` without one.
    pub const fn halt(self) -> Option<Halt> {
        match self {
            Self::Fault(halt) | Self::EStop(halt) => Some(halt),
            _ => None,
        }
    }

    /// Whether a latched stop is still in progress.
    pub(super) const fn is_halting(self) -> bool {
        matches!(self.halt(), Some(Halt::Stopping | Halt::Closing(_)))
    }

    /// Whether torque holds or moves the arm.
    pub const fn is_powered(self) -> bool {
        self.control_word().contains(ControlWord::TORQUE_ENABLE)
    }

    /// Whether the arm is being stopped.
    pub(super) const fn is_stopping(self) -> bool {
        self.is_halting() || matches!(self, Self::QuickStop)
    }

    /// Whether the brake may hold the lift in addition to the torque.
    pub(super) const fn is_braking(self) -> bool {
        matches!(
            self,
            Self::Enabling(_)
                | Self::Disabling(_)
                | Self::Fault(Halt::Closing(_))
                | Self::EStop(Halt::Closing(_))
        )
    }
}
