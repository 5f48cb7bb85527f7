//! The reading end of a connection, and what a client may send: so many bytes in so long a handshake, then so many a second.

use std::{
    io::{self, ErrorKind, Read, Write},
    net::TcpStream,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

/// Largest handshake \[bytes\].
const HANDSHAKE_BYTES: usize = 16 << 10;
/// Longest handshake, from connection to answer.
pub const HANDSHAKE_TIME: Duration = Duration::from_secs(10);
/// Bytes after the handshake: per second, and at once. One may be above the other for as long as the sum allows.
const BYTES: (f64, f64) = ((1 << 20) as f64, (2 << 20) as f64);
/// Longest pause of a client that sends too much; it ends with the connection.
const PAUSE: Duration = Duration::from_millis(100);

/// An allowance that grows with time.
#[derive(Debug)]
pub struct Allowance {
    rate: f64,
    most: f64,
    rest: f64,
    at: Instant,
}

impl Allowance {
    /// * `rate`: growth per second
    /// * `most`: largest allowance, that of the beginning
    pub fn new((rate, most): (f64, f64)) -> Self {
        Self { rate, most, rest: most, at: Instant::now() }
    }

    /// Spends some of it, and sleeps if it is used up: the client waits, as its bytes are not read.
    pub fn spend(&mut self, amount: f64) {
        let now = Instant::now();
        let grown = self.rest + (now - self.at).as_secs_f64() * self.rate;
        (self.rest, self.at) = (grown.min(self.most) - amount, now);
        if self.rest < 0.0 {
            thread::sleep(Duration::from_secs_f64(-self.rest / self.rate).min(PAUSE));
        }
    }
}

/// How far a connection is.
#[derive(Debug, Default)]
pub struct Phases {
    /// The handshake is over.
    pub is_open: AtomicBool,
    /// It ends: what has come but is not read yet, is not read.
    pub is_over: AtomicBool,
}

/// The reading end. Replies of the library, pongs for example, must not go between the frames of the writing thread: after
/// the handshake they are discarded here and sent there.
pub struct ReadHalf {
    stream: TcpStream,
    phases: Arc<Phases>,
    phase: Phase,
}

enum Phase {
    Handshake { end: Instant, bytes: usize },
    Open(Allowance),
}

impl ReadHalf {
    pub fn new(stream: TcpStream, phases: &Arc<Phases>) -> Self {
        let phase = Phase::Handshake { end: Instant::now() + HANDSHAKE_TIME, bytes: HANDSHAKE_BYTES };
        Self { stream, phases: Arc::clone(phases), phase }
    }

    pub fn open(&mut self) -> io::Result<()> {
        self.phase = Phase::Open(Allowance::new(BYTES));
        self.phases.is_open.store(true, Ordering::Relaxed);
        self.stream.set_read_timeout(None)
    }

    pub fn stream(&self) -> &TcpStream {
        &self.stream
    }
}

impl Read for ReadHalf {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        if self.phases.is_over.load(Ordering::Relaxed) {
            return Ok(0);
        }
        match &mut self.phase {
            Phase::Handshake { end, bytes } => {
                let rest = end.saturating_duration_since(Instant::now());
                if rest.is_zero() || *bytes == 0 {
                    return Err(ErrorKind::TimedOut.into());
                }
                self.stream.set_read_timeout(Some(rest))?;
                let most = buffer.len().min(*bytes);
                let count = match self.stream.read(&mut buffer[..most]) {
                    // the library would try again
                    Err(error) if error.kind() == ErrorKind::WouldBlock => {
                        return Err(ErrorKind::TimedOut.into());
                    }
                    other => other?,
                };
                *bytes -= count;
                Ok(count)
            }
            Phase::Open(allowance) => {
                let count = self.stream.read(buffer)?;
                allowance.spend(count as f64);
                Ok(count)
            }
        }
    }
}

impl Write for ReadHalf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        match self.phase {
            Phase::Handshake { .. } => self.stream.write(bytes),
            Phase::Open(_) => Ok(bytes.len()),
        }
    }

    fn flush(&mut self) -> io::Result<()> {
        match self.phase {
            Phase::Handshake { .. } => self.stream.flush(),
            Phase::Open(_) => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_allowance_holds_back_what_exceeds_it() {
        let mut allowance = Allowance::new((1000.0, 50.0));
        let start = Instant::now();
        (0..50).for_each(|_| allowance.spend(1.0));
        assert!(start.elapsed() < Duration::from_millis(40), "{:?}", start.elapsed());
        (0..200).for_each(|_| allowance.spend(1.0));
        assert!(start.elapsed() >= Duration::from_millis(190), "{:?}", start.elapsed());
        // one pause is short, however much is spent
        let start = Instant::now();
        allowance.spend(1e9);
        assert!(start.elapsed() < Duration::from_secs(1), "{:?}", start.elapsed());
    }
}
