//! Accepts connections, each with a thread of its own, and bounds how many there are.

use std::{
    io,
    net::{Shutdown, TcpListener, TcpStream},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    thread::{self, JoinHandle},
    time::Duration,
};

use crate::{
    connection::{self, Shared},
    stream::Phases,
};

/// Largest number of connections in the handshake. For one more the oldest is closed: a real viewer needs a moment only.
const HANDSHAKES: usize = 64;
const PAUSE: Duration = Duration::from_millis(20);

pub struct Connection {
    stream: TcpStream,
    thread: JoinHandle<()>,
    phases: Arc<Phases>,
}

impl Connection {
    fn start(stream: TcpStream, shared: &Arc<Shared>) -> io::Result<Self> {
        let (kept, closed) = (stream.try_clone()?, stream.try_clone()?);
        let phases = Arc::new(Phases::default());
        let (shared, copy) = (Arc::clone(shared), Arc::clone(&phases));
        let thread = thread::Builder::new().spawn(move || {
            connection::serve(stream, &shared, &copy);
            // dropping it closes nothing: there are copies
            drop(closed.shutdown(Shutdown::Both));
        })?;
        Ok(Self { stream: kept, thread, phases })
    }

    fn is_in_handshake(&self) -> bool {
        !self.phases.is_open.load(Ordering::Relaxed)
    }

    fn end(&self) {
        self.phases.is_over.store(true, Ordering::Relaxed);
        drop(self.stream.shutdown(Shutdown::Both));
    }
}

/// Closes connections, all of them at once.
pub fn close(connections: Vec<Connection>) {
    connections.iter().for_each(Connection::end);
    connections.into_iter().for_each(|connection| drop(connection.thread.join()));
}

/// A thread that accepts connections until the end.
pub struct Acceptor {
    is_closed: Arc<AtomicBool>,
    thread: Option<JoinHandle<Vec<Connection>>>,
}

impl Acceptor {
    /// Begins to accept; the listener must not block.
    pub fn start(listener: TcpListener, shared: Shared) -> io::Result<Self> {
        let is_closed = Arc::new(AtomicBool::new(false));
        let flag = Arc::clone(&is_closed);
        let thread = thread::Builder::new().spawn(move || accept(&listener, &Arc::new(shared), &flag))?;
        Ok(Self { is_closed, thread: Some(thread) })
    }

    /// Accepts no more, closes what is in the handshake, and returns the open connections.
    pub fn end(&mut self) -> Vec<Connection> {
        self.is_closed.store(true, Ordering::Relaxed);
        let connections = self.thread.take().and_then(|thread| thread.join().ok()).unwrap_or_default();
        let (waiting, open): (Vec<_>, Vec<_>) =
            connections.into_iter().partition(Connection::is_in_handshake);
        close(waiting);
        open
    }
}

fn accept(listener: &TcpListener, shared: &Arc<Shared>, is_closed: &AtomicBool) -> Vec<Connection> {
    let mut connections: Vec<Connection> = Vec::new();
    while !is_closed.load(Ordering::Relaxed) {
        connections.retain(|connection| !connection.thread.is_finished());
        // errors concern single connections, or are temporary
        let Ok((stream, _)) = listener.accept() else {
            thread::sleep(PAUSE);
            continue;
        };
        let mut waiting =
            connections.iter().enumerate().filter(|(_, connection)| connection.is_in_handshake());
        let oldest = waiting.next().map(|(place, _)| place);
        if waiting.count() + 1 >= HANDSHAKES
            && let Some(oldest) = oldest
        {
            close(vec![connections.remove(oldest)]);
        }
        // without room for a thread the connection is dropped
        connections.extend(Connection::start(stream, shared));
    }
    connections
}
