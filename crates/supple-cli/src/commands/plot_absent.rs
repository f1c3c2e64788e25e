//! `supple plot` in a program that was built without figures.

use crate::arguments::PlotOptions;
use crate::failure::Failure;
use crate::outcome::Outcome;

/// Checks that this program can draw figures.
///
/// # Errors
/// Always; the message says how to build with figures.
pub fn check_figures() -> Result<(), Failure> {
    Err(Failure::usage(
        "this program was built without figures; build it with them by `cargo install --path crates/supple-cli \
         --features figures`, or run `cargo run --release --features figures -- ..`"
            .to_owned(),
    ))
}

/// `supple plot`
pub fn plot(_: &PlotOptions) -> Result<Outcome, Failure> {
    check_figures().map(|()| Outcome::Shortfall)
}
