//! Bus addresses, as typed after `--bus`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Address of a bus: `socketcan:can0`, `slcan:/dev/ttyACM0`, `slcan:tcp:HOST:PORT` or
/// `slcan:listen:HOST:PORT`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkAddress {
    /// Network interface.
    SocketCan(String),
    /// Serial-line adapter.
    Slcan(SlcanPeer),
}

/// Other end of a serial line.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SlcanPeer {
    /// Terminal device.
    Terminal(PathBuf),
    /// TCP server, host and port.
    Tcp(String),
    /// All clients of this TCP port: see [`SlcanHub`](super::SlcanHub).
    Listen(String),
}

/// The text is not the address of a bus.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct AddressError {
    /// What was typed.
    pub text: String,
}

impl fmt::Display for AddressError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{:?} is not a bus; allowed: socketcan:INTERFACE (socketcan:can0), slcan:TERMINAL (slcan:/dev/ttyACM0), \
             slcan:tcp:HOST:PORT (slcan:tcp:localhost:29536), slcan:listen:HOST:PORT (slcan:listen:localhost:29536)",
            self.text
        )
    }
}

impl core::error::Error for AddressError {}

impl FromStr for LinkAddress {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let address = match text.split_once(':') {
            // Linux allows 15 bytes and neither blanks nor slashes in the name of an interface.
            Some(("socketcan", name)) => ((1..=15).contains(&name.len())
                && name
                    .bytes()
                    .all(|byte| byte.is_ascii_graphic() && byte != b'/'))
            .then(|| Self::SocketCan(name.to_string())),
            Some(("slcan", peer)) => slcan_peer(peer).map(Self::Slcan),
            _ => None,
        };
        address.ok_or_else(|| AddressError {
            text: text.to_string(),
        })
    }
}

fn slcan_peer(text: &str) -> Option<SlcanPeer> {
    let server = |text: &str| {
        let (host, port) = text.rsplit_once(':')?;
        (!host.is_empty() && port.parse::<u16>().is_ok()).then(|| text.to_string())
    };
    if let Some(text) = text.strip_prefix("tcp:") {
        server(text).map(SlcanPeer::Tcp)
    } else if let Some(text) = text.strip_prefix("listen:") {
        server(text).map(SlcanPeer::Listen)
    } else {
        (!text.is_empty()).then(|| SlcanPeer::Terminal(PathBuf::from(text)))
    }
}

impl fmt::Display for LinkAddress {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::SocketCan(interface) => write!(f, "socketcan:{interface}"),
            Self::Slcan(peer) => write!(f, "slcan:{peer}"),
        }
    }
}

impl fmt::Display for SlcanPeer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Terminal(path) => write!(f, "{}", path.display()),
            Self::Tcp(server) => write!(f, "tcp:{server}"),
            Self::Listen(server) => write!(f, "listen:{server}"),
        }
    }
}
