//! Directed information from state to measurements and to controls.

mod control;
mod control_adjoint;
mod factor;

use serde::Serialize;
use supple_kernels::{Matrices, rows};

use crate::Error;
use crate::belief::Belief;
use crate::given::{Given, MEASUREMENT};
use crate::noise::Noise;

pub use control::control_information;
pub use control_adjoint::add_control_partials;

/// Directed information from the state to the measurements, `DI(x^N -> y^N)`, in nats.
///
/// Example: the [front page](crate).
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct Information {
    /// `1/2 log |S^y_t| / |V_t|` at t = 0..=N (theory, equation I.1): never negative.
    pub per_step: Vec<f64>,
    /// Their sum.
    pub total: f64,
}

/// The directed information of a belief in innovation form (theory, equation I.1); reuses the memory of `out`.
///
/// # Errors
/// Where `V` is not symmetric and positive definite, or does not fit the belief.
///
/// Example: the [front page](crate).
pub fn information(belief: &Belief, noise: &Noise, out: &mut Information) -> Result<(), Error> {
    let p = belief.innovation_factor.rows();
    let steps = belief.innovation_factor.count() - 1;
    Given { what: MEASUREMENT, array: &noise.measurement, shape: (p, p), count: steps + 1 }.check_variances()?;
    let noise_part = |step| {
        log_determinant_at(&noise.measurement, step).ok_or(Error::NotPositiveDefinite { what: MEASUREMENT, step })
    };
    let mut of_noise = noise_part(0)?;
    out.per_step.clear();
    for t in 0..=steps {
        if t > 0 && !noise.measurement.is_constant() {
            of_noise = noise_part(t)?;
        }
        let factor = belief.innovation_factor.at(t);
        let innovation = rows::log_determinant(factor, p, belief.innovation_factor.stride());
        out.per_step.push(0.5 * (innovation - of_noise));
    }
    out.total = out.per_step.iter().sum();
    Ok(())
}

/// The same by entropies: `sum 1/2 log |P_t| / |Sigma_t|` (theory, equation I.2), for comparison.
///
/// `None` where a covariance is singular, as it is when a state is known exactly.
///
/// ```
/// use supple_lqg::{Belief, Information, Knots, LinearQuadratic, Noise};
/// use supple_lqg::{constant, entropy_form, information, kalman, paper_form, recursion_radius};
///
/// let plant = LinearQuadratic { a: &[[0.9]], b: &[[1.0]], c: &[[1.0]], q: &[[1.0]], r: &[[1.0]] };
/// let knots = Knots::linear(10, plant)?;
/// let one = constant(&[[1.0]]);
/// let noise = Noise { initial: one.clone(), process: one.clone(), measurement: one };
/// let (mut belief, mut measured) = (Belief::zeros(1, 1, 10), Information::default());
/// kalman(&knots, &noise, &mut belief)?;
/// information(&belief, &noise, &mut measured)?;
/// let entropies = entropy_form(&belief).ok_or("a covariance is singular")?;
/// assert!((entropies - measured.total).abs() < 1e-9);
///
/// // The paper's form lacks the first prior and the last posterior.
/// let (first, last) = (belief.predicted.get(0, 0, 0), belief.corrected.get(10, 0, 0));
/// let paper = paper_form(&belief).ok_or("a covariance is singular")?;
/// assert!((entropies - paper - 0.5 * (first / last).ln()).abs() < 1e-9);
/// assert!(recursion_radius(&knots, &belief).is_some_and(|radius| radius < 1.0));
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[must_use]
pub fn entropy_form(belief: &Belief) -> Option<f64> {
    let logs =
        |matrices: &Matrices| (0..matrices.count()).map(|t| log_determinant_at(matrices, t)).sum::<Option<f64>>();
    Some(0.5 * (logs(&belief.predicted)? - logs(&belief.corrected)?))
}

/// The paper's form, `sum_{t<N} 1/2 log |P_{t+1}| - 1/2 log |Sigma_t|`, for comparison only: it pairs a step's
/// prior with the posterior of the step before (theory, section I). `None` where a covariance is singular.
///
/// Example: [`entropy_form`].
#[must_use]
pub fn paper_form(belief: &Belief) -> Option<f64> {
    let steps = belief.predicted.count() - 1;
    let term = |t| Some(log_determinant_at(&belief.predicted, t + 1)? - log_determinant_at(&belief.corrected, t)?);
    Some(0.5 * (0..steps).map(term).sum::<Option<f64>>()?)
}

fn log_determinant_at(matrices: &Matrices, index: usize) -> Option<f64> {
    let (n, stride) = (matrices.rows(), matrices.stride());
    let mut factor = matrices.at(index).to_vec();
    rows::cholesky(&mut factor, n, stride).ok()?;
    Some(rows::log_determinant(&factor, n, stride))
}
