//! `/log`: messages of the run in text, for the log panels of viewers.

use prost_types::Timestamp;

pub use crate::message::foxglove::log::Level;

use super::{Channel, FieldNote};
use crate::{message::foxglove, view::EventKind};

pub const TOPIC: &str = "/log";

pub fn timestamp(log_time: u64) -> Timestamp {
    Timestamp { seconds: (log_time / 1_000_000_000) as i64, nanos: (log_time % 1_000_000_000) as i32 }
}

/// A line of log at a log time \[ns\].
pub fn line(level: Level, log_time: u64, text: &str) -> foxglove::Log {
    foxglove::Log {
        timestamp: Some(timestamp(log_time)),
        level: level.into(),
        message: text.into(),
        name: "percuss".into(),
        file: String::new(),
        line: 0,
    }
}

pub fn channel() -> Channel {
    let fields = vec![
        FieldNote::new("level", "1", "severity, 1 DEBUG to 5 FATAL"),
        FieldNote::new("line", "1", "unused"),
    ];
    Channel::new(TOPIC, "foxglove.Log", fields, |view, outlet| {
        for event in &*view.events {
            let level =
                if matches!(event.kind, EventKind::Warning(_)) { Level::Warning } else { Level::Info };
            outlet.put(&line(level, outlet.log_time, &event.text));
        }
    })
}
