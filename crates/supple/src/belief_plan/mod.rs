//! Plans of least expected cost, which account for the uncertainty along the plan and its cost (theory,
//! section P, "Belief-space plans").

mod gradient;
mod hessian;
mod point;
mod search;

use std::time::Instant;

use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::SeedableRng;
use rand_distr::{Distribution, StandardNormal};
use supple_kernels::{Matrices, Scratch};
use supple_model::system::Curvature;

pub(crate) use gradient::belief_plan_gradient;
pub(crate) use search::Memory;

use crate::plan::{CostCurvature, Plan, PlanMode, PlanSettings, PlanStatus, add_wave, is_over};
use crate::problem::TaskAt;
use search::Search;

/// Number of cosine waves in a perturbed guess; the slowest has half a period over the task.
const WAVES: usize = 4;

/// Finds the plan of least expected cost (theory, equation P.10), starting from the nominal plan already found in `plan`,
/// or from `controls`, the first guess of that search, if they cost less (as the controls of a belief-space plan
/// of a nearby design may); and from random perturbations of the nominal plan, whose number is in the settings. Where none of
/// these converges and the choice of curvature is automatic, again with the law of Gauss-Newton's.
pub(crate) fn plan_belief(
    TaskAt { task, phi }: TaskAt,
    controls: &Matrices,
    settings: &PlanSettings,
    deadline: Option<Instant>,
    plan: &mut Plan,
    memory: &mut Memory,
    scratch: &mut Scratch,
) {
    let curvatures = match settings.curvature {
        CostCurvature::Exact => &[Curvature::Exact][..],
        CostCurvature::GaussNewton => &[Curvature::GaussNewton],
        CostCurvature::Auto if !task.system.has_smooth_gauss_newton() => &[Curvature::Exact],
        CostCurvature::Auto => &[Curvature::Exact, Curvature::GaussNewton],
    };
    let mut found = Found { best: None, iterations: plan.iterations };
    for &curvature in curvatures {
        if found.best.as_ref().is_some_and(|best| best.status.is_converged() || is_over(deadline)) {
            break;
        }
        memory.set_curvature(curvature);
        let given = start(task.at(phi), plan, controls, memory, scratch);
        // Evaluate the nominal plan last, so that it is the centre if it is the better one.
        let nominal = start(task.at(phi), plan, &plan.trajectory.controls, memory, scratch);
        if given.is_some_and(|given| nominal.is_none_or(|nominal| given < nominal)) {
            start(task.at(phi), plan, controls, memory, scratch);
        }
        let mut consider = |memory: &mut Memory, scratch: &mut Scratch| {
            Search { task, phi, settings, memory, scratch }.run(deadline);
            found.consider(&mut memory.centre.plan);
        };
        if given.is_some() || nominal.is_some() {
            consider(memory, scratch);
        }
        for number in (1..settings.belief.starts).take_while(|_| !is_over(deadline)) {
            let perturbed = wandering(&plan.trajectory.controls, settings, number);
            if start(task.at(phi), plan, &perturbed, memory, scratch).is_some() {
                consider(memory, scratch);
            }
        }
    }
    match found.best {
        Some(best) => {
            *plan = best;
            plan.iterations = found.iterations;
        }
        // The expected cost is undefined everywhere: keep the nominal plan for inspection.
        None => {
            plan.mode = PlanMode::Belief;
            plan.status = PlanStatus::Indefinite;
        }
    }
}

/// The best plan of searches so far, and the iterations of all.
struct Found {
    best: Option<Plan>,
    iterations: usize,
}

impl Found {
    /// Keeps the plan of a search if it is better: converged ones before others, then cheaper ones.
    fn consider(&mut self, plan: &mut Plan) {
        plan.mode = PlanMode::Belief;
        self.iterations += plan.iterations;
        let rank = |plan: &Plan| (!plan.status.is_converged(), plan.objective);
        if self.best.as_ref().is_none_or(|best| rank(plan) < rank(best)) {
            self.best = Some(plan.clone());
        }
    }
}

/// Puts the centre of searches on controls, from the first state of a plan; its expected cost, where it has one.
fn start(
    TaskAt { task, phi }: TaskAt,
    nominal: &Plan,
    controls: &Matrices,
    memory: &mut Memory,
    scratch: &mut Scratch,
) -> Option<f64> {
    let to = &mut memory.centre.plan.trajectory;
    to.states.vector_mut(0).copy_from_slice(nominal.trajectory.states.vector(0));
    to.controls.copy_from(controls);
    memory.centre.simulate(task, phi, scratch).is_ok().then_some(memory.centre.plan.objective)
}

fn normal(random: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(random)
}

/// Randomly perturbed controls: adds a few cosine waves of random amplitude, scaled by `spread` times the controls' root
/// mean square; stream `number` of the seed.
fn wandering(around: &Matrices, settings: &PlanSettings, number: usize) -> Matrices {
    let mut random = ChaCha8Rng::seed_from_u64(settings.belief.seed);
    random.set_stream(number as u64);
    let mut controls = around.clone();
    let steps = around.count();
    for a in 0..around.cols() {
        let squares: f64 = (0..steps).map(|t| around.vector(t)[a].powi(2)).sum();
        let size = if squares > 0.0 { (squares / steps as f64).sqrt() } else { 1.0 };
        for wave in 1..=WAVES {
            let amplitude = settings.belief.spread * size * normal(&mut random) / wave as f64;
            add_wave(&mut controls, a, wave, amplitude);
        }
    }
    controls
}
