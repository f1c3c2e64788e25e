//! The main job: the optimum of the shipped tasks, from many starts.

use crate::common;

use std::sync::atomic::AtomicBool;

use crate::common::shipped;
use supple::Stop;
use supple::aims::weighted_information;
use supple::design::{
    Aim, Control, Design, DesignSettings, DesignStatus, Ending, GradientKind, InformationWeights, Method, Optimiser,
    OuterProblem, Searcher, StartSummary, design,
};
use supple::pipeline::TaskState;
use supple::{EvaluateOptions, Problem};

fn search(problem: &Problem, settings: &DesignSettings) -> Design {
    let control = Control::default();
    design(problem, &problem.parameters.initial(), settings, control).unwrap()
}

/// From the file's start and ten random ones.
fn eleven_starts() -> DesignSettings {
    DesignSettings { starts: 11, ..Default::default() }
}

#[test]
fn all_starts_reach_one_optimum() {
    let problem = shipped("two_mass.toml");
    let found = search(&problem, &eleven_starts());
    assert_eq!(found.status, DesignStatus::Converged);
    for StartSummary { status, information, costs, to, branches, .. } in &found.starts {
        assert_eq!(*status, DesignStatus::Converged);
        assert!(*information <= 169.0, "{information} nat");
        assert!(costs[0] <= 250.05, "cost {}", costs[0]);
        assert!((information - 168.28594).abs() < 1e-4, "{information} nat");
        assert!((to[0] - 135.9121).abs() < 1e-3 && (150.0..200.0).contains(&to[1]), "{to:?}");
        assert!(*branches > 1);
    }
}

/// What the paper's method does from the same starts: it scatters, and most of its ends are no optima.
#[test]
fn barrier_with_the_frozen_gradient_does_not_meet_in_one_point() {
    let problem = shipped("two_mass.toml");
    let settings = DesignSettings { method: Method::Barrier, gradient: GradientKind::Frozen, ..eleven_starts() };
    let found = search(&problem, &settings);
    let feasible = found.starts.iter().filter(|start| start.violation <= 1e-6);
    let ends: Vec<f64> = feasible.map(|start| start.information).collect();
    let least = ends.iter().copied().fold(f64::INFINITY, f64::min);
    let most = ends.iter().copied().fold(0.0, f64::max);
    assert!(least > 168.29 + 5.0, "none comes near the optimum: {least}");
    assert!(most - least > 20.0, "they scatter: {least} to {most}");
    assert!(found.starts.iter().all(|start| start.status != DesignStatus::Converged));
}

/// Its barrier drives it from a start near the limits to a design with more information, and it ends there.
#[test]
fn barrier_returns_no_design_worse_than_its_start() {
    let tasks = [("t0", 11, 4.4712, [-0.08, 1.46, -0.52]), ("t1", 12, 5.1427, [-1.34, 0.0, -0.03])];
    let tasks = tasks.map(|(name, steps, bound, from)| {
        format!(
            "[[tasks]]
name = '{name}'
steps = {steps}
time_step = 0.1
initial_state = {from:?}
bound = {bound}
noise = {{ initial = [0.08, 0.16, 0.028], process = [0.0037, 0.0011, 0.0023], measurement = ['v'] }}
[[tasks.costs]]
kind = 'quadratic'
Q = [[0.8, 0.0, 0.0], [0.0, 0.97, 0.0], [0.0, 0.0, 1.47]]
R = [[0.87]]
final = [[0.35, 0.0, 0.0], [0.0, 4.78, 0.0], [0.0, 0.0, 3.63]]
"
        )
    });
    let text = format!(
        "[model]
kind = 'linear'
A = [[0.324, -0.123, -0.809], [-0.066, 0.465, 0.313], [0.335, 0.487, 1.069]]
B = [['sqrt(1 + b^2) * -0.053'], ['0.86 * a'], [1.505]]
C = [[-0.654, 0.61, -0.043]]
[parameters]
a = {{ initial = 1.0, bounds = [0.62, 4.65], scale = 'log' }}
b = {{ initial = 0.25, bounds = [0.0, 4.0] }}
v = {{ initial = 0.015, bounds = [0.00076, 0.31], scale = 'log' }}
{}",
        tasks.join("")
    );
    let problem = supple_file::parse(&text, "task.toml").unwrap();
    let settings = DesignSettings { method: Method::Barrier, starts: 1, ..Default::default() };
    let found = search(&problem, &settings);
    let first = problem.evaluate(&problem.parameters.initial(), &EvaluateOptions::default()).unwrap();
    let first: f64 = first.tasks.iter().map(|task| task.information.total_nats).sum();
    assert!(found.found().information <= first, "{} {first}", found.found().information);
}

/// Without gradients it takes more designs, and ends at the same one.
#[test]
fn linear_approximations_reach_the_same_optimum() {
    let problem = shipped("two_mass.toml");
    let settings = DesignSettings { method: Method::Cobyla, starts: 2, tolerance: 1e-8, ..Default::default() };
    let found = search(&problem, &settings);
    for StartSummary { information, costs, to, status, .. } in &found.starts {
        assert!(costs[0] <= 250.05, "cost {}", costs[0]);
        assert!((information - 168.28594).abs() < 1e-2, "{information} nat, {status:?}");
        assert!((to[0] - 135.9121).abs() < 0.1, "{to:?}");
    }
    let small =
        search(&shipped("two_mass_small.toml"), &DesignSettings { method: Method::Cobyla, ..Default::default() });
    assert!((small.starts[small.best].to[0] - 20.0).abs() < 1e-3, "k1 at its lower bound");
}

#[test]
fn small_task_ends_at_the_box() {
    let problem = shipped("two_mass_small.toml");
    let found = search(&problem, &DesignSettings::default());
    assert_eq!(found.status, DesignStatus::Converged);
    let best = &found.starts[found.best];
    assert!((best.to[0] - 20.0).abs() < 1e-9, "k1 at its lower bound: {:?}", best.to);
    assert!(best.costs[0] < 25.0 && best.multipliers[0] == 0.0, "the bound on the cost is not active");
}

#[test]
fn impossible_bound_is_reported_with_its_violation() {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass_small.toml")).unwrap();
    let problem = supple_file::parse(&text.replace("bound = 25.0", "bound = 5.0"), "test").unwrap();
    let found = search(&problem, &DesignSettings { starts: 2, ..Default::default() });
    assert_eq!(found.status, DesignStatus::BoundViolated);
    let best = &found.starts[found.best];
    assert!((best.violation - 0.9343).abs() < 1e-3, "the least that can be missed by: {}", best.violation);
    assert_eq!(best.multipliers, [0.0], "no price is put on a bound that cannot be met");
}

#[test]
fn no_bound_gives_the_least_information_of_the_box() {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass_small.toml")).unwrap();
    let problem = supple_file::parse(&text.replace("bound = 25.0\n", ""), "test").unwrap();
    let found = search(&problem, &DesignSettings { starts: 2, ..Default::default() });
    assert_eq!(found.status, DesignStatus::Converged);
    assert!((found.starts[found.best].to[0] - 20.0).abs() < 1e-9);
}

#[test]
fn same_seed_gives_the_same_bits_on_any_number_of_threads() {
    let problem = shipped("two_mass.toml");
    let settings = DesignSettings { starts: 3, seed: 5, ..Default::default() };
    let run = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let found = pool.install(|| search(&problem, &settings));
        found.starts.into_iter().map(|start| (start.to, start.information, start.costs)).collect::<Vec<_>>()
    };
    assert_eq!(run(1), run(8));
}

#[test]
fn a_stop_keeps_what_was_found() {
    let problem = shipped("two_mass.toml");
    let stop = AtomicBool::new(true);
    let control = Control { stop: Stop::when(&stop), ..Control::default() };
    let settings = DesignSettings { starts: 1, ..Default::default() };
    let found = design(&problem, &problem.parameters.initial(), &settings, control).unwrap();
    assert_eq!(found.status, DesignStatus::Stopped);
    assert!(found.starts[0].information.is_finite() && !found.starts[0].controls.is_empty());
}

/// Optima that neither a limit nor the box holds were never told as such: there, all gradients are zero. The reference is
/// a sweep over `k`.
#[test]
fn optima_that_no_limit_holds_are_optima() {
    let text = |bound: &str| {
        format!(
            r#"
[model]
kind = "linear"
A = [[1.0, 0.1], ["-0.1 * k", 1.0]]
B = [[0.0], [0.1]]
C = [[1.0, 0.0]]

[parameters.k]
initial = 1.0
bounds = [0.1, 10.0]

[[tasks]]
name = "hold"
steps = 20
time_step = 0.1
initial_state = [1.0, 0.0]
{bound}
noise = {{ initial = [0.1, 0.1], process = [1e-4, 1e-4], measurement = [1e-2] }}
costs = [{{ kind = "quadratic", Q = [[1.0, 0.0], [0.0, 0.0]], R = [[0.1]], final = [[10.0, 0.0], [0.0, 0.0]] }}]
"#
        )
    };
    for (bound, method) in [("", Method::Sqp), ("bound = 100", Method::Sqp), ("", Method::Cobyla)] {
        let problem = supple_file::parse(&text(bound), "hold.toml").unwrap();
        let settings = DesignSettings { method, starts: 1, tolerance: 1e-8, ..Default::default() };
        for first in [0.5, 2.0, 4.735_589_839_572_523, 9.0] {
            let found = design(&problem, &[first], &settings, Control::default()).unwrap();
            let StartSummary { to, optimality, information, .. } = &found.starts[0];
            assert_eq!(found.status, DesignStatus::Converged, "{method:?} from {first}: {optimality}");
            assert!((to[0] - 4.735_59).abs() < 1e-3, "{method:?} from {first}: {to:?}");
            assert!((information / std::f64::consts::LN_2 - 6.604_196).abs() < 1e-5, "{information}");
        }
        // Beside the optimum, where the gradient is not zero, a search that ends has not converged.
        let settings = DesignSettings { max_evaluations: 1, ..settings };
        let found = design(&problem, &[4.6], &settings, Control::default()).unwrap();
        assert_ne!(found.status, DesignStatus::Converged, "{}", found.starts[0].optimality);
    }
}

/// A scalar system with these entries `A` and `C`, these parameters, and tasks of these lines.
fn scalar([dynamics, measurement]: [&str; 2], parameters: &str, tasks: &[String]) -> Problem {
    let mut text = format!(
        "model = {{ kind = \"linear\", A = [[{dynamics}]], B = [[1.0]], C = [[{measurement}]] }}\n[parameters]\n{parameters}\n"
    );
    for (index, task) in tasks.iter().enumerate() {
        text += &format!("[[tasks]]\nname = \"t{index}\"\ntime_step = 0.1\n{task}\n");
    }
    supple_file::parse(&text, "scalar.toml").unwrap()
}

/// Two tasks pull at `a` from both sides: their cost gradients are nearly opposite, and multipliers were wrong by a factor of 2,
/// so that the optimum was not told as one. The references are differences of designs with other limits.
#[test]
fn opposing_limits_have_their_own_prices() {
    let with = |limits: [f64; 2]| {
        let starts = ["10.0 * a", "10.0 * (1 - a)"];
        let tasks = [0, 1].map(|index| {
            format!(
                "steps = 10\ninitial_state = [\"{}\"]\nbound = {}\nnoise = {{ initial = [0.1], process = [0.1], measurement = \
                 [\"v\"] }}\ncosts = [{{ kind = \"quadratic\", Q = [[1.0]], R = [[1.0]], final = [[1.0]] }}]",
                starts[index], limits[index]
            )
        });
        let parameters =
            "a = { initial = 0.5, bounds = [0.0, 1.0] }\nv = { initial = 0.1, bounds = [1e-3, 10.0], scale = \"log\" }";
        let problem = scalar(["0.9", "1.0"], parameters, &tasks);
        let found = search(&problem, &DesignSettings { starts: 1, tolerance: 1e-10, ..Default::default() });
        assert_eq!(found.status, DesignStatus::Converged, "{}", found.starts[0].optimality);
        found.starts[found.best].clone()
    };
    let (limits, by) = ([39.644, 40.041], 1e-3);
    let found = with(limits);
    for index in 0..2 {
        let moved = |by: f64| {
            let mut limits = limits;
            limits[index] += by;
            with(limits).information
        };
        let saved = (moved(-by) - moved(by)) / (2.0 * by);
        assert!((found.multipliers[index] / saved - 1.0).abs() < 1e-3, "{} is not {saved}", found.multipliers[index]);
    }
}

/// A range far wider than what matters: the first step went to a sensor that sees nothing, where all slopes are 0, and the
/// search returned its start. The reference is a brute-force search in NumPy.
#[test]
fn wide_ranges_that_include_zero_are_searched() {
    for upper in ["3.0", "10.0", "100.0", "1e3"] {
        let parameters = format!("c = {{ initial = 1.0, bounds = [0.0, {upper}] }}");
        let task = "steps = 8\ninitial_state = [1.0]\nbound = 5.6423\nnoise = { initial = [0.3], process = [0.1], measurement = \
                    [0.2] }\ncosts = [{ kind = \"quadratic\", Q = [[1.0]], R = [[0.5]], final = [[1.0]] }]";
        let problem = scalar(["1.1", "\"c\""], &parameters, &[task.to_owned()]);
        let found = search(&problem, &DesignSettings { starts: 1, ..Default::default() });
        let StartSummary { to, information, multipliers, .. } = &found.starts[0];
        assert_eq!(found.status, DesignStatus::Converged, "up to {upper}: {to:?}");
        assert!(
            (to[0] - 0.500_005).abs() < 1e-4 && (information / std::f64::consts::LN_2 - 2.689).abs() < 1e-3,
            "{to:?}"
        );
        assert!((multipliers[0] / std::f64::consts::LN_2 - 0.8303).abs() < 1e-3, "{multipliers:?}");
        assert!(!problem.parameters.get(0).is_at(0.0, to[0]), "0.5 is not at 0");
    }
}

/// Needed information falls as the limit rises, also where the plan's own cost does not reach it.
#[test]
fn limits_have_a_price_for_needed_information() {
    for information in [InformationWeights::NEEDED, InformationWeights { needed: 1.0, used: 0.0, measured: 0.1 }] {
        let with = |limit: f64| {
            let parameters = "a = { initial = 1.37, bounds = [1.07, 1.67] }\nc = { initial = 1.0, bounds = [0.1, 10.0], scale = \"log\" }";
            let task = format!(
                "steps = 6\ninitial_state = [0.5]\nbound = {limit}\nnoise = {{ initial = [0.4], process = [\"0.1 * (1 + 3 * (a - \
                 1.43)^2)\"], measurement = [0.2] }}\ncosts = [{{ kind = \"quadratic\", Q = [[1.0]], R = [[0.3]], final = [[2.0]] }}]"
            );
            let problem = scalar(["\"a\"", "\"c\""], parameters, &[task]);
            let settings = DesignSettings { starts: 1, tolerance: 1e-10, information, ..Default::default() };
            let found = search(&problem, &settings);
            found.starts[found.best].clone()
        };
        let by = 1e-2;
        let [found, tighter, looser] = [0.0, -by, by].map(|by| with(3.694 + by));
        let saved = (tighter.objective - looser.objective) / (2.0 * by);
        assert!(
            saved > 0.1 && (found.multipliers[0] / saved - 1.0).abs() < 1e-2,
            "{:?} is not {saved}",
            found.multipliers
        );
    }
}

/// Two tasks that pull in opposite directions, with limits that no design meets: each method ends where the greatest excess is
/// least, by a scan over all designs.
#[test]
fn designs_that_miss_limits_are_the_nearest_to_them() {
    let limits = [34.0, 33.0];
    let starts = ["10.0 * a", "10.0 * (1 - a)"];
    let tasks = [0, 1].map(|index| {
        format!(
            "steps = 10\ninitial_state = [\"{}\"]\nbound = {}\nnoise = {{ initial = [0.1], process = [0.1], measurement = [\"v\"] \
             }}\ncosts = [{{ kind = \"quadratic\", Q = [[1.0]], R = [[1.0]], final = [[1.0]] }}]",
            starts[index], limits[index]
        )
    });
    let parameters =
        "a = { initial = 0.2, bounds = [0.0, 1.0] }\nv = { initial = 0.1, bounds = [1e-3, 10.0], scale = \"log\" }";
    let problem = scalar(["0.9", "1.0"], parameters, &tasks);
    let excess = |a: f64| {
        let each = problem.tasks.iter().zip(limits).map(|(task, limit)| {
            let mut state = TaskState::new(task);
            state.evaluate(task, &[a, 1e-3], &problem.planning, None).unwrap();
            state.cost.expected() / limit - 1.0
        });
        each.fold(f64::NEG_INFINITY, f64::max)
    };
    let least = (0..=1000).map(|i| excess(f64::from(i) * 1e-3)).fold(f64::INFINITY, f64::min);
    for method in [Method::Sqp, Method::Cobyla] {
        let found = search(&problem, &DesignSettings { starts: 1, method, ..Default::default() });
        assert_eq!(found.status, DesignStatus::BoundViolated);
        let StartSummary { violation, to, .. } = &found.starts[0];
        assert!(least > 0.1 && *violation < least + 1e-3, "{method:?} {to:?}: {violation} is not {least}");
    }
}

/// At the optimum the second task just begins to need information. Searches stopped beside that kink, where the gradient is
/// not zero.
#[test]
fn an_optimum_may_be_where_a_task_begins_to_need_information() {
    let tasks = [("s", 200.0, 1.0), ("1 / s", 170.0, 20.0)].map(|(process, bound, weight)| {
        format!(
            "steps = 50\nbound = {bound}\ninformation_weight = {weight}\ninitial_state = [0.0]\nnoise = {{ initial = [1e-2], \
             process = [\"{process}\"], measurement = [1e-2] }}\ncosts = [{{ kind = \"quadratic\", Q = [[1.0]], R = [[0.1]] }}]"
        )
    });
    let problem = scalar(["0.9", "1.0"], "s = { initial = 1.0, bounds = [0.2, 5.0], scale = \"log\" }", &tasks);
    let weights = InformationWeights::NEEDED;
    let found = search(&problem, &DesignSettings { starts: 1, information: weights, ..Default::default() });
    let StartSummary { to, objective, optimality, .. } = &found.starts[0];
    assert_eq!(found.status, DesignStatus::Converged, "{optimality}");
    let needed = |s: f64| {
        let each = problem.tasks.iter().map(|task| {
            let mut state = TaskState::new(task);
            state.evaluate(task, &[s], &problem.planning, None).unwrap();
            let nats = weighted_information(task, &[s], weights, &mut state, &mut Vec::new()).unwrap();
            task.information_weight * nats
        });
        each.collect::<Vec<_>>()
    };
    let sum = |s: f64| needed(s).iter().sum::<f64>();
    let s = to[0];
    assert!((sum(s) - objective).abs() < 1e-6 && needed(s)[1] < 1e-6, "{:?} is not {objective}", needed(s));
    assert!(needed(0.999 * s)[1] > 1e-3 && sum(0.999 * s) > objective + 1e-3 && sum(1.001 * s) > objective + 1e-3);
}

/// Above `v = 1.6` there is no system. The first step of the search leads there; the optimum is below.
#[test]
fn searches_step_back_from_designs_that_cannot_be_evaluated() {
    let text = r#"
[model]
kind = "linear"
A = [["1 + 0.001 * sqrt(1.6 - v)"]]
B = [[1.0]]
C = [[1.0]]

[parameters.v]
initial = 0.001
bounds = [1e-6, 4.0]
scale = "log"

[[tasks]]
name = "hold"
steps = 30
time_step = 1.0
initial_state = [0]
initial_control = [0]
bound = 10.0

[tasks.noise]
initial = [1.0]
process = [0.1]
measurement = ["v"]

[[tasks.costs]]
kind = "quadratic"
Q = [[1]]
R = [[1]]

[design]
branch_attempts = 0
"#;
    let problem = supple_file::parse(text, "hold.toml").unwrap();
    let found = search(&problem, &DesignSettings { starts: 1, ..problem.design.clone() });
    assert_eq!(found.status, DesignStatus::Converged);
    let StartSummary { costs, to, error, .. } = &found.starts[0];
    assert!(error.is_none() && (costs[0] - 10.0).abs() < 1e-6 && (to[0] - 0.256_912).abs() < 1e-5, "{to:?}, {error:?}");
    // Methods without a line search end there, and say why.
    let cobyla = DesignSettings { method: Method::Cobyla, starts: 1, ..problem.design.clone() };
    let found = search(&problem, &cobyla);
    assert!(found.starts[0].status == DesignStatus::Converged || found.starts[0].error.is_some());
}

/// Asks at numbers that are none, as SLSQP has been seen to do, and notes what it is told.
struct Lost;

impl Optimiser for Lost {
    fn minimise(&self, problem: &mut OuterProblem) -> Ending {
        let first = problem.first();
        assert!(problem.at(&first).unwrap().objective.is_finite());
        problem.at(&vec![f64::NAN; first.len()]);
        assert!(!problem.is_new() && problem.is_stopped());
        Ending::Stalled
    }
}

#[test]
fn designs_that_are_no_numbers_are_not_evaluated() {
    let problem = shipped("two_mass_small.toml");
    let settings = DesignSettings { starts: 1, rounds: 1, ..problem.design.clone() };
    let searcher = Searcher::new(&problem, &settings, Aim::default(), Control::default()).with_optimiser(&Lost);
    let found = searcher.search(&problem.parameters.initial()).unwrap();
    let start = found.found();
    assert_eq!((start.evaluations, &start.to), (1, &problem.parameters.initial()));
    assert!(start.error.is_none(), "{:?}", start.error);
}
