//! The server, and the clients and viewers that it meets.

use std::{collections::BTreeMap, thread, time::Duration};

use percuss_serve::{Access, Address, Channel, Server};

mod clients;
mod viewer;
mod viewers;

/// A server of JSON messages.
///
/// * `range`: of a recording that viewers can play
fn open(topics: &[&str], range: Option<(u64, u64)>, access: Access) -> Server {
    let channel = |topic: &&str| Channel {
        topic: (*topic).into(),
        encoding: "json".into(),
        schema: None,
        metadata: BTreeMap::from([("unit.force".into(), "N".into())]),
    };
    let channels: Vec<Channel> = topics.iter().map(channel).collect();
    let address = Address { port: 0, ..Address::default() };
    Server::open(&address, "a test", &channels, range, access).expect("a free port")
}

/// Waits until a viewer has subscribed.
fn wait_for_viewer(server: &Server) {
    while server.viewers() == 0 {
        thread::sleep(Duration::from_millis(5));
    }
}
