//! Numbers of task files in other words: expressions of parameters, standard deviations, and noise and weights per second.

use supple::{EvaluateOptions, Names, Problem};

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../");

fn two_mass() -> String {
    std::fs::read_to_string(format!("{ROOT}tasks/two_mass.toml")).unwrap()
}

/// The task with something else in the place of words that stand there once.
fn with(text: &str, changes: &[(&str, &str)]) -> String {
    changes.iter().fold(text.to_owned(), |text, (from, to)| {
        assert_eq!(text.matches(from).count(), 1, "{from}");
        text.replace(from, to)
    })
}

/// Expected cost and measured information in nats at the initial parameters, and the total gradient of the latter.
fn evaluate(text: &str) -> (f64, f64, Vec<f64>) {
    let problem = supple_file::parse(text, "task.toml").unwrap();
    let phi = problem.parameters.initial();
    let options = EvaluateOptions { total_gradient: true, ..EvaluateOptions::default() };
    let found = problem.evaluate(&phi, &options).unwrap();
    let task = &found.tasks[0];
    let total = task.gradient.as_ref().unwrap().total.as_ref().unwrap();
    let gradient = problem.parameters.iter().map(|p| total.information_nats.get(&p.name).unwrap()).collect();
    (task.cost.expected, task.information.total_nats, gradient)
}

fn error(text: &str) -> String {
    supple_file::parse(text, "task.toml").err().unwrap().to_string()
}

fn assert_close(found: f64, expected: f64, tolerance: f64) {
    assert!((found - expected).abs() <= tolerance * expected.abs(), "{found} is not {expected}");
}

const STIFFNESS: &str = "stiffness = [\"k1\", \"k2\"]";

#[test]
fn expressions_are_values_with_their_derivatives() {
    let (cost, information, gradient) = evaluate(&two_mass());
    let changed = with(&two_mass(), &[(STIFFNESS, "stiffness = [\"k1^2 / 500\", \"-(-2 * sqrt(k2) * k2^0.5) / 2\"]")]);
    let (other_cost, other_information, other_gradient) = evaluate(&changed);
    assert_close(other_cost, cost, 1e-12);
    assert_close(other_information, information, 1e-12);
    // At k1 = 500 the first has the slope 2.
    for (place, slope) in [2.0, 1.0, 1.0, 1.0].into_iter().enumerate() {
        assert_close(other_gradient[place], slope * gradient[place], 1e-8);
    }
}

#[test]
fn every_operation_is_what_it_says() {
    let names: Vec<String> = ["a", "b-c", "d"].map(str::to_owned).to_vec();
    let phi = [2.0, 3.0, 0.25];
    for (text, expected) in [
        ("a + d * 8", 4.0),
        ("{b-c} - a - 1", 0.0),
        ("a^3^2 / 2^9", 1.0),
        ("-a^2", -4.0),
        ("2 - -a", 4.0),
        ("a^-1", 0.5),
        ("d^0.5", 0.5),
        ("d^(a - 0.5)", 0.125),
        ("sqrt(d) * exp(ln(a))", 1.0),
        ("sin(a)^2 + cos(a)^2 - tan(0 * a)", 1.0),
        ("tanh(a) / tanh(2)", 1.0),
        (" ( ( a ) ) ", 2.0),
        ("1e1 * a", 20.0),
        ("3 * 2", 6.0),
    ] {
        let value = Names::new(names.clone()).value(text).unwrap();
        assert_close(value.resolve::<f64>(&phi), expected, 1e-14);
        let step = 1e-6;
        for (parameter, slope) in value.slopes(&phi) {
            let at = |change: f64| {
                let mut phi = phi;
                phi[parameter] += change;
                value.resolve::<f64>(&phi)
            };
            let difference = (at(step) - at(-step)) / (2.0 * step);
            assert!((slope - difference).abs() <= 1e-7 * (1.0 + difference.abs()), "{text}: {slope} and {difference}");
        }
    }
}

#[test]
fn the_parameters_of_an_expression_count_as_used() {
    let names: Vec<String> = ["a", "b", "c"].map(str::to_owned).to_vec();
    let names = Names::new(names);
    assert_eq!(names.unused(), ["a", "b", "c"]);
    names.value("c * a").unwrap();
    assert_eq!(names.unused(), ["b"]);
    names.value("b").unwrap();
    assert_eq!(names.unused(), [""; 0]);
}

#[test]
fn the_least_of_an_expression_is_within_the_bounds_of_its_parameters() {
    let text = with(&two_mass(), &[(STIFFNESS, "stiffness = [\"k1 - 40\", \"k2\"]")]);
    supple_file::parse(&text, "task.toml").unwrap();
    for (stiffness, least) in [
        ("k1 - 700", "it can be -650"),
        ("-k1", "it can be -600"),
        ("100 - k1^2", "it can be -359900"),
        ("k1 / (k1 - 100)", "it may be infinite or undefined"),
    ] {
        let message = error(&with(&two_mass(), &[(STIFFNESS, &format!("stiffness = [\"{stiffness}\", \"k2\"]"))]));
        assert!(message.contains(&format!("within the bounds of its parameters {least}")), "{message}");
    }
}

#[test]
fn what_is_no_expression_is_said_by_place() {
    for (stiffness, expected) in [
        ("k1 *", "unexpected end after `k1 *`"),
        ("k1 k2", "unexpected `k2` after `k1`"),
        ("(k1", "1 opening and 0 closing"),
        ("cosh(k1)", "unknown function `cosh`; valid: `sqrt`"),
        ("k1 + k3", "parameter `k3` is not declared"),
        ("k1-k3", "parameter `k1-k3` is not declared"),
        ("1 / 0", "is inf, not a finite number"),
        ("k1 / 0", "must be finite; at the initial values of the parameters `k1 / 0` is inf"),
        ("sqrt(k1 - 1000)", "must be finite; at the initial values of the parameters `sqrt(k1 - 1000)` is NaN"),
        ("k1^k1^k1", "must be finite"),
        ("", "must be"),
        ("500", "write numbers without quotes"),
    ] {
        let message = error(&with(&two_mass(), &[(STIFFNESS, &format!("stiffness = [\"{stiffness}\", \"k2\"]"))]));
        assert!(message.contains("task.toml:14:14: model.stiffness[0]: "), "{message}");
        assert!(message.contains(expected) || stiffness.is_empty(), "{stiffness}: {message}");
    }
    let deep = format!("{}k1{}", "(".repeat(400), ")".repeat(400));
    assert!(
        error(&with(&two_mass(), &[(STIFFNESS, &format!("stiffness = [\"{deep}\", \"k2\"]"))])).contains("at most")
    );
}

#[test]
fn standard_deviations_stand_for_variances() {
    let given = "initial = [1e-3, 1e-3, 1e-3, 1e-3, \"wall_variance\"]";
    let deviations =
        "initial_deviation = [\"1e-3^0.5\", \"1e-3^0.5\", \"1e-3^0.5\", \"1e-3^0.5\", \"sqrt(wall_variance)\"]";
    let (cost, information, gradient) = evaluate(&two_mass());
    let (other_cost, other_information, other_gradient) = evaluate(&with(&two_mass(), &[(given, deviations)]));
    assert_close(other_cost, cost, 1e-12);
    assert_close(other_information, information, 1e-12);
    gradient.iter().zip(&other_gradient).for_each(|(own, other)| assert_close(*other, *own, 1e-8));

    let both = error(&with(&two_mass(), &[(given, &format!("{given}\n{deviations}"))]));
    assert!(both.contains("`initial` and `initial_deviation` are both given"), "{both}");
    let negative =
        error(&with(&two_mass(), &[(given, "initial_deviation = [-0.1, 0.1, 0.1, 0.1, \"wall_variance\"]")]));
    assert!(
        negative.contains("initial_deviation[0]: must be at least 0, as a standard deviation; found -0.1"),
        "{negative}"
    );
    let missing = error(&with(&two_mass(), &[(given, "")]));
    assert!(missing.contains("noise.initial: is missing"), "{missing}");
    let matrix = error(&with(&two_mass(), &[(given, "initial_deviation = [[1.0]]")]));
    assert!(matrix.contains("a matrix is given by `initial`"), "{matrix}");
}

#[test]
fn sensors_have_deviations() {
    let file = std::fs::read_to_string(format!("{ROOT}tasks/iiwa_door.toml")).unwrap();
    let file = file.replace("../models", &format!("{ROOT}models"));
    let load = |text: &str| supple_file::parse(text, "task.toml");
    let (own, other) = (load(&file).unwrap(), load(&file.replacen("variance = 1e-2", "deviation = 0.1", 1)).unwrap());
    let first = |problem: &Problem| problem.tasks[0].noise.measurement.clone();
    let variance = |problem: &Problem| {
        let mut out = supple::Matrices::constant(14, 14);
        first(problem).resolve(&problem.parameters.initial(), &mut out);
        out.get(0, 0, 0)
    };
    assert_close(variance(&other), variance(&own), 1e-15);
    let message = |to: &str| load(&file.replacen("variance = 1e-2", to, 1)).err().unwrap().to_string();
    assert!(
        message("deviation = 0.0").contains("sensors[0].deviation: must be above 0: sensor noise is required; found 0")
    );
    assert!(message("deviation = 0.1\nvariance = 0.01").contains("`variance` and `deviation` are both given"));
}

/// The two masses per second, with another time step over the same 2.5 s.
fn per_second(time_step: f64) -> String {
    let text = with(
        &two_mass(),
        &[
            ("time_step = 0.02 ", &format!("per = \"second\"\ntime_step = {time_step} ")),
            ("steps = 125", &format!("steps = {}", (2.5 / time_step).round())),
            (
                "process = [1e-7, \"drive_variance\", 1e-7, 1e-2, 0.0]",
                "process = [5e-6, \"50 * drive_variance\", 5e-6, 0.5, 0.0]",
            ),
            ("measurement = [1e-3, 1e-2]", "measurement = [2e-5, 2e-4]"),
            ("weight = 0.05", "weight = 2.5"),
            ("weight = 0.1", "weight = 5.0"),
            ("weight = 1e-4", "weight = 5e-3"),
        ],
    );
    supple_file::parse(&text, "task.toml").unwrap();
    text
}

#[test]
fn what_is_given_per_second_is_the_same_by_time() {
    let (cost, information, gradient) = evaluate(&two_mass());
    let (same_cost, same_information, same_gradient) = evaluate(&per_second(0.02));
    assert_close(same_cost, cost, 1e-12);
    assert_close(same_information, information, 1e-12);
    gradient.iter().zip(&same_gradient).for_each(|(own, other)| assert_close(*other, *own, 1e-8));
    let wrong = error(&per_second(0.02).replace("\"second\"", "\"minute\""));
    assert!(wrong.contains("`step`, `second`"), "{wrong}");
}

/// A damped mass that is pushed to 0, by time steps of `time_step` over 2 s.
fn pushed(time_step: f64) -> String {
    format!(
        r#"
[model]
kind = "linear"
A = [[1.0, "dt"], [0.0, "1 - 0.5 * dt"]]
B = [[0.0], ["dt"]]
C = [[1.0, 0.0]]

[parameters.dt]
initial = {time_step}
bounds = [1e-4, 0.1]
role = "study"

[[tasks]]
name = "push"
steps = {steps}
time_step = "dt"
per = "second"
initial_state = [1.0, 0.0]
noise = {{ initial = [0.01, 0.01], process = [0.0, 0.1], measurement_deviation = [0.02] }}

[[tasks.costs]]
kind = "quadratic"
Q = [[2.0, 0.0], [0.0, 0.1]]
R = [[0.05]]
final = [[1.0, 0.0], [0.0, 1.0]]
"#,
        steps = (2.0 / time_step).round()
    )
}

#[test]
fn shorter_steps_of_what_is_given_per_second_converge() {
    let [coarse, half, quarter] = [0.02, 0.01, 0.005].map(|time_step| evaluate(&pushed(time_step)));
    for of in [|found: &(f64, f64, Vec<f64>)| found.0, |found: &(f64, f64, Vec<f64>)| found.1] {
        let [first, second] = [(of(&coarse), of(&half)), (of(&half), of(&quarter))].map(|(a, b)| (b - a) / a);
        assert!(first.abs() < 0.03, "{first}");
        assert!((0.4..0.6).contains(&(second / first)), "{first} and {second}: of first order");
    }
}
