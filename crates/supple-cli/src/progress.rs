use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, Once};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use supple::halt;
use supple_study::Watch;

/// Set by Ctrl-C and by SIGTERM: long work stops soon and keeps what it found.
pub static STOP: AtomicBool = AtomicBool::new(false);

/// Handles Ctrl-C and SIGTERM from now on: what is under way ends within moments; a second signal terminates the program.
pub fn listen() {
    static LISTENS: Once = Once::new();
    LISTENS.call_once(|| {
        let handler = || {
            if STOP.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
            halt::request(true);
        };
        // Where signals cannot be listened for, Ctrl-C ends the program as usual.
        let _ = ctrlc::set_handler(handler);
    });
}

/// Ends the program at Ctrl-C or SIGTERM, as asked for, from now on.
pub fn end_when_asked() {
    // Where signals cannot be listened for, Ctrl-C ends the program as usual.
    let _ = ctrlc::set_handler(|| std::process::exit(0));
}

/// Does long work with a bar, until it is done or a signal stops it.
pub fn watched<T>(work: impl FnOnce(Watch) -> T) -> T {
    listen();
    let bar = Bar::new();
    let found = work(Watch { progress: &bar, stop: &STOP });
    bar.finish();
    found
}

/// What is being done, with the time since, on standard error; gone when it is dropped where that is a terminal.
pub struct Waiting(Bar);

impl Waiting {
    pub fn new() -> Self {
        Self(Bar::new())
    }

    /// Shows another text.
    pub fn say(&self, what: &str) {
        supple_study::Progress::begin(&self.0, what, 0, 0);
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.finish();
    }
}

/// A bar with rate and time left on standard error, where that is a terminal; lines of text from time to time elsewhere.
struct Bar {
    bar: ProgressBar,
    lines: Option<Lines>,
}

impl Bar {
    fn new() -> Self {
        let lines = (!std::io::stderr().is_terminal()).then(Lines::begin);
        let bar = Self { bar: ProgressBar::new(0), lines };
        bar.bar.set_message("working");
        bar.show(0, 0);
        bar.bar.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// Shows what is known once `done` parts of `total` have been done just now.
    fn show(&self, done: u64, total: u64) {
        if let Ok(style) = ProgressStyle::with_template(template(done, total)) {
            self.bar.set_style(style);
        }
    }

    fn tell(&self, change: impl FnOnce(&mut Stage)) {
        if let Some(lines) = &self.lines {
            lines.change(change);
        }
    }

    fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

/// Lines about long work in logs and pipes: none in its first ten seconds, then one for every stage and every ten seconds,
/// and one a minute once it has lasted a minute.
struct Lines {
    state: Arc<Mutex<Stage>>,
    /// Dropped to end the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// What is being done.
#[derive(Clone, Debug, Default, PartialEq)]
struct Stage {
    what: String,
    done: u64,
    total: u64,
    said: String,
}

/// How often the thread looks for what is new.
const LOOK: Duration = Duration::from_millis(500);

impl Lines {
    fn begin() -> Self {
        let state = Arc::new(Mutex::new(Stage { what: "working".to_owned(), ..Stage::default() }));
        let (end, ended) = channel();
        let seen = Arc::clone(&state);
        let thread = std::thread::Builder::new().name("progress".to_owned()).spawn(move || write_lines(&seen, &ended));
        Self { state, end: Some(end), thread: thread.ok() }
    }

    fn change(&self, change: impl FnOnce(&mut Stage)) {
        if let Ok(mut stage) = self.state.lock() {
            change(&mut stage);
        }
    }
}

impl Drop for Lines {
    fn drop(&mut self) {
        self.end = None;
        // Its last line is written before what follows on standard error.
        if let Some(thread) = self.thread.take() {
            let _ = thread.join();
        }
    }
}

fn write_lines(state: &Mutex<Stage>, ended: &Receiver<()>) {
    let mut clock = Clock { began: Instant::now(), last: None };
    while ended.recv_timeout(LOOK) == Err(RecvTimeoutError::Timeout) {
        let Ok(stage) = state.lock().map(|stage| stage.clone()) else { return };
        if let Some(line) = clock.line(&stage, Instant::now()) {
            // Nobody is left to tell where this fails.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }
}

/// When the last line was written, and about what.
struct Clock {
    began: Instant,
    last: Option<(Instant, String)>,
}

impl Clock {
    /// The line that is due.
    fn line(&mut self, stage: &Stage, now: Instant) -> Option<String> {
        const SHORT: Duration = Duration::from_secs(10);
        const LONG: Duration = Duration::from_secs(60);
        let since = now.duration_since(self.began);
        let is_due = match &self.last {
            None => since >= SHORT,
            Some((last, what)) => {
                let wait = if since < LONG { SHORT } else { LONG };
                *what != stage.what || now.duration_since(*last) >= wait
            }
        };
        is_due.then(|| {
            self.last = Some((now, stage.what.clone()));
            let Stage { what, done, total, said } = stage;
            let count = if *total > 0 { format!(", {done} of {total}") } else { String::new() };
            let said = if said.is_empty() { String::new() } else { format!(" ({said})") };
            format!("{what}{count}, {} s{said}", since.as_secs())
        })
    }
}

/// What a bar shows: no count where the number of parts is not known, no rate and time left before a part is done.
fn template(done: u64, total: u64) -> &'static str {
    match (done, total) {
        (_, 0) => "{msg} {spinner} {elapsed}",
        (0, _) => "{msg} {wide_bar} {pos} of {len}, {elapsed}",
        _ => "{msg} {wide_bar} {pos} of {len}, {per_sec}, {eta} left",
    }
}

impl supple_study::Progress for Bar {
    fn begin(&self, what: &str, done: u64, total: u64) {
        self.bar.reset();
        self.bar.set_length(total);
        self.bar.set_position(done);
        self.bar.reset_eta();
        self.bar.set_message(what.to_owned());
        self.show(0, total);
        let said = String::new();
        self.tell(|stage| *stage = Stage { what: what.to_owned(), done, total, said });
    }

    fn advance(&self, parts: u64) {
        self.bar.inc(parts);
        self.show(parts, self.bar.length().unwrap_or(0));
        self.tell(|stage| stage.done += parts);
    }

    fn say(&self, message: &str) {
        self.bar.set_message(message.to_owned());
        self.tell(|stage| message.clone_into(&mut stage.said));
    }
}

#[cfg(test)]
mod tests {
    use supple_study::Progress;

    use super::*;

    /// `supple evaluate` and `supple check` showed a full bar, "0 of 0, 0/s, 0s left", as long as they ran.
    #[test]
    fn work_of_unknown_length_shows_no_count_and_no_time_left() {
        for done in [0, 3] {
            let shown = template(done, 0);
            assert!(!shown.contains("{len}") && !shown.contains("{eta}") && shown.contains("{elapsed}"), "{shown}");
        }
        assert!(!template(0, 4).contains("{eta}") && template(1, 4).contains("{eta}"));
        for (done, total) in [(0, 0), (0, 4), (1, 4)] {
            assert!(ProgressStyle::with_template(template(done, total)).is_ok());
        }
        let bar = Bar { bar: ProgressBar::hidden(), lines: Some(Lines::begin()) };
        bar.begin("parts", 1, 4);
        bar.advance(2);
        assert_eq!((bar.bar.position(), bar.bar.length()), (3, Some(4)));
        let told = bar.lines.as_ref().unwrap().state.lock().unwrap().clone();
        assert_eq!(told, Stage { what: "parts".into(), done: 3, total: 4, said: String::new() });
    }

    /// A piped `supple design` said nothing until its end.
    #[test]
    fn logs_have_a_line_by_stage_and_from_time_to_time() {
        let began = Instant::now();
        let mut clock = Clock { began, last: None };
        let mut stage = Stage { what: "starts".into(), total: 4, ..Stage::default() };
        let mut lines = Vec::new();
        for second in 0..=200 {
            if second == 25 {
                stage = Stage { what: "causes".into(), said: "slow".into(), ..Stage::default() };
            }
            stage.done += u64::from(second == 15);
            lines.extend(clock.line(&stage, began + Duration::from_secs(second)));
        }
        let expected = ["starts, 0 of 4, 10 s", "starts, 1 of 4, 20 s", "causes, 25 s (slow)", "causes, 35 s (slow)"];
        assert_eq!(lines[..4], expected);
        assert_eq!(lines[4..], [45, 55, 115, 175].map(|second| format!("causes, {second} s (slow)")));
    }
}
