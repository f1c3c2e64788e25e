//! Lower bounds on the minimum in closed form, without a search, and the overhead of practical codes.

use nalgebra::linalg::balancing::balance_parlett_reinsch;
use nalgebra::{Complex, DMatrix, DVector};
use supple_kernels::Matrices;
use supple_kernels::math;

use super::horizon::Stationary;
use super::product::log_singular_values;
use crate::Error;
use crate::dense::{dense, eigen, eigenvalues, svd};

/// A matrix counts as singular if, scaled to a unit diagonal, its least eigenvalue is at most this times its
/// order.
const SINGULAR: f64 = 1e-13;

/// The data-rate theorem: `sum log |lambda|` over the eigenvalues of `A` outside the unit circle (theory, equation
/// L.20), nats per step. No controller that keeps the state bounded can use less. Possible rounding errors are subtracted.
///
/// `dynamics`: one matrix, n x n.
///
/// # Errors
/// Where an entry is not finite, or the eigenvalues cannot be found.
///
/// Example: [`kostina_hassibi`].
pub fn data_rate_floor(dynamics: &Matrices) -> Result<f64, Error> {
    if dynamics.rows() == 0 {
        return Ok(0.0);
    }
    let a = dense(dynamics, 0);
    if a.iter().any(|entry| !entry.is_finite()) {
        return Err(Error::NotFinite { what: "the dynamics", step: 0 });
    }
    let balanced = balanced(a);
    let values = eigenvalues(&balanced).ok_or(Error::NotFinite { what: "an eigenvalue of the dynamics", step: 0 })?;
    let known: Vec<(f64, f64)> = values.iter().map(|value| (value.norm(), blur(&balanced, *value))).collect();
    let outside = known.iter().filter(|(size, _)| *size > 1.0);
    let one_by_one: f64 = outside.map(|(size, blur)| math::ln(size - blur).max(0.0)).sum();
    // The determinant less the eigenvalues that are inside: rounding moves several equal eigenvalues much, and their product
    // little.
    let (log, error) = log_determinant(&balanced);
    let inside: f64 = known.iter().map(|(size, blur)| math::ln(size + blur).min(0.0)).sum();
    // An empty sum is -0.
    Ok([log - error - inside, 0.0].into_iter().fold(one_by_one, f64::max) + 0.0)
}

/// An upper estimate of the rounding error of an eigenvalue: its condition number times the rounding of the matrix.
/// For a defective eigenvalue, as in chained integrators, this exceeds the spread caused by rounding.
fn blur(matrix: &DMatrix<f64>, value: Complex<f64>) -> f64 {
    let n = matrix.nrows();
    let rounding = 10.0 * n as f64 * f64::EPSILON * matrix.norm();
    // Inverse iteration: `x` is a right eigenvector, and `y` is the left one with the least component across it.
    let shifted = |shift: f64| matrix.map(Complex::from) - DMatrix::identity(n, n) * (value + shift);
    let condition = [1.0, 2.0, 4.0].into_iter().find_map(|times| {
        let shifted = shifted(times * f64::EPSILON * matrix.norm());
        let (right, left) = (shifted.clone().lu(), shifted.adjoint().lu());
        let mut x = DVector::from_fn(n, |i, _| Complex::new(1.0, (i as f64 + 1.0).sqrt())).normalize();
        for _ in 0..3 {
            x = right.solve(&x)?.normalize();
        }
        let y = left.solve(&x)?.normalize();
        let condition = y.dotc(&x).norm().recip();
        condition.is_finite().then_some(condition)
    });
    condition.map_or(f64::INFINITY, |condition| condition * rounding)
}

/// `sum log sigma` over the singular values above 1 of `A_{T-1} ... A_0` (theory, equation L.21), nats over `steps`
/// steps.
///
/// How much the open loop amplifies uncertainty. In a time-invariant system its mean over T tends to the data-rate floor
/// as T grows, but over a finite horizon it is no bound: it depends on the units of the states, and if the cost
/// allows the growth, no information is needed at all.
///
/// `dynamics`: n x n, one for each step or one that holds at every step.
///
/// # Errors
/// Where an entry is not finite.
///
/// ```
/// use supple_lqg::bound::product_growth;
/// use supple_lqg::constant;
///
/// let nats = product_growth(&constant(&[[1.5]]), 4)?;
/// assert!((nats - 4.0 * 1.5f64.ln()).abs() < 1e-9);
/// # Ok::<(), supple_lqg::Error>(())
/// ```
pub fn product_growth(dynamics: &Matrices, steps: usize) -> Result<f64, Error> {
    let bad = (0..dynamics.count()).find(|&t| dynamics.at(t).iter().any(|entry| !entry.is_finite()));
    if let Some(step) = bad {
        return Err(Error::NotFinite { what: "the dynamics", step });
    }
    let matrices = (0..steps).map(|t| dense(dynamics, t));
    Ok(log_singular_values(matrices, dynamics.rows()).into_iter().map(|log| log.max(0.0)).sum())
}

/// The lower bound of Kostina and Hassibi at one cost.
///
/// Example: [`kostina_hassibi`].
#[derive(Clone, Copy, Debug, PartialEq)]
#[non_exhaustive]
pub struct KostinaHassibi {
    /// Nats per step; negative or minus infinity if the bound is vacuous.
    pub nats: f64,
    /// Why the bound is not stronger than the data-rate floor; `None` if it is.
    pub vacuous: Option<Vacuous>,
}

/// Why the bound of Kostina and Hassibi is vacuous.
///
/// Example: [`kostina_hassibi`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
#[non_exhaustive]
pub enum Vacuous {
    /// The process noise does not drive every state, so its entropy power is 0.
    SingularProcess,
    /// Uncertainty in some direction of the state has no cost, as with fewer controls than states.
    SingularPrice,
    /// At such a high cost it is below the data-rate floor.
    LooseCost,
}

impl std::fmt::Display for Vacuous {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        f.write_str(match self {
            Self::SingularProcess => "does not apply: the process noise does not drive every state",
            Self::SingularPrice => {
                "does not apply: uncertainty in some direction of the state has no cost, as with fewer controls than states"
            }
            Self::LooseCost => "is below the data-rate floor at this cost",
        })
    }
}

/// The bound of Kostina and Hassibi (theory, equation L.22): the least nats per step that the cost `cost` per step
/// requires, `n/2 log(|det A|^(2/n) + N(W) |det Theta|^(1/n) / ((D - D_min)/n))`, with the entropy power
/// `N(W) = |det W|^(1/n)` of Gaussian noise. `floor` is the data-rate floor in nats per step.
///
/// It is `log |det A| + n/2 log(1 + N(W) |det M|^(1/n) / ((D - D_min)/n))` with `Theta = A' M A`, written so that it
/// holds for singular `A` too; our `M` and costs are half of theirs, because of the factor 1/2 in our cost.
///
/// ```
/// use supple_lqg::bound::{Stationary, data_rate_floor, kostina_hassibi};
/// use supple_lqg::constant;
///
/// // x+ = 1.5 x + u + w, w of variance 1, with the cost x^2 / 2 per step.
/// let plant = Stationary::new(&constant(&[[1.5, 1.0]]), &constant(&[[1.0]]), &constant(&[[1.0, 0.0], [0.0, 0.0]]))?;
/// let floor = data_rate_floor(&plant.dynamics)?;
/// let found = kostina_hassibi(&plant, 2.0, floor);
/// assert!((floor - 1.5f64.ln()).abs() < 1e-9);
/// assert!((found.nats - 0.5 * 3f64.ln()).abs() < 1e-6, "the minimum itself, as there is one state");
/// assert_eq!(found.vacuous, None);
/// # Ok::<(), supple_lqg::Error>(())
/// ```
#[must_use]
pub fn kostina_hassibi(stationary: &Stationary, cost: f64, floor: f64) -> KostinaHassibi {
    let n = stationary.dynamics.rows() as f64;
    let own = 2.0 / n * log_determinant(&balanced(dense(&stationary.dynamics, 0))).0;
    let noise = log_determinant_semidefinite(&dense(&stationary.process, 0));
    let price = log_determinant_semidefinite(&dense(&stationary.price, 0));
    let (Some(noise), Some(price)) = (noise, price) else {
        let vacuous = if noise.is_none() { Vacuous::SingularProcess } else { Vacuous::SingularPrice };
        return KostinaHassibi { nats: f64::NEG_INFINITY, vacuous: Some(vacuous) };
    };
    let driven = (noise + price) / n - math::ln((cost - stationary.base_cost) / n);
    let (greater, less) = (own.max(driven), own.min(driven));
    let nats = 0.5 * n * (greater + math::ln_1p(math::exp(less - greater)));
    KostinaHassibi { nats, vacuous: (nats < floor).then_some(Vacuous::LooseCost) }
}

/// An upper bound on the bits of a prefix-free code with scalar quantisers if the minimum is `bits`:
/// `bits + sum_t (r_t/2 log2(4 pi e / 12) + 1)` over the steps at which anything is sent, where `ranks` gives how many
/// numbers the virtual sensor measures at each step (theory, equation L.23; Tanaka, Johansson, Oechtering, Sandberg,
/// Skoglund 2016).
///
/// ```
/// // Ten steps, at each of which one number is sent.
/// let bits = supple_lqg::bound::quantiser_bound(20.0, &[1; 10]);
/// assert!((bits - 37.55).abs() < 0.01);
/// ```
#[must_use]
pub fn quantiser_bound(bits: f64, ranks: &[usize]) -> f64 {
    let loss = 0.5 * math::log2(4.0 * std::f64::consts::PI * std::f64::consts::E / 12.0);
    let sent = ranks.iter().filter(|&&rank| rank > 0);
    bits + sent.map(|&rank| loss * rank as f64 + 1.0).sum::<f64>()
}

/// A matrix with its rows and columns scaled so that they are of similar length; eigenvalues and determinant stay.
fn balanced(mut matrix: DMatrix<f64>) -> DMatrix<f64> {
    balance_parlett_reinsch(&mut matrix);
    matrix
}

/// `log |det A|` of a balanced matrix, minus infinity if it is singular, and by how much rounding may have changed it.
fn log_determinant(matrix: &DMatrix<f64>) -> (f64, f64) {
    let values = svd(matrix).values;
    let rounding = 10.0 * matrix.nrows() as f64 * f64::EPSILON * values.iter().copied().fold(0.0, f64::max);
    (values.iter().map(|value| math::ln(*value)).sum(), values.iter().map(|value| rounding / value).sum())
}

/// `log det` of a positive semidefinite matrix; `None` if it is singular, whatever the units of its rows.
fn log_determinant_semidefinite(matrix: &DMatrix<f64>) -> Option<f64> {
    let n = matrix.nrows();
    let scale: Vec<f64> = (0..n).map(|i| matrix[(i, i)].sqrt()).collect();
    if scale.iter().any(|&scale| scale.is_nan() || scale <= 0.0) {
        return None;
    }
    let scaled = DMatrix::from_fn(n, n, |i, j| matrix[(i, j)] / scale[i] / scale[j]);
    let values = eigen(scaled)?.eigenvalues;
    let regular = values.min() > SINGULAR * n as f64;
    regular.then(|| {
        values.iter().map(|value| math::ln(*value)).sum::<f64>()
            + 2.0 * scale.iter().map(|scale| math::ln(*scale)).sum::<f64>()
    })
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;
    use crate::constant;

    /// Eigenvalues that rounding splits by the root of its size counted as nothing.
    #[test]
    fn repeated_unstable_eigenvalues_count() {
        let floor = |dynamics: &Matrices| data_rate_floor(dynamics).unwrap();
        assert!((floor(&constant(&[[4.0, 1.0], [0.0, 4.0]])) - 16f64.ln()).abs() < 1e-12);
        assert!((floor(&constant(&[[3.0, -2.25], [1.0, 0.0]])) - 2.25f64.ln()).abs() < 1e-12);
        assert!((floor(&constant(&[[4.0, 1.0], [0.0, 4.0 * (1.0 + 1e-14)]])) - 16f64.ln()).abs() < 1e-12);
        // Beside eigenvalues inside, of which one is 0.
        let mixed = constant(&[[4.0, 1.0, 0.3], [0.0, 4.0, 0.2], [0.0, 0.0, 0.5]]);
        assert!((floor(&mixed) - 16f64.ln()).abs() < 1e-12);
        let singular = constant(&[[1.5, 0.0, 0.3], [0.0, 0.7, 0.2], [0.0, 0.0, 0.0]]);
        assert!((floor(&singular) - 1.5f64.ln()).abs() < 1e-12);
        // Chains of integrators have none.
        assert_eq!(floor(&constant(&[[1.0, 0.1], [0.0, 1.0]])), 0.0);
        assert_eq!(floor(&constant(&[[1.0, 0.1, 0.005], [0.0, 1.0, 0.1], [0.0, 0.0, 1.0]])), 0.0);
    }
}
