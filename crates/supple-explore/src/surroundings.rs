use std::any::Any;

/// Hooks around an explorer's computations when it is embedded in another program, such as a Python interpreter.
pub trait Surroundings: Send + Sync {
    /// Called before each computation; what it returns is dropped after it.
    fn enter(&self) -> Box<dyn Any>;

    /// Why user-supplied functions called by computations failed, since the last call of this method.
    fn failure(&self) -> Option<String>;
}

/// No surroundings: the explorer is not embedded.
pub struct Alone;

impl Surroundings for Alone {
    fn enter(&self) -> Box<dyn Any> {
        Box::new(())
    }

    fn failure(&self) -> Option<String> {
        None
    }
}
