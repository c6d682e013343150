//! `plant-sim parameters`: lists and sets parameters over the bus.

use clap::{Args, ValueEnum};
use link::LinkAddress;
use plant_sim::parameters::{self, Assignment, Client, ClientError, Reading};
use plant_sim::say;
use protocol::messages::Server;

use super::{Failure, show};

/// Arguments of `parameters`.
#[derive(Args)]
pub(super) struct ParametersArgs {
    /// The bus, with a controller on it: socketcan:INTERFACE, slcan:TERMINAL or slcan:tcp:HOST:PORT.
    #[arg(long, value_name = "BUS", required_unless_present = "markdown")]
    bus: Option<LinkAddress>,
    /// Set a parameter instead of listing all; may be repeated. Takes effect from the next sample until the node
    /// restarts.
    #[arg(long, value_name = "NAME=VALUE", conflicts_with = "server")]
    set: Vec<Assignment>,
    /// Whose parameters; default: both.
    #[arg(long, value_name = "SERVER")]
    server: Option<ServerChoice>,
    /// Print JSON instead of text.
    #[arg(long)]
    json: bool,
    /// Print the table of parameters for docs/parameters.md; needs no bus.
    #[arg(long, conflicts_with_all = ["bus", "set", "server", "json"])]
    markdown: bool,
}

#[derive(Clone, Copy, PartialEq, ValueEnum)]
enum ServerChoice {
    Controller,
    Drives,
}

/// Lists or sets parameters.
pub(super) fn run(args: &ParametersArgs) -> Result<(), Failure> {
    let Some(bus) = &args.bus else {
        show(&parameters::markdown())?;
        return Ok(());
    };
    let mut client = Client::connect(bus).map_err(|error| error.to_string())?;
    let mut readings = Vec::new();
    let result = if args.set.is_empty() {
        list(&mut client, args.server, &mut readings)
    } else {
        set(&mut client, &args.set, &mut readings)
    };
    // Show what was read or set before an error.
    if !readings.is_empty() {
        show(&if args.json {
            parameters::json(&readings, client.period())
        } else {
            parameters::table(&readings, client.period())
        })?;
    }
    result.map_err(|error| error.to_string())?;
    Ok(())
}

fn list(
    client: &mut Client,
    server: Option<ServerChoice>,
    readings: &mut Vec<Reading>,
) -> Result<(), ClientError> {
    if server != Some(ServerChoice::Drives) {
        readings.extend(client.list(Server::Controller)?);
    }
    if server != Some(ServerChoice::Controller) {
        match client.list(Server::Drives) {
            // A controller may be configured before its drives are present.
            Err(error @ ClientError::DrivesSilent { .. }) if server.is_none() => {
                say!("plant-sim: {error}");
            }
            listed => readings.extend(listed?),
        }
    }
    Ok(())
}

fn set(
    client: &mut Client,
    assignments: &[Assignment],
    readings: &mut Vec<Reading>,
) -> Result<(), ClientError> {
    for Assignment { parameter, value } in assignments {
        readings.push(client.set(parameter, *value)?);
    }
    Ok(())
}
