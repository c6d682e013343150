//! Why a link cannot be used, and what to do about it.

use std::fmt;
use std::io;

/// Why a link cannot be used, or has failed.
#[derive(Debug)]
pub enum LinkError {
    /// The system has no such network interface.
    NoInterface {
        /// The name requested.
        name: String,
        /// The CAN interfaces of this machine, separated by blanks.
        present: String,
    },
    /// The network interface is not a CAN interface.
    NotCan {
        /// Name.
        name: String,
    },
    /// The interface carries classical frames only.
    ClassicalOnly {
        /// Name.
        name: String,
        /// Its MTU, bytes: 16 for classical CAN, 72 for CAN FD.
        mtu: u32,
    },
    /// The interface is down.
    Down {
        /// Name.
        name: String,
    },
    /// The other end of the serial line is gone.
    Closed {
        /// Terminal or TCP address.
        peer: String,
    },
    /// The operating system refused something else.
    Io {
        /// The operation, and what it was attempted on.
        what: String,
        /// Error of the operating system.
        source: io::Error,
    },
}

impl LinkError {
    /// Whether this may pass by itself: an interface that is down or missing may come back.
    #[must_use]
    pub const fn may_pass(&self) -> bool {
        matches!(self, Self::Down { .. } | Self::NoInterface { .. })
    }

    pub(crate) fn io(what: impl Into<String>, source: impl Into<io::Error>) -> Self {
        Self::Io {
            what: what.into(),
            source: source.into(),
        }
    }
}

impl fmt::Display for LinkError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NoInterface { name, present } => {
                write!(f, "there is no interface {name}; CAN interfaces here: ")?;
                f.write_str(if present.is_empty() { "none" } else { present })?;
                if name.starts_with("vcan") {
                    write!(
                        f,
                        ". Add it with: ip link add dev {name} type vcan && ip link set {name} mtu 72 up"
                    )?;
                }
                Ok(())
            }
            Self::NotCan { name } => write!(f, "{name} is not a CAN interface"),
            Self::ClassicalOnly { name, mtu } => {
                write!(
                    f,
                    "{name} carries classical CAN only (MTU {mtu}), CAN FD needs MTU 72. "
                )?;
                if name.starts_with("vcan") {
                    write!(
                        f,
                        "Set it with: ip link set {name} down && ip link set {name} mtu 72 up"
                    )
                } else {
                    write!(
                        f,
                        "If its controller supports FD: ip link set {name} type can bitrate 1000000 dbitrate 5000000 fd on"
                    )
                }
            }
            Self::Down { name } => {
                write!(f, "{name} is down; bring it up with: ip link set {name} up")
            }
            Self::Closed { peer } => write!(f, "{peer} has closed the connection"),
            Self::Io { what, source } => write!(f, "cannot {what}: {source}"),
        }
    }
}

impl core::error::Error for LinkError {
    fn source(&self) -> Option<&(dyn core::error::Error + 'static)> {
        match self {
            Self::Io { source, .. } => Some(source),
            _ => None,
        }
    }
}
