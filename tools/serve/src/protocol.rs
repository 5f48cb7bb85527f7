//! The frames of the Foxglove WebSocket protocol: <https://github.com/foxglove/ws-protocol/blob/main/docs/spec.md>, and of its
//! playback control.
//!
//! Messages carry their log time, but viewers place them at the time of the last *time* frame before them.

use std::{collections::BTreeSet, sync::Arc};

use base64::{Engine, engine::general_purpose::STANDARD};
use serde::Deserialize;
use serde_json::{Value, json};
use tungstenite::Message;

use crate::{Channel, Playback, Playing};

/// Versions of the protocol. Their frames are the same, except that viewers of the older one do not know playback control, neither
/// its requests nor the states of a player.
pub const SUBPROTOCOLS: [&str; 2] = [PLAYBACK_SUBPROTOCOL, "foxglove.websocket.v1"];
pub const PLAYBACK_SUBPROTOCOL: &str = "foxglove.sdk.v1";

const MESSAGE: u8 = 1;
const TIME: u8 = 2;
const PLAYBACK_STATE: u8 = 5;
/// The only binary request.
const PLAYBACK_CONTROL: u8 = 3;
/// Longest name of a request of playback control \[bytes\].
const REQUEST_NAME: usize = 256;
/// Longest text of an error \[characters\].
const ERROR_LENGTH: usize = 200;
/// Level of an error status.
const ERROR: u8 = 2;

/// A frame with data.
#[derive(Clone, Debug)]
pub enum Frame {
    Message {
        /// Subscription it goes to.
        subscription: u32,
        /// Log time \[ns\].
        log_time: u64,
        content: Arc<[u8]>,
    },
    /// The time of the following messages \[ns\].
    Time(u64),
    Playback {
        playback: Playback,
        /// True after a jump.
        did_seek: bool,
        /// Name of the request that it answers.
        request: Option<String>,
    },
}

impl Frame {
    pub fn encode(&self) -> Message {
        let mut data;
        match self {
            Self::Message { subscription, log_time, content } => {
                data = Vec::with_capacity(13 + content.len());
                data.push(MESSAGE);
                data.extend(subscription.to_le_bytes());
                data.extend(log_time.to_le_bytes());
                data.extend_from_slice(content);
            }
            Self::Time(time) => {
                data = vec![TIME];
                data.extend(time.to_le_bytes());
            }
            Self::Playback { playback, did_seek, request } => {
                let request = request.as_deref().unwrap_or_default();
                let state = match playback.state {
                    Playing::Playing => 0,
                    Playing::Paused => 1,
                    Playing::Ended => 3,
                };
                data = vec![PLAYBACK_STATE, state];
                data.extend(playback.time.to_le_bytes());
                data.extend((playback.speed as f32).to_le_bytes());
                data.push(u8::from(*did_seek));
                data.extend((request.len() as u32).to_le_bytes());
                data.extend_from_slice(request.as_bytes());
            }
        }
        Message::binary(data)
    }
}

/// The first frame of a server.
///
/// * `session`: distinguishes this server from others at the same address
/// * `range`: first and last time \[ns\] that a viewer can play
pub fn server_info(name: &str, session: &str, range: Option<(u64, u64)>) -> Message {
    let time = |time: u64| json!({ "sec": time / 1_000_000_000, "nsec": time % 1_000_000_000 });
    let mut info =
        json!({ "op": "serverInfo", "name": name, "sessionId": session, "capabilities": ["time"] });
    if let Some((start, end)) = range {
        info["capabilities"] = json!(["time", "playbackControl"]);
        info["dataStartTime"] = time(start);
        info["dataEndTime"] = time(end);
    }
    Message::text(info.to_string())
}

/// Advertises channels: the number of a channel is its index in the list, its id one more.
pub fn advertise(channels: &[Channel]) -> impl Iterator<Item = Message> + '_ {
    const AT_ONCE: usize = 100;
    let advertised = |(number, channel): (usize, &Channel)| {
        let mut entry = json!({
            "id": number + 1,
            "topic": channel.topic,
            "encoding": channel.encoding,
            "schemaName": "",
            "schema": "",
        });
        if let Some((name, encoding, data)) = &channel.schema {
            entry["schemaName"] = name.as_str().into();
            entry["schemaEncoding"] = encoding.as_str().into();
            entry["schema"] = match encoding.as_str() {
                "protobuf" | "flatbuffer" => STANDARD.encode(data).into(),
                _ => String::from_utf8_lossy(data).into(),
            };
        }
        if !channel.metadata.is_empty() {
            entry["metadata"] = json!(channel.metadata);
        }
        entry
    };
    channels.chunks(AT_ONCE).enumerate().map(move |(chunk, channels)| {
        let numbered = channels.iter().enumerate().map(|(i, channel)| (chunk * AT_ONCE + i, channel));
        let channels: Vec<Value> = numbered.map(advertised).collect();
        Message::text(json!({ "op": "advertise", "channels": channels }).to_string())
    })
}

/// Reports an error in a request to its viewer, in a short text of printable characters: it may quote the request.
pub fn error(message: &str) -> Message {
    let printable = |c: char| if c.is_control() { char::REPLACEMENT_CHARACTER } else { c };
    let message: String = message.chars().take(ERROR_LENGTH).map(printable).collect();
    Message::text(json!({ "op": "status", "level": ERROR, "message": message }).to_string())
}

/// A request of a viewer.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(tag = "op", rename_all = "camelCase", rename_all_fields = "camelCase")]
pub enum ClientMessage {
    Subscribe {
        subscriptions: Vec<Subscription>,
    },
    Unsubscribe {
        subscription_ids: BTreeSet<u32>,
    },
    /// Playback control, in binary.
    #[serde(skip)]
    Playback {
        play: bool,
        /// Speed, if it is a positive number.
        speed: Option<f64>,
        /// Time to go to \[ns\].
        seek: Option<u64>,
        request: String,
    },
    /// A request that this server does not support.
    #[serde(other)]
    Other,
}

/// A channel, by the id that it was advertised with, and the id of its messages.
#[derive(Debug, PartialEq, Deserialize)]
#[serde(rename_all = "camelCase")]
pub struct Subscription {
    pub id: u32,
    pub channel_id: usize,
}

/// Parses a text request.
///
/// # Errors
///
/// It is not a request of the protocol.
pub fn text(text: &str) -> Result<ClientMessage, String> {
    serde_json::from_str(text).map_err(|error| format!("not a request: {error}"))
}

/// Parses a binary request.
///
/// # Errors
///
/// It is truncated, or not a request of the protocol.
pub fn binary(data: &[u8]) -> Result<ClientMessage, String> {
    if data.first() != Some(&PLAYBACK_CONTROL) {
        return Ok(ClientMessage::Other);
    }
    playback_control(&data[1..]).ok_or_else(|| "not a request of playback control".into())
}

fn playback_control(mut data: &[u8]) -> Option<ClientMessage> {
    let command = take::<1>(&mut data)?[0];
    let speed = f64::from(f32::from_le_bytes(take(&mut data)?));
    let has_seek = take::<1>(&mut data)?[0] != 0;
    let seek = u64::from_le_bytes(take(&mut data)?);
    let length = u32::from_le_bytes(take(&mut data)?) as usize;
    if length > REQUEST_NAME {
        return None;
    }
    let request = std::str::from_utf8(data.get(..length)?).ok()?;
    Some(ClientMessage::Playback {
        play: match command {
            0 => true,
            1 => false,
            _ => return None,
        },
        speed: (speed.is_finite() && speed > 0.0).then_some(speed),
        seek: has_seek.then_some(seek),
        request: request.into(),
    })
}

fn take<const N: usize>(data: &mut &[u8]) -> Option<[u8; N]> {
    let (head, rest) = data.split_first_chunk()?;
    *data = rest;
    Some(*head)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_those_of_the_specification() {
        let content: Arc<[u8]> = b"xy".as_slice().into();
        let message = Frame::Message { subscription: 0x0102, log_time: 5, content };
        assert_eq!(message.encode().into_data(), &[1, 2, 1, 0, 0, 5, 0, 0, 0, 0, 0, 0, 0, b'x', b'y'][..]);
        assert_eq!(Frame::Time(258).encode().into_data(), &[2, 2, 1, 0, 0, 0, 0, 0, 0][..]);
        let playback = Playback { state: Playing::Ended, time: 7, speed: 1.0 };
        let state = Frame::Playback { playback, did_seek: true, request: Some("r".into()) };
        let data = [5, 3, 7, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0x80, 0x3f, 1, 1, 0, 0, 0, b'r'];
        assert_eq!(state.encode().into_data(), &data[..]);
    }

    #[test]
    fn requests_are_parsed() {
        let subscribe =
            r#"{"op":"subscribe","subscriptions":[{"id":3,"channelId":1},{"id":4,"channelId":9}]}"#;
        let subscriptions = [(3, 1), (4, 9)].map(|(id, channel_id)| Subscription { id, channel_id }).into();
        assert_eq!(text(subscribe), Ok(ClientMessage::Subscribe { subscriptions }));
        let subscription_ids = BTreeSet::from([3]);
        assert_eq!(
            text(r#"{"op":"unsubscribe","subscriptionIds":[3]}"#),
            Ok(ClientMessage::Unsubscribe { subscription_ids })
        );
        assert_eq!(text(r#"{"op":"getParameters","parameterNames":[]}"#), Ok(ClientMessage::Other));
        for bad in ["", "{}", r#"{"op":"subscribe"}"#] {
            assert!(text(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn playback_control_is_parsed_and_truncated_requests_are_refused() {
        let mut data = vec![3, 1];
        data.extend(2.5_f32.to_le_bytes());
        data.push(1);
        data.extend(9_u64.to_le_bytes());
        data.extend(2_u32.to_le_bytes());
        data.extend(b"id");
        let expected =
            ClientMessage::Playback { play: false, speed: Some(2.5), seek: Some(9), request: "id".into() };
        assert_eq!(binary(&data), Ok(expected));
        for length in 1..data.len() {
            assert!(binary(&data[..length]).is_err(), "{length} bytes");
        }
        assert_eq!(binary(&[1, 0, 0]), Ok(ClientMessage::Other));
        let start = data.len() - 6;
        data[start..start + 4].copy_from_slice(&(REQUEST_NAME as u32 + 1).to_le_bytes());
        data.extend([b'x'; REQUEST_NAME]);
        assert!(binary(&data).is_err(), "a long name");
    }

    #[test]
    fn errors_are_short_and_printable() {
        let message = error(&format!("\u{1b}[2J\u{9b}31m{}", "x".repeat(100_000)));
        let text = message.into_text().expect("a text");
        let content: Value = serde_json::from_str(&text).expect("JSON");
        let message = content["message"].as_str().expect("a message");
        assert!(message.starts_with("\u{fffd}[2J\u{fffd}31mx") && message.chars().count() == ERROR_LENGTH);
        // quoted by the library
        let quoted = format!(r#"{{"op":"subscribe","subscriptions":"\u001b[2J{}"}}"#, "x".repeat(100_000));
        let Err(quoted) = super::text(&quoted) else { panic!("it is no list") };
        assert!(error(&quoted).into_data().len() < 2 * ERROR_LENGTH);
    }
}
