use std::sync::Once;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

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

/// What is being done, with the time since, on standard error, where that is a terminal; gone when it is dropped.
pub struct Waiting(Bar);

impl Waiting {
    pub fn new() -> Self {
        Self(Bar::new())
    }

    /// Shows another text.
    pub fn say(&self, what: &str) {
        self.0.0.set_message(what.to_owned());
    }
}

impl Drop for Waiting {
    fn drop(&mut self) {
        self.0.finish();
    }
}

/// A bar with rate and time left on standard error, where that is a terminal.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let bar = Self(ProgressBar::new(0));
        bar.0.set_message("working");
        bar.show(0, 0);
        bar.0.enable_steady_tick(Duration::from_millis(100));
        bar
    }

    /// Shows what is known once `done` parts of `total` have been done just now.
    fn show(&self, done: u64, total: u64) {
        if let Ok(style) = ProgressStyle::with_template(template(done, total)) {
            self.0.set_style(style);
        }
    }

    fn finish(&self) {
        self.0.finish_and_clear();
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
        self.0.reset();
        self.0.set_length(total);
        self.0.set_position(done);
        self.0.reset_eta();
        self.0.set_message(what.to_owned());
        self.show(0, total);
    }

    fn advance(&self, parts: u64) {
        self.0.inc(parts);
        self.show(parts, self.0.length().unwrap_or(0));
    }

    fn say(&self, message: &str) {
        self.0.set_message(message.to_owned());
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
        let bar = Bar(ProgressBar::hidden());
        bar.begin("parts", 1, 4);
        bar.advance(2);
        assert_eq!((bar.0.position(), bar.0.length()), (3, Some(4)));
    }
}
