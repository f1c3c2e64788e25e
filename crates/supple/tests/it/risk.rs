//! Risk-sensitive plans against brute force, against the nominal plan, and what noise does to their gains.

use crate::common::reference;

use crate::common::reference::dense;
use crate::common::{repository, shipped};
use nalgebra::{DMatrix, DVector};
use supple::pipeline::TaskState;
use supple::plan::{PlanMode, PlanSettings, PlanStatus};
use supple::{Problem, Scratch, Task};

const LINEAR: &str = r#"
    [model]
    kind = "linear"
    A = [[1.0, 0.3], [-0.2, 0.9]]
    B = [[0.0], [0.4]]
    C = [[1.0, 0.0]]
    [[tasks]]
    name = "hold"
    steps = 7
    time_step = 0.1
    initial_state = [1.0, 0.5]
    initial_control = [0.0]
    noise = { initial = [0.1, 0.2], process = [0.03, 0.05], measurement = [0.05] }
    [[tasks.costs]]
    kind = "quadratic"
    Q = [[1.0, 0.0], [0.0, 0.1]]
    R = [[0.2]]
"#;

fn settings(risk_sensitivity: f64) -> PlanSettings {
    PlanSettings { plan: PlanMode::Risk, risk_sensitivity, ..Default::default() }
}

fn planned(problem: &Problem, settings: &PlanSettings) -> TaskState {
    let mut state = TaskState::new(&problem.tasks[0]);
    state.evaluate(&problem.tasks[0], &problem.parameters.initial(), settings, None).unwrap();
    assert_eq!(state.plan.status, PlanStatus::Converged);
    state
}

/// A law: controls and gains around a trajectory, the roll-out of those controls.
#[derive(Clone)]
struct Law {
    controls: Vec<f64>,
    gains: Vec<DMatrix<f64>>,
}

/// What the controller expects to pay, given the innovations: the cost at its estimates, and that of their covariance.
fn expected_to_pay(task: &Task, state: &TaskState, law: &Law, innovations: &[f64]) -> f64 {
    let (steps, mut scratch) = (task.steps, Scratch::new());
    let knots = &state.plan.knots;
    let mut reference = DVector::from_vec(vec![1.0, 0.5]);
    let mut estimate = reference.clone();
    let mut cost = 0.0;
    for (t, innovation) in innovations.iter().enumerate() {
        let gain = dense(&state.belief.gain_transposed, t).transpose();
        estimate += gain.column(0) * *innovation;
        let l_xx = dense(&knots.cost, t).view((0, 0), (2, 2)).into_owned();
        cost += 0.5 * (l_xx * dense(&state.belief.corrected, t)).trace();
        if t == steps {
            break;
        }
        let u = law.controls[t] + (&law.gains[t] * (&estimate - &reference))[0];
        cost += task.system.stage_cost(t, estimate.as_slice(), &[u], &[], &mut scratch);
        for (x, u) in [(&mut estimate, u), (&mut reference, law.controls[t])] {
            let mut next = DVector::zeros(2);
            task.system.step(t, x.as_slice(), &[u], &[], next.as_mut_slice());
            *x = next;
        }
    }
    cost + task.system.final_cost(estimate.as_slice(), &[], &mut scratch)
}

/// `1/sigma log E exp(sigma cost)` over the innovations, of which the cost is a quadratic function: a Gaussian integral.
fn certainty_equivalent(task: &Task, state: &TaskState, law: &Law, sigma: f64) -> f64 {
    let count = task.steps + 1;
    let at = |entries: &[(usize, f64)]| {
        let mut innovations = vec![0.0; count];
        entries.iter().for_each(|&(i, value)| innovations[i] += value);
        expected_to_pay(task, state, law, &innovations)
    };
    let base = at(&[]);
    let slope = DVector::from_fn(count, |i, _| 0.5 * (at(&[(i, 1.0)]) - at(&[(i, -1.0)])));
    let curvature =
        DMatrix::from_fn(count, count, |i, j| at(&[(i, 1.0), (j, 1.0)]) - at(&[(i, 1.0)]) - at(&[(j, 1.0)]) + base);
    let deviation = |t| state.belief.innovation_factor.get(t, 0, 0);
    let factor = DMatrix::from_diagonal(&DVector::from_fn(count, |t, _| deviation(t)));
    let m = DMatrix::identity(count, count) - &factor * curvature * &factor * sigma;
    let solved = m.clone().cholesky().unwrap().solve(&(&factor * &slope));
    base + 0.5 * sigma * (&factor * slope).dot(&solved) - 0.5 / sigma * m.determinant().ln()
}

#[test]
fn the_law_is_the_best_one_and_its_value_that_of_brute_force() {
    let problem = supple_file::parse(LINEAR, "test").unwrap();
    let task = &problem.tasks[0];
    for sigma in [-0.3, 0.05, 0.2] {
        let state = planned(&problem, &settings(sigma));
        let law = Law {
            controls: (0..task.steps).map(|t| state.plan.trajectory.controls.vector(t)[0]).collect(),
            gains: (0..task.steps).map(|t| dense(&state.plan.policy.feedback, t)).collect(),
        };
        let best = certainty_equivalent(task, &state, &law, sigma);
        reference::assert_near("the value", state.plan.objective, best, 1e-10);
        for t in 0..task.steps {
            for change in [1e-2, -1e-2] {
                let mut other = law.clone();
                other.gains[t][(0, t % 2)] += change;
                assert!(certainty_equivalent(task, &state, &other, sigma) > best, "gain {t}, sigma {sigma}");
                let mut other = law.clone();
                other.controls[t] += change;
                assert!(certainty_equivalent(task, &state, &other, sigma) > best, "control {t}, sigma {sigma}");
            }
        }
    }
}

#[test]
fn without_sensitivity_it_is_the_nominal_plan_and_near_it_close_by() {
    for name in ["two_mass_small.toml", "two_mass.toml"] {
        let problem = shipped(name);
        let nominal = planned(&problem, &PlanSettings::default());
        let gains = |state: &TaskState| state.plan.policy.feedback.as_slice().to_vec();
        let off = |sigma| {
            let state = planned(&problem, &settings(sigma));
            let cost = (state.cost.expected() - nominal.cost.expected()).abs() / nominal.cost.expected();
            let value = (state.plan.objective - nominal.cost.expected()).abs() / nominal.cost.expected();
            (reference::relative_error(&gains(&state), &gains(&nominal)), cost, value)
        };
        let (gain, cost, value) = off(0.0);
        assert!(gain < 1e-9 && cost < 1e-12 && value < 1e-9, "{name}: {gain:.1e} {cost:.1e} {value:.1e}");
        let (near, nearer) = (off(2e-3).0, off(1e-3).0);
        assert!((near / nearer - 2.0).abs() < 0.1, "{name}: not linear in sigma: {near:.3e} {nearer:.3e}");
    }
}

/// The four parts against the covariance of estimate and error, carried along in closed loop.
#[test]
fn its_expected_cost_is_that_of_its_own_gains() {
    let problem = shipped("two_mass_small.toml");
    let mut last = planned(&problem, &PlanSettings::default()).cost.expected();
    for sigma in [0.5, 1.0] {
        let state = planned(&problem, &settings(sigma));
        let (knots, n) = (&state.plan.knots, 5);
        let mut spread = dense(&state.belief.predicted, 0) - dense(&state.belief.corrected, 0);
        let mut cost = state.plan.nominal_cost;
        for t in 0..=knots.steps() {
            let (l, sigma) = (dense(&knots.cost, t), dense(&state.belief.corrected, t));
            let l_xx = l.view((0, 0), (n, n)).into_owned();
            cost += 0.5 * (&l_xx * sigma).trace();
            if t == knots.steps() {
                cost += 0.5 * (&l_xx * &spread).trace();
                break;
            }
            let gain = dense(&state.plan.policy.feedback, t);
            let closed = DMatrix::from_fn(n + 1, n, |i, j| if i < n { f64::from(i == j) } else { gain[(0, j)] });
            cost += 0.5 * (closed.transpose() * l.columns(0, n + 1) * &closed * &spread).trace();
            let moved = dense(&knots.dynamics, t) * &closed;
            let change = dense(&state.belief.predicted, t + 1) - dense(&state.belief.corrected, t + 1);
            spread = &moved * spread * moved.transpose() + change;
        }
        reference::assert_near("the expected cost", state.cost.expected(), cost, 1e-10);
        assert!(state.cost.expected() > last - 1e-3, "it does not lower the expected cost by much");
        last = state.cost.expected();
    }
}

#[test]
fn too_much_sensitivity_names_one_that_works() {
    let problem = shipped("two_mass.toml");
    let mut state = TaskState::new(&problem.tasks[0]);
    let phi = problem.parameters.initial();
    let error = state.evaluate(&problem.tasks[0], &phi, &settings(3.0), None).unwrap_err().to_string();
    let named =
        |error: &str| -> f64 { error.split("; ").nth(1).unwrap().split(" has one").next().unwrap().parse().unwrap() };
    let (far, named) = (named, named(&error));
    assert!(error.contains("risk_sensitivity = 3"), "{error}");
    assert!(named > 0.1 && named < 3.0, "{named}");
    planned(&problem, &settings(named));
    // However far too much is asked for.
    let error = state.evaluate(&problem.tasks[0], &phi, &settings(1e6), None).unwrap_err().to_string();
    let far = far(&error);
    assert!((far / named - 1.0).abs() < 0.1, "{far} {named}");
}

/// A task with some of its noise multiplied.
fn noisier(process: f64, measurement: f64) -> Problem {
    let text = std::fs::read_to_string(repository("tasks/two_mass_small.toml")).unwrap();
    let list = |values: &[f64], factor: f64| {
        format!("[{}]", values.iter().map(|value| format!("{:e}", value * factor)).collect::<Vec<_>>().join(", "))
    };
    let lists = [
        ("[1e-7, 1e-2, 1e-7, 4e-2, 0.0]", list(&[1e-7, 1e-2, 1e-7, 4e-2, 0.0], process)),
        ("[5e-3, 5e-2]", list(&[5e-3, 5e-2], measurement)),
    ];
    let text = lists.iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replace(from, to)
    });
    supple_file::parse(&text, "test").unwrap()
}

/// Where the robot presses, for good.
const PRESSING: usize = 60;

/// How hard the control pushes against a displacement of the first position, N/m.
fn stiffness(state: &TaskState) -> f64 {
    -state.plan.policy.feedback.get(PRESSING, 0, 0)
}

/// The stiffness of the exact solution for the exponential of the cost itself (Whittle): the estimate is tilted by costs
/// past and to come.
fn exact_stiffness(state: &TaskState, sigma: f64) -> f64 {
    let (knots, noise, n) = (&state.plan.knots, &state.noise, state.plan.knots.dynamics.rows());
    let (steps, eye) = (knots.steps(), DMatrix::<f64>::identity(n, n));
    let mut pi = dense(&knots.cost, steps).view((0, 0), (n, n)).into_owned();
    let mut laws = vec![(DMatrix::zeros(1, n), DMatrix::zeros(n, n)); steps];
    for t in (0..steps).rev() {
        let tilted = &pi * (&eye - dense(&noise.process, t) * &pi * sigma).try_inverse().unwrap();
        let (f, l) = (dense(&knots.dynamics, t), dense(&knots.cost, t));
        let q = l.columns(0, n + 1) + f.transpose() * tilted * &f;
        let gain = -q.view((n, 0), (1, n)) / q[(n, n)];
        pi = q.view((0, 0), (n, n)) + q.view((0, n), (n, 1)) * &gain;
        laws[t] = (gain, pi.clone());
    }
    let mut p = dense(&noise.initial, 0);
    for (t, (gain, pi)) in laws.iter().enumerate() {
        let (c, v) = (dense(&knots.measurement, t), dense(&noise.measurement, t));
        let known = &p * c.transpose() * (&c * &p * c.transpose() + v).try_inverse().unwrap() * &c * &p;
        let sigma_t = &p - known;
        if t == PRESSING {
            return -(gain * (&eye - &sigma_t * pi * sigma).try_inverse().unwrap())[0];
        }
        let l_xx = dense(&knots.cost, t).view((0, 0), (n, n)).into_owned();
        let tilted = &sigma_t * (&eye - l_xx * &sigma_t * sigma).try_inverse().unwrap();
        let a = dense(&knots.dynamics, t).columns(0, n).into_owned();
        p = &a * tilted * a.transpose() + dense(&noise.process, t);
    }
    f64::NAN
}

/// The stiffness of the law with the same filter that minimises the exponential of the cost of state and estimate together,
/// the state put at its estimate (in the manner of Ponton et al.).
fn joint_stiffness(state: &TaskState, sigma: f64) -> f64 {
    let (knots, noise, n) = (&state.plan.knots, &state.noise, state.plan.knots.dynamics.rows());
    let steps = knots.steps();
    let zero = DMatrix::<f64>::zeros(n, n);
    let square = |xx: &DMatrix<f64>, xm: &DMatrix<f64>, mx: &DMatrix<f64>, mm: &DMatrix<f64>| {
        let mut all = DMatrix::zeros(2 * n, 2 * n);
        for (part, (i, j)) in [(xx, (0, 0)), (xm, (0, n)), (mx, (n, 0)), (mm, (n, n))] {
            all.view_mut((i, j), (n, n)).copy_from(part);
        }
        all
    };
    let end = dense(&knots.cost, steps).view((0, 0), (n, n)).into_owned();
    let mut pi = square(&end, &zero, &zero, &zero);
    for t in (0..steps).rev() {
        let (f, l) = (dense(&knots.dynamics, t), dense(&knots.cost, t));
        let (a, b) = (f.columns(0, n).into_owned(), f.column(n).into_owned());
        let c = dense(&knots.measurement, t + 1);
        let gain = dense(&state.belief.gain_transposed, t + 1).transpose();
        let lc = &gain * &c;
        let w = dense(&noise.process, t);
        let lv = &gain * dense(&noise.measurement, t + 1) * gain.transpose();
        let g = square(&w, &(&w * lc.transpose()), &(&lc * &w), &(&lc * &w * lc.transpose() + lv));
        let tilted = &pi * (DMatrix::identity(2 * n, 2 * n) - g * &pi * sigma).try_inverse().unwrap();
        let move_x = square(&a, &zero, &(&lc * &a), &(&a - &lc * &a));
        let move_u = DVector::from_fn(2 * n, |i, _| b[i % n]);
        let q_uu = l[(n, n)] + (move_u.transpose() * &tilted * &move_u)[0];
        let mut q_ux = move_u.transpose() * &tilted * &move_x;
        (0..n).for_each(|i| q_ux[i] += l[(n, i)]);
        let law = -(q_ux.columns(0, n) + q_ux.columns(n, n)) / q_uu;
        if t == PRESSING {
            return -law[0];
        }
        let mut on_estimate = DMatrix::zeros(1, 2 * n);
        on_estimate.view_mut((0, n), (1, n)).copy_from(&law);
        let own = square(&l.view((0, 0), (n, n)).into_owned(), &zero, &zero, &zero);
        let cross = q_ux.transpose() * &on_estimate;
        pi = own
            + move_x.transpose() * &tilted * &move_x
            + on_estimate.transpose() * &on_estimate * q_uu
            + &cross
            + cross.transpose();
    }
    f64::NAN
}

#[test]
fn noise_of_the_process_stiffens_and_noise_of_the_measurement_softens() {
    let at = |process, measurement, sigma| stiffness(&planned(&noisier(process, measurement), &settings(sigma)));
    let nominal = at(1.0, 1.0, 0.0);
    reference::assert_near("without risk noise has no say", at(2.0, 10.0, 0.0), nominal, 1e-6);
    let process: Vec<f64> = [0.5, 1.0, 2.0].iter().map(|&factor| at(factor, 1.0, 2.0)).collect();
    let measurement: Vec<f64> = [1.0, 10.0, 100.0, 1000.0].iter().map(|&factor| at(1.0, factor, 2.0)).collect();
    assert!(process.is_sorted_by(|a, b| *b > a + 0.1), "{process:?}");
    assert!(measurement.is_sorted_by(|a, b| *b < a - 0.05), "{measurement:?}");
    assert!(measurement[3] > nominal);
}

/// A point mass of 1 kg that leans on a wall of 200 N/m and measures the force.
fn leaning(process: f64, measurement: f64) -> Problem {
    let text = format!(
        r#"
        [model]
        kind = "linear"
        A = [[1.0, 0.02], [-4.0, 0.9]]
        B = [[0.0], [0.02]]
        C = [[200.0, 0.0]]
        [[tasks]]
        name = "lean"
        steps = 150
        time_step = 0.02
        initial_state = [0.0, 0.0]
        initial_control = [0.0]
        noise = {{ initial = [1e-4, 1e-2], process = [0.0, {process:e}], measurement = [{measurement:e}] }}
        [[tasks.costs]]
        kind = "quadratic"
        Q = [[400.0, 0.0], [0.0, 0.1]]
        R = [[0.01]]
        "#
    );
    supple_file::parse(&text, "test").unwrap()
}

/// The exact solution for the exponential of the cost itself is stiffened by both: the estimate is tilted towards what costs
/// most, the further the less is known. That of state and estimate together hardly feels the measurement.
#[test]
fn laws_for_the_cost_itself_are_not_softened_by_the_measurement() {
    let (few, many) = (0.0625, 0.5);
    let table = |process: f64, measurement: f64| {
        let problem = leaning(process, measurement);
        let nominal = planned(&problem, &PlanSettings::default());
        let ours = stiffness(&planned(&problem, &settings(many)));
        [ours, exact_stiffness(&nominal, few), joint_stiffness(&nominal, few)]
    };
    let (base, driven, noisy) = (table(4e-3, 10.0), table(8e-3, 10.0), table(4e-3, 1000.0));
    let sharp = table(4e-3, 0.01);
    assert!(driven[0] > 1.2 * base[0] && noisy[0] < 0.9 * base[0], "this law");
    assert!(driven[1] > base[1] && noisy[1] > 1.1 * base[1] && sharp[1] < base[1], "the exact law");
    assert!((noisy[2] / sharp[2] - 1.0).abs() < 1e-2, "state and estimate together");
    // Where the sensor is sharp already, what it tells moves the estimate less than the noise it adds.
    assert!(sharp[0] < base[0]);
}

/// Sensitivities without a plan are told with one of the same sign that has one, and a greater one that has none.
#[test]
fn sensitivities_that_are_too_large_are_told_with_one_that_works() {
    let problem = shipped("two_mass_small.toml");
    let (task, phi) = (&problem.tasks[0], problem.parameters.initial());
    let mut told = 0;
    for wrong in [1e4, -1e10] {
        let mut state = TaskState::new(task);
        let Err(error) = state.evaluate(task, &phi, &settings(wrong), None) else { panic!("{wrong} has a plan") };
        let said = error.to_string();
        let advice = if wrong < 0.0 { "closer to 0" } else { "lower risk_sensitivity" };
        assert!(said.contains(advice), "{said}");
        let Some((works, fails)) = said.split_once(" has one, and ") else { continue };
        let works: f64 = works.rsplit(' ').next().unwrap().parse().unwrap();
        let fails: f64 = fails.split(' ').next().unwrap().parse().unwrap();
        assert!(works.signum() == wrong.signum() && works.abs() < fails.abs() && fails.abs() <= wrong.abs(), "{said}");
        assert!(state.evaluate(task, &phi, &settings(works), None).is_ok(), "{works}");
        told += 1;
    }
    assert!(told > 0, "some sensitivity works");
}
