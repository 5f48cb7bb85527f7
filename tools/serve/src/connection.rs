//! One connection: a thread that reads the requests of the viewer, and one that writes its frames.

use std::{
    error::Error,
    io::{self, Read, Write},
    net::{Shutdown, TcpStream},
    sync::Arc,
    thread,
    time::{Duration, Instant},
};

use tungstenite::{
    Message, WebSocket, accept_hdr_with_config,
    handshake::server::{self, ErrorResponse, Response},
    http::{HeaderValue, StatusCode, header::SEC_WEBSOCKET_PROTOCOL},
    protocol::{Role, WebSocketConfig},
};

use crate::{
    Answer, Request,
    protocol::{self, ClientMessage, SUBPROTOCOLS},
    viewers::{Next, Viewers},
};

/// Largest request \[bytes\].
const MAX_REQUEST: usize = 1 << 20;
/// Longest silence of a connection during the handshake.
const HANDSHAKE_TIMEOUT: Duration = Duration::from_secs(10);
/// Longest wait for the writer of a viewer that has left.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(10);

/// The reading end. Replies of the library, pongs for example, must not go between the frames of the writing thread: after
/// the handshake they are discarded here and sent there.
struct ReadHalf {
    stream: TcpStream,
    discards_writes: bool,
}

impl Read for ReadHalf {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for ReadHalf {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.discards_writes { Ok(bytes.len()) } else { self.stream.write(bytes) }
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.discards_writes { Ok(()) } else { self.stream.flush() }
    }
}

/// Serves a connection until it ends.
///
/// * `greeting`: first messages to a viewer
pub fn serve(stream: TcpStream, viewers: &Arc<Viewers>, greeting: &[Message]) {
    // an error ends this connection only
    let Ok((mut reader, socket)) = handshake(stream) else { return };
    let id = viewers.enter();
    let writer = {
        let (viewers, greeting) = (Arc::clone(viewers), greeting.to_vec());
        thread::spawn(move || write(socket, &viewers, id, greeting))
    };
    while let Ok(message) = reader.read() {
        match message {
            Message::Text(text) => handle(protocol::text(&text), viewers, id),
            Message::Binary(data) => handle(protocol::binary(&data), viewers, id),
            Message::Ping(data) => viewers.answer(id, Message::Pong(data)),
            Message::Close(_) => break,
            Message::Pong(_) | Message::Frame(_) => {}
        }
    }
    viewers.leave(id);
    // the writer may wait for a viewer that no longer reads
    let start = Instant::now();
    while !writer.is_finished() && start.elapsed() < CLOSE_TIMEOUT {
        thread::sleep(PAUSE);
    }
    drop(reader.get_ref().stream.shutdown(Shutdown::Both));
    drop(writer.join());
}

fn handshake(stream: TcpStream) -> Result<(WebSocket<ReadHalf>, WebSocket<TcpStream>), Box<dyn Error>> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(HANDSHAKE_TIMEOUT))?;
    let write_half = stream.try_clone()?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_REQUEST))
        .max_frame_size(Some(MAX_REQUEST))
        .read_buffer_size(4096);
    let read_half = ReadHalf { stream, discards_writes: false };
    let mut reader = accept_hdr_with_config(read_half, choose_subprotocol, Some(config))
        .map_err(|error| error.to_string())?;
    reader.get_mut().discards_writes = true;
    reader.get_ref().stream.set_read_timeout(None)?;
    Ok((reader, WebSocket::from_raw_socket(write_half, Role::Server, None)))
}

#[expect(clippy::result_large_err, reason = "the signature is the library's")]
fn choose_subprotocol(request: &server::Request, mut response: Response) -> Result<Response, ErrorResponse> {
    let offered = request.headers().get_all(SEC_WEBSOCKET_PROTOCOL).iter();
    let offered: Vec<&str> =
        offered.flat_map(|header| header.to_str().unwrap_or_default().split(',')).map(str::trim).collect();
    let Some(chosen) = SUBPROTOCOLS.into_iter().find(|known| offered.contains(known)) else {
        let mut refusal = ErrorResponse::new(Some(format!("offer one of {}\n", SUBPROTOCOLS.join(", "))));
        *refusal.status_mut() = StatusCode::BAD_REQUEST;
        return Err(refusal);
    };
    response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(chosen));
    Ok(response)
}

fn handle(message: Result<ClientMessage, String>, viewers: &Viewers, id: u64) {
    let outcome = match message {
        Ok(ClientMessage::Subscribe(wanted)) => viewers.subscribe(id, wanted),
        Ok(ClientMessage::Unsubscribe(ids)) => {
            viewers.unsubscribe(id, &ids);
            Ok(())
        }
        Ok(ClientMessage::Playback { play, speed, seek, request }) => {
            viewers.request(Request { play, speed, seek, answer: Answer { viewer: id, request } });
            Ok(())
        }
        Ok(ClientMessage::Other) => Ok(()),
        Err(text) => Err(text),
    };
    if let Err(text) = outcome {
        viewers.answer(id, protocol::error(&text));
    }
}

/// Writes frames until the viewer leaves or the server ends; then closes the connection.
fn write(mut socket: WebSocket<TcpStream>, viewers: &Viewers, id: u64, greeting: Vec<Message>) {
    let outcome = write_all(&mut socket, viewers, id, greeting);
    if outcome.and_then(|()| socket.close(None)).and_then(|()| socket.flush()).is_err() {
        // the connection is broken: ends the reading thread too
        drop(socket.get_ref().shutdown(Shutdown::Both));
    }
}

fn write_all(
    socket: &mut WebSocket<TcpStream>,
    viewers: &Viewers,
    id: u64,
    greeting: Vec<Message>,
) -> tungstenite::Result<()> {
    greeting.into_iter().try_for_each(|message| socket.write(message))?;
    socket.flush()?;
    let mut frames = Vec::new();
    loop {
        match viewers.next(id, &mut frames) {
            Next::Answers(messages) => messages.into_iter().try_for_each(|message| socket.write(message))?,
            Next::Frames => frames.drain(..).try_for_each(|frame| socket.write(frame.encode()))?,
            Next::End => return Ok(()),
        }
        socket.flush()?;
    }
}
