//! A server of small pages on the loopback address.
//!
//! One request per connection, GET and HEAD only. Bodies are not read. Rejected are heads longer than
//! [`LONGEST_HEAD`], clients slower than [`PATIENCE`], and pages of another site that name this address
//! (their `Host` is not ours: DNS rebinding).

use std::io::{ErrorKind, Read as _, Write as _};
use std::net::{Ipv4Addr, SocketAddr, TcpListener, TcpStream};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::thread;
use std::time::{Duration, Instant};

use anyhow::{Context as _, Result};

/// Maximum number of bytes of a request's first line and headers.
const LONGEST_HEAD: usize = 16 << 10;
/// Maximum number of headers of a request.
const MOST_HEADERS: usize = 64;
/// Time limit for a client to send its request, and to receive the answer.
const PATIENCE: Duration = Duration::from_secs(5);
/// Maximum number of simultaneous connections; others are closed.
const MOST_CONNECTIONS: usize = 64;

/// The response to a request.
pub(super) struct Answer {
    pub(super) status: u16,
    /// The media type of the body.
    pub(super) kind: &'static str,
    pub(super) body: String,
}

impl Answer {
    pub(super) fn text(status: u16, body: impl Into<String>) -> Self {
        Self { status, kind: "text/plain; charset=utf-8", body: body.into() }
    }
}

/// A listening socket.
pub(super) struct Server {
    listener: TcpListener,
    pub(super) address: SocketAddr,
    stopped: AtomicBool,
    connections: AtomicUsize,
}

impl Server {
    pub(super) fn new(port: u16) -> Result<Self> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port)).with_context(|| {
            format!(
                "cannot listen at port {port}; another one is chosen by --port, and a free one by --port 0"
            )
        })?;
        let address = listener.local_addr()?;
        Ok(Self { listener, address, stopped: AtomicBool::new(false), connections: AtomicUsize::new(0) })
    }

    /// Ends [`serve`](Self::serve).
    #[cfg(test)]
    pub(super) fn stop(&self) {
        self.stopped.store(true, Ordering::Relaxed);
        // Wakes the accepting thread.
        let _ = TcpStream::connect(self.address);
    }

    /// Answers requests by path and query, each in a thread, until it is stopped.
    pub(super) fn serve(self: &Arc<Self>, answer: impl Fn(&str) -> Answer + Send + Sync + 'static) {
        let answer = Arc::new(answer);
        for stream in self.listener.incoming() {
            if self.stopped.load(Ordering::Relaxed) {
                return;
            }
            // The client may have gone.
            let Ok(stream) = stream else { continue };
            if self.connections.fetch_add(1, Ordering::Relaxed) >= MOST_CONNECTIONS {
                self.connections.fetch_sub(1, Ordering::Relaxed);
                continue;
            }
            let (server, answer) = (Arc::clone(self), Arc::clone(&answer));
            let worker = move || {
                let _ = server.converse(stream, &*answer);
                server.connections.fetch_sub(1, Ordering::Relaxed);
            };
            if thread::Builder::new().spawn(worker).is_err() {
                self.connections.fetch_sub(1, Ordering::Relaxed);
            }
        }
    }

    /// Reads one request, and answers it.
    fn converse(&self, mut stream: TcpStream, answer: &impl Fn(&str) -> Answer) -> std::io::Result<()> {
        stream.set_write_timeout(Some(PATIENCE))?;
        let (with_body, answer) = match read_head(&mut stream)? {
            Head::Request { method, target, host } => match method.as_str() {
                _ if !self.is_own(&host) => {
                    (true, Answer::text(421, "this page is served to this machine alone"))
                }
                "GET" => (true, answer(&target)),
                "HEAD" => (false, answer(&target)),
                _ => (true, Answer::text(405, "only GET and HEAD are answered")),
            },
            Head::Malformed => (true, Answer::text(400, "this is no HTTP/1 request")),
            Head::TooLong => (true, Answer::text(431, "the request's headers are too long")),
            Head::TooSlow => (true, Answer::text(408, "the request did not come in time")),
        };
        let Answer { status, kind, body } = answer;
        let allow = if status == 405 { "Allow: GET, HEAD\r\n" } else { "" };
        let head = format!(
            "HTTP/1.1 {status} {}\r\nContent-Type: {kind}\r\nContent-Length: {}\r\nConnection: close\r\n\
             X-Content-Type-Options: nosniff\r\n{allow}\r\n",
            reason(status),
            body.len()
        );
        stream.write_all(head.as_bytes())?;
        if with_body {
            stream.write_all(body.as_bytes())?;
        }
        stream.flush()
    }

    fn is_own(&self, host: &str) -> bool {
        let port = self.address.port();
        ["127.0.0.1", "localhost"].iter().any(|name| host == format!("{name}:{port}"))
    }
}

enum Head {
    Request { method: String, target: String, host: String },
    Malformed,
    TooLong,
    TooSlow,
}

/// Reads up to the empty line after the headers.
fn read_head(stream: &mut TcpStream) -> std::io::Result<Head> {
    let end = Instant::now() + PATIENCE;
    let (mut head, mut piece) = (Vec::new(), [0; 4096]);
    loop {
        let left = end.saturating_duration_since(Instant::now());
        if left.is_zero() {
            return Ok(Head::TooSlow);
        }
        stream.set_read_timeout(Some(left))?;
        let count = match stream.read(&mut piece) {
            Ok(0) => return Ok(Head::Malformed),
            Ok(count) => count,
            Err(error) if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) => {
                return Ok(Head::TooSlow);
            }
            Err(error) if error.kind() == ErrorKind::Interrupted => continue,
            Err(error) => return Err(error),
        };
        head.extend_from_slice(&piece[..count]);
        let mut headers = [httparse::EMPTY_HEADER; MOST_HEADERS];
        let mut request = httparse::Request::new(&mut headers);
        match request.parse(&head) {
            Ok(httparse::Status::Complete(_)) => {
                let host = request.headers.iter().find(|h| h.name.eq_ignore_ascii_case("host"));
                let host = host.map_or(String::new(), |h| String::from_utf8_lossy(h.value).into_owned());
                let [method, target] =
                    [request.method, request.path].map(|s| s.unwrap_or_default().to_owned());
                return Ok(Head::Request { method, target, host });
            }
            Ok(httparse::Status::Partial) if head.len() < LONGEST_HEAD => {}
            Ok(httparse::Status::Partial) | Err(httparse::Error::TooManyHeaders) => return Ok(Head::TooLong),
            Err(_) => return Ok(Head::Malformed),
        }
    }
}

fn reason(status: u16) -> &'static str {
    match status {
        200 => "OK",
        400 => "Bad Request",
        404 => "Not Found",
        405 => "Method Not Allowed",
        408 => "Request Timeout",
        421 => "Misdirected Request",
        431 => "Request Header Fields Too Large",
        _ => "",
    }
}
