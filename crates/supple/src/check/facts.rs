use nalgebra::DMatrix;
use serde::Serialize;
use supple_kernels::Matrices;
use supple_lqg::Noise;
use supple_lqg::spectral_radius;

use crate::plan::Plan;
use crate::problem::Task;

/// A property of the knots that affects how reliable the numbers are.
///
/// Example: [`check`](crate::check::check()).
#[derive(Clone, Debug, Serialize)]
#[non_exhaustive]
pub struct Fact {
    /// Name of the property.
    pub name: String,
    /// Its value.
    pub value: f64,
    /// What the value means for this plan.
    pub note: String,
}

/// Conditioning and observability of the knots of a plan.
pub(super) fn facts(task: &Task, plan: &Plan, noise: &Noise) -> Vec<Fact> {
    let n = plan.knots.dimensions.states;
    let radius =
        (0..plan.trajectory.steps()).map(|t| spectral_radius(part(&plan.knots.dynamics, t, n))).fold(0.0, f64::max);
    let note = if radius > 1.0 + 1e-9 {
        "above 1: unstable at some step; if the robot itself is stable, the time step is too long"
    } else {
        "at most 1: no step is unstable"
    };
    let mut facts = vec![Fact { name: "largest spectral radius of A".into(), value: radius, note: note.into() }];
    facts.extend(observability(task, plan, noise));
    facts
}

/// The first `cols` columns of matrix `t`.
fn part(matrices: &Matrices, t: usize, cols: usize) -> DMatrix<f64> {
    DMatrix::from_fn(matrices.rows(), cols, |i, j| matrices.get(t, i, j))
}

/// Eigenvalues of the observability Gramian `sum Phi_t' C' V^-1 C Phi_t`, `Phi_t = A_{t-1}...A_0`, each state scaled
/// by its initial standard deviation if that is not 0. Over many steps, modes that grow hide all others by rounding, although
/// more steps never show less. So if fewer steps (1, 2, 4, ..) show more directions, those with the best condition are taken.
/// Empty if the Gramian of the first step is not finite.
fn observability(task: &Task, plan: &Plan, noise: &Noise) -> Vec<Fact> {
    let size = plan.knots.dimensions;
    let (n, p) = (size.states, size.measurements);
    let mut phi = DMatrix::from_fn(n, n, |i, j| {
        let deviation = noise.initial.get(0, i, i).max(0.0).sqrt();
        if i == j { if deviation > 0.0 { deviation } else { 1.0 } } else { 0.0 }
    });
    let mut gramian: DMatrix<f64> = DMatrix::zeros(n, n);
    let steps = plan.trajectory.steps();
    let mut found: Vec<Seen> = Vec::new();
    for t in 0..=steps {
        let seen = part(&plan.knots.measurement, t, n) * &phi;
        let Some(v) = part(&noise.measurement, t, p).cholesky() else { return Vec::new() };
        gramian += seen.transpose() * v.solve(&seen);
        if gramian.iter().any(|entry| !entry.is_finite()) {
            break;
        }
        if t == steps || (t + 1).is_power_of_two() {
            found.push(Seen::of(gramian.clone()));
        }
        if t < steps {
            phi = part(&plan.knots.dynamics, t, n) * phi;
        }
    }
    let rank = found.iter().map(|seen| seen.rank).max().unwrap_or(0);
    let whole = found.last().filter(|seen| seen.rank == rank);
    let best = found.iter().filter(|seen| seen.rank == rank).min_by(|a, b| a.condition.total_cmp(&b.condition));
    let Some(&Seen { condition, direction, .. }) = whole.or(best) else { return Vec::new() };
    let state = task.system.state_names().get(direction).cloned().unwrap_or_default();
    let rank_note = if rank == n {
        "all states are observable".to_owned()
    } else {
        format!("of {n}: {} directions are unobservable", n - rank)
    };
    let mut facts =
        vec![Fact { name: "observable directions of the first state".into(), value: rank as f64, note: rank_note }];
    let worst = format!("least observable: mostly {state}");
    let note = if rank == n { worst } else { format!("over the observable directions; {worst}") };
    if rank > 0 {
        facts.push(Fact { name: "condition of the observability Gramian".into(), value: condition, note });
    }
    facts
}

/// What a Gramian shows.
struct Seen {
    /// How many directions.
    rank: usize,
    /// Over these, the ratio of its eigenvalues.
    condition: f64,
    /// The state that most of the least observable direction is.
    direction: usize,
}

impl Seen {
    fn of(gramian: DMatrix<f64>) -> Self {
        let eigen = gramian.symmetric_eigen();
        let largest = eigen.eigenvalues.max();
        let seen = |value: &f64| *value > 1e-12 * largest;
        let rank = eigen.eigenvalues.iter().filter(|&value| seen(value)).count();
        let smallest = eigen.eigenvalues.iter().copied().filter(seen).fold(f64::INFINITY, f64::min);
        let direction = eigen.eigenvectors.column(eigen.eigenvalues.imin()).iamax();
        Self { rank, condition: largest / smallest, direction }
    }
}
