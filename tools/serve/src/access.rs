//! Who may connect: the rules for the `Origin` and `Host` of a request.
//!
//! A browser says in `Origin` which page a connection is for, and no page can change that. So a server on this machine, which
//! every page of every site can try to reach through its visitor's browser, admits
//!
//! * requests without an origin: programs, not pages;
//! * pages from the machine of the browser: served by it, from files, and those of desktop viewers (`file://`, `app://…`);
//! * pages from the host that the server itself is reached at, if its address names that host, or by number;
//! * the origins of [`AllowedOrigin`].
//!
//! `null` is refused although some browsers send it for files: every site can send it from a sandboxed frame. At an address of
//! this machine only, `Host` must name this machine, too: a site that points its own name here (DNS rebinding) is refused.

use std::{
    net::IpAddr,
    sync::{Arc, Mutex, PoisonError},
};

use tungstenite::http::{
    HeaderMap,
    header::{HOST, ORIGIN},
};

use crate::{
    AllowedOrigin,
    origin::{Origin, host_and_port, is_loopback},
};

/// Largest number of reports; later refusals are silent.
const REPORTS: usize = 16;

/// Shows a line to the user.
pub type Report = Arc<dyn Fn(&str) + Send + Sync>;

/// Who may connect, and who learns of refusals.
#[derive(Clone)]
pub struct Access {
    /// Origins that may connect besides local ones.
    pub origins: Vec<AllowedOrigin>,
    /// Shows a line for every origin that is refused, once.
    pub report: Report,
}

impl Default for Access {
    /// Local origins only, without reports.
    fn default() -> Self {
        Self { origins: Vec::new(), report: Arc::new(|_| {}) }
    }
}

/// Checks requests.
pub struct Admission {
    access: Access,
    /// Host of the address of the server, in lower case.
    host: String,
    reported: Mutex<Vec<String>>,
}

impl Admission {
    /// Admission to the server at `host`.
    pub fn new(host: &str, access: Access) -> Self {
        Self { access, host: host.to_ascii_lowercase(), reported: Mutex::default() }
    }

    /// Admits a request, or says why not.
    ///
    /// * `local`: number of this machine that the connection came to
    ///
    /// # Errors
    ///
    /// Who is refused, and what allows it. The text has no byte of the request that is not part of a well-formed origin.
    pub fn admit(&self, headers: &HeaderMap, local: IpAddr) -> Result<(), String> {
        let refusal = match self.check_host(headers, local).and_then(|()| self.check_origin(headers, local)) {
            Ok(()) => return Ok(()),
            Err(refusal) => refusal,
        };
        let mut reported = self.reported.lock().unwrap_or_else(PoisonError::into_inner);
        if reported.len() < REPORTS && !reported.contains(&refusal) {
            (self.access.report)(&refusal);
            reported.push(refusal.clone());
            if reported.len() == REPORTS {
                (self.access.report)("refused more than that; further refusals are not shown");
            }
        }
        Err(refusal)
    }

    fn check_host(&self, headers: &HeaderMap, local: IpAddr) -> Result<(), String> {
        if !local.to_canonical().is_loopback() || self.access.origins.contains(&AllowedOrigin::Any) {
            return Ok(());
        }
        let host = single(headers, &HOST).and_then(host_and_port).map(|(host, _)| host);
        let Some(host) = host else { return Err("refused a request without a host".into()) };
        let is_allowed = |allowed: &AllowedOrigin| match allowed {
            AllowedOrigin::Any => true,
            AllowedOrigin::One(origin) => origin.host() == Some(&host),
        };
        if is_loopback(&host) || host == self.host || self.access.origins.iter().any(is_allowed) {
            return Ok(());
        }
        Err(format!(
            "refused a request to {host}, which is not this machine; --allow-origin http://{host} allows it"
        ))
    }

    fn check_origin(&self, headers: &HeaderMap, local: IpAddr) -> Result<(), String> {
        if !headers.contains_key(ORIGIN) || self.access.origins.contains(&AllowedOrigin::Any) {
            return Ok(());
        }
        let Some(origin) = single(headers, &ORIGIN).and_then(|text| text.parse::<Origin>().ok()) else {
            return Err("refused a browser without a well-formed origin; --allow-origin '*' allows it".into());
        };
        let is_own = |host: &str| {
            let number = host.parse::<IpAddr>();
            host == self.host || number.is_ok_and(|number| number.to_canonical() == local.to_canonical())
        };
        let is_allowed = self.access.origins.iter().any(|allowed| allowed.covers(&origin));
        if origin.is_local() || is_allowed || origin.host().is_some_and(is_own) {
            return Ok(());
        }
        Err(format!("refused a browser with a page of {origin}; --allow-origin {origin} allows it"))
    }
}

/// The text of a header that comes once.
fn single<'a>(headers: &'a HeaderMap, name: &tungstenite::http::HeaderName) -> Option<&'a str> {
    let mut values = headers.get_all(name).iter();
    let value = values.next()?.to_str().ok()?;
    values.next().is_none().then_some(value)
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    const LOCAL: IpAddr = IpAddr::V4(Ipv4Addr::LOCALHOST);
    const LAN: IpAddr = IpAddr::V4(Ipv4Addr::new(192, 168, 1, 7));

    fn headers(host: &str, origin: &str) -> HeaderMap {
        let mut headers = HeaderMap::new();
        headers.insert(HOST, host.parse().expect("a value"));
        if !origin.is_empty() {
            headers.insert(ORIGIN, origin.parse().expect("a value"));
        }
        headers
    }

    fn admission(host: &str, allowed: &str) -> Admission {
        let origins = allowed.split_whitespace().map(|text| text.parse().expect("an origin")).collect();
        Admission::new(host, Access { origins, ..Access::default() })
    }

    #[test]
    fn requests_are_admitted_or_refused() {
        // for this machine; for all machines
        let servers = [
            ("home", admission("127.0.0.1", ""), LOCAL),
            ("site", admission("127.0.0.1", "https://app.foxglove.dev"), LOCAL),
            ("any", admission("127.0.0.1", "*"), LOCAL),
            ("named", admission("runs.example.org", ""), LAN),
            ("open", admission("0.0.0.0", ""), LAN),
        ];
        for (host, origin, expected) in [
            ("127.0.0.1:8765", "", "home site any named open"),
            ("localhost", "", "home site any named open"),
            ("localhost:9000", "", "home site any named open"),
            ("[::1]:8765", "", "home site any named open"),
            // a name that a site points here; for all machines the host says nothing
            ("evil.example:8765", "", "any named open"),
            ("evil.example", "http://evil.example", "any"),
            ("app.foxglove.dev", "", "site any named open"),
            ("localhost.evil.example", "", "any named open"),
            ("", "", "any named open"),
            ("localhost", "http://localhost:8080", "home site any named open"),
            ("localhost", "http://127.0.0.1", "home site any named open"),
            ("localhost", "http://[::1]:5173", "home site any named open"),
            ("localhost", "file://", "home site any named open"),
            ("localhost", "app://viewer", "home site any named open"),
            ("localhost", "null", "any"),
            ("localhost", "https://app.foxglove.dev", "site any"),
            ("localhost", "https://app.foxglove.dev:444", "any"),
            ("localhost", "http://app.foxglove.dev", "any"),
            ("localhost", "https://localhost.evil.example", "any"),
            ("localhost", "not an origin", "any"),
            ("localhost", "http://runs.example.org:8080", "any named"),
            ("localhost", "http://192.168.1.7:8080", "any named open"),
            ("localhost", "http://192.168.1.8:8080", "any"),
        ] {
            let headers = headers(host, origin);
            let admit = servers.iter().filter(|(_, server, local)| server.admit(&headers, *local).is_ok());
            let admit: Vec<&str> = admit.map(|(name, ..)| *name).collect();
            assert_eq!(admit.join(" "), expected, "{host:?} {origin:?}");
        }
        let (_, home, _) = &servers[0];
        assert!(home.admit(&HeaderMap::new(), LOCAL).is_err());
        let refusal = home.admit(&headers("localhost", "https://evil.example"), LOCAL);
        assert_eq!(
            refusal.expect_err("it is foreign"),
            "refused a browser with a page of https://evil.example; --allow-origin https://evil.example allows it"
        );
    }

    #[test]
    fn two_origins_are_none() {
        let home = admission("127.0.0.1", "");
        let mut headers = headers("localhost", "http://localhost");
        headers.append(ORIGIN, "https://evil.example".parse().expect("a value"));
        assert!(home.admit(&headers, LOCAL).is_err());
    }

    #[test]
    fn every_origin_is_reported_once_and_not_too_many() {
        let lines = Arc::new(Mutex::new(Vec::new()));
        let copy = Arc::clone(&lines);
        let report: Report =
            Arc::new(move |line: &str| copy.lock().expect("one thread").push(line.to_owned()));
        let home = Admission::new("127.0.0.1", Access { origins: Vec::new(), report });
        for site in 0..2 * REPORTS {
            for _ in 0..3 {
                let origin = format!("https://{site}.example");
                assert!(home.admit(&headers("localhost", &origin), LOCAL).is_err());
            }
        }
        let lines = lines.lock().expect("one thread");
        assert_eq!(lines.len(), REPORTS + 1);
        assert!(lines[1].contains("--allow-origin https://1.example"), "{}", lines[1]);
        assert!(lines[REPORTS].contains("not shown"));
    }
}
