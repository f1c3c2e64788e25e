use supple_kernels::{Matrices, Scratch};
use supple_lqg::{Dimensions, Error};

use super::arrays::{Arrays, Checked};
use super::{Adjoints, Curvature, Points, System, Variation};
use crate::Channels;

/// A linear system whose matrices may differ from step to step, with quadratic costs: arrays of numbers, without
/// parameters.
///
/// ```text
/// x_{t+1} = A_t x_t + B_t u_t + c_t      y_t = C_t x_t + d_t
/// l_t = x'Q_t x + 2 x'S_t u + u'R_t u + q_t'x + r_t'u      l_N = x'Q_N x + q_N'x
/// ```
///
/// There are no factors 1/2, as in task files. Its derivatives are its arrays; second derivatives of the dynamics are 0.
///
/// ```
/// use supple_lqg::constant;
/// use supple_model::system::{Arrays, Curvature, RollOut, Sequence, System};
/// use supple_model::{Matrices, Scratch, Trajectory};
///
/// // x+ = 0.9 x + u over 3 steps, with the cost x^2 + 0.1 u^2, from x = 1 without control.
/// let [a, one, r] = [0.9, 1.0, 0.1].map(|entry| constant(&[[entry]]));
/// let system = Sequence::new(3, &Arrays::new([a, one.clone(), one.clone(), one, r]))?;
/// let (mut plan, mut scratch) = (Trajectory::zeros(system.dimensions(), 3), Scratch::new());
/// plan.states.vector_mut(0)[0] = 1.0;
/// let cost = system.roll_out(RollOut::Controls, &[], &mut plan, &mut scratch);
/// assert!((cost - (1.0 + 0.81 + 0.6561 + 0.531441)).abs() < 1e-12);
///
/// // Its derivatives at all points of the plan: [A B], and [l_zz | l_z].
/// let (mut dynamics, mut quadratics) = (Matrices::zeros(3, 1, 2), Matrices::zeros(4, 2, 3));
/// system.dynamics_jacobians(plan.points(), &[], &mut dynamics, &mut scratch);
/// system.cost_quadratics(plan.points(), &[], Curvature::Exact, &mut quadratics, &mut scratch);
/// assert_eq!((plan.points().times.of(2), dynamics.get(2, 0, 0), quadratics.get(2, 0, 0)), (2, 0.9, 2.0));
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[derive(Clone, Debug)]
pub struct Sequence {
    size: Dimensions,
    steps: usize,
    /// `[A B]`, n x (n + m).
    dynamics: Matrices,
    /// `c`, length n.
    drift: Option<Matrices>,
    /// `C`, p x n.
    measurement: Matrices,
    /// `d`, length p.
    offset: Option<Matrices>,
    /// `[l_zz | l_z at z = 0]`, (n + m) x (n + m + 1).
    cost: Matrices,
    /// The same of the final cost; that of the control is 0.
    last: Matrices,
    channels: Channels,
    picks: Option<Vec<usize>>,
}

impl Sequence {
    /// The system over `steps` steps, at least 1. States are named `x1`, `x2`...
    ///
    /// # Errors
    /// Where an array has a wrong shape or an entry that is not finite.
    pub fn new(steps: usize, arrays: &Arrays) -> Result<Self, Error> {
        let Checked { size, dynamics, cost, last } = arrays.check(steps)?;
        let Arrays { C, c, d, .. } = arrays;
        let names = (1..=size.states).map(|i| format!("x{i}")).collect();
        let picks = if d.is_none() { picks(C) } else { None };
        Ok(Self {
            size,
            steps,
            dynamics,
            drift: c.clone(),
            measurement: C.clone(),
            offset: d.clone(),
            cost,
            last,
            channels: Channels::plain(names, size),
            picks,
        })
    }

    /// The same with other names and units.
    ///
    /// # Errors
    /// Where there is not one for each state, control and measurement.
    pub fn with_channels(mut self, channels: Channels) -> Result<Self, Error> {
        let Channels { states, controls, measurements } = &channels;
        let parts = [
            ("names of states", states.len(), self.size.states),
            ("names of controls", controls.len(), self.size.controls),
            ("names of measurements", measurements.len(), self.size.measurements),
        ];
        for (what, found, expected) in parts {
            if found != expected {
                return Err(Error::Shape { what: format!("the list of {what}"), found, expected });
            }
        }
        self.channels = channels;
        Ok(self)
    }
}

/// The state that each row of `C` selects, if in every matrix each row is 1 there and 0 elsewhere.
#[allow(non_snake_case)]
fn picks(C: &Matrices) -> Option<Vec<usize>> {
    let state_of = |t: usize, i: usize| {
        let state = (0..C.cols()).position(|j| C.get(t, i, j) != 0.0)?;
        let alone = C.get(t, i, state) == 1.0 && (state + 1..C.cols()).all(|j| C.get(t, i, j) == 0.0);
        alone.then_some(state)
    };
    let picks: Vec<usize> = (0..C.rows()).map(|i| state_of(0, i)).collect::<Option<_>>()?;
    let same = |t: usize| picks.iter().enumerate().all(|(i, &state)| state_of(t, i) == Some(state));
    (1..C.count()).all(same).then_some(picks)
}

/// `row [x; u]`
fn times(row: &[f64], x: &[f64], u: &[f64]) -> f64 {
    row.iter().zip(x.iter().chain(u)).fold(0.0, |sum, (entry, z)| sum + entry * z)
}

/// `out = M [x; u]`, or with a vector `M [x; u] + vector`, `M` by padded rows.
fn affine(matrices: &Matrices, vectors: Option<&Matrices>, t: usize, x: &[f64], u: &[f64], out: &mut [f64]) {
    for (out, row) in out.iter_mut().zip(matrices.at(t).chunks_exact(matrices.stride())) {
        *out = times(row, x, u);
    }
    if let Some(vectors) = vectors {
        out.iter_mut().zip(vectors.vector(t)).for_each(|(out, entry)| *out += entry);
    }
}

/// `z'(l_zz z / 2 + l_z)` with the matrix `[l_zz | l_z]` at `z = 0`, and `z = [x; u]`.
fn quadratic(quadratics: &Matrices, t: usize, x: &[f64], u: &[f64]) -> f64 {
    let joint = quadratics.rows();
    let rows = quadratics.at(t).chunks_exact(quadratics.stride());
    rows.zip(x.iter().chain(u)).fold(0.0, |sum, (row, z)| sum + z * (0.5 * times(row, x, u) + row[joint]))
}

/// Writes `[l_zz | l_z]` at `z = [x; u]`, from that at `z = 0`.
fn write_quadratic(from: &[f64], joint: usize, stride: usize, x: &[f64], u: &[f64], out: &mut [f64]) {
    out.copy_from_slice(from);
    for row in out.chunks_exact_mut(stride).take(x.len() + u.len()) {
        row[joint] += times(row, x, u);
    }
}

impl System for Sequence {
    fn dimensions(&self) -> Dimensions {
        self.size
    }

    fn state_names(&self) -> Vec<String> {
        self.channels.states.iter().map(|channel| channel.name.clone()).collect()
    }

    fn channels(&self) -> Channels {
        self.channels.clone()
    }

    fn steps(&self) -> Option<usize> {
        Some(self.steps)
    }

    fn depends_on(&self, parameters: usize) -> Vec<bool> {
        vec![false; parameters]
    }

    fn step(&self, t: usize, x: &[f64], u: &[f64], _: &[f64], next: &mut [f64]) {
        affine(&self.dynamics, self.drift.as_ref(), t, x, u, next);
    }

    fn observe(&self, t: usize, x: &[f64], _: &[f64], y: &mut [f64]) {
        affine(&self.measurement, self.offset.as_ref(), t, x, &[], y);
    }

    fn picks(&self) -> Option<&[usize]> {
        self.picks.as_deref()
    }

    fn stage_cost(&self, t: usize, x: &[f64], u: &[f64], _: &[f64], _: &mut Scratch) -> f64 {
        quadratic(&self.cost, t, x, u)
    }

    fn final_cost(&self, x: &[f64], _: &[f64], _: &mut Scratch) -> f64 {
        quadratic(&self.last, 0, x, &[])
    }

    fn dynamics_jacobians(&self, at: Points, _: &[f64], out: &mut Matrices, _: &mut Scratch) {
        for i in 0..at.stages {
            out.at_mut(i).copy_from_slice(self.dynamics.at(at.times.of(i)));
        }
    }

    fn measurement_jacobians(&self, at: Points, _: &[f64], out: &mut Matrices, _: &mut Scratch) {
        for i in 0..at.count() {
            out.at_mut(i).copy_from_slice(self.measurement.at(at.times.of(i)));
        }
    }

    fn cost_quadratics(&self, at: Points, _: &[f64], _: Curvature, out: &mut Matrices, _: &mut Scratch) {
        let (joint, stride) = (self.size.joint(), out.stride());
        for i in 0..at.count() {
            let (from, u) = if i < at.stages {
                (self.cost.at(at.times.of(i)), at.controls.vector(i))
            } else {
                (self.last.at(0), [].as_slice())
            };
            write_quadratic(from, joint, stride, at.states.vector(i), u, out.at_mut(i));
        }
    }

    fn add_dynamics_curvature(&self, _: Points, _: &[f64], _: &Matrices, _: &mut Matrices, _: &mut Scratch) {}

    /// The knots do not depend on the trajectory, except for the gradient of the cost, which has no adjoint.
    fn has_smooth_gauss_newton(&self) -> bool {
        true
    }

    fn contract(&self, _: Points, _: &[f64], _: Adjoints, _: &mut Matrices, _: &mut [f64], _: &mut Scratch) {}

    /// There are no parameters.
    fn add_parameter_gradient(
        &self,
        _: Points,
        _: &[f64],
        _: &Matrices,
        _: Option<Variation>,
        _: &mut [f64],
        _: &mut Scratch,
    ) {
    }
}
