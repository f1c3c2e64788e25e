//! Both gradients against finite differences of the whole chain, over random designs of a nonlinear task.

use crate::common::reference;

use crate::common::reference::differences::{FUNCTIONALS, gradients, total_gradient_errors};
use crate::common::reference::finger::{self, design, parameter, scales};
use crate::common::reference::{cases, evaluated, parameters, relative_error, ring};
use proptest::prelude::*;
use supple::aims::weighted_information;
use supple::design::InformationWeights;
use supple::gradient::{FrozenGradient, Functional};
use supple::lqg::Noise;
use supple::lqg::{Belief, kalman};
use supple::lqg::{Information, information};
use supple::pipeline::TaskState;
use supple::plan::{PlanSettings, PlanStatus};
use supple::{Error, Scratch, Task};

/// A random task of few steps with its design, planned.
fn planned(phi: &[f64], steps: usize) -> Result<(Task, TaskState), TestCaseError> {
    let task = finger::task(steps);
    task.check(&parameters(phi)).unwrap();
    let mut state = TaskState::new(&task);
    state.evaluate(&task, phi, &PlanSettings::default(), None).unwrap();
    prop_assert_eq!(state.plan.status, PlanStatus::Converged);
    Ok((task, state))
}

/// Entries times the size of their parameter, so that each counts by what it can change.
fn scaled(gradient: &[f64]) -> Vec<f64> {
    gradient.iter().zip(scales()).map(|(entry, scale)| entry * scale).collect()
}

proptest! {
    #![proptest_config(cases(48))]

    /// Only the knots and the noise move: trajectory, feedback and value of information stay.
    #[test]
    fn frozen_gradient_is_that_of_information_and_belief_cost_at_fixed_plan(phi in design(), steps in 3usize..20) {
        let (task, mut state) = planned(&phi, steps)?;
        let mut frozen = FrozenGradient::default();
        state.frozen_gradient(&task, &phi, &mut frozen);

        let size = task.system.dimensions();
        let mut noise = Noise::zeros(size.states, size.measurements);
        let mut belief = Belief::zeros(size.states, size.measurements, steps);
        let (mut knots, mut scratch) = (state.plan.knots.clone(), Scratch::new());
        let (points, xi) = (state.plan.trajectory.points(), &state.plan.policy.value_of_information);
        let steps_of_phi: Vec<f64> = scales().iter().map(|scale| 1e-4 * scale).collect();
        let expected = gradients(&phi, &steps_of_phi, |phi| {
            task.noise.resolve(phi, &mut noise).unwrap();
            task.system.dynamics_jacobians(points, phi, &mut knots.dynamics, &mut scratch);
            task.system.measurement_jacobians(points, phi, &mut knots.measurement, &mut scratch);
            kalman(&knots, &noise, &mut belief).unwrap();
            let mut found = Information::default();
            information(&belief, &noise, &mut found).unwrap();
            let price = |t| (reference::dense(xi, t) * reference::dense(&belief.corrected, t)).trace();
            vec![found.total, 0.5 * (0..steps).map(price).sum::<f64>()]
        });
        let pairs = [("information", &frozen.information), ("belief cost", &frozen.belief_cost)];
        for ((name, found), expected) in pairs.into_iter().zip(&expected) {
            let error = relative_error(&scaled(found), &scaled(expected));
            prop_assert!(error < 1e-8, "{name}: off by {error:.1e}: {found:?}, not {expected:?}");
            for (parameter, fixed) in [parameter::ANGLE_WEIGHT, parameter::INITIAL_ANGLE, parameter::UNUSED]
                .map(|parameter| (parameter, found[parameter]))
            {
                prop_assert_eq!(fixed, 0.0, "parameter {} has no part in what moves", parameter);
            }
        }
    }

    /// Everything moves: the task is planned anew for every difference.
    #[test]
    fn total_gradients_are_those_of_the_task_planned_anew(phi in design(), steps in 3usize..20) {
        let (task, mut state) = planned(&phi, steps)?;
        for (name, error) in total_gradient_errors(&task, &mut state, &phi, &scales()) {
            prop_assert!(error < 1e-7, "{name}: off by {error:.1e}");
        }
    }

    #[test]
    fn gradients_of_sums_are_sums_of_gradients(
        phi in design(), steps in 3usize..20, weights in prop::array::uniform4(-2.0..2.0),
    ) {
        let (task, mut state) = planned(&phi, steps)?;
        let [belief, process, initial, information] = weights;
        let functional = Functional { information, belief, process, initial, partials: None };
        let (mut found, mut part) = (Vec::new(), Vec::new());
        state.total_gradient(&task, &phi, functional, &mut found).unwrap();
        let mut expected = vec![0.0; phi.len()];
        let mut largest = 0.0_f64;
        for (weight, (_, functional)) in weights.into_iter().zip(FUNCTIONALS) {
            state.total_gradient(&task, &phi, functional, &mut part).unwrap();
            for (sum, part) in expected.iter_mut().zip(scaled(&part)) {
                *sum += weight * part;
                largest = largest.max((weight * part).abs());
            }
        }
        for (found, expected) in scaled(&found).iter().zip(&expected) {
            prop_assert!((found - expected).abs() < 1e-11 * largest, "{found} instead of {expected}");
        }
    }

    /// What was computed before must not show in what is computed next.
    #[test]
    fn used_memory_leaves_no_trace(first in design(), second in design(), steps in 3usize..20) {
        let (task, mut used) = planned(&first, steps)?;
        let (_, mut fresh) = planned(&second, steps)?;
        let mut found = [Vec::new(), Vec::new()];
        used.total_gradient(&task, &first, Functional::NOISE, &mut found[0]).unwrap();
        used.evaluate(&task, &second, &PlanSettings::default(), None).unwrap();
        prop_assert_eq!(used.cost, fresh.cost);
        prop_assert_eq!(&used.information, &fresh.information);
        for functional in [Functional::INFORMATION, Functional::NOISE, Functional::PROCESS] {
            used.total_gradient(&task, &second, functional, &mut found[0]).unwrap();
            fresh.total_gradient(&task, &second, functional, &mut found[1]).unwrap();
            prop_assert_eq!(&found[0], &found[1]);
        }
        let mut frozen = [FrozenGradient::default(), FrozenGradient::default()];
        used.frozen_gradient(&task, &second, &mut frozen[0]);
        fresh.frozen_gradient(&task, &second, &mut frozen[1]);
        prop_assert_eq!(&frozen[0], &frozen[1]);
    }
}

/// Sizes on both sides of the width of a vector register, and of what fits on the stack.
#[test]
fn total_gradients_hold_for_every_size() {
    for (n, m, p) in
        [(1, 1, 1), (5, 1, 2), (6, 1, 2), (6, 2, 3), (7, 1, 8), (7, 2, 9), (8, 8, 1), (15, 2, 4), (34, 3, 2)]
    {
        let task = ring::task(n, m, p, 10);
        let mut state = evaluated(&task, &ring::DESIGN);
        for (name, error) in total_gradient_errors(&task, &mut state, &ring::DESIGN, &ring::DESIGN) {
            assert!(error < 1e-7, "{name}: off by {error:.1e} with {n} states, {m} controls, {p} measurements");
        }
    }
}

#[test]
fn unused_parameter_has_no_gradient_and_is_not_depended_on() {
    let phi: Vec<f64> = finger::BOUNDS.iter().map(|[lower, upper]| 0.5 * (lower + upper)).collect();
    let (task, mut state) = planned(&phi, 12).unwrap();
    let mut gradient = Vec::new();
    for (_, functional) in FUNCTIONALS {
        state.total_gradient(&task, &phi, functional, &mut gradient).unwrap();
        assert_eq!(gradient[parameter::UNUSED], 0.0);
    }
    state.nominal_gradient(&task, &phi, &mut gradient).unwrap();
    assert_eq!(gradient[parameter::UNUSED], 0.0);
    let used = task.system.depends_on(phi.len());
    let elsewhere = [
        parameter::PROCESS_VARIANCE,
        parameter::MEASUREMENT_VARIANCE,
        parameter::MEASUREMENT_COVARIANCE,
        parameter::INITIAL_VARIANCE,
        parameter::INITIAL_ANGLE,
        parameter::UNUSED,
    ];
    for (parameter, used) in used.into_iter().enumerate() {
        assert_eq!(used, !elsewhere.contains(&parameter), "parameter {parameter} of the system");
    }
}

/// With a sensor that is nearly exact, the derivatives of the information used are small differences of large numbers: the filter's
/// covariances are inverted. Information does not change as all covariances grow alike, which measures what rounding left.
#[test]
fn derivatives_that_rounding_hides_are_refused() {
    let problem = supple_file::parse(PRECISE, "balance.toml").unwrap();
    let task = &problem.tasks[0];
    let used = |variance: f64| {
        let (mut state, mut gradient) = (TaskState::new(task), Vec::new());
        state.evaluate(task, &[variance], &problem.planning, None).unwrap();
        weighted_information(task, &[variance], InformationWeights::USED, &mut state, &mut gradient)
            .map(|nats| (nats, gradient))
    };
    let (_, gradient) = used(1e-4).unwrap();
    let step = 1e-6;
    let slope = (used(1e-4 + step).unwrap().0 - used(1e-4 - step).unwrap().0) / (2.0 * step);
    assert!((gradient[0] / slope - 1.0).abs() < 1e-4, "{gradient:?} {slope}");
    assert!(matches!(used(1e-16), Err(Error::Rounded { .. })));
}

/// One of its states is unstable, one stiff, and one sensor measures their sum.
const PRECISE: &str = r#"
    model.kind = "linear"
    model.A = [[1.3, 0.1, 0.0], [0.02, -0.9, 0.0], [0.0, 100.0, 0.001]]
    model.B = [[0.0], [1.0], [0.0]]
    model.C = [[1.0, 0.0, 1.0]]
    parameters.variance = { initial = 1e-4, bounds = [1e-20, 1e-2], scale = "log", unit = "m^2" }
    [[tasks]]
    name = "balance"
    steps = 60
    time_step = 1.0
    initial_state = [0.5, 0.0, 0.0]
    noise = { initial = [1e-2, 1e-2, 1e-2], process = [1e-4, 1e-4, 1e-4], measurement = ["variance"] }
    costs = [{ kind = "quadratic", Q = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]], R = [[0.01]] }]
"#;
