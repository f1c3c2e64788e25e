use serde::Deserialize;
use supple_kernels::Scalar;

use super::{Known, Measurable, QuantityFile, Reach, Unfit, Vocabulary, pick};
use crate::channels::Channel;
use crate::physics::Point;

/// Controls, in their units.
///
/// Example: [`Cost`](crate::cost::Cost).
#[derive(Clone, Debug)]
pub struct Control {
    selected: Vec<usize>,
}

/// Controls, in their units.
#[derive(Debug, Deserialize)]
#[cfg_attr(feature = "schema", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct File {
    /// Names of the controls; default: all.
    select: Option<Vec<String>>,
}

impl Control {
    /// All controls, given their number.
    #[must_use]
    pub fn all(controls: usize) -> Self {
        Self { selected: (0..controls).collect() }
    }

    /// The indices of the controls.
    #[must_use]
    pub fn selected(&self) -> &[usize] {
        &self.selected
    }
}

impl QuantityFile for Control {
    type File = File;
    const OF_CONTROL: bool = true;

    fn build(file: File, vocabulary: &Vocabulary) -> Result<Self, Unfit> {
        let Some(select) = file.select else { return Ok(Self::all(vocabulary.controls())) };
        if select.is_empty() {
            return Err(Unfit::new("select", "name at least one"));
        }
        let names: Vec<&str> = vocabulary.channels.controls.iter().map(|channel| channel.name.as_str()).collect();
        let find = |name: &String| {
            let place = names.iter().position(|other| other == name);
            place.ok_or_else(|| Unfit::unknown("select", &format!("the model has no control `{name}`"), name, &names))
        };
        Ok(Self { selected: select.iter().map(find).collect::<Result<_, _>>()? })
    }
}

impl Measurable for Control {
    const NAME: &'static str = "control";

    fn len(&self) -> usize {
        self.selected.len()
    }

    fn channels(&self, vocabulary: &Vocabulary) -> Vec<Channel> {
        self.selected.iter().map(|&place| vocabulary.channels.controls[place].clone()).collect()
    }

    fn reach(&self) -> Reach {
        Reach { controls: Reach::beyond(&self.selected), ..Reach::default() }
    }

    fn evaluate<S: Scalar>(&self, at: &Point<S>, _: &Known<S>, out: &mut [S]) {
        pick(at.u, &self.selected, out);
    }

    fn needs_signals(&self) -> bool {
        false
    }

    fn depends_on_control(&self) -> bool {
        Self::OF_CONTROL
    }
}
