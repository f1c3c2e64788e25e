//! Prices of parameters: designs with them are those that one finds by hand.

use supple::design::{
    Aim, Control, Design, DesignSettings, DesignStatus, GradientKind, Method, Searcher, StartSummary,
};
use supple::{Price, Problem};

/// `x` stays as it is but for the control; at both steps it is measured with the variances `v1` and `v2`. With the
/// precision `q = 1 / v1 + 1 / v2` and the first variance 2, `DI = 1/2 ln(1 + 4 q)`, and the cost of not knowing `x` is
/// `1/2 Xi / (1/2 + q)`.
fn problem(first: &str, second: &str, settings: &str, bound: &str) -> Problem {
    let file = format!(
        "[model]\nkind = \"linear\"\nA = [[1.0]]\nB = [[1.0]]\nC = [[1.0], [1.0]]\n\
         [parameters.v1]\ninitial = 0.5\nbounds = [1e-3, 1e3]\nscale = \"log\"\nprice = {{ {first} }}\n\
         [parameters.v2]\ninitial = 0.7\nbounds = [1e-3, 1e3]\nscale = \"log\"\n{second}\n\
         [design]\nstarts = 2\n{settings}\n\
         [[tasks]]\nname = \"t\"\nsteps = 1\ntime_step = 1.0\ninitial_state = [0.0]\n{bound}\n\
         [tasks.noise]\ninitial = [2.0]\nprocess = [0.0]\nmeasurement = [\"v1\", \"v2\"]\n\
         [[tasks.costs]]\nkind = \"state\"\nselect = [\"x1\"]\nweight = 2.0\n\
         [[tasks.costs]]\nkind = \"control\"\nweight = 1.0\n"
    );
    supple_file::parse(&file, "prices.toml").unwrap_or_else(|error| panic!("{error}"))
}

fn search(problem: &Problem, aim: Aim, settings: &DesignSettings) -> Design {
    let control = Control::default();
    let phi = problem.parameters.initial();
    Searcher::new(problem, settings, aim, control).search(&phi).unwrap()
}

fn best(problem: &Problem) -> StartSummary {
    let found = search(problem, Aim::default(), &problem.design);
    assert_eq!(found.status, DesignStatus::Converged);
    found.starts[found.best].clone()
}

fn near(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found} is not {expected}");
}

/// Cost with no information after the first step, and `Xi` of that step.
fn cost(problem: &Problem, v: [f64; 2]) -> f64 {
    problem.evaluate(&v, &Default::default()).unwrap().tasks[0].cost.expected
}

#[test]
fn a_weighted_price_is_traded_against_information() {
    // One sensor counts: the other has the greatest variance and no price, and next to no precision.
    let problem = problem("linear = 0.4", "role = \"study\"", "price_weight = 0.5", "");
    let mut phi = problem.parameters.initial();
    phi[1] = 1e3;
    let control = Control::default();
    let found = supple::design::design(&problem, &phi, &problem.design, control).unwrap();
    let best = &found.starts[found.best];
    // 1/2 ln(1 + 4 (1/v + 1e-3)) + 0.2 v: its derivative is 0 at a (v^2 + 4 v / a) = 2 / 0.2, with a = 1 + 4e-3.
    let a: f64 = 1.004;
    let v = -2.0 / a + (4.0 / (a * a) + 10.0 / a).sqrt();
    near(best.to[0], v, 1e-5);
    near(best.price, 0.4 * v, 1e-5);
    near(best.objective, 0.5 * (a + 4.0 / v).ln() + 0.2 * v, 1e-9);
    near(best.information, best.objective - 0.2 * v, 1e-5);
    assert_eq!(found.status, DesignStatus::Converged);
}

#[test]
fn a_budget_is_used_up_and_has_a_multiplier() {
    let problem = problem("linear = 0.4", "role = \"study\"", "budget = 0.6", "");
    let mut phi = problem.parameters.initial();
    phi[1] = 1e3;
    let control = Control::default();
    let found = supple::design::design(&problem, &phi, &problem.design, control).unwrap();
    let best = &found.starts[found.best];
    near(best.to[0], 1.5, 1e-7);
    near(best.price, 0.6, 1e-7);
    // What a unit more of budget saves: -dDI/dv / 0.4.
    near(best.budget_multiplier, 2.0 / (1.5 * (1.004 * 1.5 + 4.0)) / 0.4, 1e-6);
    assert_eq!(found.status, DesignStatus::Converged);
    let evaluation = problem.evaluate(&best.to, &Default::default()).unwrap();
    let price = evaluation.price.as_ref().unwrap();
    assert!(evaluation.feasible && price.budget == Some(0.6));
    near(price.parameters.get("v1").unwrap(), 0.6, 1e-7);
    phi[0] = 1.6;
    assert!(!problem.evaluate(&phi, &Default::default()).unwrap().feasible, "too dear");
}

#[test]
fn two_sensors_share_the_precision_that_the_bound_asks_for() {
    // Prices c q^2 of the precisions: q1 / q2 = c2 / c1. Information depends on their sum alone.
    let power = |c: f64| format!("power = {{ coefficient = {c}, exponent = -2.0, reference = 1.0 }}");
    let second = format!("price = {{ {} }}", power(0.1));
    let unbound = problem(&power(0.3), &second, "price_weight = 1.0", "");
    // The bound of a precision of 2.
    let bound = cost(&unbound, [1.0, 1.0]);
    let problem = problem(&power(0.3), &second, "price_weight = 1.0", &format!("bound = {bound}"));
    let found = best(&problem);
    near(1.0 / found.to[0], 0.5, 1e-4);
    near(1.0 / found.to[1], 1.5, 1e-4);
    near(found.price, 0.3 * 0.25 + 0.1 * 2.25, 1e-5);
    assert!(found.violation <= 1e-6);
    // Worked out: the multiplier of the bound holds both the price and the information of more precision.
    let slope = |q: f64| 2.0 / (1.0 + 4.0 * q) + 2.0 * 0.1 * 1.5;
    let step = 1e-5;
    let rise = (cost(&unbound, [1.0, 1.0 / (1.0 - step)]) - cost(&unbound, [1.0, 1.0 / (1.0 + step)])) / (2.0 * step);
    near(found.multipliers[0], slope(2.0) / rise, 1e-3);
}

#[test]
fn the_least_cost_within_a_budget_spends_all_of_it() {
    let problem = problem("inverse = 0.2", "role = \"study\"", "budget = 0.5", "bound = 100.0");
    let found = search(&problem, Aim::Cost, &problem.design);
    let best = &found.starts[found.best];
    near(best.to[0], 0.4, 1e-5);
    assert!(best.overspent <= 1e-6 && best.violation < 0.0);
    assert_eq!(found.status, DesignStatus::Converged);
}

#[test]
fn the_barrier_keeps_to_a_budget() {
    let problem = problem("linear = 0.4", "role = \"study\"", "budget = 0.6", "");
    for gradient in [GradientKind::Total, GradientKind::Frozen] {
        let settings = DesignSettings {
            method: Method::Barrier,
            gradient,
            barrier_weight: 1e-3,
            max_evaluations: 100,
            starts: 1,
            ..problem.design.clone()
        };
        let found = search(&problem, Aim::default(), &settings);
        let best = &found.starts[found.best];
        assert!(best.to[0] > 1.2 && best.price <= 0.6 * (1.0 + 1e-6), "{best:?}");
    }
}

#[test]
fn a_budget_that_no_design_meets_is_said_to_be_missed() {
    let problem = problem("inverse = 1e4", "role = \"study\"", "budget = 1.0", "");
    let found = search(&problem, Aim::default(), &problem.design);
    assert_eq!(found.status, DesignStatus::BoundViolated);
    near(found.starts[found.best].overspent, 9.0, 1e-6);
}

#[test]
fn slopes_are_those_of_differences() {
    let forms = [
        Price::Inverse(0.3),
        Price::Linear(2.0),
        Price::Log { coefficient: 1.5, reference: 4.0 },
        Price::Power { coefficient: 0.7, exponent: -1.5, reference: 2.0 },
    ];
    for price in forms {
        for phi in [0.1, 1.0, 3.0] {
            let step = 1e-6 * phi;
            let difference = (price.at(phi + step) - price.at(phi - step)) / (2.0 * step);
            near(price.slope(phi), difference, 1e-8);
        }
    }
    near(Price::Log { coefficient: 1.5, reference: 4.0 }.at(1.0), 1.5 * 4.0_f64.ln(), 1e-15);
    near(forms[3].at(2.0), 0.7, 1e-15);
}

#[test]
fn prices_that_cannot_be_are_refused() {
    let read = |price: &str, settings: &str| {
        let file = format!(
            "[model]\nkind = \"linear\"\nA = [[1.0]]\nB = [[1.0]]\nC = [[1.0]]\n[parameters.v]\ninitial = 1.0\n\
             bounds = [0.5, 4.0]\n{price}\n[design]\n{settings}\n[[tasks]]\nname = \"t\"\nsteps = 1\ntime_step = 1.0\n\
             initial_state = [0.0]\n[tasks.noise]\ninitial = [2.0]\nprocess = [0.0]\nmeasurement = [\"v\"]\n\
             [[tasks.costs]]\nkind = \"control\"\nweight = 1.0\n"
        );
        supple_file::parse(&file, "t.toml").map(|_| ()).map_err(|error| format!("{}: {}", error.key, error.message))
    };
    assert_eq!(read("price = { inverse = 1.0 }", "budget = 1.0"), Ok(()));
    let wrong = [
        ("price = { inverse = -1.0 }", ""),
        ("price = { log = { coefficient = 1.0, reference = 2.0 } }", ""),
        ("price = { squared = 1.0 }", ""),
        ("price = { inverse = 1.0 }", "budget = 0.0"),
        ("price = { inverse = 1.0 }", "price_weight = -1.0"),
        ("", "budget = 1.0"),
    ];
    let found = wrong.map(|(price, settings)| read(price, settings).unwrap_err());
    let expected = [
        "parameters.v.price: must be at least 0 within the bounds [0.5, 4]; it can be -2",
        "parameters.v.price: must be at least 0 within the bounds [0.5, 4]; it can be -0.6931471805599453",
        "parameters.v.price.squared: must be one of `inverse`, `linear`, `log`, `power`; found `squared`",
        "design.budget: must be above 0; found 0",
        "design.price_weight: must be at least 0; found -1",
        "design.budget: needs a parameter with a price: [parameters.NAME] price = { inverse = 1.0 }",
    ];
    assert_eq!(found, expected);
}
