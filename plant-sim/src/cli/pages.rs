//! `plant-sim completions` and `plant-sim man`: what a shell and a reader of manuals want, made from the command line itself.

use std::io;
use std::path::PathBuf;

use clap::{Args, Command};
use clap_complete::Shell;

use plant_sim::output::refuse_tilde;

use super::{Failure, show};

/// Arguments of `completions`.
#[derive(Args)]
pub(super) struct CompletionsArgs {
    /// The shell.
    #[arg(value_enum)]
    shell: Shell,
}

/// Arguments of `man`.
#[derive(Args)]
pub(super) struct ManArgs {
    /// Write the pages of all subcommands into this folder, instead of the first page to standard output.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
}

/// Writes a completion script.
pub(super) fn completions(args: &CompletionsArgs, mut command: Command) -> Result<(), Failure> {
    let name = command.get_name().to_owned();
    let mut script = Vec::new();
    clap_complete::generate(args.shell, &mut command, name, &mut script);
    show(&String::from_utf8_lossy(&script))
}

/// Writes manual pages.
pub(super) fn man(args: &ManArgs, command: Command) -> Result<(), Failure> {
    let Some(folder) = &args.out else {
        let mut page = Vec::new();
        clap_mangen::Man::new(command)
            .render(&mut page)
            .map_err(|error| error.to_string())?;
        return show(&String::from_utf8_lossy(&page));
    };
    let failed = |error: io::Error| {
        Failure::failed(format!("cannot write to {}: {error}", folder.display()))
    };
    refuse_tilde(folder)?;
    std::fs::create_dir_all(folder).map_err(failed)?;
    clap_mangen::generate_to(command, folder).map_err(failed)
}
