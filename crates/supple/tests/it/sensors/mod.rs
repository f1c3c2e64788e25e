//! Sets of sensors: what they are worth, the best ones, and that no certificate is ever violated.

mod catalogues;

use crate::common::shipped;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use supple::Problem;
use supple::lqg;
use supple::pipeline::TaskState;
use supple::sensors::{Candidate, Goal, Limits, Selection, every_measurement, select};

struct Random(ChaCha8Rng);

impl Random {
    fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }
    fn uniform(&mut self) -> f64 {
        (self.0.next_u64() >> 11) as f64 / (1_u64 << 53) as f64
    }
    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.uniform()
    }
    fn whole(&mut self, low: usize, high: usize) -> usize {
        low + (self.uniform() * (high - low + 1) as f64) as usize
    }
    fn matrix(&mut self, rows: usize, cols: usize, size: f64) -> Vec<Vec<f64>> {
        (0..rows).map(|_| (0..cols).map(|_| size * self.between(-1.0, 1.0)).collect()).collect()
    }
}

/// A random linear task with `candidates` measurements, and which of them are candidates at which prices.
struct Drawn {
    a: Vec<Vec<f64>>,
    b: Vec<Vec<f64>>,
    c: Vec<Vec<f64>>,
    variances: Vec<f64>,
    start: Vec<f64>,
    process: Vec<f64>,
    steps: usize,
    candidates: Vec<Candidate>,
}

fn drawn(seed: u64, count: usize) -> Drawn {
    let mut random = Random::new(seed);
    let (n, m, steps) = (random.whole(2, 5), random.whole(1, 2), random.whole(4, 16));
    let base = random.whole(0, 1);
    let a = random.matrix(n, n, 1.8 / (n as f64).sqrt());
    let b = random.matrix(n, m, 1.0);
    let mut c = random.matrix(count + base, n, 1.0);
    for row in c.iter_mut().skip(base) {
        // Sensors of few states, some of them nearly alike.
        let keep = random.whole(0, n - 1);
        row.iter_mut().enumerate().filter(|(i, _)| *i != keep && random.uniform() < 0.6).for_each(|(_, c)| *c = 0.0);
    }
    let variances: Vec<f64> = (0..count + base).map(|_| 10_f64.powf(random.between(-3.0, 1.0))).collect();
    let start = (0..n).map(|_| 10_f64.powf(random.between(-2.0, 1.0))).collect();
    let process = (0..n).map(|_| 10_f64.powf(random.between(-4.0, 0.0))).collect();
    let candidate = |i: usize| Candidate {
        name: format!("s{i}"),
        price: (10.0 * random.between(0.5, 5.0)).round() / 10.0,
        rows: vec![base + i],
    };
    let candidates = (0..count).map(candidate).collect();
    Drawn { a, b, c, variances, start, process, steps, candidates }
}

impl Drawn {
    /// The task with some of its measurements.
    fn problem(&self, rows: &[usize]) -> Problem {
        let n = self.a.len();
        let c: Vec<_> = rows.iter().map(|&row| self.c[row].clone()).collect();
        let v: Vec<_> = rows.iter().map(|&row| self.variances[row]).collect();
        let file = format!(
            "[model]\nkind = \"linear\"\nA = {:?}\nB = {:?}\nC = {c:?}\n[[tasks]]\nname = \"t\"\nsteps = {}\n\
             time_step = 0.1\ninitial_state = {:?}\n[tasks.noise]\ninitial = {:?}\nprocess = {:?}\nmeasurement = {v:?}\n\
             [[tasks.costs]]\nkind = \"state\"\nselect = {:?}\nweight = 1.0\n[[tasks.costs]]\nkind = \"control\"\nweight = 0.3\n",
            self.a,
            self.b,
            self.steps,
            vec![0.0; n],
            self.start,
            self.process,
            (1..=n).map(|i| format!("x{i}")).collect::<Vec<_>>()
        );
        supple_file::parse(&file, "drawn.toml").unwrap_or_else(|error| panic!("{error}\n{file}"))
    }

    fn selection(&self) -> Selection {
        let rows: Vec<usize> = (0..self.c.len()).collect();
        select(&self.problem(&rows), &[], self.candidates.clone(), None).unwrap().selection
    }

    fn total(&self) -> f64 {
        self.candidates.iter().map(|candidate| candidate.price).sum()
    }
}

#[test]
fn a_set_is_worth_what_its_sensors_alone_are() {
    for seed in 0..20 {
        let drawn = drawn(seed, 4);
        let selection = drawn.selection();
        let base = drawn.c.len() - 4;
        for mask in 0..16_usize {
            let chosen: Vec<bool> = (0..4).map(|i| mask >> i & 1 == 1).collect();
            let rows: Vec<usize> = (0..base).chain((0..4).filter(|&i| chosen[i]).map(|i| base + i)).collect();
            if rows.is_empty() {
                continue;
            }
            let problem = drawn.problem(&rows);
            let mut state = TaskState::new(&problem.tasks[0]);
            state.evaluate(&problem.tasks[0], &[], &problem.planning, None).unwrap();
            let (found, cost) = (selection.worth(&chosen), state.cost.expected());
            assert!((found.cost - cost).abs() < 1e-9 * (1.0 + cost), "{seed} {mask}: {} {cost}", found.cost);
            let nats = state.information.total;
            assert!((found.information - nats).abs() < 1e-9 * (1.0 + nats), "{seed} {mask}");
        }
    }
}

#[test]
fn shipped_tasks_are_worth_what_they_cost() {
    for name in ["two_mass.toml", "iiwa_door.toml", "wiping_arm.toml"] {
        let problem = shipped(name);
        let phi = problem.parameters.initial();
        let selection = select(&problem, &phi, every_measurement(&problem, &phi).unwrap(), None).unwrap().selection;
        let found = selection.worth(&vec![true; selection.candidates.len()]);
        let evaluation = problem.evaluate(&phi, &Default::default()).unwrap();
        let cost: f64 = evaluation.tasks.iter().map(|task| task.cost.expected).sum();
        assert!((found.cost - cost).abs() < 1e-8 * cost, "{name}: {} and {cost}", found.cost);
        let nats = evaluation.objective.information_nats;
        assert!((found.information - nats).abs() < 1e-7 * nats, "{name}: {} and {nats}", found.information);
    }
}

#[test]
fn derivatives_by_the_weights_are_those_of_differences() {
    for seed in 0..30 {
        let drawn = drawn(seed, 5);
        let selection = drawn.selection();
        let mut random = Random::new(seed + 1000);
        let z: Vec<f64> = (0..5).map(|_| random.between(0.05, 0.95)).collect();
        let (_, [cost, information]) = selection.relaxed(&z);
        for i in 0..5 {
            let step = 1e-5;
            let at = |sign: f64| {
                let mut z = z.clone();
                z[i] += sign * step;
                selection.relaxed(&z).0
            };
            let (above, below) = (at(1.0), at(-1.0));
            let pairs = [
                (cost[i], (above.cost - below.cost) / (2.0 * step), above.cost),
                (information[i], (above.information - below.information) / (2.0 * step), above.information),
            ];
            for (analytic, numeric, size) in pairs {
                let error = (analytic - numeric).abs();
                assert!(error < 1e-5 * (analytic.abs() + 1e-3 * size.abs() + 1e-6), "{seed} {i}: {analytic} {numeric}");
            }
        }
    }
}

#[test]
fn cost_is_convex_and_information_concave_in_the_weights() {
    for seed in 0..60 {
        let selection = drawn(seed, 6).selection();
        let mut random = Random::new(seed + 2000);
        for _ in 0..10 {
            let mut draw = || -> Vec<f64> {
                // Corners and faces too.
                (0..6).map(|_| (random.between(-0.5, 1.5)).clamp(0.0, 1.0)).collect()
            };
            let (z, other) = (draw(), draw());
            let share = random.uniform();
            let mixed: Vec<f64> = z.iter().zip(&other).map(|(a, b)| a + share * (b - a)).collect();
            let [at, there, between] = [&z, &other, &mixed].map(|z| selection.relaxed(z));
            let cost = (1.0 - share) * at.0.cost + share * there.0.cost;
            assert!(between.0.cost <= cost + 1e-10 * cost, "{seed}: {} above {cost}", between.0.cost);
            let nats = (1.0 - share) * at.0.information + share * there.0.information;
            assert!(between.0.information >= nats - 1e-10 * (1.0 + nats), "{seed}");
            // Linearisations lie on the other side.
            let along = |gradient: &[f64]| -> f64 {
                gradient.iter().zip(z.iter().zip(&other)).map(|(g, (a, b))| g * (b - a)).sum()
            };
            let linear = at.0.cost + along(&at.1[0]);
            assert!(there.0.cost >= linear - 1e-9 * (cost + linear.abs()), "{seed}: {} below {linear}", there.0.cost);
            let linear = at.0.information + along(&at.1[1]);
            assert!(there.0.information <= linear + 1e-9 * (nats + linear.abs()), "{seed}");
        }
    }
}

/// What random catalogues show together.
#[derive(Default)]
struct Shown {
    worst_greedy: f64,
    worst_certified: f64,
    mean_certified: f64,
    optimal: usize,
    instances: usize,
    worst_gap: f64,
}

/// Greedy, exhaustive, branch and bound and the certificate on random catalogues, with limits on price, count or both.
fn compare(seeds: std::ops::Range<u64>, goal: Goal) -> Shown {
    let one = |seed: u64| {
        let mut random = Random::new(seed + 5000);
        let drawn = drawn(seed, random.whole(4, 9));
        let (selection, count) = (drawn.selection(), drawn.candidates.len());
        let budget = Some(random.between(0.15, 0.8) * drawn.total());
        let counted = Some(random.whole(1, count - 1));
        let limits = [(budget, None), (None, counted), (budget, counted)][(seed % 3) as usize];
        let limits = Limits { budget: limits.0, count: limits.1 };
        let best = selection.exhaustive(goal, limits, &mut || true).unwrap();
        let greedy = selection.greedy(goal, limits).unwrap();
        let relaxed = selection.bound(goal, limits).unwrap();
        let bound = relaxed.bound;
        let searched = selection.branch_and_bound(goal, limits, 10_000, &mut || true).unwrap();
        let none = selection.worth(&vec![false; count]);
        let gain = |worth: supple::sensors::Worth| match goal {
            Goal::MostInformation => worth.information - none.information,
            _ => none.cost - worth.cost,
        };
        let most = match goal {
            Goal::MostInformation => bound - none.information,
            _ => none.cost - bound,
        };
        let (of_best, of_greedy) = (gain(best.worth), gain(greedy.worth));
        assert!(of_best <= most * (1.0 + 1e-12), "{seed}: the certificate {most} is below the best {of_best}");
        assert!(of_greedy <= of_best * (1.0 + 1e-12), "{seed}: greedy {of_greedy} above the best {of_best}");
        assert!(searched.proved, "{seed}");
        let of_searched = gain(searched.chosen.worth);
        assert!((of_searched - of_best).abs() <= 2e-7 * gain(selection.worth(&vec![true; count])), "{seed}");
        for chosen in [&best, &greedy, &searched.chosen] {
            assert!(chosen.price <= limits.budget.unwrap_or(f64::INFINITY) * (1.0 + 1e-12), "{seed}");
            assert!(chosen.sensors.len() <= limits.count.unwrap_or(usize::MAX), "{seed}");
        }
        // How far the linearisation lies below the relaxed problem where it was made.
        let gap = (most - gain(selection.relaxed(&relaxed.weights).0)) / most;
        (of_greedy / of_best, of_greedy / most, gap)
    };
    let found: Vec<(f64, f64, f64)> = seeds.into_par_iter().map(one).collect();
    let of = |which: fn(&(f64, f64, f64)) -> f64| found.iter().map(which);
    Shown {
        worst_greedy: of(|x| x.0).fold(1.0, f64::min),
        worst_certified: of(|x| x.1).fold(1.0, f64::min),
        mean_certified: of(|x| x.1).sum::<f64>() / found.len() as f64,
        optimal: found.iter().filter(|x| x.0 > 1.0 - 1e-9).count(),
        instances: found.len(),
        worst_gap: of(|x| x.2).fold(0.0, f64::max),
    }
}

fn report(what: &str, shown: &Shown) {
    let Shown { worst_greedy, worst_certified, mean_certified, optimal, instances, worst_gap } = shown;
    println!(
        "{what}: greedy is best on {optimal} of {instances}, worst {worst_greedy:.4}; certified worst {worst_certified:.4}, \
         mean {mean_certified:.4}; worst gap of the relaxed problem {worst_gap:.1e}"
    );
}

#[test]
fn the_certificate_holds_on_random_catalogues() {
    for (what, goal) in [("cost", Goal::LeastCost), ("information", Goal::MostInformation)] {
        let shown = compare(0..240, goal);
        report(what, &shown);
        assert_eq!(shown.instances, 240);
        // A little of a very exact sensor is nearly as good as all of it: then the certificate says little.
        assert!(shown.worst_greedy > 0.9 && shown.worst_certified > 0.005, "{what}");
        assert!(shown.worst_gap < 1e-3, "{what}: the relaxed problem was not solved");
        assert!(shown.mean_certified > 0.9, "{what}");
    }
}

#[test]
#[ignore = "2,000 catalogues take some minutes"]
fn the_certificate_holds_on_many_random_catalogues() {
    for (what, goal) in [("cost", Goal::LeastCost), ("information", Goal::MostInformation)] {
        report(what, &compare(1000..3000, goal));
    }
}

#[test]
fn the_cheapest_set_within_a_cost_is_found_and_bounded() {
    let mut shares = Vec::new();
    for seed in 0..80 {
        let drawn = drawn(seed, 7);
        let selection = drawn.selection();
        let [none, all] = [false, true].map(|there| selection.worth(&[there; 7]).cost);
        let cost = all + Random::new(seed).between(0.02, 0.9) * (none - all);
        let goal = Goal::LeastPrice { cost };
        let best = selection.exhaustive(goal, Limits::default(), &mut || true).unwrap();
        let greedy = selection.greedy(goal, Limits::default()).unwrap();
        let bound = selection.bound(goal, Limits::default()).unwrap().bound;
        assert!(best.worth.cost <= cost * (1.0 + 1e-12) && greedy.worth.cost <= cost * (1.0 + 1e-12), "{seed}");
        assert!(bound <= best.price * (1.0 + 1e-12) && best.price <= greedy.price * (1.0 + 1e-12), "{seed}");
        shares.push(bound / best.price);
        let searched = selection.branch_and_bound(goal, Limits::default(), 10_000, &mut || true).unwrap();
        assert!(searched.proved && (searched.chosen.price - best.price).abs() < 1e-6 * best.price, "{seed}");
        // Among all subsets, by hand.
        let sets = (0..128_usize).map(|mask| (0..7).map(|i| mask >> i & 1 == 1).collect::<Vec<bool>>());
        let good = sets.filter(|set| selection.worth(set).cost <= cost);
        let price = |set: Vec<bool>| (0..7).filter(|&i| set[i]).map(|i| drawn.candidates[i].price).sum::<f64>();
        let least = good.map(price).fold(f64::INFINITY, f64::min);
        assert!((least - best.price).abs() < 1e-12, "{seed}: {least} {}", best.price);
    }
    let mean = shares.iter().sum::<f64>() / shares.len() as f64;
    println!("bound on the price over the least price: mean {mean:.3}");
    assert!(mean > 0.05);
}

#[test]
fn a_cost_below_that_of_all_sensors_is_refused_with_the_least_one() {
    let selection = drawn(3, 5).selection();
    let all = selection.worth(&[true; 5]).cost;
    let goal = Goal::LeastPrice { cost: 0.9 * all };
    for error in [
        selection.greedy(goal, Limits::default()).unwrap_err(),
        selection.exhaustive(goal, Limits::default(), &mut || true).unwrap_err(),
        selection.branch_and_bound(goal, Limits::default(), 100, &mut || true).unwrap_err(),
    ] {
        let lqg::Error::NoSensorsSuffice { least, .. } = error else { panic!("{error}") };
        assert_eq!(least, all);
    }
    assert_eq!(selection.bound(goal, Limits::default()).unwrap().bound, f64::INFINITY);
}

#[test]
fn branch_and_bound_proves_thirty_candidates() {
    let drawn = drawn(11, 30);
    let selection = drawn.selection();
    let limits = Limits { budget: Some(0.25 * drawn.total()), count: None };
    let searched = selection.branch_and_bound(Goal::LeastCost, limits, 100_000, &mut || true).unwrap();
    assert!(searched.proved, "{searched:?}");
    let greedy = selection.greedy(Goal::LeastCost, limits).unwrap();
    assert!(searched.chosen.worth.cost <= greedy.worth.cost);
    let gain = selection.worth(&[false; 30]).cost - selection.worth(&[true; 30]).cost;
    assert!(searched.bound >= searched.chosen.worth.cost - 1e-6 * gain);
    let stopped = selection.branch_and_bound(Goal::LeastCost, limits, 100_000, &mut || false).unwrap();
    assert!(!stopped.proved && stopped.bound <= searched.chosen.worth.cost);
}

#[test]
fn without_limits_all_that_help_are_taken() {
    let mut drawn = drawn(5, 4);
    let blind = drawn.c.len() - 1;
    drawn.c[blind].fill(0.0);
    let selection = drawn.selection();
    let found = selection.greedy(Goal::LeastCost, Limits::default()).unwrap();
    let mut sensors = found.sensors.clone();
    sensors.sort_unstable();
    assert_eq!(sensors, [0, 1, 2], "the one that sees nothing is left out");
    let best = selection.exhaustive(Goal::LeastCost, Limits::default(), &mut || true).unwrap();
    assert_eq!(best.sensors, [0, 1, 2]);
    let none = Limits { count: Some(0), budget: None };
    assert!(selection.greedy(Goal::LeastCost, none).unwrap().sensors.is_empty());
    assert!(selection.exhaustive(Goal::LeastCost, none, &mut || true).unwrap().sensors.is_empty());
    let bound = selection.bound(Goal::LeastCost, none).unwrap().bound;
    assert!((bound - selection.worth(&[false; 4]).cost).abs() < 1e-8 * bound);
}

/// Of sensors that tell the same in other units, which rounding alone distinguishes, the cheapest is taken.
#[test]
fn of_equal_sensors_the_cheapest_is_taken() {
    for seed in 0..20 {
        let mut drawn = drawn(seed, 2);
        let last = drawn.c.len() - 1;
        for (unit, price) in [(0.3, 2.0), (7.0, 3.0), (1e3, 0.5), (0.1, 4.0)] {
            drawn.c.push(drawn.c[last].iter().map(|entry| unit * entry).collect());
            drawn.variances.push(unit * unit * drawn.variances[last]);
            drawn.candidates.push(Candidate { name: format!("{unit}"), price, rows: vec![drawn.c.len() - 1] });
        }
        drawn.candidates.remove(0);
        drawn.candidates[0].price = 1.0;
        let (selection, one) = (drawn.selection(), Limits { count: Some(1), ..Limits::default() });
        for goal in [Goal::LeastCost, Goal::MostInformation] {
            let best = selection.exhaustive(goal, one, &mut || true).unwrap();
            let greedy = selection.greedy(goal, one).unwrap();
            let searched = selection.branch_and_bound(goal, one, 1000, &mut || true).unwrap().chosen;
            for chosen in [best, greedy, searched] {
                assert_eq!(chosen.price, 0.5, "{seed}, {goal:?}: {:?}", chosen.sensors);
            }
        }
    }
}

#[test]
fn extreme_noises_and_short_horizons_are_no_trouble() {
    for (factor, steps) in [(1e-12, 6), (1e12, 6), (1.0, 1), (1e-12, 1)] {
        let mut drawn = drawn(7, 6);
        drawn.variances.iter_mut().for_each(|v| *v *= factor);
        drawn.steps = steps;
        let selection = drawn.selection();
        let limits = Limits { count: Some(2), budget: None };
        let best = selection.exhaustive(Goal::LeastCost, limits, &mut || true).unwrap();
        let bound = selection.bound(Goal::LeastCost, limits).unwrap().bound;
        assert!(bound <= best.worth.cost, "{factor} {steps}: {bound} above {}", best.worth.cost);
        assert!(best.worth.cost <= selection.worth(&[false; 6]).cost * (1.0 + 1e-12));
    }
}

#[test]
fn correlated_measurements_are_one_candidate() {
    let file = "[model]\nkind = \"linear\"\nA = [[1.0, 0.1], [0.0, 1.0]]\nB = [[0.0], [0.1]]\n\
         C = [[1.0, 0.0], [0.0, 1.0], [1.0, 1.0]]\n[[tasks]]\nname = \"t\"\nsteps = 5\ntime_step = 0.1\n\
         initial_state = [0.0, 0.0]\n[tasks.noise]\ninitial = [1.0, 1.0]\nprocess = [0.1, 0.1]\n\
         measurement = [[0.5, 0.0, 0.2], [0.0, 0.4, 0.0], [0.2, 0.0, 0.3]]\n\
         [[tasks.costs]]\nkind = \"state\"\nselect = [\"x1\", \"x2\"]\nweight = 1.0\n[[tasks.costs]]\nkind = \"control\"\nweight = 0.3\n";
    let problem = supple_file::parse(file, "t.toml").unwrap();
    let selection = select(&problem, &[], every_measurement(&problem, &[]).unwrap(), None).unwrap().selection;
    let rows: Vec<_> = selection.candidates.iter().map(|candidate| candidate.rows.clone()).collect();
    assert_eq!(rows, [vec![0, 2], vec![1]]);
    let evaluation = problem.evaluate(&[], &Default::default()).unwrap();
    let found = selection.worth(&[true; 2]);
    assert!((found.cost - evaluation.tasks[0].cost.expected).abs() < 1e-12);
    let alone = |row: usize| Candidate { name: row.to_string(), price: 1.0, rows: vec![row] };
    let error = select(&problem, &[], (0..3).map(alone).collect(), None).err().unwrap();
    assert_eq!(error.to_string(), "the noise of measurements 0 and 2 is correlated; put both in one sensor");
    let error = select(&problem, &[], Vec::new(), Some("no")).err().unwrap();
    assert_eq!(error.to_string(), "no task `no`; valid: `t`");
}
