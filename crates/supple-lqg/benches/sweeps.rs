//! Times every sweep over random knots of given sizes, in process on one thread, and prints one line of JSON for each:
//! `cargo bench -p supple-lqg --bench sweeps -- [STATES,CONTROLS,MEASUREMENTS ..]`. `SECONDS_EACH` is how long each is
//! repeated (0.3), `PART` the only one that is timed.
//!
//! Positions follow rates, as in every robot, and the measurements are the first states with independent noise; parts
//! whose names end in `_dense` mix all states in their measurements. Steps are as many as keep a run below a millisecond.
#![allow(missing_docs, clippy::unwrap_used, clippy::print_stdout)]

use std::hint::black_box;

use supple_lqg::{
    Belief, BeliefAdjoint, BeliefSeeds, ControlBounds, Dimensions, KnotAdjoints, Knots, Limits, Lq, Matrices, Noise,
    Policy, Regularisation, RiccatiAdjoint, RiccatiSeeds, kalman, reverse_kalman, reverse_riccati, solve_limited,
    solve_riccati,
};

#[path = "common/timing.rs"]
mod timing;

use timing::times;

/// Numbers between -1 and 1.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / f64::from(1_u32 << 30) - 1.0
    }
}

/// Runs work again and again, and prints the least and the median time of a run, ns for each step.
fn time(name: &str, sizes: &str, steps: usize, work: impl FnMut()) {
    if std::env::var("PART").is_ok_and(|part| part != name) {
        return;
    }
    let seconds = std::env::var("SECONDS_EACH").ok().and_then(|text| text.parse().ok()).unwrap_or(0.3);
    let times = times(seconds, work);
    let [least, median] = [times[0], times[times.len() / 2]].map(|time| 1e9 * time / steps as f64);
    println!("{{\"sizes\": \"{sizes}\", \"name\": \"{name}\", \"least_ns\": {least:.1}, \"median_ns\": {median:.1}}}");
}

fn knots(dimensions: Dimensions, steps: usize, random: &mut Random) -> Knots {
    let Dimensions { states: n, controls: m, measurements: p } = dimensions;
    let (half, joint, dt) = (n / 2, n + m, 1e-3);
    let mut knots = Knots::zeros(dimensions, steps);
    for t in 0..=steps {
        for i in 0..joint {
            for j in 0..i {
                let entry = 0.1 * random.next() / joint as f64;
                knots.cost.set(t, i, j, entry);
                knots.cost.set(t, j, i, entry);
            }
            knots.cost.set(t, i, i, 1.0);
            knots.cost.set(t, i, joint, random.next());
        }
        for i in 0..p {
            (0..n).for_each(|j| knots.measurement.set(t, i, j, random.next()));
        }
        if t == steps {
            break;
        }
        for (i, j) in (half..n).flat_map(|i| (0..joint).map(move |j| (i, j))) {
            let own = if i == j { 0.9 } else { 0.0 };
            knots.dynamics.set(t, i, j, own + 0.05 * random.next() / (n as f64).sqrt());
        }
        for (i, j) in (0..half).flat_map(|i| (0..joint).map(move |j| (i, j))) {
            let own = if i == j { 1.0 } else { 0.0 };
            let rate = knots.dynamics.get(t, n - half + i, j);
            knots.dynamics.set(t, i, j, own + dt * rate);
        }
    }
    knots
}

fn noise(n: usize, p: usize) -> Noise {
    let mut noise = Noise::zeros(n, p);
    for i in 0..n {
        noise.initial.set(0, i, i, 1e-2);
        noise.process.set(0, i, i, 1e-4);
    }
    (0..p).for_each(|i| noise.measurement.set(0, i, i, 1e-3));
    noise
}

fn run(sizes: &str, dimensions: Dimensions) {
    let Dimensions { states: n, controls: m, measurements: p } = dimensions;
    // About 3 flops in a nanosecond.
    let steps = (500_000 / (n + m).pow(3)).clamp(20, 500);
    let random = &mut Random(1);
    let dense = knots(dimensions, steps, random);
    let picked = Knots { picks: Some((0..p).collect()), ..dense.clone() };
    let noise = noise(n, p);
    let mut policy = Policy::zeros(dimensions, steps);
    let (dynamics, cost) = (&dense.dynamics, &dense.cost);
    let regularisation = Regularisation::default();
    time("riccati", sizes, steps, || {
        let lq = Lq { dynamics, cost: black_box(cost), regularisation, limits: None, with_value: false };
        solve_limited(lq, &mut policy).unwrap();
    });
    time("riccati_with_value", sizes, steps, || {
        solve_riccati(dynamics, black_box(cost), regularisation, &mut policy).unwrap();
    });
    let regularisation = Regularisation { control: 1e-6, state: 1e-6 };
    time("riccati_regularised", sizes, steps, || {
        let lq = Lq { dynamics, cost: black_box(cost), regularisation, limits: None, with_value: false };
        solve_limited(lq, &mut policy).unwrap();
    });
    let controls = Matrices::vectors(steps, m);
    let bounds = ControlBounds::new(&vec![[-0.5, 0.5]; m]);
    let limits = Some(Limits::Bounds(&bounds, &controls));
    time("riccati_limited", sizes, steps, || {
        let regularisation = Regularisation::default();
        let lq = Lq { dynamics, cost: black_box(cost), regularisation, limits, with_value: false };
        solve_limited(lq, &mut policy).unwrap();
    });
    solve_riccati(dynamics, cost, Regularisation::default(), &mut policy).unwrap();
    let mut belief = Belief::zeros(n, p, steps);
    let mut adjoints = KnotAdjoints::zeros(dimensions, steps);
    let mut by_noise = Noise::zeros(n, p);
    let mut work = BeliefAdjoint::new(n, p);
    let seeds = BeliefSeeds { information: 1.0, ..BeliefSeeds::default() };
    for (ending, knots) in [("", &picked), ("_dense", &dense)] {
        time(&format!("kalman{ending}"), sizes, steps, || {
            kalman(black_box(knots), &noise, &mut belief).unwrap();
        });
        kalman(knots, &noise, &mut belief).unwrap();
        time(&format!("reverse_kalman{ending}"), sizes, steps, || {
            reverse_kalman(black_box(knots), &noise, &belief, seeds, &mut work, &mut adjoints, &mut by_noise);
        });
    }
    let mut memory = RiccatiAdjoint::new(n, n + m);
    let seeds = RiccatiSeeds { belief: 1.0, process: 1.0, initial: 1.0, partials: None };
    time("reverse_riccati", sizes, steps, || {
        reverse_riccati(black_box(&dense), &policy, &belief, &noise, seeds, &mut memory, &mut adjoints);
    });
}

fn main() {
    let given: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let usual = ["4,1,2", "4,2,2", "8,2,4", "12,6,6", "14,7,7", "16,7,14", "30,14,15", "58,29,29", "64,32,32"];
    let all = if given.is_empty() { usual.map(String::from).to_vec() } else { given };
    for sizes in &all {
        let numbers: Vec<usize> = sizes.split(',').map(|number| number.parse().unwrap()).collect();
        let [states, controls, measurements] = numbers[..] else { panic!("three numbers: {sizes}") };
        run(sizes, Dimensions { states, controls, measurements });
    }
}
