//! Access control: only pages served by this server, on this machine, may talk to it.

use std::fmt::Write;

/// What requests must show.
pub struct Guard {
    token: String,
    port: u16,
}

/// What a request shows.
#[derive(Clone, Copy, Debug, Default)]
pub struct Shown<'a> {
    /// The token in its address.
    pub token: Option<&'a str>,
    /// Its header `Host`.
    pub host: Option<&'a str>,
    /// Its header `Origin`.
    pub origin: Option<&'a str>,
}

impl Guard {
    /// With a new token of 128 random bits.
    ///
    /// # Errors
    /// Where the system gives no random numbers.
    pub fn new(port: u16) -> std::io::Result<Self> {
        let mut bytes = [0; 16];
        getrandom::fill(&mut bytes).map_err(|error| std::io::Error::other(error.to_string()))?;
        let token = bytes.iter().fold(String::new(), |mut text, byte| {
            let _ = write!(text, "{byte:02x}");
            text
        });
        Ok(Self { token, port })
    }

    /// The token.
    pub fn token(&self) -> &str {
        &self.token
    }

    /// Why a request is refused; `None` if it may pass. `acts` marks requests that change something or open a channel:
    /// for these, browsers send the origin, and it must be a page of this server.
    pub fn refusal(&self, shown: Shown, acts: bool) -> Option<&'static str> {
        let here = |name: &str| {
            let host = name.strip_suffix(&format!(":{}", self.port));
            matches!(host, Some("127.0.0.1" | "localhost"))
        };
        if !shown.host.is_some_and(here) {
            return Some("requests must use the host 127.0.0.1 (header Host)");
        }
        let own = |origin: &str| origin.strip_prefix("http://").is_some_and(here);
        match shown.origin {
            Some(origin) if !own(origin) => return Some("requests from other origins are rejected (header Origin)"),
            None if acts => return Some("this server answers its own pages only (no header Origin)"),
            _ => {}
        }
        if !shown.token.is_some_and(|token| same(token, &self.token)) {
            return Some("missing token: use the address printed by `supple explore`");
        }
        None
    }
}

/// Compares all bytes, so that timing does not reveal where texts differ.
fn same(a: &str, b: &str) -> bool {
    a.len() == b.len() && a.bytes().zip(b.bytes()).fold(0, |seen, (a, b)| seen | (a ^ b)) == 0
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn only_own_pages_with_the_token_pass() {
        let guard = Guard::new(8000).unwrap();
        let other = Guard::new(8000).unwrap();
        assert!(guard.token().len() == 32 && guard.token() != other.token());
        let good = Shown { token: Some(guard.token()), host: Some("127.0.0.1:8000"), origin: None };
        assert_eq!(guard.refusal(good, false), None);
        assert_eq!(guard.refusal(Shown { host: Some("localhost:8000"), ..good }, false), None);
        let own = Shown { origin: Some("http://127.0.0.1:8000"), ..good };
        assert_eq!(guard.refusal(own, true), None);
        for bad in [
            Shown { token: None, ..own },
            Shown { token: Some(other.token()), ..own },
            Shown { token: Some(""), ..own },
            Shown { host: None, ..own },
            Shown { host: Some("127.0.0.1"), ..own },
            Shown { host: Some("127.0.0.1:8001"), ..own },
            Shown { host: Some("evil.example:8000"), ..own },
            Shown { origin: None, ..own },
            Shown { origin: Some("null"), ..own },
            Shown { origin: Some("https://127.0.0.1:8000"), ..own },
            Shown { origin: Some("http://127.0.0.1:8000.evil.example"), ..own },
            Shown { origin: Some("http://evil.example"), ..own },
        ] {
            assert!(guard.refusal(bad, true).is_some(), "{bad:?}");
        }
    }
}
