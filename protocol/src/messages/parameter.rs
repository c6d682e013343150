//! Reading and writing parameters, and the handshake.

use serde::{Deserialize, Serialize};

use super::Node;
use crate::codes::codes;

/// A node that has parameters. Each has one client, because an identifier must have one sender: the controller asks
/// the drives, the operator asks the controller.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Server {
    /// Parameters of the drives; the client is the controller.
    Drives,
    /// Parameters of the controller; the client is the operator.
    Controller,
}

impl Server {
    /// The node that answers.
    #[must_use]
    pub const fn node(self) -> Node {
        match self {
            Self::Drives => Node::Drives,
            Self::Controller => Node::Controller,
        }
    }
}

/// Client to server; each is answered by one [`ParameterReply`].
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterRequest {
    /// Value of one parameter.
    Get {
        /// Number of the parameter.
        #[serde(with = "postcard::fixint::le")]
        index: u16,
    },
    /// Change one parameter.
    Set {
        /// Number of the parameter.
        #[serde(with = "postcard::fixint::le")]
        index: u16,
        /// New value, in the parameter's unit.
        value: f32,
    },
    /// The first parameter from this number on; repeating it with the number after each answer lists them all.
    List {
        /// Lowest number of interest.
        #[serde(with = "postcard::fixint::le")]
        from: u16,
    },
    /// Identity of the client; the server answers with its own.
    Hello(Hello),
}

impl ParameterRequest {
    /// Names by wire tag, which is the order of the variants.
    pub const NAMES: &'static [(u8, &'static str)] =
        &[(0, "get"), (1, "set"), (2, "list"), (3, "hello")];
}

/// Server to client.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum ParameterReply {
    /// Value after the request, and its range, in the parameter's unit.
    Value {
        /// Number of the parameter.
        #[serde(with = "postcard::fixint::le")]
        index: u16,
        /// Value in force.
        value: f32,
        /// Least value allowed.
        lower: f32,
        /// Greatest value allowed.
        upper: f32,
    },
    /// Nothing has changed.
    Error {
        /// Number requested.
        #[serde(with = "postcard::fixint::le")]
        index: u16,
        /// Why.
        error: ParameterError,
        /// Bound violated, in the parameter's unit; 0 if there is none.
        limit: f32,
    },
    /// Identity of the server.
    Hello(Hello),
}

impl ParameterReply {
    /// Names by wire tag, which is the order of the variants.
    pub const NAMES: &'static [(u8, &'static str)] = &[(0, "value"), (1, "error"), (2, "hello")];
}

codes! {
    /// Why a parameter could not be read or written.
    pub enum ParameterError {
        /// No parameter has this number, or in a listing, none from it on.
        NotFound = 0, "not-found";
        /// The parameter cannot be written.
        ReadOnly = 1, "read-only";
        /// The value is out of the parameter's range.
        OutOfRange = 2, "out-of-range";
        /// Not allowed in the present state.
        NotNow = 3, "not-now";
    }
}

/// Identity of a node. Enable is refused while the schema hashes of two peers differ.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Hello {
    /// [`table::HASH`](crate::table::HASH) of the sender.
    #[serde(with = "postcard::fixint::le")]
    pub schema: u32,
    /// Version of the sender: major, minor and patch number, a byte each from bit 16 down.
    #[serde(with = "postcard::fixint::le")]
    pub build: u32,
    /// Link profile in use.
    pub profile: u8,
}

impl Hello {
    /// Link profile of this crate: CAN FD with bit rate switch, 1 and 5 Mbit/s.
    pub const PROFILE_FD: u8 = 1;
}
