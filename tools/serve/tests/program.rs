//! A program that serves viewers, as a process of its own.

use std::{
    io::{BufRead, BufReader, Read},
    process::{Child, Command, Stdio},
    thread,
};

/// Starts a program; returns it with the address that it prints.
pub fn serving(command: &mut Command) -> (Child, String) {
    let mut child = command.stderr(Stdio::piped()).spawn().expect("the program starts");
    let mut lines = BufReader::new(child.stderr.take().expect("stderr is taken"));
    let mut line = String::new();
    lines.read_line(&mut line).expect("it says where it is");
    let url = line.split_whitespace().find(|word| word.starts_with("ws://")).expect("an address").to_owned();
    // reads the rest, so that the program does not block
    thread::spawn(move || drop(lines.read_to_end(&mut Vec::new())));
    (child, url)
}
