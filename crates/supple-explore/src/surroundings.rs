use std::any::Any;

/// What surrounds the computations of an explorer in a program that does more, such as an interpreter of Python.
pub trait Surroundings: Send + Sync {
    /// Called before each computation; what it returns is dropped after it.
    fn enter(&self) -> Box<dyn Any>;

    /// Why functions failed that are not supple's own and that computations called, since this was asked last.
    fn failure(&self) -> Option<String>;
}

/// Nothing else.
pub struct Alone;

impl Surroundings for Alone {
    fn enter(&self) -> Box<dyn Any> {
        Box::new(())
    }

    fn failure(&self) -> Option<String> {
        None
    }
}
