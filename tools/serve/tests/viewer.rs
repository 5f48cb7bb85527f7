//! A viewer that places messages as Lichtblick does: at the last time sent to it; when time goes back it drops all of them. It offers
//! what Lichtblick offers, and knows what it knows.

use std::{
    collections::BTreeMap,
    io::ErrorKind,
    net::TcpStream,
    time::{Duration, Instant},
};

use tungstenite::{ClientRequestBuilder, Error, Message, WebSocket, client};

/// A message, its log time and the time at which it is placed \[ns\].
#[derive(Clone, Debug, PartialEq)]
pub struct Stamped {
    pub log_time: u64,
    pub stamp: u64,
    pub data: Vec<u8>,
}

/// A connection.
pub struct Viewer {
    socket: WebSocket<TcpStream>,
    /// Ids of channels by topic.
    pub channels: BTreeMap<String, u64>,
    /// Messages by topic.
    pub messages: BTreeMap<String, Vec<Stamped>>,
    /// How often time has gone back.
    pub jumps: u32,
    clock: Option<u64>,
    pub is_closed: bool,
}

impl Viewer {
    /// Connects, and reads the advertised channels.
    pub fn connect(url: &str) -> Self {
        let stream = TcpStream::connect(url.trim_start_matches("ws://")).expect("a listening server");
        let uri = url.parse().expect("an address");
        let request = ClientRequestBuilder::new(uri)
            .with_sub_protocol("foxglove.websocket.v1")
            .with_sub_protocol("foxglove.sdk.v1");
        let (socket, _) = client(request, stream).expect("a server of the protocol");
        socket.get_ref().set_read_timeout(Some(Duration::from_millis(20))).expect("a socket");
        let mut viewer = Self {
            socket,
            channels: BTreeMap::new(),
            messages: BTreeMap::new(),
            jumps: 0,
            clock: None,
            is_closed: false,
        };
        viewer.watch(Duration::from_secs(5), |viewer| !viewer.channels.is_empty());
        viewer
    }

    /// Subscribes to topics, each with a frame of its own.
    pub fn subscribe(&mut self, topics: &[&str]) {
        for topic in topics {
            let id = self.channels[*topic];
            let text =
                format!(r#"{{"op":"subscribe","subscriptions":[{{"id":{},"channelId":{id}}}]}}"#, id + 100);
            self.socket.send(Message::text(text)).expect("it listens");
            self.messages.entry((*topic).into()).or_default();
        }
    }

    /// Receives until a condition holds, the server closes, or the time is over.
    pub fn watch(&mut self, longest: Duration, is_enough: impl Fn(&Self) -> bool) {
        let start = Instant::now();
        while !self.is_closed && !is_enough(self) && start.elapsed() < longest {
            match self.socket.read() {
                Ok(Message::Text(text)) => self.read_text(&text),
                Ok(Message::Binary(data)) => self.read_binary(&data),
                Ok(_) => {}
                Err(Error::Io(error))
                    if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {}
                Err(_) => self.is_closed = true,
            }
        }
    }

    fn read_text(&mut self, text: &str) {
        let content: serde_json::Value = serde_json::from_str(text).expect("text frames are JSON");
        assert_ne!(content["op"], "status", "{text}");
        for channel in content["channels"].as_array().into_iter().flatten() {
            let topic = channel["topic"].as_str().expect("a topic");
            self.channels.insert(topic.into(), channel["id"].as_u64().expect("an id"));
        }
    }

    fn read_binary(&mut self, data: &[u8]) {
        let number = |at: usize| u64::from_le_bytes(data[at..at + 8].try_into().expect("eight bytes"));
        match data[0] {
            1 => {
                let subscription = u32::from_le_bytes(data[1..5].try_into().expect("four bytes"));
                let id = u64::from(subscription - 100);
                let topic = self.channels.iter().find(|(_, known)| **known == id).expect("a known channel").0;
                let stamp = self.clock.expect("a time comes before every message");
                let message = Stamped { log_time: number(5), stamp, data: data[13..].to_vec() };
                self.messages.get_mut(topic).expect("a subscribed topic").push(message);
            }
            2 => {
                let time = number(1);
                if self.clock.is_some_and(|clock| time < clock) {
                    self.messages.values_mut().for_each(Vec::clear);
                    self.jumps += 1;
                }
                self.clock = Some(time);
            }
            opcode => panic!("Unrecognized server opcode {opcode}"),
        }
    }

    /// Log times of the messages of a topic, each of which must be placed at its own.
    pub fn times(&self, topic: &str) -> Vec<u64> {
        let messages = &self.messages[topic];
        for message in messages {
            assert_eq!(message.stamp, message.log_time, "{topic}: a message at a wrong time");
        }
        messages.iter().map(|message| message.log_time).collect()
    }

    /// Leaves.
    pub fn leave(mut self) {
        drop(self.socket.close(None));
        self.watch(Duration::from_secs(2), |_| false);
    }
}
