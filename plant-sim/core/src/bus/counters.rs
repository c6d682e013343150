//! Error counters of a node, and the state that they lead to: fault confinement of ISO 11898-1.

/// From here on a counter is worth a warning.
const WARNING: u16 = 96;
/// From here on the node is error passive.
const PASSIVE: u16 = 128;
/// From here on the node is bus-off, by its transmit error counter alone.
const BUS_OFF: u16 = 256;
/// Where the receive error counter stays: its register has eight bits.
pub(super) const MOST_RECEIVE: u16 = 255;
/// What a successful reception makes of a receive error counter beyond it; the standard allows 119 to 127.
const BACK: u16 = 127;

/// What happens to a node on the bus as far as its counters are concerned; letters are those of the standard.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Rule {
    /// a) A receiver has found an error.
    ReceiverError,
    /// b) A receiver has read a dominant bit right after its error flag: the others were slower to notice.
    DominantAfterFlag,
    /// c) A transmitter has sent an error flag, and none of the exceptions to this rule holds.
    TransmitterFlag,
    /// d) A transmitter has read a recessive bit while it sent an active error flag.
    TransmitterFlagBit,
    /// e) A receiver has.
    ReceiverFlagBit,
    /// f) A transmitter has read the 14th dominant bit in a row since the beginning of its error flag, or eight more.
    TransmitterHeld,
    /// f) A receiver has.
    ReceiverHeld,
    /// g) A frame was sent and acknowledged.
    Sent,
    /// h) A frame was received.
    Received,
}

/// What a node may do on the bus.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum State {
    /// It destroys frames with errors by an active error flag.
    ErrorActive,
    /// As error active, with a counter of 96 or more.
    Warning,
    /// Its error flag is recessive and destroys only frames of its own; before it sends again it lets others go first.
    ErrorPassive,
    /// It neither sends nor receives.
    BusOff,
}

impl State {
    /// Whether an error flag of the node is seen by the others.
    #[must_use]
    pub fn is_active(self) -> bool {
        self < Self::ErrorPassive
    }
}

/// Both counters of a node.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counters {
    transmit: u16,
    receive: u16,
}

impl Counters {
    /// Transmit error counter, TEC; 256 and more only while bus-off.
    #[must_use]
    pub fn transmit(self) -> u16 {
        self.transmit
    }

    /// Receive error counter, REC.
    #[must_use]
    pub fn receive(self) -> u16 {
        self.receive
    }

    /// The state of the node.
    #[must_use]
    pub fn state(self) -> State {
        self.transmitter().max(self.receiver())
    }

    /// The state that the transmit error counter alone leads to.
    #[must_use]
    pub fn transmitter(self) -> State {
        if self.transmit >= BUS_OFF {
            State::BusOff
        } else {
            level(self.transmit)
        }
    }

    /// The state that the receive error counter alone leads to.
    #[must_use]
    pub fn receiver(self) -> State {
        level(self.receive)
    }

    /// Counts what has happened.
    pub fn count(&mut self, rule: Rule) {
        let Self { transmit, receive } = self;
        match rule {
            Rule::ReceiverError => *receive = (*receive + 1).min(MOST_RECEIVE),
            Rule::DominantAfterFlag | Rule::ReceiverFlagBit | Rule::ReceiverHeld => {
                *receive = (*receive + 8).min(MOST_RECEIVE);
            }
            Rule::TransmitterFlag | Rule::TransmitterFlagBit | Rule::TransmitterHeld => {
                *transmit += 8;
            }
            Rule::Sent => *transmit = transmit.saturating_sub(1),
            Rule::Received if *receive >= PASSIVE => *receive = BACK,
            Rule::Received => *receive = receive.saturating_sub(1),
        }
    }
}

fn level(counter: u16) -> State {
    match counter {
        PASSIVE.. => State::ErrorPassive,
        WARNING.. => State::Warning,
        _ => State::ErrorActive,
    }
}
