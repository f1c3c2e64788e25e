use supple_kernels::{Matrices, Scratch};
use supple_model::system::{Constraints, add_excess};

use super::workspace::GradientWorkspace;
use crate::Error;
use crate::plan::Plan;

/// Penalties of the first round, relative to the curvature of the cost; growth factor; maximum number of growths.
const FIRST_PENALTY: f64 = 1e2;
const GROWTH: f64 = 30.0;
const MOST_GROWTHS: usize = 8;
/// Maximum number of rounds.
const MOST_ROUNDS: usize = 60;
/// Factor by which a round should reduce the residual.
const ENOUGH: f64 = 0.1;
/// How much the excesses held constant may vary, relative to the largest variation of the trajectory so far, as limits may
/// leave none: target, and maximum.
const AIM: f64 = 1e-13;
const MOST: f64 = 1e-7;

/// An active limit of a plan: the point where it is active, and the gradient of its excess.
struct Active {
    point: usize,
    end: usize,
    gradient: Vec<f64>,
    penalty: f64,
}

/// The variation of trajectory and costates by the linear terms in `work.hessian`, and of the multipliers, where excesses
/// that have multipliers stay as they are (theory, equation G.11): the LQ problem with `e_z dz = 0` there, by the method of
/// multipliers. Leaves the variation in `work`.
///
/// # Errors
/// If the trajectory is not a strict local optimum within its limits, or cannot move along them.
pub(super) fn vary_within_limits(
    plan: &Plan,
    phi: &[f64],
    limits: &dyn Constraints,
    work: &mut GradientWorkspace,
    scratch: &mut Scratch,
) -> Result<Matrices, Error> {
    let (points, ends) = (plan.multipliers.count(), plan.multipliers.cols());
    let joint = work.hessian.rows();
    let mut jacobians = Matrices::zeros(points, ends, joint);
    limits.excess_jacobians(plan.trajectory.points(), phi, &plan.multipliers, &mut jacobians, scratch);
    let given = work.hessian.clone();
    let active = active(&plan.multipliers, &jacobians, largest_curvature(&given));
    let moved = move_multipliers(plan, active, &given, Matrices::vectors(points, ends), work);
    work.hessian = given;
    moved
}

/// The rounds of the method of multipliers, from `[H | h]` as given, which is changed in `work`.
fn move_multipliers(
    plan: &Plan,
    mut active: Vec<Active>,
    given: &Matrices,
    mut moved: Matrices,
    work: &mut GradientWorkspace,
) -> Result<Matrices, Error> {
    let (mut left, mut growths, mut size) = (f64::INFINITY, 0, f64::MIN_POSITIVE);
    for _ in 0..MOST_ROUNDS {
        work.hessian.copy_from(given);
        active.iter().for_each(|active| active.add_to(&mut work.hessian, moved.vector(active.point)[active.end]));
        if let Err(error) = work.vary(plan) {
            // If the cost has negative curvature across a limit, only a penalty makes the sum convex.
            if growths == MOST_GROWTHS {
                return Err(error);
            }
        } else {
            size = work.variation.as_slice().iter().fold(size, |size, entry| size.max(entry.abs()));
            let mut most: f64 = 0.0;
            for active in &active {
                let excess = active.excess(&work.variation);
                moved.vector_mut(active.point)[active.end] += active.penalty * excess;
                most = most.max(excess.abs() / active.norm() / size);
            }
            let before = std::mem::replace(&mut left, most);
            if left <= AIM || growths == MOST_GROWTHS && left > 0.5 * before {
                break;
            }
            if left <= ENOUGH * before {
                continue;
            }
        }
        if growths < MOST_GROWTHS {
            growths += 1;
            active.iter_mut().for_each(|active| active.penalty *= GROWTH);
        }
    }
    if left <= MOST {
        Ok(moved)
    } else {
        let step = active.first().map_or(0, |active| active.point);
        Err(Error::NoDerivative { step })
    }
}

/// The limits that have multipliers.
fn active(multipliers: &Matrices, jacobians: &Matrices, curvature: f64) -> Vec<Active> {
    let joint = jacobians.cols();
    let mut active = Vec::new();
    for point in 0..multipliers.count() {
        for (end, _) in multipliers.vector(point).iter().enumerate().filter(|(_, multiplier)| **multiplier > 0.0) {
            let gradient = jacobians.at(point)[end * jacobians.stride()..][..joint].to_vec();
            let mut active_end = Active { point, end, gradient, penalty: 0.0 };
            let norm = active_end.norm();
            if norm > 0.0 {
                active_end.penalty = FIRST_PENALTY * curvature / (norm * norm);
                active.push(active_end);
            }
        }
    }
    active
}

/// The largest entry on any diagonal of `[H | h]`.
fn largest_curvature(hessian: &Matrices) -> f64 {
    let diagonal = (0..hessian.count()).flat_map(|t| (0..hessian.rows()).map(move |i| hessian.get(t, i, i).abs()));
    diagonal.fold(f64::MIN_POSITIVE, f64::max)
}

impl Active {
    fn norm(&self) -> f64 {
        self.gradient.iter().map(|entry| entry * entry).sum::<f64>().sqrt()
    }

    /// `e_z dz`
    fn excess(&self, variation: &Matrices) -> f64 {
        self.gradient.iter().zip(variation.vector(self.point)).map(|(entry, dz)| entry * dz).sum()
    }

    /// Adds `dmu e_z + rho e_z' e_z dz` to `[H | h]`.
    fn add_to(&self, hessian: &mut Matrices, multiplier: f64) {
        let stride = hessian.stride();
        add_excess(hessian.at_mut(self.point), stride, &self.gradient, multiplier, self.penalty);
    }
}
