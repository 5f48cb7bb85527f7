//! Addresses to serve at.

use std::{
    fmt,
    net::{IpAddr, SocketAddr},
    str::FromStr,
};

/// Host and port to serve at.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Address {
    /// Host name or number.
    pub host: String,
    /// Port; 0 for any that is free.
    pub port: u16,
}

/// The text is not an address.
#[derive(Debug, thiserror::Error)]
#[error("write HOST:PORT, HOST or PORT, for example 127.0.0.1:8765 or [::1]:8765")]
pub struct AddressError;

impl Address {
    /// The same as it was bound: with the port that was free, and a host that is a number in another form, `127.1`, in the usual one.
    pub(crate) fn bound(&self, at: SocketAddr) -> Self {
        let is_number =
            |part: &str| part.strip_prefix("0x").unwrap_or(part).chars().all(|c| c.is_ascii_hexdigit());
        let last = self.host.rsplit('.').next().filter(|part| part.starts_with(|c: char| c.is_ascii_digit()));
        let host = if last.is_some_and(is_number) { at.ip().to_string() } else { self.host.clone() };
        Self { host, port: at.port() }
    }
}

impl Default for Address {
    /// This machine only, at the default port of viewers.
    fn default() -> Self {
        Self { host: "127.0.0.1".into(), port: 8765 }
    }
}

impl FromStr for Address {
    type Err = AddressError;

    fn from_str(text: &str) -> Result<Self, AddressError> {
        let default = Self::default();
        if let Ok(port) = text.parse() {
            return Ok(Self { port, ..default });
        }
        if let Ok(number) = text.parse::<IpAddr>() {
            return Ok(Self { host: number.to_string(), ..default });
        }
        let (host, port) = match text.rsplit_once(':') {
            Some((host, port)) => (host, port.parse().map_err(|_| AddressError)?),
            None => (text, default.port),
        };
        let host = if host.is_empty() { default.host.as_str() } else { host };
        let inner = host.strip_prefix('[').and_then(|host| host.strip_suffix(']')).unwrap_or(host);
        let is_name = !inner.contains(|c: char| c.is_whitespace() || "/[]".contains(c));
        if is_name && (!inner.contains(':') || inner.parse::<IpAddr>().is_ok()) {
            Ok(Self { host: inner.into(), port })
        } else {
            Err(AddressError)
        }
    }
}

impl fmt::Display for Address {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if self.host.contains(':') {
            write!(f, "[{}]:{}", self.host, self.port)
        } else {
            write!(f, "{}:{}", self.host, self.port)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_are_parsed() {
        for (text, shown) in [
            ("9000", "127.0.0.1:9000"),
            (":9000", "127.0.0.1:9000"),
            ("localhost", "localhost:8765"),
            ("0.0.0.0", "0.0.0.0:8765"),
            ("192.168.1.7:80", "192.168.1.7:80"),
            ("::1", "[::1]:8765"),
            ("[::]:1", "[::]:1"),
        ] {
            assert_eq!(text.parse::<Address>().expect("an address").to_string(), shown);
        }
        for text in ["a:b", "1:2:3", "ws://localhost:1", "localhost:99999", "a b"] {
            assert!(text.parse::<Address>().is_err(), "{text}");
        }
    }

    #[test]
    fn a_bound_address_is_a_usual_one() {
        let bound = |text: &str, at: &str| {
            let address: Address = text.parse().expect("an address");
            address.bound(at.parse().expect("a socket")).to_string()
        };
        assert_eq!(bound("127.1:0", "127.0.0.1:9000"), "127.0.0.1:9000");
        assert_eq!(bound("0x7f.1:0", "127.0.0.1:9000"), "127.0.0.1:9000");
        assert_eq!(bound("[::]:0", "[::]:9000"), "[::]:9000");
        assert_eq!(bound("localhost:0", "127.0.0.1:9000"), "localhost:9000");
        assert_eq!(bound("host-1.example:0", "192.168.1.7:9000"), "host-1.example:9000");
    }
}
