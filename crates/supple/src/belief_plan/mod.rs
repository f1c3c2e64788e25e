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

pub(crate) use gradient::belief_plan_gradient;
pub(crate) use search::Memory;

use crate::plan::{Plan, PlanMode, PlanSettings, PlanStatus, add_wave, is_over};
use crate::problem::TaskAt;
use search::Search;

/// Number of cosine waves in a perturbed guess; the slowest has half a period over the task.
const WAVES: usize = 4;

/// Finds the plan of least expected cost (theory, equation P.10), starting from the nominal plan already found in `plan`,
/// or from `controls`, the first guess of that search, if they cost less (as the controls of a belief-space plan
/// of a nearby design may); and from random perturbations of the nominal plan, whose number is in the settings.
pub(crate) fn plan_belief(
    TaskAt { task, phi }: TaskAt,
    controls: &Matrices,
    settings: &PlanSettings,
    deadline: Option<Instant>,
    plan: &mut Plan,
    memory: &mut Memory,
    scratch: &mut Scratch,
) {
    let mut iterations = plan.iterations;
    let mut best: Option<Plan> = None;
    let mut consider = |memory: &mut Memory, scratch: &mut Scratch| {
        Search { task, phi, settings, memory, scratch }.run(deadline);
        let found = &mut memory.centre.plan;
        found.mode = PlanMode::Belief;
        iterations += found.iterations;
        let rank = |plan: &Plan| (!plan.status.is_converged(), plan.objective);
        if best.as_ref().is_none_or(|best| rank(found) < rank(best)) {
            best = Some(found.clone());
        }
    };
    let start = |memory: &mut Memory, from: &Matrices, scratch: &mut Scratch| {
        let to = &mut memory.centre.plan.trajectory;
        to.states.vector_mut(0).copy_from_slice(plan.trajectory.states.vector(0));
        to.controls.copy_from(from);
        memory.centre.simulate(task, phi, scratch).is_ok().then_some(memory.centre.plan.objective)
    };
    let given = start(memory, controls, scratch);
    // Evaluate the nominal plan last, so that it is the centre if it is the better one.
    let nominal = start(memory, &plan.trajectory.controls, scratch);
    let from_given = given.is_some_and(|given| nominal.is_none_or(|nominal| given < nominal));
    if from_given {
        start(memory, controls, scratch);
    }
    if given.is_some() || nominal.is_some() {
        consider(memory, scratch);
    }
    for number in (1..settings.belief.starts).take_while(|_| !is_over(deadline)) {
        if start(memory, &wandering(&plan.trajectory.controls, settings, number), scratch).is_some() {
            consider(memory, scratch);
        }
    }
    match best {
        Some(best) => {
            *plan = best;
            plan.iterations = iterations;
        }
        // The expected cost is undefined everywhere: keep the nominal plan for inspection.
        None => {
            plan.mode = PlanMode::Belief;
            plan.status = PlanStatus::Indefinite;
        }
    }
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
