//! Writes robots as MJCF, the only format that holds everything in a [`Robot`](crate::Robot) except its visual meshes.

mod bodies;
mod equipment;
mod mended;
mod mjcf;
mod rotation;
mod text;

pub use mjcf::{Written, mjcf};
