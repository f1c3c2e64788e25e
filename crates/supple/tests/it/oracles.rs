//! The library against problems with one state, solved by hand.
//!
//! `x+ = a x + b u + w`, `y = c x + v`, cost `q x^2 + r u^2` with `q_end x^2` at the end.

use crate::common::reference::{assert_near, evaluated};
use supple::Task;
use supple::lqg::entropy_form;
use supple::pipeline::TaskState;

#[derive(Clone, Copy)]
struct Scalar {
    a: f64,
    b: f64,
    c: f64,
    q: f64,
    r: f64,
    q_end: f64,
    start: f64,
    x0: f64,
    w: f64,
    v: f64,
}

const EXAMPLE: Scalar =
    Scalar { a: 1.2, b: 0.7, c: 1.5, q: 0.9, r: 0.4, q_end: 2.5, start: 0.8, x0: 0.6, w: 0.05, v: 0.3 };

impl Scalar {
    /// The task, with `sensors` equal measurements.
    fn task(&self, steps: usize, sensors: usize) -> Task {
        let Self { a, b, c, q, r, q_end, start, x0, w, v } = *self;
        let (rows, variances) = (vec![[c]; sensors], vec![v; sensors]);
        let text = format!(
            "[model]\nkind = 'linear'\nA = [[{a:?}]]\nB = [[{b:?}]]\nC = {rows:?}\n\
             [[tasks]]\nname = 'scalar'\nsteps = {steps}\ntime_step = 1.0\n\
             initial_state = [{start:?}]\ninitial_control = [0.3]\n\
             noise = {{ initial = [{x0:?}], process = [{w:?}], measurement = {variances:?} }}\n\
             costs = [{{ kind = 'quadratic', Q = [[{q:?}]], R = [[{r:?}]], final = [[{q_end:?}]] }}]\n"
        );
        supple_file::parse(&text, "scalar").unwrap().tasks.remove(0)
    }

    fn solve(&self, steps: usize) -> TaskState {
        evaluated(&self.task(steps, 1), &[])
    }

    /// `P_t` in closed form: `P+ = a^2 P v/(c^2 P + v) + w` is a fraction of linear functions of `P`, so the powers of
    /// its matrix `[[a^2 v + c^2 w, w v], [c^2, v]]` give all of them, as numerator and denominator.
    fn predicted(&self, t: usize) -> (f64, f64) {
        let Self { a, c, w, v, .. } = *self;
        let [[m11, m12], [m21, m22]] = [[a * a * v + c * c * w, w * v], [c * c, v]];
        let (trace, determinant) = (m11 + m22, m11 * m22 - m12 * m21);
        let root = (trace * trace / 4.0 - determinant).sqrt();
        let (large, small) = (trace / 2.0 + root, determinant / (trace / 2.0 + root));
        // M^t = alpha M - beta I, by Cayley-Hamilton.
        let power = |value: f64, exponent: i32| value.powi(exponent);
        let alpha = (power(large, t as i32) - power(small, t as i32)) / (large - small);
        let beta = determinant * (power(large, t as i32 - 1) - power(small, t as i32 - 1)) / (large - small);
        (alpha * (m11 * self.x0 + m12) - beta * self.x0, alpha * (m21 * self.x0 + m22) - beta)
    }
}

#[test]
fn lqg_over_two_steps_by_hand() {
    let Scalar { a, b, c, q, r, q_end, start, x0, w, v } = EXAMPLE;
    let state = EXAMPLE.solve(2);

    // Riccati backwards, with l_xx = 2q and l_uu = 2r.
    let s2 = 2.0 * q_end;
    let k1 = -a * b * s2 / (2.0 * r + b * b * s2);
    let s1 = 2.0 * q + 2.0 * r * a * a * s2 / (2.0 * r + b * b * s2);
    let k0 = -a * b * s1 / (2.0 * r + b * b * s1);
    let s0 = 2.0 * q + 2.0 * r * a * a * s1 / (2.0 * r + b * b * s1);
    let (xi0, xi1) = (k0 * k0 * (2.0 * r + b * b * s1), k1 * k1 * (2.0 * r + b * b * s2));
    for (t, s) in [s0, s1, s2].into_iter().enumerate() {
        assert_near("S", state.plan.policy.curvature.get(t, 0, 0), s, 1e-13);
    }
    for (t, (k, xi)) in [(k0, xi0), (k1, xi1)].into_iter().enumerate() {
        assert_near("K", state.plan.policy.feedback.get(t, 0, 0), k, 1e-13);
        assert_near("Xi", state.plan.policy.value_of_information.get(t, 0, 0), xi, 1e-13);
    }

    // The trajectory without noise under u = K x.
    let x1 = (a + b * k0) * start;
    let x2 = (a + b * k1) * x1;
    let trajectory = &state.plan.trajectory;
    for (t, x) in [start, x1, x2].into_iter().enumerate() {
        assert_near("x", trajectory.states.vector(t)[0], x, 1e-13);
    }
    assert_near("u_0", trajectory.controls.vector(0)[0], k0 * start, 1e-13);
    assert_near("u_1", trajectory.controls.vector(1)[0], k1 * x1, 1e-13);

    // Kalman forwards.
    let after = |p: f64| p * v / (c * c * p + v);
    let sigma0 = after(x0);
    let p1 = a * a * sigma0 + w;
    let sigma1 = after(p1);
    let p2 = a * a * sigma1 + w;
    for (t, (p, sigma)) in [(x0, sigma0), (p1, sigma1), (p2, after(p2))].into_iter().enumerate() {
        assert_near("P", state.belief.predicted.get(t, 0, 0), p, 1e-13);
        assert_near("Sigma", state.belief.corrected.get(t, 0, 0), sigma, 1e-13);
        assert_near("L", state.belief.gain_transposed.get(t, 0, 0), p * c / (c * c * p + v), 1e-13);
        assert_near("information", state.information.per_step[t], 0.5 * (1.0 + c * c * p / v).ln(), 1e-13);
    }

    assert_near("nominal cost", state.cost.nominal, 0.5 * s0 * start * start, 1e-13);
    assert_near("belief cost", state.cost.belief, 0.5 * (xi0 * sigma0 + xi1 * sigma1), 1e-13);
    assert_near("process cost", state.cost.process, 0.5 * w * (s1 + s2), 1e-13);
    assert_near("initial cost", state.cost.initial, 0.5 * s0 * x0, 1e-13);
}

/// The same cost without Riccati or Kalman: the two controls of `u_t = k_t + K_t mu_t` written out as numbers, and
/// the variance of everything that enters them.
#[test]
fn lqg_cost_over_one_step_is_that_of_the_written_out_expectation() {
    let Scalar { a, b, c, q, r, q_end, start, x0, w, v } = EXAMPLE;
    let cost = EXAMPLE.solve(1).cost;
    // One control, u = K mu with mu = start + l (c (x - start) + v): minimise q_end E[(a x + b u + w)^2] + r E[u^2].
    let gain = x0 * c / (c * c * x0 + v);
    let k = -q_end * a * b / (r + q_end * b * b);
    let mu_variance = gain * c * x0;
    let x_end_variance = a * a * x0 + 2.0 * a * b * k * mu_variance + b * b * k * k * mu_variance + w;
    let x_end = (a + b * k) * start;
    let expected =
        q * (start * start + x0) + r * k * k * (start * start + mu_variance) + q_end * (x_end * x_end + x_end_variance);
    assert_near("expected cost", cost.expected(), expected, 1e-13);
}

#[test]
fn long_horizon_reaches_the_stationary_riccati_solution() {
    let systems = [
        EXAMPLE,
        Scalar { a: 0.5, b: 2.0, q: 0.1, r: 3.0, ..EXAMPLE },
        Scalar { a: -1.8, b: 0.05, q: 1e-3, r: 1.0, ..EXAMPLE },
        Scalar { a: 1.0, b: 0.01, q: 4.0, r: 1e-4, ..EXAMPLE },
    ];
    for system in systems {
        let Scalar { a, b, q, r, .. } = system;
        let state = Scalar { start: 0.0, ..system }.solve(100);
        // S = 2q + a^2 S - a^2 b^2 S^2/(2r + b^2 S): the positive root of b^2 S^2 + h S - 4 q r = 0.
        let h = 2.0 * r * (1.0 - a * a) - 2.0 * q * b * b;
        let root = (h * h + 16.0 * b * b * q * r).sqrt();
        let s = if h < 0.0 { (root - h) / (2.0 * b * b) } else { 8.0 * q * r / (root + h) };
        assert_near("S", state.plan.policy.curvature.get(0, 0, 0), s, 1e-12);
        let k = state.plan.policy.feedback.get(0, 0, 0);
        assert_near("K", k, -a * b * s / (2.0 * r + b * b * s), 1e-12);
        assert!((a + b * k).abs() < 1.0, "the loop is stable");
    }
}

#[test]
fn long_filter_reaches_the_stationary_kalman_solution() {
    for system in [EXAMPLE, Scalar { a: 0.3, ..EXAMPLE }, Scalar { a: -2.5, w: 1e-3, v: 10.0, ..EXAMPLE }] {
        let Scalar { a, c, w, v, .. } = system;
        let belief = system.solve(100).belief;
        // P = a^2 P v/(c^2 P + v) + w: the positive root of c^2 P^2 + h P - w v = 0.
        let h = v * (1.0 - a * a) - c * c * w;
        let root = (h * h + 4.0 * c * c * w * v).sqrt();
        let p = if h < 0.0 { (root - h) / (2.0 * c * c) } else { 2.0 * w * v / (root + h) };
        assert_near("P", belief.predicted.get(100, 0, 0), p, 1e-12);
        assert_near("Sigma", belief.corrected.get(100, 0, 0), p * v / (c * c * p + v), 1e-12);
    }
}

#[test]
fn kalman_and_information_in_closed_form_at_every_step() {
    let systems = [
        EXAMPLE,
        Scalar { a: 0.9, w: 2.0, v: 0.01, ..EXAMPLE },
        Scalar { a: -1.1, w: 1e-4, v: 5.0, x0: 3.0, ..EXAMPLE },
        Scalar { a: 1.05, w: 0.0, ..EXAMPLE },
        // Nearly perfect sensors: only the Joseph form keeps the digits of what is left.
        Scalar { w: 1.0, v: 1e-12, ..EXAMPLE },
        Scalar { a: -0.7, w: 3.0, v: 1e-14, ..EXAMPLE },
    ];
    for system in systems {
        let Scalar { c, v, .. } = system;
        let steps = 60;
        let state = system.solve(steps);
        for t in 0..=steps {
            let (numerator, denominator) = system.predicted(t);
            let p = numerator / denominator;
            assert_near("P", state.belief.predicted.get(t, 0, 0), p, 1e-12);
            assert_near("Sigma", state.belief.corrected.get(t, 0, 0), p * v / (c * c * p + v), 1e-12);
            assert_near("information", state.information.per_step[t], 0.5 * (1.0 + c * c * p / v).ln(), 1e-12);
        }
        // c^2 P_t + v is the ratio of successive denominators, so the sum of the logarithms telescopes.
        let total = 0.5 * (system.predicted(steps + 1).1.ln() - (steps + 1) as f64 * v.ln());
        assert_near("total information", state.information.total, total, 1e-12);
        assert_near("by entropies", entropy_form(&state.belief).unwrap_or(f64::NAN), total, 1e-12);
    }
}

#[test]
fn measuring_a_constant_gives_half_the_logarithm_of_one_plus_signal_to_noise() {
    let system = Scalar { a: 1.0, b: 0.5, w: 0.0, x0: 2.0, c: 0.7, v: 0.9, ..EXAMPLE };
    let steps = 99;
    let state = system.solve(steps);
    let ratio = |t: f64| t * 0.7 * 0.7 * 2.0 / 0.9;
    for (t, information) in state.information.per_step.iter().enumerate() {
        let t = t as f64;
        assert_near("information", *information, 0.5 * ((1.0 + ratio(t + 1.0)) / (1.0 + ratio(t))).ln(), 1e-12);
    }
    assert_near("total", state.information.total, 0.5 * (1.0 + ratio(100.0)).ln(), 1e-12);
    assert_near("Sigma", state.belief.corrected.get(steps, 0, 0), 2.0 / (1.0 + ratio(100.0)), 1e-12);
}

/// The data-rate theorem: an unstable mode without process noise takes `ln |a|` per step; a stable one nothing.
#[test]
fn information_rate_of_a_noiseless_mode_is_the_logarithm_of_its_eigenvalue() {
    for (a, rate) in [(1.3, 1.3f64.ln()), (-2.0, 2f64.ln()), (0.8, 0.0)] {
        let state = Scalar { a, w: 0.0, ..EXAMPLE }.solve(200);
        let last = state.information.per_step[200];
        assert!((last - rate).abs() < 1e-12, "{last} instead of {rate}");
    }
}

#[test]
fn two_equal_sensors_count_as_one_of_half_the_variance() {
    let one = Scalar { v: 0.5 * EXAMPLE.v, ..EXAMPLE }.solve(25);
    let two = evaluated(&EXAMPLE.task(25, 2), &[]);
    for t in 0..=25 {
        assert_near("information", two.information.per_step[t], one.information.per_step[t], 1e-12);
        assert_near("Sigma", two.belief.corrected.get(t, 0, 0), one.belief.corrected.get(t, 0, 0), 1e-12);
    }
}
