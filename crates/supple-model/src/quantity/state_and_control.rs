use supple_kernels::Scalar;

use super::{Known, Measurable, NoKeys, QuantityFile, Reach, Unfit, Vocabulary};
use crate::channels::Channel;
use crate::physics::Point;

/// All states and all controls, stacked.
///
/// Example: the [module](crate::quantity).
#[derive(Clone, Debug)]
pub struct StateAndControl {
    states: usize,
    controls: usize,
}

impl StateAndControl {
    /// All states and controls, given their numbers.
    #[must_use]
    pub fn new(states: usize, controls: usize) -> Self {
        Self { states, controls }
    }

    /// How many states there are.
    #[must_use]
    pub fn states(&self) -> usize {
        self.states
    }
}

impl QuantityFile for StateAndControl {
    type File = NoKeys;
    const OF_CONTROL: bool = true;

    fn build(_: NoKeys, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        Ok(Self::new(vocabulary.states.len(), vocabulary.controls()))
    }
}

impl Measurable for StateAndControl {
    const NAME: &'static str = "state_and_control";

    fn len(&self) -> usize {
        self.states + self.controls
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        let states = (0..self.states).map(|place| vocabulary.state_channel(place));
        states.chain(vocabulary.channels.controls.iter().cloned()).collect()
    }

    fn reach(&self) -> Reach {
        Reach { states: self.states, controls: self.controls, signals: 0 }
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &Known<S>, out: &mut [S]) {
        let (x, u) = out.split_at_mut(self.states);
        x.copy_from_slice(&at.x[..self.states]);
        u.copy_from_slice(at.u);
    }

    fn needs_signals(&self) -> bool {
        false
    }

    fn depends_on_control(&self) -> bool {
        Self::OF_CONTROL
    }
}
