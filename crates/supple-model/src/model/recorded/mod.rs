use serde::{Deserialize, Serialize};
use supple_kernels::Scalar;
use supple_lqg::Dimensions;

use crate::channels::Channels;
use crate::physics::{Model, OwnCost, Point};

mod composition;
mod tape;

use composition::Composition;
pub use tape::{Instruction, Tape, TapeError, TapeParts};

/// A model written by another program: its functions as [`Tape`]s.
///
/// They are differentiated and compiled like the physics of any other model. Its own cost is added to those of the
/// task.
///
/// ```
/// use supple_model::system::{Authored, System};
/// use supple_model::{Channels, Dimensions, Instruction, Recorded, RecordedParts, Tape, TapeError, TapeParts};
///
/// // x+ = x + time_step u and y = x. Values 0, 1 and 2 are x, u and the time step, 3 and 4 the results.
/// let tape = |instructions: Vec<Instruction>, output: u32| {
///     Tape::new(TapeParts { states: 1, controls: 1, instructions, outputs: vec![output], ..TapeParts::default() })
/// };
/// let step = tape(vec![Instruction::Mul(1, 2), Instruction::Add(0, 3)], 4)?;
/// let observe = tape(Vec::new(), 0)?;
/// let channels = Channels::plain(vec!["x".to_owned()], Dimensions { states: 1, controls: 1, measurements: 1 });
/// let model = Recorded::new(RecordedParts { channels, parameters: 0, step, observe, cost: None, final_cost: None })?;
/// let mut next = [0.0];
/// Authored::new(model, Vec::new(), 0.1, 0).step(0, &[1.0], &[2.0], &[], &mut next);
/// assert!((next[0] - 1.2).abs() < 1e-12);
/// assert!(matches!(tape(Vec::new(), 7), Err(TapeError::Output { value: 7, .. })));
/// # Ok::<(), TapeError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "RecordedParts", into = "RecordedParts")]
pub struct Recorded {
    parts: RecordedParts,
    /// Stage cost and final cost.
    costs: [Option<Composition>; 2],
}

/// The parts of a [`Recorded`] model, unchecked, as stored in files.
///
/// Example: [`Recorded`].
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RecordedParts {
    /// Names and units of states, controls and measurements.
    pub channels: Channels,
    /// How many parameters all tapes read.
    pub parameters: usize,
    /// `f(x, u; phi)`, n outputs.
    pub step: Tape,
    /// `g(x; phi)`, p outputs, of states and parameters only.
    pub observe: Tape,
    /// `l(x, u; phi)`, one output; `None` if the model has no cost of its own.
    pub cost: Option<Tape>,
    /// `l_N(x; phi)`, one output, of states and parameters only.
    pub final_cost: Option<Tape>,
}

impl RecordedParts {
    fn dimensions(&self) -> Dimensions {
        let Channels { states, controls, measurements } = &self.channels;
        Dimensions { states: states.len(), controls: controls.len(), measurements: measurements.len() }
    }

    /// Checks that a tape has the model's inputs and `outputs` results.
    fn check(&self, name: &'static str, tape: &Tape, outputs: usize, has_control: bool) -> Result<(), TapeError> {
        let (size, parts) = (self.dimensions(), tape.parts());
        let sizes = [
            ("states", parts.states, size.states),
            ("controls", parts.controls, size.controls),
            ("parameters", parts.parameters, self.parameters),
            ("outputs", tape.outputs(), outputs),
        ];
        if let Some((what, found, expected)) = sizes.into_iter().find(|(_, found, expected)| found != expected) {
            return Err(TapeError::Size { tape: name, what, found, expected });
        }
        if has_control {
            return Ok(());
        }
        let controls = &tape.needed()[size.states..size.joint()];
        match controls.iter().position(|&needed| needed) {
            Some(place) => Err(TapeError::ReadsControl { tape: name, control: place + 1 }),
            None => Ok(()),
        }
    }
}

impl TryFrom<RecordedParts> for Recorded {
    type Error = TapeError;

    fn try_from(parts: RecordedParts) -> Result<Self, TapeError> {
        Self::new(parts)
    }
}

impl From<Recorded> for RecordedParts {
    fn from(model: Recorded) -> Self {
        model.parts
    }
}

impl Recorded {
    /// The model of these parts.
    ///
    /// # Errors
    /// If a tape has the wrong size, or the measurement or final cost reads the controls.
    pub fn new(parts: RecordedParts) -> Result<Self, TapeError> {
        let size = parts.dimensions();
        parts.check("step", &parts.step, size.states, true)?;
        parts.check("observe", &parts.observe, size.measurements, false)?;
        for (name, tape, has_control) in [("cost", &parts.cost, true), ("final_cost", &parts.final_cost, false)] {
            if let Some(tape) = tape {
                parts.check(name, tape, 1, has_control)?;
            }
        }
        let costs = [&parts.cost, &parts.final_cost].map(|tape| tape.as_ref().map(Composition::of));
        Ok(Self { parts, costs })
    }

    /// The parts that it was built from.
    #[must_use]
    pub fn parts(&self) -> &RecordedParts {
        &self.parts
    }
}

fn run<S: Scalar>(tape: &Tape, at: &Point<S>, out: &mut [S]) {
    tape.run(at.x, at.u, at.phi, at.time_step, out);
}

impl Model for Recorded {
    fn dimensions(&self) -> Dimensions {
        self.parts.dimensions()
    }

    fn step<S: Scalar>(&self, at: &Point<S>, next: &mut [S]) {
        run(&self.parts.step, at, next);
    }

    fn observe<S: Scalar>(&self, at: &Point<S>, y: &mut [S]) {
        run(&self.parts.observe, at, y);
    }

    fn own_cost(&self, last: bool) -> Option<OwnCost> {
        let Composition { residual, convex, .. } = self.costs[usize::from(last)].as_ref()?;
        Some(OwnCost { residuals: residual.outputs(), convex: *convex })
    }

    fn own_residual<S: Scalar>(&self, at: &Point<S>, last: bool, out: &mut [S]) {
        if let Some(cost) = &self.costs[usize::from(last)] {
            run(&cost.residual, at, out);
        }
    }

    fn own_norm<S: Scalar>(&self, r: &[S], phi: &[S], time_step: S, last: bool) -> S {
        let mut cost = [S::zero()];
        if let Some(Composition { norm, .. }) = &self.costs[usize::from(last)] {
            norm.run(r, &[], phi, time_step, &mut cost);
        }
        cost[0]
    }

    fn state_names(&self) -> Vec<String> {
        self.parts.channels.states.iter().map(|state| state.name.clone()).collect()
    }

    fn channels(&self) -> Channels {
        self.parts.channels.clone()
    }
}
