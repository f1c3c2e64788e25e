use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, Once};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use indicatif::{ProgressBar, ProgressStyle};
use supple::{Stop, halt};
use supple_study::Watch;

/// Set by Ctrl-C and by SIGTERM: long work stops soon and keeps what it found.
pub static STOP: AtomicBool = AtomicBool::new(false);

/// Handles Ctrl-C and SIGTERM from now on: running work stops within moments; a second signal terminates the program.
pub fn listen() {
    static LISTENS: Once = Once::new();
    LISTENS.call_once(|| {
        let handler = || {
            if STOP.swap(true, Ordering::SeqCst) {
                std::process::exit(130);
            }
            halt::request(true);
        };
        // If no handler can be installed, Ctrl-C ends the program as usual.
        let _ = ctrlc::set_handler(handler);
    });
}

/// From now on, Ctrl-C or SIGTERM ends the program with exit code 0, as the user requested it.
pub fn end_when_asked() {
    // If no handler can be installed, Ctrl-C ends the program as usual.
    let _ = ctrlc::set_handler(|| std::process::exit(0));
}

/// Runs long work with a progress bar, until it is done or a signal stops it.
pub fn watched<T>(work: impl FnOnce(Watch) -> T) -> T {
    listen();
    let bar = Bar::new();
    let found = work(Watch { progress: &bar, stop: Stop::when(&STOP) });
    bar.finish();
    found
}

/// The current activity and elapsed time on standard error; on a terminal, cleared when dropped.
pub struct Waiting(Bar);

impl Waiting {
    pub fn new() -> Self {
        Self(Bar::new())
    }

    /// Changes the text.
    pub fn say(&self, what: &str) {
        supple_study::Progress::begin(&self.0, what, 0, 0);
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.finish();
    }
}

/// On a terminal: a bar with rate and time left on standard error; otherwise, periodic lines of text.
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

    /// Chooses what to display, given that `done` of `total` parts have just been completed.
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

/// Progress lines for logs and pipes: none in the first ten seconds, then one per stage and every ten seconds;
/// after the first minute, one per minute.
struct Lines {
    state: Arc<Mutex<Stage>>,
    /// Dropped to end the thread.
    end: Option<Sender<()>>,
    thread: Option<JoinHandle<()>>,
}

/// The current activity.
#[derive(Clone, Debug, Default, PartialEq)]
struct Stage {
    what: String,
    done: u64,
    total: u64,
    said: String,
}

/// How often the thread checks for changes.
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
        // Wait for the thread, so that its last line precedes any later output on standard error.
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
            // If standard error cannot be written, there is no way to report that.
            let _ = writeln!(std::io::stderr(), "{line}");
        }
    }
}

/// When the last line was written, and for which activity.
struct Clock {
    began: Instant,
    last: Option<(Instant, String)>,
}

impl Clock {
    /// The next line, if one is due.
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

/// The bar's template: no count if the total is unknown; no rate and time left before the first part is done.
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
