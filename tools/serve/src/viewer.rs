//! One connection: a thread that reads what the viewer asks for, and one that writes what is next for it.

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
    audience::{Audience, Next},
    protocol::{self, Asked, SUBPROTOCOLS},
};

/// Largest request \[bytes\].
const REQUEST: usize = 1 << 20;
/// Longest silence of a connection that has not yet said what it is.
const GREETING: Duration = Duration::from_secs(10);
/// How long what is under way to a viewer that has left may take.
const FAREWELL: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(10);

/// The reading end. What the library wants to say of itself, pongs for example, must not go between the frames of the
/// thread that writes: after the handshake it is left out here and said there.
struct Ears {
    stream: TcpStream,
    is_mute: bool,
}

impl Read for Ears {
    fn read(&mut self, buffer: &mut [u8]) -> io::Result<usize> {
        self.stream.read(buffer)
    }
}

impl Write for Ears {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        if self.is_mute { Ok(bytes.len()) } else { self.stream.write(bytes) }
    }

    fn flush(&mut self) -> io::Result<()> {
        if self.is_mute { Ok(()) } else { self.stream.flush() }
    }
}

/// Serves a connection until it ends.
///
/// * `greeting`: what a viewer is sent first
pub fn serve(stream: TcpStream, audience: &Arc<Audience>, greeting: &[Message]) {
    // whatever goes wrong with a connection is the end of this connection and of nothing else
    let Ok((mut ears, mouth)) = handshake(stream) else { return };
    let id = audience.enter();
    let writer = {
        let (audience, greeting) = (Arc::clone(audience), greeting.to_vec());
        thread::spawn(move || write(mouth, &audience, id, greeting))
    };
    while let Ok(message) = ears.read() {
        match message {
            Message::Text(text) => obey(protocol::text(&text), audience, id),
            Message::Binary(data) => obey(protocol::binary(&data), audience, id),
            Message::Ping(data) => audience.answer(id, Message::Pong(data)),
            Message::Close(_) => break,
            Message::Pong(_) | Message::Frame(_) => {}
        }
    }
    audience.leave(id);
    // the writer may wait for a viewer that no longer reads
    let start = Instant::now();
    while !writer.is_finished() && start.elapsed() < FAREWELL {
        thread::sleep(PAUSE);
    }
    drop(ears.get_ref().stream.shutdown(Shutdown::Both));
    drop(writer.join());
}

fn handshake(stream: TcpStream) -> Result<(WebSocket<Ears>, WebSocket<TcpStream>), Box<dyn Error>> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_read_timeout(Some(GREETING))?;
    let mouth = stream.try_clone()?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(REQUEST))
        .max_frame_size(Some(REQUEST))
        .read_buffer_size(4096);
    let ears = Ears { stream, is_mute: false };
    let mut ears =
        accept_hdr_with_config(ears, choose_subprotocol, Some(config)).map_err(|error| error.to_string())?;
    ears.get_mut().is_mute = true;
    ears.get_ref().stream.set_read_timeout(None)?;
    Ok((ears, WebSocket::from_raw_socket(mouth, Role::Server, None)))
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

fn obey(asked: Result<Asked, String>, audience: &Audience, id: u64) {
    let outcome = match asked {
        Ok(Asked::Subscribe(wanted)) => audience.subscribe(id, wanted),
        Ok(Asked::Unsubscribe(ids)) => {
            audience.unsubscribe(id, &ids);
            Ok(())
        }
        Ok(Asked::Playback { play, speed, seek, request }) => {
            audience.request(Request { play, speed, seek, answer: Answer { viewer: id, request } });
            Ok(())
        }
        Ok(Asked::Other) => Ok(()),
        Err(text) => Err(text),
    };
    if let Err(text) = outcome {
        audience.answer(id, protocol::error(&text));
    }
}

/// Writes what is next, until the viewer leaves or the server ends; then says goodbye.
fn write(mut mouth: WebSocket<TcpStream>, audience: &Audience, id: u64, greeting: Vec<Message>) {
    let outcome = write_all(&mut mouth, audience, id, greeting);
    if outcome.and_then(|()| mouth.close(None)).and_then(|()| mouth.flush()).is_err() {
        // nothing more gets through: the thread that reads ends too
        drop(mouth.get_ref().shutdown(Shutdown::Both));
    }
}

fn write_all(
    mouth: &mut WebSocket<TcpStream>,
    audience: &Audience,
    id: u64,
    greeting: Vec<Message>,
) -> tungstenite::Result<()> {
    greeting.into_iter().try_for_each(|message| mouth.write(message))?;
    mouth.flush()?;
    let mut frames = Vec::new();
    loop {
        match audience.next(id, &mut frames) {
            Next::Answers(messages) => messages.into_iter().try_for_each(|message| mouth.write(message))?,
            Next::Frames => frames.drain(..).try_for_each(|frame| mouth.write(frame.encode()))?,
            Next::End => return Ok(()),
        }
        mouth.flush()?;
    }
}
