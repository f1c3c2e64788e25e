//! In place of machine code, on processors for which none is made.

use super::instructions::Part;

/// There is none.
#[derive(Debug)]
pub(super) enum Code {}

impl Code {
    pub fn new(_: &[Part], _: impl Iterator<Item = usize>, _: usize) -> Option<Self> {
        None
    }

    /// # Safety
    /// Cannot be called.
    pub unsafe fn run(&self, _: usize, _: *mut f64) {
        match *self {}
    }
}
