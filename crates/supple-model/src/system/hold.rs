use nalgebra::{DMatrix, DVector};
use supple_kernels::{Matrices, Scratch};

use super::{Points, System, Times};

/// Greatest number of Newton steps. Dynamics linear in the controls take one, dry friction several.
const STEPS: usize = 20;

/// The controls, length m, that keep the system at the state `x` as closely as possible (theory, equation P.3b): gravity
/// compensation, if every joint has a drive. Zeros if they cannot be found.
///
/// ```
/// use supple_lqg::constant;
/// use supple_model::system::{Arrays, Sequence, holding_controls};
///
/// // x+ = 0.9 x + u - 0.5 stays at x = 1 with u = 0.6.
/// let [a, one, drift] = [0.9, 1.0, -0.5].map(|entry| constant(&[[entry]]));
/// let arrays = Arrays { c: Some(drift), ..Arrays::new([a, one.clone(), one.clone(), one.clone(), one]) };
/// let system = Sequence::new(3, &arrays)?;
/// assert!((holding_controls(&system, &[1.0], &[])[0] - 0.6).abs() < 1e-9);
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn holding_controls(system: &dyn System, x: &[f64], phi: &[f64]) -> Vec<f64> {
    let mut found = vec![0.0; system.dimensions().controls];
    let mut missed = miss(system, x, &found, phi);
    for _ in 0..STEPS {
        let Some(step) = correction(system, x, &found, phi) else { break };
        let next: Vec<f64> = found.iter().zip(&step).map(|(u, step)| u + step).collect();
        let misses = miss(system, x, &next, phi);
        if misses.is_nan() || misses >= missed {
            break;
        }
        (found, missed) = (next, misses);
    }
    found
}

/// `|f(x, u) - x|^2`
fn miss(system: &dyn System, x: &[f64], u: &[f64], phi: &[f64]) -> f64 {
    drift(system, x, u, phi).iter().map(|entry| entry * entry).sum()
}

/// `f(x, u) - x`
fn drift(system: &dyn System, x: &[f64], u: &[f64], phi: &[f64]) -> Vec<f64> {
    let mut next = vec![0.0; x.len()];
    system.step(0, x, u, phi, &mut next);
    next.iter().zip(x).map(|(next, x)| next - x).collect()
}

/// The least squares solution of `B du = x - f(x, u)`.
fn correction(system: &dyn System, x: &[f64], u: &[f64], phi: &[f64]) -> Option<Vec<f64>> {
    let (n, m) = (x.len(), u.len());
    let (mut states, mut controls) = (Matrices::vectors(1, n), Matrices::vectors(1, m));
    states.vector_mut(0).copy_from_slice(x);
    controls.vector_mut(0).copy_from_slice(u);
    let at = Points { states: &states, controls: &controls, stages: 1, has_end: false, times: Times::From(0) };
    let mut jacobian = Matrices::zeros(1, n, n + m);
    system.dynamics_jacobians(at, phi, &mut jacobian, &mut Scratch::new());
    let b = DMatrix::from_fn(n, m, |i, j| jacobian.get(0, i, n + j));
    let target = DVector::from_vec(drift(system, x, u, phi));
    if !(b.iter().all(|entry| entry.is_finite()) && target.iter().all(|entry| entry.is_finite())) {
        return None;
    }
    let svd = b.svd(true, true);
    let least = svd.singular_values.max() * 1e-10;
    let solution = svd.solve(&-target, least).ok()?;
    Some(solution.iter().copied().collect())
}
