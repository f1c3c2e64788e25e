//! The server: files for the page, a channel to it, and its requests.

use std::collections::{BTreeMap, HashMap};
use std::net::{Ipv4Addr, Shutdown, TcpListener, TcpStream};
use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicU64, AtomicUsize, Ordering};
use std::sync::mpsc::RecvTimeoutError;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, RwLock};
use std::time::{Duration, SystemTime};

use serde::Serialize;
use serde_json::json;
use supple_study::{LoadedTask, StudyError};
use tungstenite::handshake::derive_accept_key;
use tungstenite::protocol::Role;
use tungstenite::{Message, WebSocket};

use crate::ask::Ask;
use crate::assets::{asset, page};
use crate::guard::{Guard, Shown as Proof};
use crate::http::Request;
use crate::knobs::changes;
use crate::save::OnScreen;
use crate::session::{Session, Shown};
use crate::surroundings::{Alone, Surroundings};

/// Pages that may be open at once.
const MOST_PAGES: usize = 8;
/// Connections that may be open at once, those of pages included. One more closes the one that has waited longest without
/// a request; if there is none, the new one is closed.
const MOST_CONNECTIONS: usize = 128;
/// How often to check whether a page is still open and the task file unchanged.
const PERIOD: Duration = Duration::from_millis(500);

/// A server of a page that explores a task.
pub struct Explorer {
    state: Arc<State>,
    /// `None` once it is being served; then the port is freed when serving ends.
    listener: Mutex<Option<TcpListener>>,
}

/// The design on screen, of the page that was moved last.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Screen {
    /// All parameters: names and values.
    pub parameters: Vec<(String, f64)>,
    /// Limits that were turned: names of their sliders, and limits.
    pub limits: Vec<(String, f64)>,
    /// Noise that was turned: names of its sliders, and factors on standard deviations.
    pub noise: Vec<(String, f64)>,
    /// Whether the task file was read again.
    pub reread: bool,
}

struct State {
    guard: Guard,
    port: u16,
    shown: Arc<RwLock<Arc<Shown>>>,
    surroundings: Arc<dyn Surroundings>,
    /// The task file, where changes of it are seen, and how to read it again.
    file: Option<PathBuf>,
    pages: Mutex<HashMap<u64, Arc<Session>>>,
    next: AtomicU64,
    /// The values of the page that was moved last.
    values: Mutex<Vec<f64>>,
    closed: AtomicBool,
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Explorer {
    /// Listens on 127.0.0.1, on the given port or any that is free. Where `file` is given, it is watched, and can be
    /// read again.
    ///
    /// # Errors
    /// Where the port is taken, or the system gives no random numbers.
    pub fn open(loaded: LoadedTask, file: Option<PathBuf>, port: Option<u16>) -> Result<Self, StudyError> {
        Self::open_within(Arc::new(Alone), loaded, file, port)
    }

    /// As [`open`](Self::open), in a program that does more.
    ///
    /// # Errors
    /// As of that.
    pub fn open_within(
        surroundings: Arc<dyn Surroundings>,
        loaded: LoadedTask,
        file: Option<PathBuf>,
        port: Option<u16>,
    ) -> Result<Self, StudyError> {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, port.unwrap_or(0))).map_err(|error| {
            let port = port.unwrap_or(0);
            StudyError::usage(format!(
                "port {port} cannot be used: {error}; choose another --port, or omit it to use any free port"
            ))
        })?;
        let io = |error: std::io::Error| StudyError::Io { what: "the server".to_owned(), error };
        let port = listener.local_addr().map_err(io)?.port();
        let shown = Shown::new(loaded, 0);
        let values = shown.knobs.iter().map(|knob| knob.start).collect();
        let state = State {
            guard: Guard::new(port).map_err(io)?,
            port,
            shown: Arc::new(RwLock::new(Arc::new(shown))),
            surroundings,
            file,
            pages: Mutex::default(),
            next: AtomicU64::new(1),
            values: Mutex::new(values),
            closed: AtomicBool::new(false),
        };
        Ok(Self { state: Arc::new(state), listener: Mutex::new(Some(listener)) })
    }

    /// The address of the page, with its token.
    pub fn address(&self) -> String {
        format!("http://127.0.0.1:{}/?token={}", self.state.port, self.state.guard.token())
    }

    /// The design on screen, of the page that was moved last.
    pub fn screen(&self) -> Screen {
        self.state.on_screen(|screen, reread| {
            let problem = &screen.loaded.problem;
            let changes = changes(problem, screen.knobs, screen.values);
            Screen {
                // Parameters are the first knobs, in their order.
                parameters: problem.parameters.names().into_iter().zip(screen.values.iter().copied()).collect(),
                limits: changes.limits.iter().map(|&(name, _, limit)| (name.to_owned(), limit)).collect(),
                noise: changes.noise.iter().map(|one| (one.name.to_owned(), one.factor)).collect(),
                reread,
            }
        })
    }

    /// The design on screen as a task, whose file has its parameters, limits and noise as its own.
    ///
    /// # Errors
    /// Where limits or noise were turned and the file cannot be edited.
    pub fn task(&self) -> Result<LoadedTask, StudyError> {
        self.state.on_screen(|screen, _| screen.task()).map_err(StudyError::Usage)
    }

    /// Whether it was told to end.
    pub fn is_closed(&self) -> bool {
        self.state.closed.load(Ordering::Relaxed)
    }

    /// Serves until [`close`](Self::close); once.
    pub fn serve(&self) {
        let Some(listener) = lock(&self.listener).take() else { return };
        let (open, silent) = (Arc::new(AtomicUsize::new(0)), Arc::new(Silent::default()));
        for (number, stream) in listener.incoming().enumerate() {
            if self.state.closed.load(Ordering::Relaxed) {
                break;
            }
            // A client that went before it was accepted.
            let Ok(stream) = stream else { continue };
            let is_full = open.load(Ordering::Relaxed) >= MOST_CONNECTIONS;
            if is_full && !silent.close_oldest() || silent.add(number, &stream).is_err() {
                continue;
            }
            open.fetch_add(1, Ordering::Relaxed);
            let (state, open, silent) = (Arc::clone(&self.state), Arc::clone(&open), Arc::clone(&silent));
            std::thread::spawn(move || {
                let request = Request::read(stream);
                silent.remove(number);
                if let Ok(request) = request {
                    state.answer(request);
                }
                open.fetch_sub(1, Ordering::Relaxed);
            });
        }
    }

    /// Ends all pages and the server.
    pub fn close(&self) {
        self.state.closed.store(true, Ordering::Relaxed);
        lock(&self.state.pages).drain().for_each(|(_, page)| page.close());
        // A server that was never served frees its port here; one that waits for the next connection is woken up.
        drop(lock(&self.listener).take());
        let _ = TcpStream::connect((Ipv4Addr::LOCALHOST, self.state.port));
    }
}

/// Connections that have not sent a whole request yet, by their numbers, which increase.
#[derive(Default)]
struct Silent(Mutex<BTreeMap<usize, TcpStream>>);

impl Silent {
    fn add(&self, number: usize, stream: &TcpStream) -> std::io::Result<()> {
        lock(&self.0).insert(number, stream.try_clone()?);
        Ok(())
    }

    fn remove(&self, number: usize) {
        lock(&self.0).remove(&number);
    }

    /// Closes the oldest one; false where there is none.
    fn close_oldest(&self) -> bool {
        let oldest = lock(&self.0).pop_first();
        // Its thread ends as soon as it reads.
        oldest.map(|(_, stream)| stream.shutdown(Shutdown::Both)).is_some()
    }
}

/// A parameter of an address.
fn query<'a>(url: &'a str, name: &str) -> Option<&'a str> {
    let (_, query) = url.split_once('?')?;
    query.split('&').find_map(|pair| pair.strip_prefix(name)?.strip_prefix('='))
}

/// What pages may do: load from this server, and show themselves in a frame of a notebook.
const POLICY: &str = "default-src 'self'; script-src 'self' 'unsafe-inline' 'unsafe-eval'; style-src 'self' 'unsafe-inline'; \
                      img-src 'self' data: blob:; connect-src 'self' ws://127.0.0.1:* ws://localhost:*; object-src 'none'; \
                      base-uri 'none'; form-action 'none'";

fn respond(request: Request, status: u16, kind: &str, text: &str) {
    let headers = [
        ("Content-Type", kind),
        ("Cache-Control", "no-store"),
        ("Referrer-Policy", "no-referrer"),
        ("X-Content-Type-Options", "nosniff"),
        ("Content-Security-Policy", POLICY),
    ];
    request.respond(status, &headers, text.as_bytes());
}

const PLAIN: &str = "text/plain; charset=utf-8";

impl State {
    /// The design on screen, and whether the task file was read again.
    fn on_screen<T>(&self, with: impl FnOnce(OnScreen, bool) -> T) -> T {
        let (shown, values) = {
            // Both are changed under the lock of the first.
            let shown = self.shown.read().unwrap_or_else(PoisonError::into_inner);
            (Arc::clone(&shown), lock(&self.values).clone())
        };
        let Shown { loaded, knobs, generation } = &*shown;
        with(OnScreen { loaded, knobs, values: &values }, *generation > 0)
    }

    fn answer(&self, request: Request) {
        let url = request.target.clone();
        let path = url.split('?').next().unwrap_or_default();
        let acts = request.method != "GET" || path == "/channel";
        let (host, origin) = (request.header("Host"), request.header("Origin"));
        let proof = Proof { token: query(&url, "token"), host, origin };
        if let Some(why) = self.guard.refusal(proof, acts) {
            return respond(request, 403, PLAIN, &format!("{why}\n"));
        }
        match (request.method.as_str(), path) {
            ("GET", "/") => respond(request, 200, "text/html; charset=utf-8", &page(self.guard.token())),
            ("GET", "/channel") => self.channel(request),
            ("POST", "/ask") => self.ask(request),
            ("POST", "/reload") => self.reload(request),
            ("GET", name) => match name.strip_prefix("/file/").and_then(asset) {
                Some(asset) => respond(request, 200, asset.kind, &asset.text),
                None => respond(request, 404, PLAIN, "there is no such page\n"),
            },
            _ => respond(request, 405, PLAIN, "not allowed\n"),
        }
    }

    /// A request of a page; its answer comes by the page's channel.
    fn ask(&self, request: Request) {
        let ask = match serde_json::from_str::<Ask>(&request.body) {
            Ok(ask) => ask,
            Err(why) => return respond(request, 400, PLAIN, &format!("the request cannot be read: {why}\n")),
        };
        if let Some(excess) = ask.excess() {
            return respond(request, 400, PLAIN, &format!("{excess}\n"));
        }
        let number = query(&request.target, "page").and_then(|number| number.parse().ok());
        let page = number.and_then(|number: u64| lock(&self.pages).get(&number).cloned());
        let Some(page) = page else {
            return respond(request, 410, PLAIN, "the connection of this page is closed; reload the page\n");
        };
        if ask.view == crate::ask::View::Evaluate {
            let shown = self.shown.read().unwrap_or_else(PoisonError::into_inner);
            if ask.generation == shown.generation && ask.values.len() == shown.knobs.len() {
                lock(&self.values).clone_from(&ask.values);
            }
        }
        page.ask(ask);
        request.respond(204, &[], &[]);
    }

    /// Reads the task file again; if it is invalid, the previous version stays in use.
    fn reload(&self, request: Request) {
        let Some(file) = &self.file else {
            return respond(request, 409, PLAIN, "a stored result is shown: there is no file to read again\n");
        };
        let kinds = self.shown.read().unwrap_or_else(PoisonError::into_inner).loaded.kinds.clone();
        match LoadedTask::load_with(file, kinds) {
            Err(error) => respond(request, 422, PLAIN, &format!("{error}\n")),
            Ok(loaded) => {
                let mut shown = self.shown.write().unwrap_or_else(PoisonError::into_inner);
                let generation = shown.generation + 1;
                *shown = Arc::new(Shown::new(loaded, generation));
                *lock(&self.values) = shown.knobs.iter().map(|knob| knob.start).collect();
                drop(shown);
                let pages: Vec<Arc<Session>> = lock(&self.pages).values().cloned().collect();
                for page in pages {
                    page.tell(&page.hello());
                }
                request.respond(204, &[], &[]);
            }
        }
    }

    /// When the task file was changed last.
    fn changed(&self) -> Option<SystemTime> {
        std::fs::metadata(self.file.as_ref()?).and_then(|data| data.modified()).ok()
    }

    /// Opens the channel of a page and pushes to it until the page has gone.
    fn channel(&self, request: Request) {
        let Some(key) = request.header("Sec-WebSocket-Key") else {
            return respond(request, 400, PLAIN, "a channel is a WebSocket\n");
        };
        if lock(&self.pages).len() >= MOST_PAGES {
            return respond(request, 503, PLAIN, &format!("{MOST_PAGES} pages are open: close one\n"));
        }
        let accept = derive_accept_key(key.as_bytes());
        let headers = [("Upgrade", "websocket"), ("Connection", "Upgrade"), ("Sec-WebSocket-Accept", accept.as_str())];
        let Ok(stream) = request.upgrade(&headers) else { return };
        let mut socket = WebSocket::from_raw_socket(stream, Role::Server, None);
        let (session, pushed) = Session::open(Arc::clone(&self.shown), Arc::clone(&self.surroundings));
        let number = self.next.fetch_add(1, Ordering::Relaxed);
        lock(&self.pages).insert(number, Arc::clone(&session));
        let mut hello = session.hello();
        hello["page"] = number.into();
        hello["watched"] = self.file.is_some().into();
        let mut seen = self.changed();
        let mut alive = socket.send(Message::text(hello.to_string())).is_ok();
        while alive && !self.closed.load(Ordering::Relaxed) {
            alive = match pushed.recv_timeout(PERIOD) {
                Ok(text) => socket.send(Message::text(text)).is_ok(),
                Err(RecvTimeoutError::Timeout) => socket.send(Message::Ping(Default::default())).is_ok(),
                Err(RecvTimeoutError::Disconnected) => false,
            };
            let now = self.changed();
            if now != seen {
                seen = now;
                alive &= socket.send(Message::text(json!({ "kind": "changed" }).to_string())).is_ok();
            }
        }
        lock(&self.pages).remove(&number);
        session.close();
    }
}
