//! What files, folders and signals of others may not do to the program: each test is named for what once happened.
#![allow(clippy::unwrap_used)]

#[path = "../common/mod.rs"]
mod common;

mod bits;
mod files;
mod folders;
mod numbers;
#[cfg(unix)]
mod signals;
