//! Bounds of tasks at a design: their order, on every shipped task, and what the steady state is.

use std::path::Path;

use rayon::prelude::*;
use supple::bound::{BoundOptions, TaskBound};
use supple::pipeline::TaskState;
use supple::plan::PlanMode;
use supple::{EvaluateOptions, Problem, Value};

fn load(name: &str) -> Problem {
    supple_file::load(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks").join(name)).unwrap()
}

fn assert_ordered(bound: &TaskBound) {
    assert!(bound.is_ordered(), "{}: {:#?}", bound.name, bound.order);
    // All but the growth of the open loop, which is no bound over a horizon.
    let ordered = bound.order.iter().filter(|line| line.ordered).count();
    assert_eq!(ordered, if bound.stationary { 5 } else { 3 }, "{}: {:#?}", bound.name, bound.order);
    assert!(bound.minimum_lower_bits_per_step <= bound.minimum_bits_per_step);
    assert!((0.0..=1.0 + 1e-9).contains(&bound.efficiency.unwrap()), "{:?}", bound.efficiency);
    assert!(bound.efficiency.unwrap() <= bound.control_efficiency.unwrap() * (1.0 + 1e-9));
    assert!(bound.quantiser_bits_per_step >= bound.minimum_bits_per_step);
}

#[test]
fn bounds_of_shipped_tasks_are_in_order() {
    let folder = std::fs::read_dir(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../tasks")).unwrap();
    let files = folder.map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let files: Vec<String> = files.filter(|name| name.ends_with(".toml")).collect();
    assert!(files.len() >= 10, "{files:?}");
    files.par_iter().for_each(|name| {
        let problem = load(name);
        let phi = problem.parameters.initial();
        let found = problem.bound(&phi, &BoundOptions::default()).unwrap();
        let evaluated = problem.evaluate(&phi, &EvaluateOptions::default()).unwrap();
        for (bound, task) in found.tasks.iter().zip(&evaluated.tasks) {
            assert_ordered(bound);
            assert_eq!(bound.cost, task.cost.expected, "{name}: at the design's own cost");
            let (before, last) =
                (bound.measurement_per_step_bits.iter().sum::<f64>(), bound.last_measurement_bits.unwrap());
            let total = task.information.total_bits;
            assert!((before + last - total).abs() < 1e-9 * total, "{name}: {before} and {last} of {total}");
            let sum: f64 = bound.minimum_per_step_bits.iter().sum();
            assert!((sum - bound.minimum_bits).abs() < 1e-9 * sum.max(1.0), "{name}");
        }
    });
}

#[test]
fn what_the_virtual_sensor_tells_adds_up_to_the_minimum() {
    let problem = load("two_mass.toml");
    let found = problem.bound(&problem.parameters.initial(), &BoundOptions::default()).unwrap();
    let (bound, sensor) = (&found.tasks[0], &found.tasks[0].virtual_sensor);
    let windows: f64 = sensor.windows.iter().map(|window| window.bits).sum();
    let states: f64 = sensor.measured.iter().map(|state| state.bits).sum();
    // But for directions that the rank leaves out.
    for sum in [windows, states] {
        assert!((sum - bound.minimum_bits).abs() < 1e-2 * bound.minimum_bits, "{sum} and {}", bound.minimum_bits);
    }
    assert_eq!(sensor.states, ["x1", "v1", "x2", "v2", "xw"]);
    assert_eq!(sensor.rank_per_step.len(), bound.steps);
    for (rank, (c, (v, l))) in
        sensor.rank_per_step.iter().zip(sensor.measurement.iter().zip(sensor.variances.iter().zip(&sensor.gain)))
    {
        assert_eq!((c.len(), v.len(), l.len()), (*rank, *rank, 5));
    }
}

#[test]
fn the_steady_state_is_what_long_horizons_tend_to() {
    let mut problem = load("tanaka_plant.toml");
    problem.tasks[0].steps = 400;
    let stationary = BoundOptions { stationary: true, ..Default::default() };
    let steady = problem.bound(&[], &stationary).unwrap().tasks.remove(0);
    assert_ordered(&steady);
    let evaluated = problem.evaluate(&[], &EvaluateOptions::default()).unwrap();
    let task = &evaluated.tasks[0];
    let nats = task.information.per_step_nats[300];
    let bits = steady.measurement_bits_per_step.unwrap() * std::f64::consts::LN_2;
    assert!((bits - nats).abs() < 1e-9, "{bits} and {nats}");
    let nats = task.information.used.as_ref().unwrap().per_step_nats[300];
    let bits = steady.control_bits_per_step.unwrap() * std::f64::consts::LN_2;
    assert!((bits - nats).abs() < 1e-7, "{bits} and {nats}");
    // The ends of the horizon cost a little.
    let per_step = task.cost.expected / 400.0;
    assert!((steady.cost - per_step).abs() < 2e-2 * per_step, "{} and {per_step}", steady.cost);
}

#[test]
fn a_looser_cost_needs_less_and_says_that_there_is_no_efficiency() {
    let problem = load("two_mass_small.toml");
    let phi = problem.parameters.initial();
    let own = problem.bound(&phi, &BoundOptions::default()).unwrap().tasks.remove(0);
    let at = |cost: f64| {
        let options = BoundOptions { cost: Some(cost), ..Default::default() };
        problem.bound(&phi, &options).unwrap().tasks.remove(0)
    };
    let (tight, loose) = (at(0.5 * (own.cost + own.minimum_cost)), at(1.5 * own.cost));
    assert!(loose.minimum_bits < own.minimum_bits && own.minimum_bits < tight.minimum_bits);
    assert_eq!((loose.efficiency, tight.efficiency), (None, None));
    assert!(loose.is_ordered() && tight.is_ordered());
    // The design keeps the loose cost, and not the tight one.
    let of_design = |bound: &TaskBound| bound.order.iter().filter(|line| line.ordered).count();
    assert_eq!((of_design(&loose), of_design(&tight)), (3, 1));
    // With the price of cost on one side and on the other.
    let slope = (tight.minimum_bits - own.minimum_bits) / (own.cost - tight.cost);
    assert!(own.price_bits_per_cost < slope && loose.price_bits_per_cost < own.price_bits_per_cost);
    let free = at(own.open_loop_cost.unwrap() * 1.001);
    assert_eq!((free.minimum_bits, free.virtual_sensor.rank), (0.0, 0));
}

#[test]
fn without_noise_the_least_cost_needs_no_information() {
    let mut problem = load("tanaka_plant.toml");
    let zeros = || supple::noise::Covariance::Diagonal(vec![supple::Value::Number(0.0); 4]);
    problem.tasks[0].noise.initial = zeros();
    problem.tasks[0].noise.process = zeros();
    let bound = problem.bound(&[], &BoundOptions::default()).unwrap().tasks.remove(0);
    assert_eq!((bound.minimum_bits, bound.virtual_sensor.rank, bound.efficiency), (0.0, 0, None));
    assert_eq!(bound.cost, bound.minimum_cost);
}

#[test]
fn a_plan_that_weighs_risk_is_bounded_by_the_law_of_least_expected_cost_along_it() {
    let mut problem = load("two_mass_small.toml");
    problem.planning.plan = PlanMode::Risk;
    let bounds = [0.0, 2.0].map(|sensitivity| {
        problem.planning.risk_sensitivity = sensitivity;
        problem.bound(&problem.parameters.initial(), &BoundOptions::default()).unwrap().tasks.remove(0)
    });
    let [neutral, averse] = &bounds;
    assert_ordered(neutral);
    assert_ordered(averse);
    assert!(averse.cost > neutral.cost, "{} and {}", averse.cost, neutral.cost);
    assert!(averse.remarks.iter().any(|remark| remark.contains("risk")));
    // Along the trajectory of the averse plan: the expected cost of the averse law is above the least one there.
    let mut state = TaskState::new(&problem.tasks[0]);
    let phi = problem.parameters.initial();
    state.evaluate(&problem.tasks[0], &phi, &problem.planning, None).unwrap();
    let horizon = supple::bound::horizon_of_plan(&state.plan, &state.noise).unwrap();
    let belief: f64 = (0..horizon.steps())
        .map(|t| {
            let (price, sigma) = (horizon.prices.at(t), state.belief.corrected.at(t));
            price.iter().zip(sigma).map(|(price, sigma)| price * sigma).sum::<f64>()
        })
        .sum();
    let least = horizon.base_cost + belief;
    assert!(least < state.cost.expected() - 1e-9, "{least} and {}", state.cost.expected());
}

/// `A = R diag(growth) R'` with the noise `R diag(noise) R'` and everything else round, turned by an angle.
fn turned(growth: [f64; 2], noise: [f64; 2], angle: f64, steps: usize, options: &BoundOptions) -> TaskBound {
    let (s, c) = angle.sin_cos();
    let matrix = |[a, b]: [f64; 2]| {
        let cross = c * s * (a - b);
        format!("[[{:?}, {cross:?}], [{cross:?}, {:?}]]", a * c * c + b * s * s, a * s * s + b * c * c)
    };
    let text = format!(
        r#"
        [model]
        kind = "linear"
        A = {}
        B = [[1.0, 0.0], [0.0, 1.0]]
        C = [[1.0, 0.0], [0.0, 1.0]]
        [[tasks]]
        name = "hold"
        steps = {steps}
        time_step = 1.0
        initial_state = [0.0, 0.0]
        noise = {{ initial = [1.0, 1.0], process = {}, measurement = [5.0, 5.0] }}
        [[tasks.costs]]
        kind = "quadratic"
        Q = [[1.0, 0.0], [0.0, 1.0]]
        R = [[1.0, 0.0], [0.0, 1.0]]
        "#,
        matrix(growth),
        matrix(noise)
    );
    supple_file::parse(&text, "test").unwrap().bound(&[], options).unwrap().tasks.remove(0)
}

/// Modes that grow at different paces, some without noise: a convex program over two separate modes gives the numbers.
#[test]
fn modes_of_different_pace_are_bounded_in_any_coordinates() {
    for (growth, noise, steps, known) in [
        ([1.05, 1.0], [1.0, 0.0], 400, Some(0.35072)),
        ([2.0, 1.0], [1.0, 0.0], 30, Some(0.92097)),
        ([2.0, 1.0], [1.0, 0.0], 40, Some(0.95097)),
        ([2.0, 1.0], [1.0, 0.0], 120, Some(1.01359)),
        ([2.0, 1.2], [0.0, 0.0], 120, None),
    ] {
        let whole = BoundOptions::default();
        let [straight, askew] = [0.0, 0.6].map(|angle| turned(growth, noise, angle, steps, &whole));
        for bound in [&straight, &askew] {
            assert_ordered(bound);
            let (least, lower) = (bound.minimum_bits_per_step, bound.minimum_lower_bits_per_step);
            assert!((least - straight.minimum_bits_per_step).abs() < 1e-6, "{growth:?}, {steps} steps: {least}");
            assert!(known.is_none_or(|known| (least - known).abs() < 2e-5), "{growth:?}, {steps} steps: {least}");
            assert!(least - lower < 1e-6, "{growth:?}, {steps} steps: {lower} to {least}");
        }
    }
}

/// Where the state begins has no part in what need be known, however dear it is.
#[test]
fn a_dear_start_does_not_blur_the_minimum() {
    let at = |start: f64| {
        let mut problem = load("tanaka_plant.toml");
        problem.tasks[0].initial_state[0] = Value::from(start);
        problem.bound(&[], &BoundOptions::default()).unwrap().tasks.remove(0).minimum_bits
    };
    let here = at(0.0);
    for start in [1e3, 1e6] {
        assert!((at(start) - here).abs() < 1e-6, "{start}: {} and {here}", at(start));
    }
}

/// A wall: it stays where it is, no noise moves it, and in the end it is known.
#[test]
fn what_neither_grows_nor_is_driven_needs_no_steady_information() {
    let options = BoundOptions { stationary: true, cost: Some(30.0), ..Default::default() };
    let [straight, askew] =
        [0.0, 0.6].map(|angle| turned([1.5, 1.0], [1.0, 0.0], angle, 20, &options).minimum_bits_per_step);
    assert!(straight > 0.58 && (straight - askew).abs() < 1e-6, "{straight} and {askew}");
}

/// `x+ = A x + B u + w` with all states measured to `V = 0.1 I` and the cost `x'x + u'u`, without the factor 1/2 each.
fn steady(a: &[&[f64]], b: &[f64], w: &[&[f64]], cost: Option<f64>) -> TaskBound {
    let n = a.len();
    let row = |i: usize, size: f64| (0..n).map(|j| if i == j { size } else { 0.0 }).collect::<Vec<_>>();
    let identity = [1.0, 0.1].map(|size| (0..n).map(|i| row(i, size)).collect::<Vec<_>>());
    let b: Vec<[f64; 1]> = b.iter().map(|&b| [b]).collect();
    let text = format!(
        "[model]\nkind = \"linear\"\nA = {a:?}\nB = {b:?}\nC = {one:?}\n[[tasks]]\nname = \"hold\"\nsteps = 5\ntime_step = 1.0\n\
         initial_state = {zeros:?}\nnoise = {{ initial = {one:?}, process = {w:?}, measurement = {tenth:?} }}\n\
         [[tasks.costs]]\nkind = \"quadratic\"\nQ = {one:?}\nR = [[1.0]]\n",
        one = identity[0],
        tenth = identity[1],
        zeros = vec![0.0; n],
    );
    let problem = supple_file::parse(&text, "steady.toml").unwrap();
    let options = BoundOptions { stationary: true, cost, ..BoundOptions::default() };
    problem.bound(&[], &options).unwrap().tasks.remove(0)
}

/// Noise of rank 1 that reaches some directions weakly, or hardly matters: the numbers are those of a convex program.
#[test]
fn noise_of_one_direction_is_bounded() {
    let near = |found: &TaskBound, bits: f64| {
        assert!((found.minimum_bits_per_step - bits).abs() < 1e-5, "{} and {bits}", found.minimum_bits_per_step);
        assert!(found.duality_gap_bits < 1e-6 && found.is_ordered(), "{found:?}");
    };
    let a: &[&[f64]] = &[&[-0.7, -0.1], &[0.7, 0.0]];
    let w: &[&[f64]] = &[&[1.0, -1.0], &[-1.0, 1.0]];
    near(&steady(a, &[0.0, 1.0], w, Some(3.1)), 0.617_125);
    near(&steady(a, &[0.0, 1.0], w, None), 2.208_3);
    let a: &[&[f64]] = &[&[-0.8, -0.8, 0.3], &[-1.0, -0.6, 0.6], &[0.4, 1.0, -0.2]];
    let w: &[&[f64]] = &[&[1.0, 0.0, 1.0], &[0.0, 0.0, 0.0], &[1.0, 0.0, 1.0]];
    near(&steady(a, &[0.0, 0.0, 1.0], w, Some(20.0)), 1.152_16);
    near(&steady(a, &[0.0, 0.0, 1.0], w, Some(100.0)), 0.996_33);
    assert!((steady(a, &[0.0, 0.0, 1.0], w, None).cost - 16.566).abs() < 1e-3);
    // What the noise drives has left before anything can be done about it.
    let found = steady(&[&[-0.8, 0.8], &[-0.8, 0.8]], &[0.0, 1.0], &[&[1.0, 1.0], &[1.0, 1.0]], None);
    assert!((found.cost - 2.0).abs() < 1e-9 && found.minimum_bits_per_step == 0.0, "{found:?}");
}

/// Noise drives nothing, and one mode of three grows: it is what must be told of, whatever the cost.
#[test]
fn a_growing_mode_without_noise_needs_its_growth() {
    let a: &[&[f64]] = &[
        &[-0.148_339_300_235_401_87, 0.906_291_492_080_341_7, -0.678_671_125_975_548_8],
        &[0.568_902_891_968_723_3, 1.017_508_465_055_742, -0.037_961_897_543_444_42],
        &[-0.617_596_214_544_271_3, 0.004_335_384_621_146_489_6, 0.294_434_773_771_404_9],
    ];
    let none: &[&[f64]] = &[&[0.0; 3], &[0.0; 3], &[0.0; 3]];
    for cost in [Some(0.1), Some(1.0), Some(1e4), None] {
        let found = steady(a, &[0.3, -1.0, 0.5], none, cost);
        assert!((found.minimum_bits_per_step - 1.448_848_56_f64.log2()).abs() < 1e-6, "{cost:?}: {found:?}");
    }
}

/// Filters whose modes are close to the unit circle settle late.
#[test]
fn slow_filters_have_a_steady_state() {
    for (a, w, predicted) in [(0.999, 0.0, 0.0), (1.0001, 0.0, 0.1 * (1.0001_f64.powi(2) - 1.0)), (1.0, 1e-9, 1e-5)] {
        let found = steady(&[&[a]], &[1.0], &[&[w]], None);
        // 1/2 log2 (1 + P / V)
        let bits = 0.5 * (1.0 + predicted / 0.1_f64).log2();
        let line = found.order.iter().find(|line| line.what.contains("y")).unwrap();
        assert!((line.bits_per_step.unwrap() - bits).abs() <= 1e-3 * bits, "{a}, {w}: {found:?}");
    }
}

/// One control that tells all of one measurement, in a loop whose way back from controls to measurements is unstable: what
/// rounding leaves of the measurements told before must not grow.
#[test]
fn a_control_that_tells_all_tells_no_more_however_long() {
    let text = r#"
        [model]
        kind = "linear"
        A = [[-0.108, -0.133, 0.295], [0.147, 0.033, 0.139], [0.165, -0.283, -0.03]]
        B = [[0.704], [-1.232], [0.067]]
        C = [[-0.074, -1.265, -0.015]]
        [[tasks]]
        name = "go"
        steps = 200
        time_step = 1.0
        initial_state = [0.0, 0.0, 0.0]
        [tasks.noise]
        initial = [0.0, 0.0, 0.0]
        process = [[0.525625, -0.94395, -0.335675], [-0.94395, 1.695204, 0.602826], [-0.335675, 0.602826, 0.214369]]
        measurement = [0.1]
        [[tasks.costs]]
        kind = "quadratic"
        Q = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
        R = [[0.123]]
    "#;
    let bound = supple_file::parse(text, "test").unwrap().bound(&[], &BoundOptions::default()).unwrap().tasks.remove(0);
    for (told, measured) in bound.control_per_step_bits.iter().zip(&bound.measurement_per_step_bits) {
        assert!((told - measured).abs() < 1e-9, "{told} and {measured}");
    }
    assert!(bound.is_ordered());
}

/// The control is free and what costs has a zero at 2: in double precision the law costs 8 with the state known, not 5.
#[test]
fn a_law_that_rounding_changed_is_named_and_bounds_nothing() {
    let text = r#"
        title = "zero"
        [model]
        kind = "linear"
        A = [[0.5, 0.0], [1.0, 0.0]]
        B = [[1.0], [0.0]]
        C = [[1.0, 0.0], [0.0, 1.0]]
        [[tasks]]
        name = "t"
        steps = 40
        time_step = 1.0
        initial_state = [0.0, 0.0]
        initial_control = [0.0]
        [tasks.noise]
        initial = [[1.0, 0.0], [0.0, 1.0]]
        process = [[0.0, 0.0], [0.0, 0.0]]
        measurement = [[1.0, 0.0], [0.0, 1.0]]
        [[tasks.costs]]
        kind = "quadratic"
        Q = [[1.0, -2.0], [-2.0, 4.0]]
        R = [[0.0]]
    "#;
    let problem = supple_file::parse(text, "test").unwrap();
    let at = |cost: Option<f64>| {
        let options = BoundOptions { cost, ..BoundOptions::default() };
        problem.bound(&[], &options).unwrap().tasks.remove(0)
    };
    let own = at(None);
    assert!((own.minimum_cost - 5.0).abs() < 1e-9, "{}", own.minimum_cost);
    assert!(own.remarks.iter().any(|remark| remark.contains("rounding affects this design's control law")));
    // Without measurements it costs 8.
    assert!(own.minimum_bits < 1e-4 && own.minimum_lower_bits_per_step <= own.minimum_bits_per_step, "{own:?}");
    let tight = at(Some(5.5));
    assert!(tight.proved && tight.minimum_lower_bits_per_step > 0.01, "{tight:?}");
    assert!(tight.duality_gap_bits >= 0.0 && tight.duality_gap_bits < 1e-6, "{tight:?}");
    // What an evaluation says is needed at this limit is what the proved law needs, too.
    let limited = supple_file::parse(&text.replace("steps = 40", "steps = 40\n        bound = 5.5"), "test").unwrap();
    let options = EvaluateOptions { needed: true, ..EvaluateOptions::default() };
    let task = limited.evaluate(&[], &options).unwrap().tasks.remove(0);
    let needed = task.information.needed.unwrap().total_bits;
    assert!((needed - tight.minimum_bits).abs() < 1e-6, "{needed} of {}", tight.minimum_bits);
    assert!(task.warnings.iter().any(|warning| warning.starts_with("rounding affects")), "{:?}", task.warnings);
}

/// A linear task of so many steps, without first guess and mean, whose states are all measured.
fn linear(arrays: &str, costs: &str, noise: &str, steps: usize, states: usize, controls: usize) -> Problem {
    let (zeros, ones) = (vec![0.0; states.max(controls)], vec![1.0; states]);
    let text = format!(
        "[model]\nkind = \"linear\"\n{arrays}\n[[tasks]]\nname = \"t\"\nsteps = {steps}\ntime_step = 1.0\n\
         initial_state = {:?}\ninitial_control = {:?}\n[tasks.noise]\n{noise}\nmeasurement = {ones:?}\n\
         [[tasks.costs]]\nkind = \"quadratic\"\n{costs}",
        &zeros[..states],
        &zeros[..controls],
    );
    supple_file::parse(&text, "test").unwrap()
}

/// The zeros of `z^2 + 2.5 z - 1.5` are 0.5 and -3: the best is to keep the output at what the noise adds, at a cost of 1
/// per step, and double precision finds laws that cost more, or a curvature that is not convex.
#[test]
fn bounds_are_those_of_the_exact_law_where_rounding_makes_plans_indefinite() {
    let costs = "Q = [[1.0, 2.5, -1.5], [2.5, 6.25, -3.75], [-1.5, -3.75, 2.25]]\nR = [[0.0]]";
    let noise = "initial = [0.0, 0.0, 0.0]\nprocess = [1.0, 0.0, 0.0]";
    let eye = "[[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]";
    let mut indefinite = 0;
    for [a, b, c] in
        [[-0.5, 0.25, 0.05], [-0.48318163665516267, 0.25753978461780164, 0.05307120031184715], [0.3, -0.7, 0.2]]
    {
        for steps in [12, 18, 26] {
            let arrays = format!(
                "A = [[{a}, {b}, {c}], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]\nB = [[1.0], [0.0], [0.0]]\nC = {eye}"
            );
            let problem = linear(&arrays, costs, noise, steps, 3, 1);
            let options = BoundOptions { cost: Some(3.0 * steps as f64), ..BoundOptions::default() };
            let bound = problem.bound(&[], &options).unwrap().tasks.remove(0);
            assert!(bound.proved, "{bound:?}");
            assert!((bound.minimum_cost - steps as f64).abs() < 1e-9 * steps as f64, "{}", bound.minimum_cost);
            indefinite += usize::from(bound.remarks.iter().any(|remark| remark.contains("indefinite")));
        }
    }
    assert!(indefinite > 0, "some of these plans are indefinite in double precision");
}

/// A cost `q q'` is indefinite once its entries are rounded: free controls would lower it without end, by the last digit.
#[test]
fn rounded_products_are_costs_that_are_proved() {
    let mut state = 11u32;
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state >> 8) / f64::from(3 << 22) - 2.0 / 3.0
    };
    let mut raised = 0;
    for (states, steps) in [(2, 4), (3, 4), (3, 7), (4, 5)].repeat(5) {
        let mut list = |count: usize| (0..count).map(|_| next()).collect::<Vec<f64>>();
        let rows = |entries: &[f64], width: usize| format!("{:?}", entries.chunks(width).collect::<Vec<_>>());
        let product =
            |v: Vec<f64>| rows(&v.iter().flat_map(|a| v.iter().map(move |b| a * b)).collect::<Vec<_>>(), states);
        let eye: Vec<f64> = (0..states * states).map(|i| f64::from(u8::from(i % (states + 1) == 0))).collect();
        let (a, b) = (rows(&list(states * states), states), rows(&list(states * 2), 2));
        let arrays = format!("A = {a}\nB = {b}\nC = {}", rows(&eye, states));
        let costs = format!("Q = {}\nR = [[0.0, 0.0], [0.0, 0.0]]", product(list(states)));
        let noise = format!("initial = {}\nprocess = {}", rows(&eye, states), product(list(states)));
        let problem = linear(&arrays, &costs, &noise, steps, states, 2);
        let at = |cost: f64| {
            let options = BoundOptions { cost: Some(cost), ..BoundOptions::default() };
            problem.bound(&[], &options).unwrap().tasks.remove(0)
        };
        let least = at(1e3).minimum_cost;
        for share in [0.01, 0.1, 0.3] {
            let bound = at(least * (1.0 + share));
            assert!(bound.proved, "{bound:?}");
            assert!(bound.proof_distance.unwrap() < 1e-13, "{bound:?}");
            assert!(
                bound.minimum_lower_bits_per_step <= bound.achieved_bits_per_step.unwrap() * (1.0 + 1e-9),
                "{bound:?}"
            );
            raised += usize::from(bound.proof_distance.unwrap() > 1e-15);
        }
    }
    assert!(raised > 0, "some of these costs are indefinite by rounding");
}

/// Where the first state is hardly known, a precise sensor leaves next to nothing of much: what a filter takes away in one
/// step then loses all digits of what is left, and the virtual sensor seemed to need 27 bits instead of 177.
#[test]
fn precise_sensors_of_what_grows_achieve_what_they_do() {
    for (initial, variance, price) in [(1e6, 1e-5, 1e-6), (1e3, 1e-6, 1.0), (1e6, 1e-12, 1.0)] {
        let text = format!(
            "[model]\nkind = \"linear\"\nA = [[3.1]]\nB = [[1]]\nC = [[1]]\n[[tasks]]\nname = \"t\"\nsteps = 100\n\
             time_step = 1.0\ninitial_state = [0]\ninitial_control = [0]\n[tasks.noise]\ninitial = [{initial:e}]\n\
             process = [0.0]\nmeasurement = [{variance:e}]\n[[tasks.costs]]\nkind = \"quadratic\"\nQ = [[1]]\n\
             R = [[{price:e}]]\n"
        );
        let problem = supple_file::parse(&text, "test").unwrap();
        let bound = problem.bound(&[], &BoundOptions::default()).unwrap().tasks.remove(0);
        assert!(bound.proved, "{bound:?}");
        let (lower, achieved) = (bound.minimum_lower_bits_per_step, bound.achieved_bits_per_step.unwrap());
        assert!(lower <= achieved * (1.0 + 1e-9) && achieved < lower + 0.01, "{lower} {achieved}");
        assert!(achieved > 3.1f64.log2(), "{achieved}");
    }
}

/// After the second step nothing moves that costs anything.
#[test]
fn decisions_before_which_nothing_is_left_to_know_need_no_bits() {
    let arrays = "A = [[0.0, 0.7], [0.0, 0.0]]\nB = [[0.0, -0.7], [0.0, 0.2]]\nC = [[1.0, 0.0], [0.0, 1.0]]";
    let costs = "Q = [[0.25, 0.0], [0.0, 0.0]]\nR = [[1.625, 0.9375], [0.9375, 2.5625]]";
    let noise = "initial = [[0.09090222429851177, -0.056497808982419656], [-0.056497808982419656, 0.03511467892503745]]\n\
                 process = [0.0, 0.0]";
    let problem = linear(arrays, costs, noise, 26, 2, 2);
    for cost in [0.0268, 0.0269, 0.02698971325919385, 0.027] {
        let options = BoundOptions { cost: Some(cost), ..BoundOptions::default() };
        let bound = problem.bound(&[], &options).unwrap().tasks.remove(0);
        assert!(bound.proved && bound.minimum_bits > 0.0, "{bound:?}");
    }
}
