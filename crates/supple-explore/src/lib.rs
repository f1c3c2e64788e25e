//! A page with sliders for the parameters of a task, served to the browser of this machine.
//!
//! [`Explorer::open`] starts a server that answers 127.0.0.1 alone, and only those who know the token in its address.
//! The page sends requests by POST and receives results over a WebSocket. Each page has one worker per kind of request;
//! a newer request replaces a pending one of the same kind, and each response identifies its design.
//!
//! ```text
//! page -> server (guard) -> session -> slot by kind -> knobs -> evaluate, map, search, rollouts, sensor, save -> page
//! ```
mod ask;
mod assets;
mod curves;
mod evaluate;
mod guard;
mod http;
mod knobs;
mod map;
mod noise_text;
mod rollouts;
mod save;
mod search;
mod sensor;
mod server;
mod session;
mod slot;
mod surroundings;

pub use server::{Explorer, Screen};
pub use surroundings::Surroundings;
