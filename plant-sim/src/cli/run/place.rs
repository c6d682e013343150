//! Where the controller of a run is: the options that say so, and what belongs together.

use std::path::PathBuf;
use std::str::FromStr;

use clap::{Args, ValueEnum};
use link::{AddressError, LinkAddress, SlcanPeer};
use plant_sim::qemu::{self, Channel};
use protocol::messages::Node;
use sim::faults::{Fault, What};

use crate::cli::Failure;
use crate::cli::values::image;

/// Options that say where the controller is.
#[derive(Args)]
pub(super) struct PlaceArgs {
    /// The bus: builtin is the bit-timed simulated one; socketcan:INTERFACE, slcan:TERMINAL or
    /// slcan:tcp:HOST:PORT lead to an external controller.
    #[arg(long, value_name = "BUS", default_value = "builtin")]
    bus: BusChoice,
    /// Take samples at deadlines of the clock instead of waiting for each command (needs an
    /// external controller that was started with --real-time).
    #[arg(long)]
    real_time: bool,
    /// Where the controller runs: in this process, as an image on an emulated Cortex-M4F, or
    /// external, on the other end of --bus. The last two are compared with the one in this process
    /// byte for byte.
    #[arg(long, value_name = "WHERE", default_value = "in-process")]
    controller: ControllerChoice,
    /// The image for --controller qemu, instead of the one built from the sources.
    #[arg(long, value_name = "FILE", value_parser = image)]
    image: Option<PathBuf>,
    /// How frames reach the controller in QEMU: as records (fifo, fast, the default), or as slcan over its UART.
    #[arg(long, value_name = "CHANNEL")]
    channel: Option<ChannelChoice>,
    /// Show the built-in bus to CAN tools, which connect to slcan:tcp:HOST:PORT as to an adapter. The
    /// run waits for the first one and then runs in real time.
    #[arg(long, value_name = "slcan:tcp:HOST:PORT", value_parser = server)]
    listen: Option<String>,
}

/// Host and port at which tools connect.
fn server(text: &str) -> Result<String, String> {
    match text.parse() {
        Ok(LinkAddress::Slcan(SlcanPeer::Tcp(server))) => Ok(server),
        _ => Err(
            "allowed: slcan:tcp:HOST:PORT with the port of this machine for tools to connect to (slcan:tcp:localhost:29536)"
                .into(),
        ),
    }
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum ControllerChoice {
    InProcess,
    Qemu,
    External,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum ChannelChoice {
    Fifo,
    Uart,
}

#[derive(Clone)]
enum BusChoice {
    Builtin,
    Link(LinkAddress),
}

impl FromStr for BusChoice {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if text == "builtin" {
            return Ok(Self::Builtin);
        }
        text.parse()
            .map(Self::Link)
            .map_err(|error: AddressError| format!("{error}, or builtin"))
    }
}

/// Where the controller runs, with its options.
pub(super) enum Place<'a> {
    InProcess,
    Watched(&'a str),
    Qemu(qemu::Options),
    LockStep(&'a LinkAddress),
    RealTime(&'a LinkAddress),
}

impl Place<'_> {
    /// Refuses what cannot break there.
    pub(super) fn admit(&self, faults: &[Fault]) -> Result<(), Failure> {
        for fault in faults {
            let why = match (self, fault.what) {
                (Place::LockStep(_) | Place::RealTime(_), What::Dead(Node::Controller)) => {
                    "an external controller has a power supply of its own; allowed: controller:silent, or --controller qemu"
                }
                (Place::LockStep(_) | Place::RealTime(_), What::Slow(_)) => {
                    "an external controller has a processor of its own; allowed: command:delay, or --controller qemu"
                }
                (Place::Qemu(options), What::Slow(_)) if options.channel == Channel::Uart => {
                    "over a serial line the board does not learn how long it took; allowed: with --channel fifo"
                }
                (Place::RealTime(_), What::Clock(_)) => {
                    "in real time samples are taken by the clock of this machine; allowed without --real-time"
                }
                _ => continue,
            };
            return Err(Failure::usage(format!("fault {}: {why}", fault.text)));
        }
        Ok(())
    }
}

impl PlaceArgs {
    /// Checks that options belong together: a link and an external controller need each other.
    pub(super) fn place(&self) -> Result<Place<'_>, Failure> {
        self.combine().map_err(Failure::usage)
    }

    fn combine(&self) -> Result<Place<'_>, String> {
        if self.listen.is_some() && self.controller != ControllerChoice::InProcess {
            return Err("--listen shows the built-in bus of a controller in this process; the bus of an external one can be watched itself".into());
        }
        if self.controller != ControllerChoice::Qemu {
            for (given, option) in [
                (self.channel.is_some(), "--channel"),
                (self.image.is_some(), "--image"),
            ] {
                if given {
                    return Err(format!("{option} needs --controller qemu"));
                }
            }
        }
        match (self.controller, &self.bus) {
            (ControllerChoice::External, BusChoice::Link(bus)) if self.real_time => {
                Ok(Place::RealTime(bus))
            }
            (ControllerChoice::External, BusChoice::Link(bus)) => Ok(Place::LockStep(bus)),
            (ControllerChoice::External, BusChoice::Builtin) => Err(
                "--controller external needs a bus that leads to it, such as --bus socketcan:vcan0"
                    .into(),
            ),
            (_, BusChoice::Link(bus)) => Err(format!(
                "--bus {bus} leads to an external controller: add --controller external, and start it with: controller --bus {bus}"
            )),
            _ if self.real_time => Err("--real-time needs --controller external".into()),
            (ControllerChoice::InProcess, BusChoice::Builtin) => match &self.listen {
                None => Ok(Place::InProcess),
                Some(server) => Ok(Place::Watched(server)),
            },
            (ControllerChoice::Qemu, BusChoice::Builtin) => Ok(Place::Qemu(qemu::Options {
                image: self.image.clone(),
                channel: match self.channel {
                    None | Some(ChannelChoice::Fifo) => Channel::Fifo,
                    Some(ChannelChoice::Uart) => Channel::Uart,
                },
                count: None,
                in_step: false,
            })),
        }
    }
}
