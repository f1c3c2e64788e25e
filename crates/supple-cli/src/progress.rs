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

/// A bar with rate and time left on standard error, where that is a terminal.
struct Bar(ProgressBar);

impl Bar {
    fn new() -> Self {
        let bar = ProgressBar::new(0);
        let template = "{msg} {wide_bar} {pos} of {len}, {per_sec}, {eta} left";
        if let Ok(style) = ProgressStyle::with_template(template) {
            bar.set_style(style);
        }
        bar.enable_steady_tick(Duration::from_millis(100));
        Self(bar)
    }

    fn finish(&self) {
        self.0.finish_and_clear();
    }
}

impl supple_study::Progress for Bar {
    fn begin(&self, what: &str, done: u64, total: u64) {
        self.0.reset();
        self.0.set_length(total);
        self.0.set_position(done);
        self.0.reset_eta();
        self.0.set_message(what.to_owned());
    }

    fn advance(&self, parts: u64) {
        self.0.inc(parts);
    }

    fn say(&self, message: &str) {
        self.0.set_message(message.to_owned());
    }
}
