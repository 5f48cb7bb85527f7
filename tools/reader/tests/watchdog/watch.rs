//! The reader run under watch: its address space is limited, its memory and its time are measured.

use std::{
    fs::{self, File},
    path::Path,
    process::{Command, Stdio},
    time::Duration,
};

use wait4::Wait4;

/// Memory that the reader is given \[MiB\].
pub const MEMORY: u64 = 64;

/// Memory that the program itself may take besides \[MiB\].
const PROGRAM: u64 = 64;

/// Addresses, not memory in use: what asks for more is refused by the system, and aborts \[KiB\].
pub const ADDRESSES: u64 = 600_000;

/// Longest time that a command may compute.
const LONGEST: Duration = Duration::from_secs(10);

/// What takes longer than that takes for ever: the machine may be busy \[s\].
const FOR_EVER: u64 = 60;

/// How a command has ended.
pub struct Ending {
    /// `None` for one that was killed or aborted.
    pub status: Option<i32>,
    pub stderr: String,
    /// Largest memory in use \[MiB\].
    pub memory: u64,
    /// Time of the processor.
    pub time: Duration,
}

/// A shell that runs the reader with limits.
pub fn command(folder: &Path, memory: u64, addresses: u64, arguments: &[&str]) -> Command {
    let script = format!(
        "ulimit -v {addresses}; exec timeout -s KILL {FOR_EVER} \"$0\" --max-memory {memory}MiB \"$@\""
    );
    let mut command = Command::new("sh");
    command.args(["-c", &script]).arg(assert_cmd::cargo::cargo_bin!("percuss-read")).args(arguments);
    // the names in a trace back take memory of their own
    command.env("RUST_BACKTRACE", "0");
    command.current_dir(folder).stdin(Stdio::null()).stdout(Stdio::null());
    command
}

/// Runs the reader in a folder with little memory.
pub fn watch(folder: &Path, arguments: &[&str]) -> Ending {
    watch_with(folder, MEMORY, ADDRESSES, arguments)
}

/// The same with other memory \[MiB\] and addresses \[KiB\].
pub fn watch_with(folder: &Path, memory: u64, addresses: u64, arguments: &[&str]) -> Ending {
    let said = folder.join("stderr");
    let stderr = File::create(&said).expect("a file");
    let mut child = command(folder, memory, addresses, arguments).stderr(stderr).spawn().expect("a shell");
    let used = child.wait4().expect("an end");
    let text = fs::read(&said).expect("what it says");
    Ending {
        status: used.status.code().filter(|status| *status < 128),
        stderr: String::from_utf8_lossy(&text[..text.len().min(1 << 16)]).into_owned(),
        memory: own_memory(used.rusage.maxrss) >> 20,
        time: used.rusage.utime + used.rusage.stime,
    }
}

/// Memory of a command by itself: at its start the system counts the peak of the process that starts it, this one; what is below that peak
/// says nothing of the command \[bytes\].
fn own_memory(counted: u64) -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let peak = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    let peak = peak.and_then(|peak| peak.trim().split(' ').next()?.parse::<u64>().ok()).unwrap_or(0);
    if counted > peak << 10 { counted } else { 0 }
}

/// What is wrong with an ending: a status that is not documented, a crash, too much memory or time, commands for the terminal.
///
/// * `given`: memory that it was given \[MiB\]
pub fn complaints(ending: &Ending, given: u64) -> Vec<String> {
    let Ending { status, stderr, memory, time, .. } = ending;
    let mut complaints = Vec::new();
    let mut complain = |is_wrong: bool, text: String| {
        if is_wrong {
            complaints.push(text)
        }
    };
    complain(!matches!(status, Some(0..=3)), format!("ends with {status:?}"));
    complain(stderr.contains("panicked"), "panics".into());
    complain(*memory > given + PROGRAM, format!("takes {memory} MiB"));
    complain(*time > LONGEST, format!("takes {time:?}"));
    let is_command = |c: char| (c.is_control() && !matches!(c, '\n' | '\t')) || c == '\u{202e}';
    complain(stderr.contains(is_command), "commands the terminal".into());
    complaints
}
