//! One connection: a thread that reads the requests of the viewer, and one that writes its frames.

use std::{
    error::Error,
    net::{IpAddr, Shutdown, TcpStream},
    sync::{Arc, atomic::Ordering},
    thread,
    time::{Duration, Instant},
};

use tungstenite::{
    Message, WebSocket, accept_hdr_with_config,
    handshake::server::{self, Callback, ErrorResponse, Response},
    http::{
        HeaderValue, StatusCode,
        header::{CONNECTION, CONTENT_LENGTH, CONTENT_TYPE, SEC_WEBSOCKET_PROTOCOL},
    },
    protocol::{Role, WebSocketConfig},
};

use crate::{
    Answer, Request,
    access::Admission,
    protocol::{self, ClientMessage, Frame, PLAYBACK_SUBPROTOCOL, SUBPROTOCOLS},
    stream::{Allowance, HANDSHAKE_TIME, Phases, ReadHalf},
    viewers::{Next, Viewers},
};

/// Largest request, and largest frame of one \[bytes\].
const MAX_REQUEST: usize = 256 << 10;
/// Requests of a connection: per second, and at once.
const REQUESTS: (f64, f64) = (250.0, 1000.0);
/// Longest time in which a viewer reads nothing of what is sent to it.
const STALL: Duration = Duration::from_secs(30);
/// Longest wait for the writer of a viewer that has left.
const CLOSE_TIMEOUT: Duration = Duration::from_secs(1);
const PAUSE: Duration = Duration::from_millis(10);

/// What connections have in common.
pub struct Shared {
    pub admission: Admission,
    pub viewers: Arc<Viewers>,
    /// First message to a viewer, without and with playback control.
    pub info: [Message; 2],
    /// Further first messages.
    pub greeting: Vec<Message>,
}

/// A place among the viewers, until it is dropped.
struct Seat {
    viewers: Arc<Viewers>,
    id: u64,
    has_playback: bool,
}

impl Drop for Seat {
    fn drop(&mut self) {
        self.viewers.leave(self.id);
        self.viewers.free();
    }
}

/// Serves a connection until it ends.
///
/// * `phases`: how far it is
pub fn serve(stream: TcpStream, shared: &Arc<Shared>, phases: &Arc<Phases>) {
    // an error ends this connection only
    let Ok((mut reader, socket, seat)) = handshake(stream, shared, phases) else { return };
    let (id, has_playback) = (seat.id, seat.has_playback);
    let writer = {
        let (shared, phases) = (Arc::clone(shared), Arc::clone(phases));
        thread::Builder::new().spawn(move || write(socket, &shared, (id, has_playback), &phases))
    };
    let Ok(writer) = writer else { return };
    let mut allowance = Allowance::new(REQUESTS);
    while let Ok(message) = reader.read() {
        match message {
            Message::Text(text) => handle(protocol::text(&text), &shared.viewers, (id, has_playback)),
            Message::Binary(data) => handle(protocol::binary(&data), &shared.viewers, (id, has_playback)),
            Message::Ping(data) => shared.viewers.answer(id, Message::Pong(data)),
            Message::Close(_) => break,
            Message::Pong(_) | Message::Frame(_) => {}
        }
        allowance.spend(1.0);
    }
    shared.viewers.leave(id);
    // the writer may wait for a viewer that no longer reads
    let start = Instant::now();
    while !writer.is_finished() && start.elapsed() < CLOSE_TIMEOUT {
        thread::sleep(PAUSE);
    }
    drop(reader.get_ref().stream().shutdown(Shutdown::Both));
    drop(writer.join());
}

type Opened = (WebSocket<ReadHalf>, WebSocket<TcpStream>, Seat);

fn handshake(stream: TcpStream, shared: &Shared, phases: &Arc<Phases>) -> Result<Opened, Box<dyn Error>> {
    stream.set_nonblocking(false)?;
    stream.set_nodelay(true)?;
    stream.set_write_timeout(Some(HANDSHAKE_TIME))?;
    let local = stream.local_addr()?.ip();
    let write_half = stream.try_clone()?;
    let config = WebSocketConfig::default()
        .max_message_size(Some(MAX_REQUEST))
        .max_frame_size(Some(MAX_REQUEST))
        .read_buffer_size(4096);
    let mut seat = None;
    let host = Host { shared, local, seat: &mut seat };
    let mut reader = accept_hdr_with_config(ReadHalf::new(stream, phases), host, Some(config))
        .map_err(|error| error.to_string())?;
    reader.get_mut().open()?;
    write_half.set_write_timeout(Some(STALL))?;
    let seat = seat.ok_or("the request was not answered")?;
    Ok((reader, WebSocket::from_raw_socket(write_half, Role::Server, None), seat))
}

/// Answers the request of a handshake: with a seat, or a refusal.
struct Host<'a> {
    shared: &'a Shared,
    /// Number of this machine that the connection came to.
    local: IpAddr,
    seat: &'a mut Option<Seat>,
}

impl Callback for Host<'_> {
    fn on_request(
        self,
        request: &server::Request,
        mut response: Response,
    ) -> Result<Response, ErrorResponse> {
        let (headers, shared) = (request.headers(), self.shared);
        shared.admission.admit(headers, self.local).map_err(|text| refusal(StatusCode::FORBIDDEN, &text))?;
        let offered = headers.get_all(SEC_WEBSOCKET_PROTOCOL).iter();
        let offered: Vec<&str> = offered
            .flat_map(|header| header.to_str().unwrap_or_default().split(','))
            .map(str::trim)
            .collect();
        // viewers name the one first that they know best: Lichtblick offers both, and does not know playback control
        let known = |offer: &&str| SUBPROTOCOLS.into_iter().find(|known| known == offer);
        let Some(chosen) = offered.iter().find_map(known) else {
            let text = format!("offer one of {}", SUBPROTOCOLS.join(", "));
            return Err(refusal(StatusCode::BAD_REQUEST, &text));
        };
        let Some(id) = shared.viewers.enter() else {
            return Err(refusal(StatusCode::SERVICE_UNAVAILABLE, "all places for viewers are taken"));
        };
        *self.seat = Some(Seat {
            viewers: Arc::clone(&shared.viewers),
            id,
            has_playback: chosen == PLAYBACK_SUBPROTOCOL,
        });
        response.headers_mut().insert(SEC_WEBSOCKET_PROTOCOL, HeaderValue::from_static(chosen));
        Ok(response)
    }
}

fn refusal(status: StatusCode, text: &str) -> ErrorResponse {
    let body = format!("{text}\n");
    let mut refusal = ErrorResponse::new(None);
    *refusal.status_mut() = status;
    let headers = refusal.headers_mut();
    headers.insert(CONNECTION, HeaderValue::from_static("close"));
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("text/plain; charset=utf-8"));
    headers.insert(CONTENT_LENGTH, body.len().into());
    *refusal.body_mut() = Some(body);
    refusal
}

fn handle(message: Result<ClientMessage, String>, viewers: &Viewers, (id, has_playback): (u64, bool)) {
    let outcome = match message {
        Ok(ClientMessage::Subscribe { subscriptions }) => viewers.subscribe(id, subscriptions),
        Ok(ClientMessage::Unsubscribe { subscription_ids }) => {
            viewers.unsubscribe(id, &subscription_ids);
            Ok(())
        }
        Ok(ClientMessage::Playback { .. }) if !has_playback => {
            Err(format!("playback control is of {PLAYBACK_SUBPROTOCOL}"))
        }
        Ok(ClientMessage::Playback { play, speed, seek, request }) => {
            viewers.request(Request { play, speed, seek, answer: Answer { viewer: id, request } })
        }
        Ok(ClientMessage::Other) => Ok(()),
        Err(text) => Err(text),
    };
    if let Err(text) = outcome {
        viewers.answer(id, protocol::error(&text));
    }
}

/// Writes frames until the viewer leaves or the server ends; then closes the connection.
fn write(mut socket: WebSocket<TcpStream>, shared: &Shared, viewer: (u64, bool), phases: &Phases) {
    let outcome = write_all(&mut socket, shared, viewer);
    if outcome.and_then(|()| socket.close(None)).and_then(|()| socket.flush()).is_err() {
        // the connection is broken: ends the reading thread too
        phases.is_over.store(true, Ordering::Relaxed);
        drop(socket.get_ref().shutdown(Shutdown::Both));
    }
}

fn write_all(
    socket: &mut WebSocket<TcpStream>,
    shared: &Shared,
    (id, has_playback): (u64, bool),
) -> tungstenite::Result<()> {
    let is_known = |frame: &Frame| has_playback || !matches!(frame, Frame::Playback { .. });
    socket.write(shared.info[usize::from(has_playback)].clone())?;
    shared.greeting.iter().try_for_each(|message| socket.write(message.clone()))?;
    socket.flush()?;
    let mut frames = Vec::new();
    loop {
        match shared.viewers.next(id, &mut frames) {
            Next::Answers(messages) => messages.into_iter().try_for_each(|message| socket.write(message))?,
            Next::Frames => {
                frames.drain(..).filter(is_known).try_for_each(|frame| socket.write(frame.encode()))?
            }
            Next::End => return Ok(()),
        }
        socket.flush()?;
    }
}
