//! Robots written out: as MJCF, which is the format that has all that a [`Robot`](crate::Robot) holds but its visual meshes.

mod bodies;
mod equipment;
mod mended;
mod mjcf;
mod rotation;
mod text;

pub use mjcf::{Written, mjcf};
