//! A page with sliders for the parameters of a task, in the browser of this machine, with the real computations behind it.
//!
//! [`Explorer::open`] starts a server that answers 127.0.0.1 alone, and only those who know the token in its address. The
//! page asks by POST and hears by a WebSocket. Each open page has one worker per kind of question; of two questions of one
//! kind the newer one counts, and every answer says which design it is of.
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
