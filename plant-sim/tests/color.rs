//! Escape codes: none where the output is no terminal; no colours where there is `NO_COLOR` (<https://no-color.org>).

#![allow(
    clippy::expect_used,
    clippy::panic,
    clippy::unwrap_used,
    reason = "a test fails by panicking"
)]

use std::fs::{File, OpenOptions};
use std::io::{Read, Write};
use std::process::{Child, Command, Stdio};

use rustix::pty::{OpenptFlags, grantpt, openpt, ptsname, unlockpt};
use rustix::termios::{Winsize, tcsetwinsize};

/// Starts the program on a terminal of its own; what the terminal gets is read from the file, and what is written to it is typed.
fn on_a_terminal(arguments: &[&str], no_color: bool) -> (Child, File) {
    let master = openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY).unwrap();
    grantpt(&master).unwrap();
    unlockpt(&master).unwrap();
    let size = Winsize {
        ws_row: 24,
        ws_col: 80,
        ws_xpixel: 0,
        ws_ypixel: 0,
    };
    tcsetwinsize(&master, size).unwrap();
    let name = ptsname(&master, Vec::new()).unwrap().into_string().unwrap();
    let terminal = OpenOptions::new()
        .read(true)
        .write(true)
        .open(name)
        .unwrap();
    let terminal = || Stdio::from(terminal.try_clone().unwrap());
    let mut command = Command::new(env!("CARGO_BIN_EXE_plant-sim"));
    command
        .args(arguments)
        .stdin(terminal())
        .stdout(terminal())
        .stderr(terminal())
        .env("TERM", "xterm-256color")
        .env_remove("CLICOLOR")
        .env_remove("CLICOLOR_FORCE")
        .env_remove("NO_COLOR");
    if no_color {
        command.env("NO_COLOR", "1");
    }
    (command.spawn().unwrap(), File::from(master))
}

/// All that it writes to the terminal, to its end.
fn written(arguments: &[&str], no_color: bool) -> String {
    let (mut child, mut terminal) = on_a_terminal(arguments, no_color);
    let text = rest(&mut terminal);
    child.wait().unwrap();
    text
}

fn rest(terminal: &mut File) -> String {
    let mut bytes = Vec::new();
    // Linux ends a terminal without a program with an error.
    let _ = terminal.read_to_end(&mut bytes);
    String::from_utf8_lossy(&bytes).into_owned()
}

#[test]
fn help_and_errors_are_plain_where_there_is_no_terminal_or_no_color() {
    for arguments in [
        &["--help"][..],
        &["run", "--cylces", "1"],
        &["check", "nowhere.toml"],
    ] {
        let output = Command::new(env!("CARGO_BIN_EXE_plant-sim"))
            .args(arguments)
            .env_remove("CLICOLOR_FORCE")
            .output()
            .unwrap();
        for plain in [output.stdout, output.stderr] {
            assert!(!plain.contains(&0x1B), "{arguments:?}");
        }
        let plain = written(arguments, true);
        assert!(!plain.is_empty() && !plain.contains('\x1B'), "{plain:?}");
    }
    // Where neither holds, there is something to leave out.
    assert!(written(&["run", "--cylces", "1"], false).contains("\x1B["));
}

#[test]
fn the_monitor_draws_without_colours_where_there_is_no_color() {
    for no_color in [false, true] {
        let monitor = ["monitor", "--bus", "slcan:listen:127.0.0.1:0"];
        let (mut child, mut terminal) = on_a_terminal(&monitor, no_color);
        let mut drawn = String::new();
        let mut piece = [0; 4096];
        while !drawn.contains("quit") {
            let length = terminal.read(&mut piece).unwrap();
            drawn += &String::from_utf8_lossy(&piece[..length]);
        }
        terminal.write_all(b"q").unwrap();
        drawn += &rest(&mut terminal);
        assert!(child.wait().unwrap().success(), "{drawn:?}");
        // Foreground and background: numbers 30 to 49, and 38;5;N.
        let colours = drawn.split("\x1B[").skip(1).filter(|code| {
            let (numbers, _) = code.split_once('m').unwrap_or_default();
            numbers
                .split(';')
                .any(|number| matches!(number.parse(), Ok(30..=49_u8)))
        });
        assert_eq!(colours.count() == 0, no_color, "{drawn:?}");
    }
}
