use supple_kernels::{Matrices, Scratch};

use super::Points;
use crate::Channel;

/// One side of an enforced limit.
///
/// Example: [`Constraints`].
#[derive(Clone, Debug, PartialEq)]
pub struct KeptEnd {
    /// What is limited.
    pub channel: Channel,
    /// Whether it is the upper bound; otherwise it is the lower one.
    pub upper: bool,
}

/// Limits of a task that its plans enforce: `e(x, u) <= 0` at every step, with one excess `e` for each side of a limit.
///
/// Bounds on numbers that depend on the control apply at stages 0 to N - 1, the others at 1 to N: the first state is
/// given. Where a bound does not apply, its excess is minus infinity. `z = (x, u)`; matrices are those of [`Matrices`].
///
/// ```
/// use supple_model::TwoMass;
/// use supple_model::followed::Followed;
/// use supple_model::quantity::State;
/// use supple_model::system::{Authored, System};
///
/// let model = TwoMass {
///     mass: [0.8.into(), 0.4.into()],
///     damping: [60.0.into(), 35.0.into()],
///     stiffness: [300.0.into(), 200.0.into()],
///     contact_smoothing: 0.0.into(),
/// };
/// let limit = Followed::limit(State::new([2]), -1.0, 1.0).enforced();
/// let system = Authored::new(model, Vec::new(), 0.02, 0).following(vec![limit]);
/// let constraints = system.constraints().ok_or("a limit is enforced")?;
/// assert_eq!(constraints.bounds(&[]), [1.0, -1.0]);
/// let ends = constraints.ends();
/// assert_eq!((ends[0].channel.name.as_str(), ends[0].upper, ends[1].upper), ("x2", true, false));
/// # Ok::<(), &'static str>(())
/// ```
pub trait Constraints: Send + Sync {
    /// The ends, q of them, in the order of excesses.
    fn ends(&self) -> Vec<KeptEnd>;

    /// The bounds of the ends at `phi`, q of them, in the units of their numbers.
    fn bounds(&self, phi: &[f64]) -> Vec<f64>;

    /// How far each number is beyond its bound at every point: vectors of length q; minus infinity at the end for those
    /// that depend on the control.
    fn excesses(&self, at: Points, phi: &[f64], out: &mut Matrices, scratch: &mut Scratch);

    /// Whether the number of each end depends on the control, q of them.
    fn of_control(&self) -> &[bool];

    /// `e_z` at every point where any of the multipliers, vectors of length q, is not 0: q x (n + m); rows of bounds that do not
    /// apply there are zero. Other points are left as they are.
    fn excess_jacobians(
        &self,
        at: Points,
        phi: &[f64],
        multipliers: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    );

    /// Adds `(mu' e)_zz` to the square part of `out`, (n + m) x (n + m + 1), at every point; `multipliers` are vectors of
    /// length q.
    fn add_excess_curvature(
        &self,
        at: Points,
        phi: &[f64],
        multipliers: &Matrices,
        out: &mut Matrices,
        scratch: &mut Scratch,
    );

    /// Adds to `parameters` the gradient of `sum mu' e` with respect to `phi`, or, with a variation, its derivative
    /// along that variation.
    fn add_excess_parameter_gradient(
        &self,
        at: Points,
        phi: &[f64],
        multipliers: &Matrices,
        variation: Option<ExcessVariation>,
        parameters: &mut [f64],
        scratch: &mut Scratch,
    );
}

/// Variations of trajectory and multipliers, along which second derivatives are contracted.
#[derive(Clone, Copy, Debug)]
pub struct ExcessVariation<'a> {
    /// Of state and control together, vectors of length n + m, stages and end (where the control's part is 0).
    pub joint: &'a Matrices,
    /// Of the multipliers, vectors of length q.
    pub multipliers: &'a Matrices,
}

impl dyn Constraints + '_ {
    /// The excesses at all points, as new vectors, which a plan can reduce: those of the first state, which is given, are
    /// minus infinity. `ends` is their length q.
    pub fn excesses_at(&self, at: Points, phi: &[f64], ends: usize, scratch: &mut Scratch) -> Matrices {
        let mut excesses = Matrices::vectors(at.count(), ends);
        self.excesses(at, phi, &mut excesses, scratch);
        for i in (0..at.count()).filter(|&i| at.times.of(i) == 0) {
            let given =
                excesses.vector_mut(i).iter_mut().zip(self.of_control()).filter(|(_, of_control)| !**of_control);
            given.for_each(|(excess, _)| *excess = f64::NEG_INFINITY);
        }
        excesses
    }

    /// The excesses of the first of the points that do not depend on the control, with minus infinity for the others.
    pub fn excesses_of_first(&self, at: Points, phi: &[f64], scratch: &mut Scratch) -> Vec<f64> {
        let first = Points { stages: 1, has_end: false, ..at };
        let mut excesses = Matrices::vectors(first.count(), self.of_control().len());
        self.excesses(first, phi, &mut excesses, scratch);
        let all = excesses.vector(0).iter().zip(self.of_control());
        all.map(|(&excess, &of_control)| if of_control { f64::NEG_INFINITY } else { excess }).collect()
    }
}

/// Adds `slope e_z` to the last column of one matrix `[H | h]`, given by its padded rows, and `rho e_z' e_z` to its square
/// part.
pub fn add_excess(quadratic: &mut [f64], stride: usize, gradient: &[f64], slope: f64, rho: f64) {
    let joint = gradient.len();
    for (entry, row) in gradient.iter().zip(quadratic.chunks_exact_mut(stride)) {
        row[joint] += slope * entry;
        if rho * entry != 0.0 {
            row.iter_mut().zip(gradient).for_each(|(to, other)| *to += rho * entry * other);
        }
    }
}
