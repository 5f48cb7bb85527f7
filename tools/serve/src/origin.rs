//! Origins: which web page a browser connects for.

use std::{fmt, net::IpAddr, str::FromStr};

/// Longest text of an origin \[bytes\].
const LONGEST: usize = 256;

/// Origin of a page, as browsers write it: scheme, host and port.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Origin {
    /// A page whose browser hides where it comes from: a sandboxed frame of any site, a `data:` address, in some browsers a file.
    Opaque,
    /// Any other page.
    Page {
        /// Scheme in lower case.
        scheme: String,
        /// Host in lower case, a number without brackets; empty for files.
        host: String,
        /// Port, unless it is that of the scheme.
        port: Option<u16>,
    },
}

/// Pages that a server admits besides those of this machine.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AllowedOrigin {
    /// Pages of all sites.
    Any,
    /// Pages of one origin.
    One(Origin),
}

/// The text is not an origin.
#[derive(Debug, thiserror::Error)]
#[error(
    "write SCHEME://HOST or SCHEME://HOST:PORT, for example https://app.foxglove.dev; or * for all, null for pages without one"
)]
pub struct OriginError;

impl Origin {
    /// True for pages that come from the machine of their browser: served by it, read from a file, part of an application.
    ///
    /// Desktop viewers load their pages from files (`file://`) or from within (`app://…`). A site cannot have such an
    /// origin: browsers give it the scheme that the page was loaded with.
    pub fn is_local(&self) -> bool {
        match self {
            Self::Opaque => false,
            Self::Page { scheme, host, .. } => match scheme.as_str() {
                "http" | "https" => is_loopback(host),
                "file" => host.is_empty(),
                "app" => true,
                _ => false,
            },
        }
    }

    /// Host of a page from a server.
    pub fn host(&self) -> Option<&str> {
        match self {
            Self::Page { scheme, host, .. } if scheme == "http" || scheme == "https" => Some(host),
            _ => None,
        }
    }
}

impl FromStr for Origin {
    type Err = OriginError;

    fn from_str(text: &str) -> Result<Self, OriginError> {
        if text == "null" {
            return Ok(Self::Opaque);
        }
        let (scheme, rest) = text.split_once("://").ok_or(OriginError)?;
        let is_scheme = scheme.starts_with(|c: char| c.is_ascii_alphabetic())
            && scheme.chars().all(|c| c.is_ascii_alphanumeric() || "+-.".contains(c));
        let scheme = scheme.to_ascii_lowercase();
        let (host, port) = match rest {
            "" if scheme == "file" => (String::new(), None),
            _ => host_and_port(rest).ok_or(OriginError)?,
        };
        let default = match scheme.as_str() {
            "http" => Some(80),
            "https" => Some(443),
            _ => None,
        };
        if is_scheme && text.len() <= LONGEST {
            Ok(Self::Page { scheme, host, port: port.filter(|port| Some(*port) != default) })
        } else {
            Err(OriginError)
        }
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self::Page { scheme, host, port } = self else { return f.write_str("null") };
        match host.contains(':') {
            true => write!(f, "{scheme}://[{host}]")?,
            false => write!(f, "{scheme}://{host}")?,
        }
        port.map_or(Ok(()), |port| write!(f, ":{port}"))
    }
}

impl AllowedOrigin {
    /// True if it covers an origin.
    pub fn covers(&self, origin: &Origin) -> bool {
        match self {
            Self::Any => true,
            Self::One(one) => one == origin,
        }
    }
}

impl FromStr for AllowedOrigin {
    type Err = OriginError;

    fn from_str(text: &str) -> Result<Self, OriginError> {
        match text {
            "*" => Ok(Self::Any),
            _ if text.ends_with("://") => text.parse().map(Self::One),
            _ => text.strip_suffix('/').unwrap_or(text).parse().map(Self::One),
        }
    }
}

/// Parses `HOST` or `HOST:PORT`, with numbers of version 6 in brackets; the host in lower case and without them.
pub fn host_and_port(text: &str) -> Option<(String, Option<u16>)> {
    let (host, rest) = match text.strip_prefix('[') {
        Some(inner) => {
            let (number, rest) = inner.split_once(']')?;
            (number.parse::<IpAddr>().ok()?.to_string(), rest)
        }
        None => {
            let end = text.find(':').unwrap_or(text.len());
            (text[..end].to_ascii_lowercase(), &text[end..])
        }
    };
    let is_name = !host.is_empty() && host.chars().all(|c| c.is_ascii_alphanumeric() || "-._:".contains(c));
    let port = match rest.strip_prefix(':') {
        Some(port) if port.bytes().all(|c| c.is_ascii_digit()) => Some(port.parse().ok()?),
        None if rest.is_empty() => None,
        _ => return None,
    };
    is_name.then_some((host, port))
}

/// True for the names and numbers of the machine itself, which no name service can point elsewhere.
pub fn is_loopback(host: &str) -> bool {
    host == "localhost"
        || host.ends_with(".localhost")
        || host.parse::<IpAddr>().is_ok_and(|number| number.is_loopback())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn origins_are_parsed_and_written_in_one_form() {
        for (text, shown, is_local) in [
            ("null", "null", false),
            ("http://localhost:8080", "http://localhost:8080", true),
            ("https://LocalHost:443", "https://localhost", true),
            ("http://viewer.localhost", "http://viewer.localhost", true),
            ("http://127.8.9.1:80", "http://127.8.9.1", true),
            ("http://[::1]:5173", "http://[::1]:5173", true),
            ("http://[0:0:0:0:0:0:0:1]", "http://[::1]", true),
            ("file://", "file://", true),
            ("app://viewer", "app://viewer", true),
            ("file://server", "file://server", false),
            ("https://app.foxglove.dev", "https://app.foxglove.dev", false),
            ("http://localhost.example.org", "http://localhost.example.org", false),
            ("http://127.0.0.1.example.org", "http://127.0.0.1.example.org", false),
            ("http://0.0.0.0", "http://0.0.0.0", false),
            ("chrome-extension://abc", "chrome-extension://abc", false),
        ] {
            let origin: Origin = text.parse().unwrap_or_else(|error| panic!("{text}: {error}"));
            assert_eq!((origin.to_string().as_str(), origin.is_local()), (shown, is_local), "{text}");
        }
    }

    #[test]
    fn other_texts_are_no_origins() {
        let long = format!("http://{}", "a".repeat(LONGEST));
        for text in [
            "",
            "localhost",
            "http://",
            "http:///",
            "http://a/b",
            "http://a b",
            "http://u@a",
            "http://a:99999",
            "http://a:+1",
            "http://a\x1b[2J",
            "http://é",
            "://a",
            "1http://a",
            "http://[::1",
            "http://[name]",
            "http://::1",
            "Null",
            &long,
        ] {
            assert!(text.parse::<Origin>().is_err(), "{text:?}");
        }
    }

    #[test]
    fn allowed_origins_cover_themselves_or_all() {
        let page: Origin = "https://app.foxglove.dev".parse().expect("an origin");
        for (text, covers) in [
            ("*", true),
            ("https://app.foxglove.dev/", true),
            ("https://APP.foxglove.dev:443", true),
            ("https://foxglove.dev", false),
            ("http://app.foxglove.dev", false),
            ("null", false),
            ("file://", false),
        ] {
            let allowed: AllowedOrigin = text.parse().expect("an origin");
            assert_eq!(allowed.covers(&page), covers, "{text}");
        }
        assert!("foxglove.dev".parse::<AllowedOrigin>().is_err());
    }
}
