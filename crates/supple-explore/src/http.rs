//! Minimal HTTP for local pages: one request per connection, each with its own thread.

use std::io::{Error, ErrorKind, Read, Result, Write};
use std::net::{Shutdown, TcpStream};
use std::time::Duration;

/// Bytes of the head of a request at most, and of its body.
const MOST_HEAD: usize = 64 << 10;
const MOST_BODY: usize = 1 << 20;
/// A client that neither sends nor reads for this long is disconnected.
const PATIENCE: Duration = Duration::from_secs(20);

/// A request, and the connection that waits for its answer.
pub struct Request {
    /// `GET` or another method.
    pub method: String,
    /// What is asked for, with its parameters.
    pub target: String,
    /// The body.
    pub body: String,
    headers: Vec<(String, String)>,
    stream: TcpStream,
}

fn wrong(what: impl ToString) -> Error {
    Error::new(ErrorKind::InvalidData, what.to_string())
}

impl Request {
    /// Reads the one request of a connection.
    ///
    /// # Errors
    /// If it is malformed, too long, or does not arrive.
    pub fn read(mut stream: TcpStream) -> Result<Self> {
        stream.set_nodelay(true)?;
        stream.set_read_timeout(Some(PATIENCE))?;
        stream.set_write_timeout(Some(PATIENCE))?;
        let (mut bytes, mut chunk) = (Vec::new(), [0; 8192]);
        loop {
            let mut headers = [httparse::EMPTY_HEADER; 64];
            let mut head = httparse::Request::new(&mut headers);
            if let httparse::Status::Complete(length) = head.parse(&bytes).map_err(wrong)? {
                let text = |value: &[u8]| String::from_utf8_lossy(value).into_owned();
                let list = head.headers.iter().map(|header| (header.name.to_owned(), text(header.value)));
                let headers: Vec<(String, String)> = list.collect();
                let (method, target) = (head.method.unwrap_or_default(), head.path.unwrap_or_default());
                let (method, target) = (method.to_owned(), target.to_owned());
                let body = bytes.split_off(length);
                let mut request = Self { method, target, body: String::new(), headers, stream };
                request.read_body(body)?;
                return Ok(request);
            }
            if bytes.len() > MOST_HEAD {
                return Err(wrong("the head is too long"));
            }
            match stream.read(&mut chunk)? {
                0 => return Err(ErrorKind::UnexpectedEof.into()),
                count => bytes.extend_from_slice(&chunk[..count]),
            }
        }
    }

    fn read_body(&mut self, mut bytes: Vec<u8>) -> Result<()> {
        let length: usize = self.header("Content-Length").map_or(Ok(0), str::parse).map_err(wrong)?;
        if length > MOST_BODY {
            return Err(wrong("the body is too long"));
        }
        let had = bytes.len().min(length);
        bytes.resize(length, 0);
        self.stream.read_exact(&mut bytes[had..])?;
        self.body = String::from_utf8(bytes).map_err(wrong)?;
        Ok(())
    }

    /// A header by its name.
    pub fn header(&self, name: &str) -> Option<&str> {
        self.headers.iter().find(|(other, _)| other.eq_ignore_ascii_case(name)).map(|(_, value)| value.as_str())
    }

    /// Answers and closes the connection.
    pub fn respond(mut self, status: u16, headers: &[(&str, &str)], body: &[u8]) {
        let mut bytes = head(status, headers, &format!("Connection: close\r\nContent-Length: {}\r\n", body.len()));
        bytes.extend_from_slice(body);
        // If this fails, the client is gone and cannot be informed.
        let _ = self.stream.write_all(&bytes).and_then(|()| self.stream.shutdown(Shutdown::Write));
    }

    /// Answers with another protocol, and gives the connection for it.
    ///
    /// # Errors
    /// Where the client has gone.
    pub fn upgrade(mut self, headers: &[(&str, &str)]) -> Result<TcpStream> {
        self.stream.write_all(&head(101, headers, ""))?;
        Ok(self.stream)
    }
}

/// The head of an answer.
fn head(status: u16, headers: &[(&str, &str)], more: &str) -> Vec<u8> {
    let reason = match status {
        101 => "Switching Protocols",
        200 => "OK",
        204 => "No Content",
        403 => "Forbidden",
        404 => "Not Found",
        405 => "Method Not Allowed",
        _ => "See Text",
    };
    let lines: String = headers.iter().map(|(name, value)| format!("{name}: {value}\r\n")).collect();
    format!("HTTP/1.1 {status} {reason}\r\n{lines}{more}\r\n").into_bytes()
}
