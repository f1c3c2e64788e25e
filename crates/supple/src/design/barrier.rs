use super::{Ending, Search};
use crate::Error;

/// The paper's descent with its signs mended (theory, equation D.4), in the parameters themselves:
///
/// ```text
/// phi <- phi - h (dDI/dphi + sum_i beta / (D_i - J_i) dJ_i/dphi)      h = tanh(min_i (D_i - J_i) + gamma)
/// ```
///
/// projected on the box; a budget of prices is one more `D_i`, with the prices' sum as its `J_i`. A step is at most a twentieth of the box long, which the paper leaves open; the search ends
/// when steps fall below the tolerance, or when it has used up ten times the evaluations of the other optimisers.
pub(super) fn descend(search: &mut Search) -> Result<Ending, Error> {
    let settings = search.settings();
    let Some(mut visit) = search.visitor.visits.last().cloned() else { return Ok(Ending::Stalled) };
    let problem = search.problem();
    let indices = search.visitor.scaling.indices.clone();
    for _ in 0..10 * settings.max_evaluations {
        if search.control.is_stopped() {
            return Ok(Ending::Stopped);
        }
        search.step_to(&visit, false);
        let mut direction = visit.objective_gradient(problem);
        let mut least = f64::INFINITY;
        for task in &visit.tasks {
            let Some(bound) = task.bound else { continue };
            let room = bound - task.cost;
            // The barrier is infinite where the bound is met exactly.
            let factor = settings.barrier_weight / if room.abs() < 1e-9 { 1e-9_f64.copysign(room) } else { room };
            for (direction, gradient) in direction.iter_mut().zip(task.excess_gradient(1.0)) {
                *direction += factor * gradient;
            }
            least = least.min(room);
        }
        if let Some(budget) = visit.price.budget {
            let room = budget - visit.price.total;
            let factor = settings.barrier_weight / if room.abs() < 1e-9 { 1e-9_f64.copysign(room) } else { room };
            for (direction, gradient) in direction.iter_mut().zip(&visit.price.gradient) {
                *direction += factor * gradient;
            }
            least = least.min(room);
        }
        let rate = if least.is_finite() { (least + settings.barrier_margin).tanh() } else { 1.0 };
        let mut phi = visit.phi.clone();
        let mut moved: f64 = 0.0;
        for &index in &indices {
            let [lower, upper] = problem.parameters.get(index).bounds;
            let longest = 0.05 * (upper - lower);
            let step = (-rate * direction[index]).clamp(-longest, longest);
            let next = (phi[index] + step).clamp(lower, upper);
            moved = moved.max((next - phi[index]).abs() / (upper - lower));
            phi[index] = next;
        }
        if moved <= settings.tolerance {
            return Ok(Ending::Converged);
        }
        let scaled = search.visitor.scaling.scaled(&phi);
        visit = match search.visit(&scaled) {
            Ok(visit) => visit,
            Err(error) => {
                search.error = Some(error);
                return Ok(Ending::Stalled);
            }
        };
    }
    Ok(Ending::MaxEvaluations)
}
