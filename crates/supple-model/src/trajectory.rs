use supple_kernels::Matrices;

use supple_lqg::Dimensions;

/// States at steps 0 to N and controls at steps 0 to N - 1.
///
/// Example: [`Sequence`](crate::system::Sequence).
#[derive(Clone, Debug, PartialEq)]
pub struct Trajectory {
    /// N + 1 vectors of length n.
    pub states: Matrices,
    /// N vectors of length m.
    pub controls: Matrices,
}

impl Trajectory {
    /// Zeros over `steps` steps.
    #[must_use]
    pub fn zeros(dimensions: Dimensions, steps: usize) -> Self {
        Self {
            states: Matrices::vectors(steps + 1, dimensions.states),
            controls: Matrices::vectors(steps, dimensions.controls),
        }
    }

    /// How many steps it has.
    #[must_use]
    pub fn steps(&self) -> usize {
        self.controls.count()
    }

    /// All its points, end included, from step 0 on.
    #[must_use]
    pub fn points(&self) -> Points<'_> {
        Points {
            states: &self.states,
            controls: &self.controls,
            stages: self.steps(),
            has_end: true,
            times: Times::From(0),
        }
    }
}

/// The time of a step, s: `step` times `time_step` without spurious digits from rounding, 0.036 rather than
/// 0.036000000000000004. A product that is not a short decimal is returned unchanged.
///
/// ```
/// assert_ne!(9.0 * 0.004, 0.036);
/// assert_eq!(supple_model::time_of(9, 0.004), 0.036);
/// ```
#[must_use]
pub fn time_of(step: usize, time_step: f64) -> f64 {
    let product = step as f64 * time_step;
    match format!("{product:.11e}").parse::<f64>() {
        Ok(short) if (short - product).abs() <= 2.0 * f64::EPSILON * product => short,
        _ => product,
    }
}

/// A batch of points: `stages` pairs of state and control, and one state more where the batch has an end.
///
/// Example: [`Sequence`](crate::system::Sequence).
#[derive(Clone, Copy, Debug)]
pub struct Points<'a> {
    /// States, vectors of length n.
    pub states: &'a Matrices,
    /// Controls, vectors of length m.
    pub controls: &'a Matrices,
    /// How many points have a control.
    pub stages: usize,
    /// Whether state number `stages` is the end of a trajectory, with the final cost.
    pub has_end: bool,
    /// Which step each point is at.
    pub times: Times,
}

impl Points<'_> {
    /// How many states there are.
    #[must_use]
    pub fn count(&self) -> usize {
        self.stages + usize::from(self.has_end)
    }
}

/// Which steps the points of a batch are at.
///
/// Example: [`Sequence`](crate::system::Sequence).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Times {
    /// Point i is at this step plus i: a part of a trajectory.
    From(usize),
    /// All points are at this step: samples that advance in lockstep.
    At(usize),
}

impl Times {
    /// The step that point `i` is at.
    #[must_use]
    pub fn of(self, i: usize) -> usize {
        match self {
            Self::From(first) => first + i,
            Self::At(step) => step,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::time_of;

    #[test]
    fn times_of_steps_print_as_short_as_the_time_step() {
        assert_ne!((9.0 * 0.004).to_string(), "0.036");
        assert_eq!(time_of(9, 0.004).to_string(), "0.036");
        for (time_step, decimals) in [(0.02, 2), (2.5e-4, 5), (0.004, 3), (1e-3, 3), (1e-6, 6), (0.1, 1)] {
            for step in 0..20_000 {
                let time = time_of(step, time_step);
                assert_eq!(format!("{time:.decimals$}").parse(), Ok(time), "{step} steps of {time_step}");
                assert!((time - step as f64 * time_step).abs() <= 2.0 * f64::EPSILON * time);
            }
        }
    }

    #[test]
    fn times_that_are_no_short_decimals_are_products() {
        for step in [1, 2, 7, 240, 12_345] {
            for time_step in [1.0 / 240.0, 1.0 / 3.0, 0.1 + 1e-14] {
                assert_eq!(
                    time_of(step, time_step),
                    if step == 240 && time_step == 1.0 / 240.0 { 1.0 } else { step as f64 * time_step }
                );
            }
        }
    }
}
