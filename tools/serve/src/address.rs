//! Addresses to serve at.

use std::{fmt, net::IpAddr, str::FromStr};

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
    /// Machines that can connect, in words.
    pub fn reach(&self) -> &'static str {
        if self.is_loopback() { "this machine only" } else { "every machine that reaches this one" }
    }

    /// True if only this machine can connect.
    pub fn is_loopback(&self) -> bool {
        self.host == "localhost" || self.host.parse::<IpAddr>().is_ok_and(|number| number.is_loopback())
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
        for (text, shown, local) in [
            ("9000", "127.0.0.1:9000", true),
            (":9000", "127.0.0.1:9000", true),
            ("localhost", "localhost:8765", true),
            ("0.0.0.0", "0.0.0.0:8765", false),
            ("192.168.1.7:80", "192.168.1.7:80", false),
            ("::1", "[::1]:8765", true),
            ("[::]:1", "[::]:1", false),
        ] {
            let address: Address = text.parse().expect("an address");
            assert_eq!((address.to_string().as_str(), address.is_loopback()), (shown, local));
        }
        for text in ["a:b", "1:2:3", "ws://localhost:1", "localhost:99999", "a b"] {
            assert!(text.parse::<Address>().is_err(), "{text}");
        }
    }
}
