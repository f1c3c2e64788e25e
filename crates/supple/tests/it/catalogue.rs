//! Designs from catalogues.

use crate::common;

use std::sync::atomic::AtomicBool;

use supple::ParameterHandle;
use supple::Problem;
use supple::design::{
    Aim, Attempts, CatalogueMethod, Control, Design, DesignSettings, DesignStatus, Event, Observer, Searcher, design,
    plan_at,
};
use supple::pipeline::TaskState;

/// The two masses with springs from these catalogues, `[parameters.k1]` and `[parameters.k2]`; the starts of the search
/// take no time.
fn two_masses(first: &str, second: &str) -> Problem {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    let mut parts = text.splitn(3, "unit = \"N/m\"");
    let [head, middle, tail] = [(); 3].map(|()| parts.next().unwrap().to_owned());
    let catalogue = |list: &str| if list.is_empty() { String::new() } else { format!("\ncatalogue = {list}") };
    let (first, second) = (catalogue(first), catalogue(second));
    let text = format!("{head}unit = \"N/m\"{first}{middle}unit = \"N/m\"{second}{tail}");
    let mut problem = supple_file::parse(&text, "task.toml").unwrap();
    problem.design.starts = 1;
    problem.design.branch_attempts = 12;
    problem
}

fn designed(problem: &Problem) -> Design {
    let phi = problem.parameters.initial();
    design(problem, &phi, &problem.design, Control::default()).unwrap()
}

const FIRST: [f64; 4] = [80.0, 150.0, 320.0, 480.0];
const SECOND: [f64; 4] = [110.0, 210.0, 330.0, 560.0];

/// Information and cost of a design that is only evaluated, on the cheapest branch: what a user would do by hand.
fn by_hand(problem: &Problem, springs: [f64; 2]) -> (f64, f64) {
    let (task, mut phi) = (&problem.tasks[0], problem.parameters.initial());
    phi[..2].copy_from_slice(&springs);
    let mut state = TaskState::new(task);
    let attempts = Attempts { count: problem.design.branch_attempts, seed: problem.design.seed };
    plan_at(problem, task, &phi, None, attempts, &mut state).unwrap();
    (state.information.total, state.cost.expected())
}

/// The least information of the whole grid that meets the bound, found by hand, is what the design chooses.
#[test]
fn chooses_what_a_grid_by_hand_does() {
    let problem = two_masses("[480, 80, 320, 150]", "[560.0, 330.0, 210.0, 110.0]");
    let found = designed(&problem);
    assert_eq!(found.status, DesignStatus::Converged);
    let catalogue = found.catalogue.as_ref().unwrap();
    assert_eq!(
        (catalogue.method, catalogue.combinations, catalogue.complete),
        (CatalogueMethod::AllCombinations, 16, true)
    );
    assert_eq!((catalogue.designed.len(), catalogue.failed), (16, 0));

    let mut best: Option<(f64, [f64; 2])> = None;
    let mut met = 0;
    for springs in FIRST.into_iter().flat_map(|first| SECOND.map(|second| [first, second])) {
        let (nats, cost) = by_hand(&problem, springs);
        if cost <= 250.0 * (1.0 + 1e-6) {
            met += 1;
            if best.is_none_or(|(least, _)| nats < least) {
                best = Some((nats, springs));
            }
        }
    }
    let (nats, springs) = best.unwrap();
    assert!((2..16).contains(&met), "{met} of 16 meet the bound: neither trivial nor infeasible");
    let chosen = found.found();
    assert_eq!(chosen.to[..2], springs);
    assert!((chosen.information - nats).abs() < 1e-6 * nats, "{} {nats}", chosen.information);
    let asked = searcher(&problem, &problem.design);
    assert_eq!(catalogue.feasible(&asked), met);

    let gap = catalogue.gap(&asked).unwrap();
    assert!(gap > 0.0 && (catalogue.continuous.information + gap - chosen.information).abs() < 1e-9, "{gap}");
    let ranks: Vec<f64> =
        catalogue.designed.iter().filter(|c| c.summary.violation <= 1e-6).map(|c| c.summary.information).collect();
    assert!(ranks.is_sorted(), "{ranks:?}");
}

fn searcher<'a>(problem: &'a Problem, settings: &'a DesignSettings) -> Searcher<'a> {
    Searcher::new(problem, settings, Aim::default(), Control::default())
}

/// One spring from a catalogue: the other one is optimised anew for each entry, and is at its optimum for the chosen one.
#[test]
fn other_parameters_are_optimised_anew() {
    let problem = two_masses("[150, 400]", "");
    let found = designed(&problem);
    assert_eq!(found.status, DesignStatus::Converged);
    let catalogue = found.catalogue.as_ref().unwrap();
    let seconds: Vec<f64> = catalogue.designed.iter().map(|combination| combination.summary.to[1]).collect();
    assert_eq!(seconds.len(), 2);
    for combination in &catalogue.designed {
        let mut held = two_masses("", "");
        held.parameters = held.parameters.held([ParameterHandle::at(0)]);
        let mut phi = held.parameters.initial();
        phi[0] = combination.summary.to[0];
        let again = design(&held, &phi, &held.design, Control::default()).unwrap();
        let (one, other) = (&combination.summary, again.found());
        assert_eq!(one.status, other.status);
        if one.status == DesignStatus::Converged {
            assert!(
                (one.information / other.information - 1.0).abs() < 1e-4,
                "{} {}",
                one.information,
                other.information
            );
        }
    }
}

/// Where no combination meets the bound, the design says so and shows the closest one.
#[test]
fn says_where_no_combination_will_do() {
    let problem = two_masses("[50, 55]", "[100, 105]");
    let found = designed(&problem);
    let catalogue = found.catalogue.as_ref().unwrap();
    assert!(catalogue.continuous.violation <= 1e-6, "without catalogues the bound is met");
    assert_eq!(found.status, DesignStatus::BoundViolated);
    assert_eq!(
        (catalogue.feasible(&searcher(&problem, &problem.design)), catalogue.gap(&searcher(&problem, &problem.design))),
        (0, None)
    );
    let least =
        catalogue.designed.iter().map(|combination| combination.summary.violation).fold(f64::INFINITY, f64::min);
    assert_eq!(found.found().violation, least);
}

/// Prices of entries count: within a budget the best combination that can be paid is chosen, and with a weight the best of
/// information and price together; both as found by hand over the grid.
#[test]
fn entries_are_paid_from_the_budget() {
    let priced = |values: [f64; 4], prices: [f64; 4]| {
        let entry = |(value, price)| format!("{{ value = {value}, price = {price} }}");
        format!("[{}]", values.into_iter().zip(prices).map(entry).collect::<Vec<_>>().join(", "))
    };
    let (first, second) = ([9.0, 7.0, 4.0, 2.0], [8.0, 3.0, 2.5, 1.0]);
    let mut problem = two_masses(&priced(FIRST, first), &priced(SECOND, second));
    // Springs, nats and price of what meets the bound.
    let grid: Vec<([f64; 2], f64, f64)> = (0..16)
        .filter_map(|place| {
            let springs = [FIRST[place / 4], SECOND[place % 4]];
            let (nats, cost) = by_hand(&problem, springs);
            (cost <= 250.0 * (1.0 + 1e-6)).then(|| (springs, nats, first[place / 4] + second[place % 4]))
        })
        .collect();
    let best = |budget: f64, weight: f64| {
        let objective = |nats: f64, price: f64| nats + weight * price;
        let paid = grid.iter().filter(|(.., price)| *price <= budget);
        let found = paid.map(|&(springs, nats, price)| (springs, objective(nats, price)));
        found.min_by(|(_, a), (_, b)| a.total_cmp(b)).unwrap()
    };
    let (free, _) = best(f64::INFINITY, 0.0);
    for (budget, weight) in [(7.5, 0.0), (5.0, 0.0), (f64::INFINITY, 40.0)] {
        problem.design.budget = budget.is_finite().then_some(budget);
        problem.design.price_weight = weight;
        let found = designed(&problem);
        let chosen = found.found();
        let (springs, expected) = best(budget, weight);
        assert_eq!(chosen.to[..2], springs, "{budget} {weight}");
        assert_ne!(springs, free, "prices make a difference");
        // The design may find cheaper local minima of the plan, from that without catalogues.
        assert!((chosen.objective / expected - 1.0).abs() < 1e-3, "{} {expected}", chosen.objective);
        assert!(chosen.price <= budget && chosen.price == problem.parameters.price(&chosen.to));
        assert_eq!(found.status, DesignStatus::Converged);
    }
    // Less than the cheapest combination that within the cost limit costs.
    problem.design.budget = Some(2.0);
    assert_eq!(designed(&problem).status, DesignStatus::BoundViolated);
}

/// A search on a grid of 36, of which it may design 30, ends at the best of all.
#[test]
fn neighbours_find_the_best_of_the_grid() {
    let springs = "[100, 150, 200, 300, 400, 500]";
    let mut problem = two_masses(springs, springs);
    let all = designed(&problem);
    let all = all.catalogue.unwrap();
    assert_eq!((all.method, all.designed.len()), (CatalogueMethod::AllCombinations, 36));
    problem.design.max_combinations = 30;
    let some = designed(&problem).catalogue.unwrap();
    assert_eq!((some.method, some.complete), (CatalogueMethod::Neighbourhood, true));
    assert_eq!(some.designed.len(), 30);
    assert_eq!(some.chosen().entries, all.chosen().entries);
    // Cut short, it says that it is.
    problem.design.max_combinations = 3;
    let cut = designed(&problem);
    assert_eq!(cut.status, DesignStatus::NotConverged);
    let cut = cut.catalogue.unwrap();
    assert_eq!((cut.designed.len(), cut.complete), (3, false));
}

/// Prices that rise and fall from entry to entry make most combinations better than all of their neighbours: the search of 120
/// combinations among 729 goes on from them, and finds the best of all.
#[test]
fn jagged_prices_do_not_hold_the_search() {
    let catalogue = |[lower, upper]: [f64; 2], pattern: usize| {
        let entry = |place: usize| {
            let value = lower * (upper / lower).powf(place as f64 / 8.0);
            format!("{{ value = {value}, price = {} }}", (place * place * pattern + 3 * place) % 11)
        };
        (0..9).map(entry).collect::<Vec<_>>().join(", ")
    };
    for pattern in 1..6 {
        let text = format!(
            "[model]
kind = 'linear'
A = [[0.9, 0.2], [0.0, 'a']]
B = [[0.0], ['g']]
C = [['1 + 0.3 * sin(9 * g)', 0.0]]
[parameters.v]
initial = 0.05
bounds = [0.01, 10.0]
scale = 'log'
catalogue = [{}]
[parameters.g]
initial = 1.0
bounds = [0.5, 2.0]
catalogue = [{}]
[parameters.a]
initial = 0.8
bounds = [0.5, 1.1]
catalogue = [{}]
[[tasks]]
name = 't'
steps = 8
time_step = 0.1
initial_state = [1.0, 0.5]
bound = 8.0
noise = {{ initial = [0.3, 0.2], process = [0.05, 0.05], measurement = ['v'] }}
[[tasks.costs]]
kind = 'quadratic'
Q = [[1.0, 0.0], [0.0, 0.5]]
R = [['0.3 + 0.2 * g^2']]
final = [[2.0, 0.0], [0.0, 1.0]]
[design]
starts = 1
price_weight = 0.1
max_combinations = 729
",
            catalogue([0.01, 10.0], pattern),
            catalogue([0.5, 2.0], pattern + 1),
            catalogue([0.5, 1.1], pattern + 2),
        );
        let mut problem = supple_file::parse(&text, "task.toml").unwrap();
        let all = designed(&problem).catalogue.unwrap();
        problem.design.max_combinations = 120;
        let some = designed(&problem).catalogue.unwrap();
        assert_eq!((all.designed.len(), some.designed.len()), (729, 120));
        assert_eq!(some.chosen().entries, all.chosen().entries, "{pattern}");
    }
}

/// Combinations beyond the budget used up what a search may design, and it found nothing: 25 of 36 are, and 11 may be designed.
#[test]
fn combinations_beyond_the_budget_are_not_designed() {
    let entries = |prices: [u32; 6]| {
        let values = [100, 150, 200, 300, 400, 500].iter().zip(prices);
        let entries: Vec<String> =
            values.map(|(value, price)| format!("{{ value = {value}, price = {price} }}")).collect();
        format!("[{}]", entries.join(", "))
    };
    let mut problem = two_masses(&entries([9, 1, 9, 5, 9, 2]), &entries([6, 1, 9, 9, 2, 7]));
    problem.design.budget = Some(8.5);
    let all = designed(&problem).catalogue.unwrap();
    assert_eq!(all.designed.len(), 36);
    problem.design.max_combinations = 11;
    let some = designed(&problem).catalogue.unwrap();
    assert_eq!((some.method, some.complete), (CatalogueMethod::AllCombinations, true));
    assert!(some.designed.len() <= 11 && some.designed.iter().all(|one| one.summary.overspent <= 1e-9));
    assert_eq!(some.chosen().entries, all.chosen().entries);
    problem.design.max_combinations = 4;
    let few = designed(&problem).catalogue.unwrap();
    assert_eq!((few.method, few.designed.len()), (CatalogueMethod::Neighbourhood, 4));
    assert!(few.designed.iter().all(|one| one.summary.overspent <= 1e-9));
}

/// The two masses with sensors at a price, those from catalogues of one entry each; the spring from one of its own, or free.
fn coarse_sensors(spring: &str, price: &str) -> Problem {
    let text = std::fs::read_to_string(common::repository("tasks/two_mass_sensors.toml")).unwrap();
    let edits = [
        ("scale = \"log\"\nunit = \"N/m\"\n\n[parameters.k2]", format!("scale = \"log\"{spring}\n\n[parameters.k2]")),
        ("price = { inverse = 0.05 }", format!("catalogue = [{{ value = 0.1{price} }}]")),
        ("price = { inverse = 0.5 }", format!("price = {{ inverse = 0.5 }}\ncatalogue = [{{ value = 1.0{price} }}]")),
    ];
    let text = edits.into_iter().fold(text, |text, (from, to)| {
        assert!(text.contains(from), "{from}");
        text.replacen(from, &to, 1)
    });
    supple_file::parse(&text, "task.toml").unwrap()
}

/// What is free beside the entries is searched for from every start: from the end without catalogues alone it comes to rest
/// at 97.4 bits, above what a spring of 400 N/m needs.
#[test]
fn a_free_parameter_is_no_worse_than_one_from_a_catalogue() {
    let bits = |spring: &str| {
        let found = designed(&coarse_sensors(spring, ""));
        assert_eq!(found.status, DesignStatus::Converged);
        found.found().information / std::f64::consts::LN_2
    };
    let (free, chosen) = (bits(""), bits("\ncatalogue = [400, 500, 600]"));
    assert!((chosen - 76.0658).abs() < 1e-3, "{chosen}");
    assert!(free < 71.76, "{free}");
}

/// Beside a design without catalogues, prices are told with their weight; not where that does not pay those of the entries.
#[test]
fn a_gap_compares_what_both_pay() {
    let control = Control::default();
    let gap = |problem: &Problem| {
        let searcher = Searcher::new(problem, &problem.design, Aim::default(), control);
        let found = designed(problem);
        let (chosen, catalogue) = (found.found().clone(), found.catalogue.unwrap());
        (catalogue.gap(&searcher), chosen.objective - catalogue.continuous.objective)
    };
    let (told, objectives) = gap(&coarse_sensors("", ""));
    assert!(objectives > 0.0);
    assert_eq!(told, Some(objectives));
    assert_eq!(gap(&coarse_sensors("", ", price = 3")).0, None);
    // Where prices do not count, they are no reason to tell nothing.
    let mut free = coarse_sensors("", ", price = 3");
    (free.design.budget, free.design.price_weight) = (None, 0.0);
    assert!(gap(&free).0.unwrap() > 0.0);
}

/// Told to stop, it still shows entries only: those next to the design without catalogues.
#[test]
fn stopped_searches_choose_entries() {
    struct Stop<'a>(&'a AtomicBool);
    impl Observer for Stop<'_> {
        fn observe(&self, event: Event) {
            if matches!(event, Event::StartEnded { .. }) {
                self.0.store(true, std::sync::atomic::Ordering::Relaxed);
            }
        }
    }
    let problem = two_masses("[80, 150, 320, 480]", "[110, 210, 330, 560]");
    let stop = AtomicBool::new(false);
    let control = Control { observer: &Stop(&stop), stop: supple::Stop::when(&stop) };
    let found = design(&problem, &problem.parameters.initial(), &problem.design, control).unwrap();
    assert_eq!(found.status, DesignStatus::Stopped);
    let chosen = found.found();
    assert!(FIRST.contains(&chosen.to[0]) && SECOND.contains(&chosen.to[1]), "{:?}", chosen.to);
    assert!(!found.catalogue.unwrap().complete);
}

/// Where an entry is wrong, the error names its line.
#[test]
fn errors_name_the_entry() {
    let message = |catalogue: &str| {
        let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
        let text = text.replacen("unit = \"N/m\"", &format!("unit = \"N/m\"\ncatalogue = {catalogue}"), 1);
        supple_file::parse(&text, "task.toml").map(|_| ()).unwrap_err().to_string()
    };
    let line = {
        let text = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
        text.lines().position(|line| line == "unit = \"N/m\"").unwrap() + 2
    };
    for (catalogue, column, what) in [
        ("[100, 700]", 19, "catalogue[1]: must be within the bounds [50, 600]; found 700"),
        ("[100, 100.0]", 19, "catalogue[1]: the value 100 occurs twice"),
        ("[]", 13, "catalogue: must have from 1 to 10000 entries; found 0"),
        ("[{ price = 3 }]", 14, "catalogue[0].value: is missing"),
        ("[{ value = 100, price = -1 }]", 14, "catalogue[0]: a price must be a number of at least 0; found -1"),
        ("[{ value = 100, cost = 1 }]", 29, "unknown key `cost`"),
        ("[\"100\"]", 14, "must be a number, or a table with `value`"),
        ("12", 13, "catalogue: must be a list of values, a list of tables"),
        ("\"no_such.csv\"", 13, "no_such.csv: cannot be read"),
    ] {
        let found = message(catalogue);
        assert!(found.contains(&format!("task.toml:{line}:{column}:")) && found.contains(what), "{found}");
    }
    let several = message("[\n  { value = 100, name = \"S\" },\n  { value = 900 },\n]");
    assert!(
        several.contains(&format!("task.toml:{}:3: parameters.k1.catalogue[1]: must be within", line + 2)),
        "{several}"
    );
    let study = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    let study = study.replacen("role = \"study\"", "role = \"study\"\ncatalogue = [1e-4]", 1);
    let found = supple_file::parse(&study, "task.toml").map(|_| ()).unwrap_err().to_string();
    assert!(found.contains("catalogue: applies only to design parameters"), "{found}");
}

/// Catalogues from CSV files, next to the task file; errors name the line of the CSV file.
#[test]
fn catalogues_from_files() {
    let folder = std::env::temp_dir().join(format!("supple-catalogue-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let task = std::fs::read_to_string(common::repository("tasks/two_mass.toml")).unwrap();
    let task = task.replacen("unit = \"N/m\"", "unit = \"N/m\"\ncatalogue = \"springs.csv\"", 1);
    std::fs::write(folder.join("task.toml"), task).unwrap();
    let read = |csv: &str| {
        std::fs::write(folder.join("springs.csv"), csv).unwrap();
        supple_file::load(folder.join("task.toml"))
    };
    let problem = read("# springs of one maker\nname, value, price\nS300, 300, 4.5\n\nS100, 100,\n").unwrap();
    let catalogue = &problem.parameters.get(0).catalogue;
    let entries: Vec<_> =
        catalogue.iter().map(|entry| (entry.value, entry.price, entry.name.as_deref().unwrap())).collect();
    assert_eq!(entries, [(100.0, None, "S100"), (300.0, Some(4.5), "S300")]);
    assert_eq!(problem.files, [folder.join("springs.csv")], "the file belongs to the problem");
    for (csv, place, what) in [
        ("value\n100\n700\n", "springs.csv:3:1", "must be within the bounds [50, 600]; found 700"),
        ("value\n100\nx\n", "springs.csv:3:1", "`value` must be a finite number; found `x`"),
        ("value,prize\n100,1\n", "springs.csv:1:1", "unknown column `prize`; valid: `value`, `name`, `price`"),
        ("name,price\nA,1\n", "springs.csv:1:1", "the first line of a catalogue must name its columns"),
        ("value,price\n100,1\n200\n", "springs.csv:3:1", "must have 2 cells, as the first line; found 1"),
        ("value;price\n100;1\n", "springs.csv:1:1", "columns must be separated by commas"),
        ("value,value\n100,1\n", "springs.csv:1:1", "the column `value` occurs twice"),
        ("# a\nvalue\n\n# b\n100\n# c\n 700\n", "springs.csv:7:2", "found 700"),
        ("value\n", "task.toml", "must have from 1 to 10000 entries; found 0"),
    ] {
        let found = read(csv).map(|_| ()).unwrap_err().to_string();
        assert!(found.contains(place) && found.contains(what), "{found}");
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
