//! States of the drive cabinet and every way from one to another.
//!
//! ```text
//! SelfTest -> PreOperational -> Ready <-----------------------------+
//!                   ^             | Enable                          |
//!                   |             v                                 | BrakeClosed
//!                   |          Enabling ----- Disable ------------> Disabling
//!                   |             | BrakeOpen                       ^
//!                   |             v             Disable             |
//!                   |          Enabled -----------------------------+
//!                   |        Start | ^ Arrived   ^ AtRest
//!                   |              v |           |
//!                   |            Moving -------> QuickStop
//!                   |                     Stop
//!                   |
//!                   |   from any state with torque:   Fail -> FaultReaction -BrakeClosed-> Fault
//!                   |                             PeerLost -> Fault
//!                   |   from any state:      EmergencyStop -> EStop
//!                   +-- Reset --- Fault, EStop (once the brake has closed)
//! ```
//!
//! The table is data ([`transition`]); what a state does is the controller's business.

use protocol::messages::Mode;

/// What can change the state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Event {
    /// Known answers and the model are right.
    SelfTestPassed,
    /// The drives speak the same protocol and their encoders are valid.
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
    /// A fault: stop in a controlled way, then switch off.
    Fail,
    /// The drives are silent: nothing can be controlled any more.
    PeerLost,
    /// Emergency stop.
    EmergencyStop,
    /// Operator: fault reset, or end of the emergency stop.
    Reset,
}

impl Event {
    /// Every event, for exhaustive tests and drawings.
    pub const ALL: [Self; 14] = [
        Self::SelfTestPassed,
        Self::PeerReady,
        Self::Enable,
        Self::Disable,
        Self::BrakeOpen,
        Self::BrakeClosed,
        Self::Start,
        Self::Arrived,
        Self::Stop,
        Self::AtRest,
        Self::Fail,
        Self::PeerLost,
        Self::EmergencyStop,
        Self::Reset,
    ];
}

/// Whether the drives carry torque in `mode`.
pub fn is_powered(mode: Mode) -> bool {
    matches!(
        mode,
        Mode::Enabling | Mode::Enabled | Mode::Moving | Mode::QuickStop | Mode::Disabling
    )
}

/// Next state, or `None` where the event means nothing in this state.
pub fn transition(mode: Mode, event: Event) -> Option<Mode> {
    let next = match (mode, event) {
        (Mode::EStop, Event::EmergencyStop) => return None,
        (_, Event::EmergencyStop) => Mode::EStop,
        (mode, Event::Fail) if is_powered(mode) => Mode::FaultReaction,
        (mode, Event::PeerLost) if is_powered(mode) || mode == Mode::FaultReaction => Mode::Fault,
        (Mode::SelfTest, Event::SelfTestPassed) => Mode::PreOperational,
        (Mode::PreOperational, Event::PeerReady) => Mode::Ready,
        (Mode::Ready, Event::PeerLost) => Mode::PreOperational,
        (Mode::Ready, Event::Enable) => Mode::Enabling,
        (Mode::Enabling, Event::BrakeOpen) => Mode::Enabled,
        (Mode::Enabled, Event::Start) => Mode::Moving,
        (Mode::Moving, Event::Arrived) => Mode::Enabled,
        (Mode::Moving, Event::Stop) => Mode::QuickStop,
        (Mode::QuickStop, Event::AtRest) => Mode::Enabled,
        (Mode::Enabling | Mode::Enabled, Event::Disable) => Mode::Disabling,
        (Mode::Disabling, Event::BrakeClosed) => Mode::Ready,
        (Mode::FaultReaction, Event::BrakeClosed) => Mode::Fault,
        (Mode::Fault | Mode::EStop, Event::Reset) => Mode::PreOperational,
        _ => return None,
    };
    Some(next)
}

#[cfg(test)]
mod tests {
    use super::*;

    const MODES: [Mode; 11] = [
        Mode::SelfTest,
        Mode::PreOperational,
        Mode::Ready,
        Mode::Enabling,
        Mode::Enabled,
        Mode::Moving,
        Mode::QuickStop,
        Mode::Disabling,
        Mode::FaultReaction,
        Mode::Fault,
        Mode::EStop,
    ];

    /// The safety rules, walked over every state and every event.
    #[test]
    fn every_state_and_event_keeps_the_rules() {
        for mode in MODES {
            for event in Event::ALL {
                let next = transition(mode, event);
                let Some(next) = next else { continue };
                if is_powered(next) && !is_powered(mode) {
                    assert_eq!(
                        (mode, event),
                        (Mode::Ready, Event::Enable),
                        "torque comes on only by Enable from Ready"
                    );
                }
                if next == Mode::Moving {
                    assert_eq!((mode, event), (Mode::Enabled, Event::Start));
                }
                if matches!(mode, Mode::Fault | Mode::EStop) {
                    assert!(
                        (event, next) == (Event::Reset, Mode::PreOperational)
                            || (event, next) == (Event::EmergencyStop, Mode::EStop),
                        "latched: {mode:?} left by {event:?}"
                    );
                }
            }
            if mode != Mode::EStop {
                assert_eq!(transition(mode, Event::EmergencyStop), Some(Mode::EStop));
            }
            if is_powered(mode) {
                assert_eq!(transition(mode, Event::Fail), Some(Mode::FaultReaction));
                assert_eq!(transition(mode, Event::PeerLost), Some(Mode::Fault));
            }
        }
    }

    #[test]
    fn every_state_can_be_reached_and_left() {
        for mode in MODES {
            assert!(
                Event::ALL.iter().any(|e| transition(mode, *e).is_some()),
                "{mode:?} is a dead end"
            );
            assert!(
                mode == Mode::SelfTest
                    || MODES.iter().any(|from| Event::ALL
                        .iter()
                        .any(|e| transition(*from, *e) == Some(mode))),
                "{mode:?} cannot be reached"
            );
        }
    }
}
