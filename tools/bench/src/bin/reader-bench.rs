//! Speed of `percuss-read` on a recording, compared with decompressing its chunks alone.
//!
//! ```text
//! cargo build --release --workspace
//! target/release/percuss run fig5 --set mesh.cells=800 --set record.field_every=1 --set record.frames=760 -o big.mcap      (2 GB)
//! target/release/reader-bench big.mcap --repeat 5
//! ```
//!
//! Runs, in turn: decompression (this program: every chunk read and decompressed by zstd into one buffer, without parsing),
//! `trace` of the topic with the most bytes, and `diff` of the file with a second one (by default itself). Prints
//! medians, the ratio to decompression (twice for `diff`, which reads two files), and the largest memory of the reader.

use std::{
    fs::File,
    io::{self, BufReader, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
    process::{Command, ExitCode, Stdio},
    time::{Duration, Instant},
};

use clap::Parser;
use mcap::records::{Record, op};
use percuss_bench::{exit, median};

#[derive(Parser)]
#[command(about, long_about = None)]
struct Arguments {
    /// Recording, its chunks compressed by zstd or not at all
    file: PathBuf,
    /// Second recording for `diff` [default: the same]
    other: Option<PathBuf>,
    /// Runs of each
    #[arg(long, default_value_t = 3)]
    repeat: usize,
    /// Topic that is traced
    #[arg(long, default_value = "/interface/stress")]
    topic: String,
    /// The reader
    #[arg(long, default_value = "target/release/percuss-read")]
    reader: PathBuf,
}

fn main() -> ExitCode {
    exit(run(&Arguments::parse()))
}

fn run(arguments: &Arguments) -> io::Result<()> {
    let other = arguments.other.as_ref().unwrap_or(&arguments.file);
    let (mut decompression, mut tracing, mut comparing) = (Vec::new(), Vec::new(), Vec::new());
    let (mut memory, mut bytes) = (0, 0);
    let at = "--field=stress[0]";
    let trace: [&dyn AsRef<std::ffi::OsStr>; 7] =
        [&"trace", &arguments.file, &"--topic", &arguments.topic, &at, &"-o", &"/dev/null"];
    let diff: [&dyn AsRef<std::ffi::OsStr>; 3] = [&"diff", &arguments.file, other];
    for _ in 0..arguments.repeat {
        let start = Instant::now();
        bytes = decompress(&arguments.file)?;
        decompression.push(start.elapsed());
        for (command, times) in [(&trace[..], &mut tracing), (&diff[..], &mut comparing)] {
            let (time, peak) = child(&arguments.reader, command)?;
            times.push(time);
            memory = memory.max(peak);
        }
    }
    let [decompression, tracing, comparing] = [decompression, tracing, comparing].map(median);
    let rate = |time: Duration| bytes as f64 / time.as_secs_f64() / 1e6;
    println!("decompression    {decompression:8.2?}  {:6.0} MB/s", rate(decompression));
    let share = decompression.as_secs_f64() / tracing.as_secs_f64();
    println!("trace            {tracing:8.2?}  {:6.0} MB/s  {share:.2} of decompression", rate(tracing));
    let share = 2.0 * decompression.as_secs_f64() / comparing.as_secs_f64();
    println!(
        "diff             {comparing:8.2?}  {:6.0} MB/s  {share:.2} of decompressing both",
        2.0 * rate(comparing)
    );
    println!("largest memory   {} MB", memory / 1000);
    Ok(())
}

/// Reads and decompresses every chunk of a file; returns the size of their content.
fn decompress(path: &Path) -> io::Result<u64> {
    let mut file = BufReader::with_capacity(1 << 16, File::open(path)?);
    file.seek(SeekFrom::Start(mcap::MAGIC.len() as u64))?;
    let (mut body, mut content, mut total) = (Vec::new(), Vec::new(), 0);
    let mut zstd = zstd::bulk::Decompressor::new()?;
    loop {
        let mut prefix = [0; 9];
        file.read_exact(&mut prefix)?;
        let [opcode, length @ ..] = prefix;
        body.resize(u64::from_le_bytes(length) as usize, 0);
        file.read_exact(&mut body)?;
        match opcode {
            op::DATA_END => return Ok(total),
            op::CHUNK => {
                let record = mcap::parse_record(op::CHUNK, &body).map_err(io::Error::other)?;
                let Record::Chunk { header, data } = record else { continue };
                if header.compression == "zstd" {
                    content.resize(header.uncompressed_size as usize, 0);
                    zstd.decompress_to_buffer(&data, &mut content)?;
                }
                total += header.uncompressed_size;
            }
            _ => {}
        }
    }
}

/// Runs the reader; returns its time and its largest memory \[kB\].
fn child(reader: &Path, arguments: &[&dyn AsRef<std::ffi::OsStr>]) -> io::Result<(Duration, u64)> {
    let mut command = Command::new(reader);
    for argument in arguments {
        command.arg(argument);
    }
    // /dev/null exists
    if arguments.first().is_some_and(|verb| verb.as_ref() == "trace") {
        command.arg("--force");
    }
    let start = Instant::now();
    let mut child = command.stdout(Stdio::null()).spawn()?;
    let mut peak = 0;
    while child.try_wait()?.is_none() {
        if let Ok(status) = std::fs::read_to_string(format!("/proc/{}/status", child.id())) {
            let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
            let now = line.and_then(|line| line.trim().strip_suffix(" kB")?.trim().parse().ok());
            peak = peak.max(now.unwrap_or(0));
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    Ok((start.elapsed(), peak))
}
