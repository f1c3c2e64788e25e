//! Sets of sensors: what they are worth, the best ones, and that no certificate is ever violated.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::print_stdout,
    missing_docs,
    reason = "a test that reports what it measured"
)]

mod common;

use common::shipped;
use rand_chacha::ChaCha8Rng;
use rand_chacha::rand_core::{Rng, SeedableRng};
use rayon::prelude::*;
use supple::pipeline::TaskState;
use supple::sensors::{Candidate, Goal, Limits, Selection};
use supple::{Error, Problem};
use supple_file::WithSensors;

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
        Selection::new(&self.problem(&rows), &[], self.candidates.clone(), None).unwrap()
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
        let selection = Selection::of_measurements(&problem, &phi, None).unwrap();
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
        let best = selection.exhaustive(goal, limits, &mut || true).unwrap().unwrap();
        let greedy = selection.greedy(goal, limits).unwrap();
        let relaxed = selection.bound(goal, limits);
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
        let best = selection.exhaustive(goal, Limits::default(), &mut || true).unwrap().unwrap();
        let greedy = selection.greedy(goal, Limits::default()).unwrap();
        let bound = selection.bound(goal, Limits::default()).bound;
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
    assert!(selection.greedy(goal, Limits::default()).is_none());
    for error in [
        selection.exhaustive(goal, Limits::default(), &mut || true).unwrap_err(),
        selection.branch_and_bound(goal, Limits::default(), 100, &mut || true).unwrap_err(),
    ] {
        let Error::NoSensorsSuffice { least, .. } = error else { panic!("{error}") };
        assert_eq!(least, all);
    }
    assert_eq!(selection.bound(goal, Limits::default()).bound, f64::INFINITY);
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
    let best = selection.exhaustive(Goal::LeastCost, Limits::default(), &mut || true).unwrap().unwrap();
    assert_eq!(best.sensors, [0, 1, 2]);
    let none = Limits { count: Some(0), budget: None };
    assert!(selection.greedy(Goal::LeastCost, none).unwrap().sensors.is_empty());
    assert!(selection.exhaustive(Goal::LeastCost, none, &mut || true).unwrap().unwrap().sensors.is_empty());
    let bound = selection.bound(Goal::LeastCost, none).bound;
    assert!((bound - selection.worth(&[false; 4]).cost).abs() < 1e-8 * bound);
}

#[test]
fn extreme_noises_and_short_horizons_are_no_trouble() {
    for (factor, steps) in [(1e-12, 6), (1e12, 6), (1.0, 1), (1e-12, 1)] {
        let mut drawn = drawn(7, 6);
        drawn.variances.iter_mut().for_each(|v| *v *= factor);
        drawn.steps = steps;
        let selection = drawn.selection();
        let limits = Limits { count: Some(2), budget: None };
        let best = selection.exhaustive(Goal::LeastCost, limits, &mut || true).unwrap().unwrap();
        let bound = selection.bound(Goal::LeastCost, limits).bound;
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
    let selection = Selection::of_measurements(&problem, &[], None).unwrap();
    let rows: Vec<_> = selection.candidates.iter().map(|candidate| candidate.rows.clone()).collect();
    assert_eq!(rows, [vec![0, 2], vec![1]]);
    let evaluation = problem.evaluate(&[], &Default::default()).unwrap();
    let found = selection.worth(&[true; 2]);
    assert!((found.cost - evaluation.tasks[0].cost.expected).abs() < 1e-12);
    let alone = |row: usize| Candidate { name: row.to_string(), price: 1.0, rows: vec![row] };
    let error = Selection::new(&problem, &[], (0..3).map(alone).collect(), None).err().unwrap();
    assert_eq!(error.to_string(), "the noise of measurements 0 and 2 is correlated; put both in one sensor");
    let error = Selection::of_measurements(&problem, &[], Some("no")).err().unwrap();
    assert_eq!(error.to_string(), "no task `no`; valid: `t`");
}

/// The two masses with a catalogue.
fn with_catalogue(catalogue: &str) -> Result<Problem, supple::FileError> {
    with_catalogue_as(catalogue, WithSensors::All)
}

fn with_catalogue_as(catalogue: &str, which: WithSensors) -> Result<Problem, supple::FileError> {
    let path = common::repository("tasks/two_mass.toml");
    let text = std::fs::read_to_string(&path).unwrap() + catalogue;
    supple_file::parse_with(&text, path.to_str().unwrap(), which)
}

const ENCODERS: &str = r#"
[catalogue]
base = ["force in the spring"]
chosen = ["camera"]
[[catalogue.sensors]]
name = "encoder"
kind = "measurement"
select = ["position of m1"]
variance = 1e-4
price = 2
[[catalogue.sensors]]
name = "camera"
kind = "state"
select = ["x2", "xw"]
variance = [1e-5, "wall_variance"]
price = 8.5
[[catalogue.sensors]]
name = "foot"
kind = "signal"
select = ["contact_force"]
variance = 0.1
[[catalogue.sensors]]
name = "gap"
kind = "sum"
C = [[0.0, 0.0, "k1", 0.0, -1.0]]
variance = 1e-4
price = 1.0
"#;

#[test]
fn sensors_of_a_catalogue_are_measured_where_they_are_chosen() {
    let all = with_catalogue(ENCODERS).unwrap();
    let phi = all.parameters.initial();
    let names = |problem: &Problem| -> Vec<String> {
        problem.tasks[0].system.channels().measurements.into_iter().map(|channel| channel.name).collect()
    };
    assert_eq!(names(&all), ["force in the spring", "position of m1", "x2", "xw", "contact_force", "gap 1"]);
    let mut noise = supple::noise::Noise::zeros(5, 6);
    all.tasks[0].noise.resolve(&phi, &mut noise).unwrap();
    let variances: Vec<f64> = (0..6).map(|i| noise.measurement.get(0, i, i)).collect();
    assert_eq!(variances, [1e-2, 1e-4, 1e-5, 1e-4, 0.1, 1e-4], "the base sensor keeps the noise of the task");
    let catalogue = all.catalogue.as_ref().unwrap();
    let rows: Vec<_> = catalogue.iter().map(|sensor| (sensor.rows.clone(), sensor.price, sensor.chosen)).collect();
    assert_eq!(rows, [(vec![1], 2.0, false), (vec![2, 3], 8.5, true), (vec![4], 0.0, false), (vec![5], 1.0, false)]);

    let chosen = with_catalogue_as(ENCODERS, WithSensors::Chosen).unwrap();
    assert_eq!(names(&chosen), ["force in the spring", "x2", "xw"]);
    // One sensor of the catalogue has a set's worth, in the problem that it is chosen in as well.
    let candidates = catalogue.iter().map(|sensor| Candidate {
        name: sensor.name.clone(),
        price: sensor.price,
        rows: sensor.rows.clone(),
    });
    let selection = Selection::new(&all, &phi, candidates.collect(), None).unwrap();
    let found = chosen.evaluate(&phi, &Default::default()).unwrap();
    let worth = selection.worth(&[false, true, false, false]);
    assert!((found.tasks[0].cost.expected - worth.cost).abs() < 1e-8 * worth.cost);
    assert!((found.objective.information_nats - worth.information).abs() < 1e-7 * worth.information);
    // Derivatives of added measurements, by the parameters too.
    let report = supple::check::check(&all, &phi).unwrap();
    assert!(report.passed);
}

#[test]
fn a_robot_may_have_all_its_sensors_from_a_catalogue() {
    let path = common::repository("tasks/wiping_arm.toml");
    let text = std::fs::read_to_string(&path).unwrap();
    let (before, rest) = text.split_once("[[model.sensors]]").unwrap();
    let after = rest.split_once("[parameters.k]").unwrap().1;
    let catalogue = r#"
[catalogue]
sensors = "sensors.csv"
"#;
    let table = "# prices in EUR\nname, kind, select, coupling, frame, variance, price\n\
        encoders, joint_position, shoulder;elbow, , , 1e-3, 40\n\n\
        wrist, coupling_force, , wrist_spring, , 1e-3, 90\n\
        camera, frame_point, , , pad, 1e-6; 1e-6; 1e-4, 250\n\
        wall, state, c.wall, , , 1e-6, 400\n";
    let file = format!("{before}[parameters.k]{after}{catalogue}");
    let folder = path.parent().unwrap().join("sensors.csv").display().to_string();
    let name = path.display().to_string();
    let read = |table: &str, which| {
        supple_text::with_texts([(folder.clone(), table.to_owned())], || supple_file::parse_with(&file, &name, which))
    };
    let all = read(table, WithSensors::All).unwrap();
    assert_eq!(all.tasks[0].system.dimensions().measurements, 7);
    assert!(all.files.iter().any(|file| file.ends_with("sensors.csv")));
    let phi = all.parameters.initial();
    let candidates = all.catalogue.as_ref().unwrap().iter();
    let candidates = candidates.map(|s| Candidate { name: s.name.clone(), price: s.price, rows: s.rows.clone() });
    let selection = Selection::new(&all, &phi, candidates.collect(), None).unwrap();
    let sensors = |sensors: &[&str]| -> Vec<bool> {
        selection.candidates.iter().map(|candidate| sensors.contains(&candidate.name.as_str())).collect()
    };
    // With the sensors of the shipped task it costs what that does.
    let shipped = shipped("wiping_arm.toml").evaluate(&phi, &Default::default()).unwrap();
    let worth = selection.worth(&sensors(&["encoders", "wrist"]));
    assert!((worth.cost - shipped.tasks[0].cost.expected).abs() < 1e-8 * worth.cost);
    // Without any the task still has a plan, and no information.
    let none = read(table, WithSensors::Chosen).unwrap();
    assert_eq!(none.tasks[0].system.dimensions().measurements, 0);
    let found = none.evaluate(&phi, &Default::default()).unwrap();
    assert_eq!(found.objective.information_nats, 0.0);
    assert!((found.tasks[0].cost.expected - selection.worth(&[false; 4]).cost).abs() < 1e-8 * worth.cost);
    // Any quantity may be a sensor, with the keys that it has.
    let more = "name, kind, contact, frame, axes, smoothing, lever, reference, variance\n\
        height, center_of_mass, , , y;x, , , , 1e-4\n\
        tactile, contact_force, wall, , , 0.1, , , 0.04\n\
        range, clearance, wall, , , , , , 1e-8\n\
        tracker, frame_pose, , pad, , , 0.1, 0;0;0.5, 1e-6\n";
    let found = read(more, WithSensors::All).unwrap();
    let measured: Vec<_> = found.tasks[0].system.channels().measurements.into_iter().take(4).collect();
    let named: Vec<String> = measured.iter().map(|channel| format!("{}, {}", channel.name, channel.unit)).collect();
    let expected =
        ["y of the centre of mass, m", "x of the centre of mass, m", "normal force of wall, N", "clearance of wall, m"];
    assert_eq!(named, expected);
    assert_eq!(found.tasks[0].system.dimensions().measurements, 10);
    assert!(found.evaluate(&phi, &Default::default()).unwrap().objective.information_nats > 0.0);
    // Errors are those of the table, with its lines.
    let error = read(&table.replace("wrist_spring", "wrist_sprung"), WithSensors::Chosen).err().unwrap();
    assert!(error.file.ends_with("sensors.csv"), "{error}");
    assert_eq!((error.line, error.help.as_deref()), (5, Some("did you mean `wrist_spring`?")), "{error}");
    assert_eq!((error.key.as_str(), error.column), ("sensors[1].coupling", 26), "{error}");
    let error = read(&table.replace("pad, 1e-6; 1e-6; 1e-4", "pad, 1e-6; 1e-6"), WithSensors::Chosen).err().unwrap();
    assert_eq!(error.line, 6, "{error}");
    let error = read(&table.replace("1e-6, 400", "400"), WithSensors::Chosen).err().unwrap();
    assert!(error.line == 7 && error.message.contains("must have 7 cells"), "{error}");
    let error = read(&table.replace("1e-3, 90", "nan, 90"), WithSensors::Chosen).err().unwrap();
    assert!(error.line == 5 && error.message.contains("not a finite number"), "{error}");
    let error = read(&table.replace("1e-6, 400", "1e-6, inf"), WithSensors::Chosen).err().unwrap();
    assert!(error.line == 7 && error.message.contains("must be at least 0; found inf"), "{error}");
    // One that is not there is missed where the task names it.
    let error = supple_file::parse_with(&file, &name, WithSensors::Chosen).err().unwrap();
    assert!(error.file == name && error.key == "catalogue.sensors" && error.line > 0, "{error}");
    assert!(error.message.contains("sensors.csv: cannot be read"), "{error}");
}

/// The two masses with a table of sensors.
fn with_table(table: &str) -> Result<Problem, supple::FileError> {
    let path = common::repository("tasks/two_mass.toml");
    let text = std::fs::read_to_string(&path).unwrap() + "\n[catalogue]\nsensors = \"sensors.csv\"\n";
    let table = (path.with_file_name("sensors.csv").display().to_string(), table.to_owned());
    supple_text::with_texts([table], || supple_file::parse_with(&text, path.to_str().unwrap(), WithSensors::All))
}

#[test]
fn cells_stand_for_what_is_asked_for() {
    let table = "name, kind, select, C, variance, price\n\
        7, state, x2; xw, , 1e-5; wall_variance, 3\n\
        \"gap, wide\", sum, , 0; 0; k1; 0; -1, 1e-4, 1.5\n\
        1e3, signal, contact_force, , 2, \n";
    let problem = with_table(table).unwrap();
    let phi = problem.parameters.initial();
    let sensors = problem.catalogue.as_ref().unwrap().iter();
    let sensors: Vec<_> = sensors.map(|sensor| (sensor.name.as_str(), sensor.rows.len(), sensor.price)).collect();
    assert_eq!(sensors, [("7", 2, 3.0), ("gap, wide", 1, 1.5), ("1e3", 1, 0.0)]);
    let mut noise = supple::noise::Noise::zeros(5, 6);
    problem.tasks[0].noise.resolve(&phi, &mut noise).unwrap();
    let variances: Vec<f64> = (2..6).map(|i| noise.measurement.get(0, i, i)).collect();
    assert_eq!(variances, [1e-5, 1e-4, 1e-4, 2.0]);
    let mut y = [0.0; 6];
    problem.tasks[0].system.observe(0, &[0.0, 0.0, 0.2, 0.0, 0.3], &phi, &mut y);
    assert_eq!([y[2], y[3]], [0.2, 0.3]);
    assert!((y[4] - (phi[0] * 0.2 - 0.3)).abs() < 1e-12, "the factor of x2 is the parameter k1: {}", y[4]);

    let wrong = |from: &str, to: &str| {
        let error = with_table(&table.replace(from, to)).err().unwrap();
        assert!(error.file.ends_with("sensors.csv"), "{error}");
        format!("{}:{}: {}: {}", error.line, error.column, error.key, error.message)
    };
    let found = [
        wrong("k1", "k9"),
        wrong("x2; xw", "x2; xv"),
        wrong("wall_variance", "-1"),
        wrong("1.5", "cheap"),
        wrong("-1, 1e-4", "-1; 0, 1e-4"),
        wrong("2, \n", ", 5\n"),
        wrong("state, x2; xw, ", "state, x2; xw, 1"),
    ];
    let expected = [
        "3:27: sensors[1].C[0][2]: parameter `k9` is not declared: add a table [parameters.k9], or use one of `k1`, `k2`, \
         `wall_variance`, `drive_variance`",
        "2:11: sensors[0].select: the model has no state `xv`: it has `x1`, `v1`, `x2`, `v2`, `xw`",
        "2:21: sensors[0].variance: must be above 0: sensor noise is required; found -1",
        "3:44: sensors[1].price: must be a number; found \"cheap\"",
        "3:21: sensors[1].C: must have one factor per state: 5; found 6",
        "4:1: sensors[2].variance: is missing",
        "2:19: sensors[0].C: unknown key `C`; valid are `select`, `name`, `price`, `variance`, `deviation`",
    ];
    assert_eq!(found, expected);
    let unknown = wrong("signal, contact_force", "signul, contact_force");
    assert!(
        unknown.starts_with("4:6: sensors[2].kind: must be one of `measurement`, `sum`, `center_of_mass`"),
        "{unknown}"
    );
    assert!(unknown.ends_with("found `signul`"), "{unknown}");
}

#[test]
fn errors_of_catalogues_say_what_is_valid() {
    let wrong = |from: &str, to: &str| {
        let error = with_catalogue(&ENCODERS.replace(from, to)).err().unwrap();
        (error.key.clone(), error.message.clone())
    };
    let found = [
        wrong("[\"camera\"]", "[\"cam\"]"),
        wrong("[\"camera\"]", "[\"camera\", \"camera\"]"),
        wrong("base = [\"force in the spring\"]", "base = [\"force\"]"),
        wrong("kind = \"signal\"", "kind = \"joint_position\""),
        wrong("price = 2", "price = -2"),
        wrong("\"foot\"", "\"gap\""),
        wrong("\"xw\"]", "\"xv\"]"),
        wrong("variance = 0.1", "variance = 0.0"),
        wrong("0.0, -1.0]]", "-1.0]]"),
        wrong("1e-5, \"wall_variance\"", "1e-5, 1e-5, 1e-5"),
        wrong("price = 8.5", "cost = 8.5"),
    ];
    let words: Vec<String> = found.iter().map(|(key, message)| format!("{key}: {message}")).collect();
    let expected = [
        "catalogue.chosen[0]: the catalogue has no sensor `cam`; valid: `encoder`, `camera`, `foot`, `gap`",
        "catalogue.chosen[1]: `camera` occurs twice",
        "catalogue.base[0]: the model has no measurement `force`: it has `position of m1`, `force in the spring`",
        "catalogue.sensors[2].kind: the model has no joints",
        "catalogue.sensors[0].price: must be at least 0; found -2",
        "catalogue.sensors[3].name: `gap` names two sensors",
        "catalogue.sensors[1].select: the model has no state `xv`: it has `x1`, `v1`, `x2`, `v2`, `xw`",
        "catalogue.sensors[2].variance: must be above 0: sensor noise is required; found 0",
        "catalogue.sensors[3].C: must have one factor per state: 5; found 4",
        "catalogue.sensors[1].variance: must be one number, or 2 of them, one for each entry; found 3",
        "catalogue.sensors[1].cost: unknown key `cost`; valid are `select`, `name`, `price`, `variance`, `deviation`",
    ];
    assert_eq!(words, expected);
}
