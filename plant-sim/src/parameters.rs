//! Parameters over a bus: reads and writes them as an operator, alongside other traffic.
//!
//! One request is in progress at a time. The controller also answers for the drives, whose replies it forwards.

mod show;

use std::time::{Duration, Instant};

use link::{Link, LinkAddress, LinkError};
use protocol::bus::{Transmit as _, TransmitError};
use protocol::codec;
use protocol::messages::{Message, ParameterError, ParameterReply, ParameterRequest, Server};
use protocol::parameters::{self, ControllerParameter, Parameter, Settable};

pub use show::{Row, json, markdown, table};

/// Wait for an answer before the request is repeated: some hundred samples.
const PATIENCE: Duration = Duration::from_millis(250);
/// Increment of the counter for a repeated request. Another operator may have left the counter anywhere; frames that
/// look up to 127 behind are dropped, which are at most two of four counters a quarter of the range apart.
const STRIDE: u8 = 64;
const ATTEMPTS: u32 = 4;

/// Why a parameter was not read or written.
#[derive(Debug, thiserror::Error)]
pub enum ClientError {
    /// The link failed.
    #[error(transparent)]
    Link(#[from] LinkError),
    /// The link takes no frames.
    #[error("{bus} takes no frames: {source}")]
    Transmit {
        /// Bus.
        bus: String,
        /// Reason.
        source: TransmitError,
    },
    /// The other end refuses frames.
    #[error(
        "{bus} can only be watched: it refuses frames, as the bus of `plant-sim run --listen` does. Let the controller \
         offer the bus (controller --bus slcan:listen:HOST:PORT), and connect the run and this program to it"
    )]
    Refused {
        /// Bus.
        bus: String,
    },
    /// Nobody answered.
    #[error(
        "no controller answers on {bus} within {} s; start one with: controller --bus BUS, where BUS is the same interface, \
         or slcan:listen:HOST:PORT for a connection by slcan:tcp:HOST:PORT",
        (PATIENCE * ATTEMPTS).as_secs_f64()
    )]
    Silent {
        /// Bus.
        bus: String,
    },
    /// The controller answers, the drives do not.
    #[error(
        "the drives on {bus} do not answer; they exist only during a run: plant-sim run --controller external --bus BUS"
    )]
    DrivesSilent {
        /// Bus.
        bus: String,
    },
    /// The node does not know the number.
    #[error("the {} has no {name}; it was built from other sources than this program", server.node())]
    NotFound {
        /// Parameter.
        name: &'static str,
        /// Node that was asked.
        server: Server,
    },
    /// It cannot be set at all.
    #[error("{name} cannot be set: it is a reading")]
    ReadOnly {
        /// Parameter.
        name: &'static str,
    },
    /// It cannot be set in the present state.
    #[error("{name} cannot be set now; {}", at_rest(*server))]
    NotNow {
        /// Parameter.
        name: &'static str,
        /// Node that was asked.
        server: Server,
    },
    /// The value is out of range.
    #[error("{name} cannot be {value}; allowed: {allowed}")]
    OutOfRange {
        /// Parameter.
        name: &'static str,
        /// Value refused.
        value: f32,
        /// Range and unit.
        allowed: String,
    },
}

fn at_rest(server: Server) -> &'static str {
    match server {
        Server::Controller => {
            "allowed: while the arm is at rest, that is ready, or enabled with no move planned or under way"
        }
        Server::Drives => "allowed: while the torque is off",
    }
}

/// A value, and what is allowed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reading {
    /// Number of the parameter.
    pub number: u16,
    /// Row of the table, unless the node knows more than this program.
    pub parameter: Option<&'static Parameter>,
    /// Value in force.
    pub value: f32,
    /// Least value allowed.
    pub lower: f32,
    /// Greatest value allowed.
    pub upper: f32,
}

/// A client on a bus with a controller.
pub struct Client {
    link: Link,
    bus: String,
    counter: u8,
    period: f32,
}

impl Client {
    /// Joins the bus and checks for a controller.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub fn connect(address: &LinkAddress) -> Result<Self, ClientError> {
        let mut client = Self {
            link: Link::open(address)?,
            bus: address.to_string(),
            // An operator that has just sent its Hello has used counter 0.
            counter: 1,
            period: 0.0,
        };
        let row = &ControllerParameter::SamplingPeriod.parameter();
        client.period = client.get(row)?.value;
        Ok(client)
    }

    /// Sampling period of the controller, s.
    #[must_use]
    pub fn period(&self) -> f32 {
        self.period
    }

    /// Every parameter of a server.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub fn list(&mut self, server: Server) -> Result<Vec<Reading>, ClientError> {
        let mut from = match server {
            Server::Controller => 0,
            Server::Drives => parameters::DRIVES,
        };
        let mut readings = Vec::new();
        loop {
            match self.ask(&ParameterRequest::List { from })? {
                ParameterReply::Value {
                    index,
                    value,
                    lower,
                    upper,
                } if server == Server::Drives || index < parameters::DRIVES => {
                    readings.push(reading(index, value, lower, upper));
                    let Some(next) = index.checked_add(1) else {
                        return Ok(readings);
                    };
                    from = next;
                }
                ParameterReply::Error {
                    error: ParameterError::NotNow,
                    ..
                } if server == Server::Drives => {
                    return Err(ClientError::DrivesSilent {
                        bus: self.bus.clone(),
                    });
                }
                // No parameter from here on, or none of this server.
                _ => return Ok(readings),
            }
        }
    }

    /// One parameter.
    ///
    /// # Errors
    /// See [`ClientError`].
    pub fn get(&mut self, parameter: &Parameter) -> Result<Reading, ClientError> {
        let index = parameter.rule.number;
        match self.ask(&ParameterRequest::Get { index })? {
            ParameterReply::Value {
                index,
                value,
                lower,
                upper,
            } => Ok(reading(index, value, lower, upper)),
            ParameterReply::Error {
                error: ParameterError::NotNow,
                ..
            } => Err(ClientError::DrivesSilent {
                bus: self.bus.clone(),
            }),
            _ => Err(ClientError::NotFound {
                name: parameter.name,
                server: parameter.server(),
            }),
        }
    }

    /// Writes a parameter and returns the new value, which takes effect from the next sample.
    ///
    /// # Errors
    /// See [`ClientError`]; nothing has changed then.
    pub fn set(&mut self, parameter: &Parameter, value: f32) -> Result<Reading, ClientError> {
        // The range depends on the node. A node also ignores a set as the first request it receives.
        let present = self.get(parameter)?;
        let index = parameter.rule.number;
        let name = parameter.name;
        let reply = self.ask(&ParameterRequest::Set { index, value })?;
        Err(match reply {
            ParameterReply::Value {
                index,
                value,
                lower,
                upper,
            } => return Ok(reading(index, value, lower, upper)),
            ParameterReply::Error { error, .. } => match error {
                ParameterError::ReadOnly => ClientError::ReadOnly { name },
                ParameterError::OutOfRange => ClientError::OutOfRange {
                    name,
                    value,
                    allowed: show::allowed(&present),
                },
                ParameterError::NotNow => ClientError::NotNow {
                    name,
                    server: parameter.server(),
                },
                ParameterError::NotFound => ClientError::NotFound {
                    name,
                    server: parameter.server(),
                },
            },
            ParameterReply::Hello(_) => ClientError::Silent {
                bus: self.bus.clone(),
            },
        })
    }

    fn ask(&mut self, request: &ParameterRequest) -> Result<ParameterReply, ClientError> {
        for attempt in 0..ATTEMPTS {
            if attempt > 0 {
                self.counter = self.counter.wrapping_add(STRIDE);
            }
            self.send(request)?;
            let end = Instant::now() + PATIENCE;
            while let Some(left) = left_until(end) {
                self.link.wait(left)?;
                while let Some(stamped) = self.link.take() {
                    if let Ok(received) = codec::decode(&stamped.frame)
                        && let Message::ParameterReply(Server::Controller, reply) = received.message
                        && answers(request, &reply)
                    {
                        self.counter = self.counter.wrapping_add(1);
                        return Ok(reply);
                    }
                }
                if matches!(&self.link, Link::Slcan(port) if port.refused() > 0) {
                    return Err(ClientError::Refused {
                        bus: self.bus.clone(),
                    });
                }
            }
        }
        let bus = self.bus.clone();
        // The controller itself has answered before.
        Err(if is_for_drives(request) {
            ClientError::DrivesSilent { bus }
        } else {
            ClientError::Silent { bus }
        })
    }

    fn send(&mut self, request: &ParameterRequest) -> Result<(), ClientError> {
        let message = Message::ParameterRequest(Server::Controller, *request);
        let frame = codec::encode(&message, self.counter)
            .expect("numbers were checked to be finite when they were read");
        let end = Instant::now() + PATIENCE;
        while let Err(source) = self.link.transmit(&frame) {
            // A failed link returns its error here.
            self.link.wait(Duration::from_millis(1))?;
            if source == TransmitError::Offline || left_until(end).is_none() {
                return Err(ClientError::Transmit {
                    bus: self.bus.clone(),
                    source,
                });
            }
        }
        Ok(())
    }
}

fn left_until(end: Instant) -> Option<Duration> {
    let left = end.saturating_duration_since(Instant::now());
    (!left.is_zero()).then_some(left)
}

fn is_for_drives(request: &ParameterRequest) -> bool {
    match request {
        ParameterRequest::Get { index } | ParameterRequest::Set { index, .. } => {
            *index >= parameters::DRIVES
        }
        ParameterRequest::List { from } => *from >= parameters::DRIVES,
        ParameterRequest::Hello(_) => false,
    }
}

/// Whether a reply belongs to this request and not to an abandoned one.
fn answers(request: &ParameterRequest, reply: &ParameterReply) -> bool {
    let (asked, listing) = match *request {
        ParameterRequest::Get { index } | ParameterRequest::Set { index, .. } => (index, false),
        ParameterRequest::List { from } => (from, true),
        ParameterRequest::Hello(_) => return matches!(reply, ParameterReply::Hello(_)),
    };
    match *reply {
        ParameterReply::Value { index, .. } => index == asked || listing && index > asked,
        ParameterReply::Error { index, .. } => index == asked,
        ParameterReply::Hello(_) => false,
    }
}

fn reading(number: u16, value: f32, lower: f32, upper: f32) -> Reading {
    Reading {
        number,
        parameter: parameters::numbered(number),
        value,
        lower,
        upper,
    }
}

/// A parameter and a new value: `NAME=VALUE`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Assignment {
    /// Row of the table.
    pub parameter: &'static Parameter,
    /// New value, finite.
    pub value: f32,
}

impl std::str::FromStr for Assignment {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let (name, value) = text
            .split_once('=')
            .ok_or("allowed: NAME=VALUE, such as bandwidth=120")?;
        let parameter = parameters::named(name).ok_or_else(|| {
            let names: Vec<&str> = parameters::all()
                .filter(|parameter| parameter.rule.settable != Settable::Never)
                .map(|parameter| parameter.name)
                .collect();
            format!("{name:?} is not a parameter; allowed: {}", names.join(", "))
        })?;
        let value = value
            .parse()
            .ok()
            .filter(|value: &f32| value.is_finite())
            .ok_or_else(|| {
                let unit = match parameter.unit {
                    "" => String::new(),
                    unit => format!(" in {unit}"),
                };
                format!("{value:?} is not a value of {name}; allowed: a number{unit}")
            })?;
        Ok(Self { parameter, value })
    }
}
