//! A server, and an open page of it.
#![allow(dead_code)]

use std::io::{Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::sync::Arc;
use std::thread::JoinHandle;
use std::time::Duration;

use serde_json::{Value, json};
use supple_explore::Explorer;
use supple_study::LoadedTask;
use tungstenite::client::IntoClientRequest;
use tungstenite::{Message, WebSocket};

pub const SMALL: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../tasks/two_mass_small.toml");

/// A server in a thread of its own, which ends with the test.
pub struct Served {
    pub explorer: Arc<Explorer>,
    thread: Option<JoinHandle<()>>,
}

impl Served {
    pub fn of(path: &Path) -> Self {
        let loaded = LoadedTask::load(path).unwrap();
        let explorer = Arc::new(Explorer::open(loaded, Some(path.to_owned()), None).unwrap());
        let serving = Arc::clone(&explorer);
        Self { explorer, thread: Some(std::thread::spawn(move || serving.serve())) }
    }

    pub fn port(&self) -> u16 {
        let address = self.explorer.address();
        address.strip_prefix("http://127.0.0.1:").unwrap().split('/').next().unwrap().parse().unwrap()
    }

    pub fn token(&self) -> String {
        self.explorer.address().split_once("token=").unwrap().1.to_owned()
    }

    pub fn host(&self) -> String {
        format!("127.0.0.1:{}", self.port())
    }

    pub fn stream(&self) -> TcpStream {
        let stream = TcpStream::connect(("127.0.0.1", self.port())).unwrap();
        stream.set_read_timeout(Some(Duration::from_secs(120))).unwrap();
        stream.set_nodelay(true).unwrap();
        stream
    }

    /// Status and text of an answer to a request with these header lines.
    pub fn request(&self, method: &str, path: &str, headers: &[(&str, &str)], body: &str) -> (u16, String) {
        let mut text = format!("{method} {path} HTTP/1.1\r\nConnection: close\r\nContent-Length: {}\r\n", body.len());
        for (name, value) in headers {
            text += &format!("{name}: {value}\r\n");
        }
        let mut stream = self.stream();
        stream.write_all(format!("{text}\r\n{body}").as_bytes()).unwrap();
        let mut answer = String::new();
        stream.read_to_string(&mut answer).unwrap();
        let status = answer.split(' ').nth(1).and_then(|status| status.parse().ok()).expect(&answer);
        (status, answer.split_once("\r\n\r\n").map_or("", |(_, text)| text).to_owned())
    }

    /// A request of an own page.
    pub fn own(&self, method: &str, path: &str, body: &str) -> (u16, String) {
        let joint = if path.contains('?') { "&" } else { "?" };
        let (host, token) = (self.host(), self.token());
        let origin = format!("http://{host}");
        self.request(method, &format!("{path}{joint}token={token}"), &[("Host", &host), ("Origin", &origin)], body)
    }

    /// An open page: its channel, and what it hears first.
    pub fn page(&self) -> Page<'_> {
        let host = self.host();
        let mut request = format!("ws://{host}/channel?token={}", self.token()).into_client_request().unwrap();
        request.headers_mut().insert("Origin", format!("http://{host}").parse().unwrap());
        let (socket, _) = tungstenite::client(request, self.stream()).unwrap();
        let mut page = Page { served: self, socket, hello: Value::Null };
        page.hello = page.next("hello");
        page
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        self.explorer.close();
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

pub struct Page<'a> {
    served: &'a Served,
    pub socket: WebSocket<TcpStream>,
    pub hello: Value,
}

impl Page<'_> {
    /// The next message of a kind.
    pub fn next(&mut self, kind: &str) -> Value {
        loop {
            if let Message::Text(text) = self.socket.read().unwrap() {
                let message: Value = serde_json::from_str(&text).unwrap();
                if message["kind"] == kind {
                    return message;
                }
            }
        }
    }

    pub fn values(&self) -> Vec<f64> {
        self.hello["knobs"].as_array().unwrap().iter().map(|knob| knob["start"].as_f64().unwrap()).collect()
    }

    pub fn text(&self, view: &str, id: u64, more: Value) -> String {
        let mut body =
            json!({ "view": view, "id": id, "generation": self.hello["generation"], "values": self.values() });
        more.as_object().unwrap().iter().for_each(|(key, value)| body[key] = value.clone());
        body.to_string()
    }

    pub fn ask(&self, view: &str, id: u64, more: Value) {
        let path = format!("/ask?page={}", self.hello["page"]);
        let (status, text) = self.served.own("POST", &path, &self.text(view, id, more));
        assert_eq!(status, 204, "{text}");
    }
}
