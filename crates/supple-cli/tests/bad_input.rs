//! Whatever is wrong in a task file: exit code 2, an error with file, line, key and what is valid, and nothing written.

mod common;

use common::{Folder, LINEAR, TWO_MASS, edited};

/// An edit that makes a file bad.
struct Case {
    /// The file before.
    text: &'static str,
    /// What is replaced, and by what.
    edit: [&'static str; 2],
    /// Where the error must point: at the first place of this text after the edit.
    at: &'static str,
    /// The key that the error must name.
    key: &'static str,
    /// What the error must say.
    says: &'static str,
}

/// An edit of the small two-mass task.
const fn two_mass(edit: [&'static str; 2], at: &'static str, key: &'static str, says: &'static str) -> Case {
    Case { text: TWO_MASS, edit, at, key, says }
}

/// An edit of the linear tasks.
const fn linear(edit: [&'static str; 2], at: &'static str, key: &'static str, says: &'static str) -> Case {
    Case { text: LINEAR, edit, at, key, says }
}

/// Line and column, from 1, of the first place of `at`.
fn position(text: &str, at: &str) -> (usize, usize) {
    let Some(byte) = text.find(at) else { panic!("the edited file has no `{at}`") };
    let before = &text[..byte];
    let column = before.chars().rev().take_while(|&c| c != '\n').count() + 1;
    (before.matches('\n').count() + 1, column)
}

/// Runs a design that would write a result; what is wrong with the error.
fn difference(text: &str, (line, column): (usize, usize), key: &str, says: &str) -> Option<String> {
    let folder = Folder::with_task(text);
    let run = folder.run(&["design", "task.toml", "--starts", "1", "--out", "out", "--json"]);
    let error = run.error();
    assert_eq!(folder.names(), ["task.toml"]);
    let key = if key.is_empty() { String::new() } else { format!("{key}: ") };
    let start = format!("error: task.toml:{line}:{column}: {key}");
    let same = error.starts_with(&start) && error.contains(says);
    (!same).then(|| format!("expected {start}... {says}\n   found {error}\n"))
}

fn meet(text: &str, position: (usize, usize), key: &str, says: &str) {
    if let Some(difference) = difference(text, position, key, says) {
        panic!("{difference}");
    }
}

fn meet_all(cases: &[Case]) {
    let differences = cases.iter().filter_map(|case| {
        let text = edited(case.text, case.edit[0], case.edit[1]);
        difference(&text, position(&text, case.at), case.key, case.says)
    });
    let differences: Vec<_> = differences.collect();
    assert!(differences.is_empty(), "\n{}", differences.concat());
}

#[test]
fn the_files_that_are_edited_are_good() {
    for text in [TWO_MASS, LINEAR] {
        assert_eq!(Folder::with_task(text).run(&["evaluate", "task.toml"]).quiet().0, Some(0));
    }
}

#[test]
fn unknown_keys_at_every_level() {
    const NOISE: &str = "[tasks.noise]";
    const COST: &str = "kind = \"contact_force\"";
    meet_all(&[
        two_mass(["title =", "tittle ="], "tittle", "tittle", "did you mean `title`?"),
        two_mass(["[model]", "[modell]"], "modell", "modell", "did you mean `model`?"),
        two_mass(["[parameters.k1]", "[parameter.k1]"], "parameter.k1", "parameter", "did you mean `parameters`?"),
        two_mass(["mass =", "mas ="], "mas =", "model.mas", "did you mean `mass`?"),
        linear(["A = ", "a = "], "a = ", "model.a", "valid: `A`, `B`, `C` (did you mean `A`?)"),
        two_mass(["scale =", "scal ="], "scal =", "parameters.k1.scal", "did you mean `scale`?"),
        two_mass(["steps =", "stepz ="], "stepz", "tasks[0].stepz", "did you mean `steps`?"),
        two_mass([NOISE, "[tasks.nois]"], "nois]", "tasks[0].nois", "did you mean `noise`?"),
        two_mass(["process =", "proces ="], "proces =", "tasks[0].noise.proces", "did you mean `process`?"),
        two_mass(["target =", "targets ="], "targets", "tasks[0].costs[0].targets", "did you mean `target`?"),
        linear(["R = ", "S = "], "S = ", "tasks[0].costs[0].S", "valid: `Q`, `R`, `final`"),
        linear(
            ["smoothing = 0.1", "smoothin = 0.1"],
            "smoothin = 0.1",
            "tasks[1].costs[0].norm.absolute.smoothin",
            "did you mean `smoothing`?",
        ),
        two_mass(["title =", "plannin.mode = \"nominal\"\ntitle ="], "plannin", "plannin", "did you mean `planning`?"),
        two_mass(
            ["title =", "planning.max_iteration = 3\ntitle ="],
            "max_iteration",
            "planning.max_iteration",
            "did you mean `max_iterations`?",
        ),
        two_mass(
            ["title =", "planning.sampled.iteration = 3\ntitle ="],
            "iteration =",
            "planning.sampled.iteration",
            "did you mean `iterations`?",
        ),
        two_mass(["title =", "design.start = 3\ntitle ="], "start =", "design.start", "did you mean `starts`?"),
        two_mass(
            [COST, "kind = \"contact\""],
            "\"contact\"",
            "tasks[0].costs[0].kind",
            "did you mean `contact_force`?",
        ),
        two_mass(["\"two_mass\"", "\"two_mas\""], "\"two_mas\"", "model.kind", "did you mean `two_mass`?"),
        two_mass(["\"log\"", "\"logarithm\""], "\"logarithm\"", "parameters.k1.scale", "did you mean `log`?"),
        linear(
            ["\"study\"", "\"studies\""],
            "\"studies\"",
            "parameters.allowance.role",
            "must be one of `design`, `study`",
        ),
        linear(["{ absolute", "{ absolut"], "absolut =", "tasks[1].costs[0].norm.absolut", "did you mean `absolute`?"),
    ]);
}

#[test]
fn missing_keys() {
    let rest = TWO_MASS.split_once("[[tasks.costs]]").map(|(rest, _)| rest).unwrap_or_default();
    meet(rest, position(rest, "[[tasks]]"), "tasks[0].costs", "is missing");
    let rest = TWO_MASS.split_once("[[tasks]]").map(|(rest, _)| rest).unwrap_or_default();
    meet(rest, (1, 1), "tasks", "is missing");
    meet("", (1, 1), "model", "is missing");
    meet("\n# nothing\n", (1, 1), "model", "is missing");
    meet_all(&[
        two_mass(["kind = \"two_mass\"", ""], "[model]", "model.kind", "must be one of `linear`, `robot`, `two_mass`"),
        two_mass(["kind = \"contact_force\"", ""], "[[tasks.costs]]", "tasks[0].costs[0].kind", "`contact_force`"),
        two_mass(["initial = 60.0", ""], "[parameters.k1]", "parameters.k1.initial", "is missing"),
        two_mass(["bounds = [20.0, 120.0]", ""], "[parameters.k1]", "parameters.k1.bounds", "is missing"),
        two_mass(["steps = 125", ""], "[[tasks]]", "tasks[0].steps", "is missing"),
        two_mass(["measurement =", "# measurement ="], "[tasks.noise]", "tasks[0].noise.measurement", "is missing"),
        two_mass(["target = 3.0", ""], "[[tasks.costs]]", "tasks[0].costs[0].target", "is missing"),
        linear(["C = [[1.0, 0.0]]", ""], "[model]", "model.C", "is missing"),
    ]);
}

#[test]
fn wrong_types() {
    meet_all(&[
        two_mass(["title = \"", "title = 3 # \""], "3 #", "title", "must be text in quotes; found 3"),
        two_mass(["steps = 125", "steps = 12.5"], "12.5", "tasks[0].steps", "a whole number of at least 1; found 12.5"),
        two_mass(["steps = 125", "steps = \"k1\""], "\"k1\"\ntime", "tasks[0].steps", "a whole number"),
        two_mass(["= 0.02 ", "= 1979-05-27 "], "1979", "tasks[0].time_step", "found a date or a time"),
        two_mass(
            ["= 0.02 ", "= true "],
            "true",
            "tasks[0].time_step",
            "a number, the name of a parameter or an expression of parameters",
        ),
        two_mass(["= 0.02 ", "= \"0.02\" "], "\"0.02\"", "tasks[0].time_step", "write numbers without quotes"),
        two_mass(["initial = 60.0", "initial = \"60\""], "\"60\"", "parameters.k1.initial", "must be a number"),
        two_mass(["unit = \"N/m\"", "unit = 3"], "3\n\n[parameters.k2", "parameters.k1.unit", "text in quotes"),
        two_mass(["scale = \"log\"", "scale = 3"], "3\n", "parameters.k1.scale", "must be one of `linear`, `log`"),
        two_mass(["[[tasks]]", "[tasks]"], "[tasks]", "tasks", "must be a list of one or more tables: [[tasks]]"),
        two_mass(["[model]", "[[model]]"], "[[model]]", "model", "must be a table"),
        two_mass(["[tasks.noise]", "[[tasks.noise]]"], "[[tasks.noise]]", "tasks[0].noise", "must be a table"),
        two_mass(["[parameters.k1]", "[[parameters.k1]]"], "[[param", "parameters.k1", "must be a table"),
        linear(["Q = [[1.0, 0.0], [0.0, 0.1]]", "Q = [1.0, 0.1]"], "1.0, 0.1]\nR", "tasks[0].costs[0].Q[0]", "a list"),
        linear(["norm = {", "norm = \"absolute\" #"], "\"absolute\"", "tasks[1].costs[0].norm", "smoothing = .."),
        linear(
            ["norm = \"quadratic\"", "norm = 2.25"],
            "2.25",
            "tasks[1].costs[1].norm",
            "one of `absolute`, `quadratic`; found 2.25",
        ),
    ]);
}

#[test]
fn lists_of_the_wrong_shape() {
    meet_all(&[
        two_mass(["mass = [0.2, 0.11]", "mass = [0.2]"], "[0.2]", "model.mass", "must be a list of 2; found 1"),
        two_mass(["mass = [0.2, 0.11]", "mass = [1, 2, 3]"], "[1, 2, 3]", "model.mass", "must be a list of 2; found 3"),
        two_mass(["mass = [0.2, 0.11]", "mass = 0.2"], "0.2 ", "model.mass", "must be a list of 2; found 0.2"),
        two_mass(["[20.0, 120.0]", "[20, 90, 120]"], "[20, 90", "parameters.k1.bounds", "must be a list of 2; found 3"),
        two_mass(["= [0.0, 0.0, 0.0, 0.0, 0.75]", "= [0, 0.75]"], "[0, 0.75]", "tasks[0].initial_state", "found 2"),
        two_mass(["= [10.0]", "= [1, 2]"], "[1, 2]", "tasks[0].initial_control", "found 2 numbers"),
        two_mass(["= [10.0]", "= []"], "[]", "tasks[0].initial_control", "found 0 numbers"),
        two_mass(["= [10.0]", "= [[1], [2, 3]]"], "[2, 3]", "tasks[0].initial_control[1]", "this row has 2 numbers"),
        two_mass(["= [10.0]", "= [1, [2]]"], "[1, [2]]", "tasks[0].initial_control", "must not be mixed"),
        linear(["[[0.0], [1], [0.5]]", "[[0], [1]]"], "[[0], [1]]", "tasks[1].initial_control", "found 2 rows"),
        linear(
            ["A = [[1.0, 0.1],", "A = [[1.0],"],
            "[[1.0],",
            "model.A",
            "must be square: it has 2 rows, but its row 1",
        ),
        linear(["B = [[0], [\"gain\"]]", "B = [[0]]"], "[[0]]", "model.B", "one row per state: 2, not 1"),
        linear(["C = [[1.0, 0.0]]", "C = [[1]]"], "[[1]]", "model.C", "one column per state: 2, but its row 1 has 1"),
        linear(["Q = [[1.0, 0.0], [0.0, 0.1]]", "Q = [[1]]"], "[[1]]", "tasks[0].costs[0].Q", "must be 2 x 2"),
        linear(
            ["target = [0.5, 0]", "target = [0.5]"],
            "[0.5]\nweight",
            "tasks[1].costs[0].target",
            "must be 2 numbers, one for each entry; found 1",
        ),
        two_mass(["[5e-3, 5e-2]", "[5e-3]"], "[5e-3]", "tasks[0].noise.measurement", "must have 2 variances; found 1"),
        two_mass(["[5e-3, 5e-2]", "[[1, 0], [1]]"], "[[1, 0]", "tasks[0].noise.measurement", "must be 2 x 2"),
    ]);
}

#[test]
fn numbers_that_are_not_valid() {
    const BOUNDS: &str = "[20.0, 120.0]";
    const V: &str = "tasks[0].noise.measurement";
    meet_all(&[
        two_mass(["steps = 125", "steps = 0"], "0\ntime", "tasks[0].steps", "must be from 1 to 1000000"),
        two_mass(["steps = 125", "steps = -1"], "-1\n", "tasks[0].steps", "a whole number of at least 1; found -1"),
        two_mass(["title =", "design.starts = -1\ntitle ="], "-1\n", "design.starts", "must not be negative; found -1"),
        two_mass(["title =", "design.starts = 1.5\ntitle ="], "1.5\n", "design.starts", "a whole number; found 1.5"),
        two_mass(["= 0.02 ", "= 0.0 "], "0.0 ", "tasks[0].time_step", "must be above 0; found 0"),
        two_mass(["= 0.02 ", "= nan "], "nan ", "tasks[0].time_step", "NaN is not a finite number"),
        two_mass(["0.11]", "inf]"], "inf]", "model.mass[1]", "inf is not a finite number"),
        two_mass(["[0.2, 0.11]", "[0.2, 0]"], "[0.2, 0]", "model.mass", "must be above 0 kg; found 0"),
        two_mass(["[9.8", "[-9.8"], "[-9.8", "model.damping", "must be at least 0 N s/m; found -9.8"),
        two_mass(["= 25.0", "= -25.0"], "-25.0", "tasks[0].bound", "must be at least 0"),
        two_mass(["= 25.0", "= inf"], "inf", "tasks[0].bound", "inf is not a finite number"),
        two_mass([BOUNDS, "[120.0, 20.0]"], "[120.0", "parameters.k1.bounds", "are reversed: [120, 20]"),
        two_mass(
            [BOUNDS, "[60.0, 60.0]"],
            "[60.0",
            "parameters.k1.bounds",
            "are equal: [60, 60]; replace a fixed parameter by a number",
        ),
        two_mass([BOUNDS, "[0.0, 120.0]"], "[0.0, 120", "parameters.k1.bounds", "must be above 0 with scale = \"log\""),
        two_mass([BOUNDS, "[20.0, inf]"], "[20.0, inf]", "parameters.k1.bounds", "must be two finite numbers"),
        two_mass(["= 60.0", "= 600.0"], "600.0", "parameters.k1.initial", "600 is outside the bounds [20, 120]"),
        two_mass(["= 60.0", "= nan"], "nan", "parameters.k1.initial", "NaN is outside the bounds [20, 120]"),
        two_mass(["[3e-4,", "[-3e-4,"], "-3e-4", "tasks[0].noise.initial[0]", "must be at least 0"),
        two_mass(
            ["[5e-3, 5e-2]", "[5e-3, 0]"],
            "0]\n\n[[tasks.costs]]",
            "tasks[0].noise.measurement[1]",
            "must be above 0",
        ),
        two_mass(["[5e-3, 5e-2]", "[[1, 2], [2, 1]]"], "[[1, 2]", V, "semidefinite; its leading 2 x 2 block is not"),
        two_mass(["[5e-3, 5e-2]", "[[1, 1], [1, 1]]"], "[[1, 1]", V, "must be positive definite"),
        two_mass(
            ["[5e-3, 5e-2]", "[[2, 1], [0, 2]]"],
            "0, 2]]",
            "tasks[0].noise.measurement[1][0]",
            "must be symmetric up to rounding: [1][0] is 0, and [0][1] is 1",
        ),
        linear(
            ["[0.01, 1.0]\nscale = \"log\"", "[0.0, 1.0]"],
            "\"sensor-noise\"]\n",
            "tasks[0].noise.measurement[0]",
            "its parameter can be as low as 0",
        ),
        two_mass(["weight = 0.05", "weight = -0.05"], "-0.05", "tasks[0].costs[0].weight", "at least 0; found -0.05"),
        linear(["final_weight = 2.5", "final_weight = -1"], "-1\nnorm", "tasks[1].costs[0].final_weight", "at least 0"),
        linear(
            ["weight = 0.01", "weight = \"stiffness\""],
            "\"stiffness\"\n",
            "tasks[1].costs[1].weight",
            "its parameter can be as low as -1",
        ),
        linear(
            ["Q = [[1.0,", "Q = [[-1.0,"],
            "[[-1.0,",
            "tasks[0].costs[0].Q",
            "entry (1, 1) must be at least 0; found -1",
        ),
        linear(
            ["final = [[2.0, 0.1], [0.1, 1.0]]", "final = [[1, 2], [2, 1]]"],
            "[[1, 2]",
            "tasks[0].costs[0].final",
            "must be positive semidefinite",
        ),
        linear(
            ["final = [[2.0, 0.1], [0.1, 1.0]]", "final = [[1, 2], [0, 1]]"],
            "0, 1]]",
            "tasks[0].costs[0].final[1][0]",
            "must be symmetric up to rounding: [1][0] is 0, and [0][1] is 2",
        ),
        linear(
            ["process = [0.0, 1e-3]", "process = [[1, \"sensor-noise\"], [0.5, 1e-3]]"],
            "0.5, 1e-3]]",
            "tasks[0].noise.process[1][0]",
            "must be symmetric up to rounding: [1][0] is 0.5, and [0][1] is `sensor-noise`",
        ),
        linear(
            ["process = [0.0, 1e-3]", "process_deviation = { x1 = 0.0, \"x-2\" = 0.1 }"],
            "0.1 }",
            "tasks[0].noise.process_deviation.x-2",
            "no state is `x-2`",
        ),
        linear(
            ["process = [0.0, 1e-3]", "process_deviation = [0.1]"],
            "[0.1]",
            "tasks[0].noise.process_deviation",
            "must have 2 standard deviations; found 1",
        ),
        linear(
            ["smoothing = 0.1", "smoothing = 0"],
            "{ absolute",
            "tasks[1].costs[0].norm",
            "must be above 0; found 0",
        ),
        two_mass(
            ["smoothing = 5.0", "smoothing = -5.0"],
            "-5.0",
            "tasks[0].costs[0].smoothing",
            "above 0 N, or left out for the force as it is; found -5",
        ),
        linear(
            ["information_weight = 2", "information_weight = -2"],
            "-2\n",
            "tasks[1].information_weight",
            "at least 0",
        ),
        two_mass(["title =", "design.starts = 0\ntitle ="], "0\ntitle", "design.starts", "must be at least 1; found 0"),
        two_mass(
            ["title =", "design.starts = 1000000000000000000\ntitle ="],
            "1000000",
            "design.starts",
            "must be at most 10000",
        ),
        two_mass(
            ["title =", "design.branch_attempts = 1000000000000000000\ntitle ="],
            "1000000",
            "design.branch_attempts",
            "must be at most 10000",
        ),
        two_mass(
            ["title =", "planning.sampled = { iterations = 0 }\ntitle ="],
            "0 }\ntitle",
            "planning.sampled.iterations",
            "must be at least 1",
        ),
        two_mass(
            ["title =", "planning.sampled = { tolerance = nan }\ntitle ="],
            "nan }\ntitle",
            "planning.sampled.tolerance",
            "must be between 0 and 1",
        ),
        two_mass(["title =", "planning.tolerance = nan\ntitle ="], "nan", "planning.tolerance", "between 0 and 1"),
    ]);
}

/// What a product such as `G G'` leaves in the last digit is no asymmetry, and the bound is the same.
#[test]
fn matrices_that_are_symmetric_but_for_rounding_are_taken() {
    let bits = |covariance: &str, weight: &str| {
        let text = edited(LINEAR, "process = [0.0, 1e-3]", &format!("process = {covariance}"));
        let folder = Folder::with_task(edited(&text, "Q = [[1.0, 0.0], [0.0, 0.1]]", &format!("Q = {weight}")));
        let found = folder.run(&["bound", "task.toml", "--json"]).json(0);
        found["tasks"][0]["minimum_bits"].as_f64().unwrap()
    };
    let exact = bits("[[1e-3, 3e-4], [3e-4, 1e-3]]", "[[1.0, 0.3], [0.3, 1.0]]");
    let rounded = bits("[[1e-3, 3.0000000000000003e-4], [3e-4, 1e-3]]", "[[1.0, 0.3], [0.30000000000000004, 1.0]]");
    assert!(exact > 0.0 && (rounded - exact).abs() < 1e-9 * exact, "{exact} {rounded}");
}

#[test]
fn huge_numbers_end_in_an_error_and_not_in_want_of_memory() {
    const STEPS: &str = "steps = 125";
    meet_all(&[
        two_mass(
            [STEPS, "steps = 1_000_001"],
            "1_000_001",
            "tasks[0].steps",
            "must be from 1 to 1000000 with 5 states",
        ),
        two_mass([STEPS, "steps = 1000000000"], "1000000000", "tasks[0].steps", "found 1000000000"),
        two_mass([STEPS, "steps = 1000000000000"], "1000000000000", "tasks[0].steps", "found 1000000000000"),
        two_mass([STEPS, "steps = 9223372036854775807"], "9223372036854775807", "tasks[0].steps", "must be from 1"),
        two_mass([STEPS, "steps = 0x7fffffffffffffff"], "0x7f", "tasks[0].steps", "found 9223372036854775807"),
        two_mass(
            [STEPS, "steps = 99999999999999999999"],
            "99999999999999999999",
            "tasks[0].steps",
            "too large a number",
        ),
        two_mass(["= 0.02 ", "= 1e999 "], "1e999", "tasks[0].time_step", "is too large a number"),
        two_mass(["= 60.0", "= -inf"], "-inf", "parameters.k1.initial", "-inf is outside the bounds"),
    ]);
    let deep = edited(TWO_MASS, "[10.0]", &format!("{}10.0{}", "[".repeat(100_000), "]".repeat(100_000)));
    let run = Folder::with_task(deep).run(&["evaluate", "task.toml"]);
    assert!(run.error().contains("recurs"), "{}", run.error());
    assert!(run.stderr.len() < 1000, "a long line is not shown");
}

#[test]
fn parameters_and_their_names() {
    const NAME: &str = "[parameters.k1]";
    meet_all(&[
        two_mass(
            ["[\"k1\", \"k2\"]", "[\"k1\", \"k3\"]"],
            "\"k3\"",
            "model.stiffness[1]",
            "add a table [parameters.k3]",
        ),
        two_mass(["[\"k1\", \"k2\"]", "[\"k1\", \"\"]"], "\"\"]", "model.stiffness[1]", "the name of a parameter"),
        two_mass(["[\"k1\", \"k2\"]", "[\"k1\", 30]"], "k2]\n", "parameters.k2", "is declared but never used"),
        linear(
            ["[\"stiffness\", 0.9]", "[\"stifness\", 0.9]"],
            "\"stifness\"",
            "model.A[1][0]",
            "or use one of `stiffness`",
        ),
        two_mass([NAME, "[parameters.\"a b\"]"], "\"a b\"", "parameters.\"a b\"", "letters, digits, `_`, `-` and `.`"),
        two_mass([NAME, "[parameters.\"\"]"], "\"\"]", "parameters.\"\"", "cannot name a parameter"),
        two_mass([NAME, "[parameters.\"k=1\"]"], "\"k=1\"", "parameters.\"k=1\"", "cannot name a parameter"),
        two_mass([NAME, "[parameters.\"k\\n\"]"], "\"k\\n\"", "parameters.\"k\\n\"", "cannot name a parameter"),
        two_mass([NAME, "[parameters.k1.x]"], "x]", "parameters.k1.x", "unknown key `x`"),
    ]);
}

#[test]
fn names_of_tasks_states_and_signals() {
    meet_all(&[
        two_mass(["\"press\"", "\"\""], "\"\"", "tasks[0].name", "must not be empty"),
        linear(["\"hold\"", "\"reach\" "], "\"reach\" ", "tasks[1].name", "`reach` names two tasks"),
        two_mass(
            ["[\"v1\", \"v2\"]", "[\"v1\", \"w\"]"],
            "[\"v1\"",
            "tasks[0].costs[2].select",
            "no state `w`: it has `x1`",
        ),
        linear(["[\"x1\", \"x2\"]", "[]"], "[]", "tasks[1].costs[0].select", "name at least one"),
        linear(
            ["[\"x1\", \"x2\"]", "[\"x1\", \"x1\"]"],
            "\"x1\"]",
            "tasks[1].costs[0].select[1]",
            "is selected already",
        ),
        linear(
            ["kind = \"control\"", "kind = \"penetration\""],
            "\"penetration\"",
            "tasks[1].costs[1].kind",
            "the model has no contact",
        ),
    ]);
}

#[test]
fn text_that_is_no_toml() {
    meet_all(&[
        two_mass(["steps = 125", "steps 125"], "125\n", "", "expected `=`"),
        two_mass(["steps = 125", "steps = 125\nsteps = 3"], "steps = 3", "steps", "`steps` is defined twice"),
        two_mass(["\"press\"", "\"press"], "\nsteps", "", "expected `\"`"),
        two_mass(["steps = 125", "steps = 125 s"], "125 s", "", "write `125` in SI units and radians, without `s`"),
        two_mass(
            ["steps = 125", "steps = 0.5ms # half"],
            "0.5ms",
            "",
            "write `0.5` in SI units and radians, without `ms`",
        ),
        two_mass(["steps = 125", "steps = -1e3°"], "-1e3°", "", "write `-1e3` in SI units and radians, without `°`"),
        two_mass(["steps = 125", "steps = 5 N m/rad"], "5 N", "", "without `N m/rad`"),
        two_mass(["steps = 125", "steps = kk_"], "kk_", "", "string values must be quoted"),
        two_mass(["steps = 125", "steps = 0x1G"], "G", "", ""),
        two_mass(["steps = 125", "\u{1f600} = 125"], "\u{1f600}", "", "invalid unquoted key"),
        two_mass(["\"press\"", "\"dr\u{fc}cken\" x"], "x\nsteps", "", "expected newline"),
    ]);
    meet("{\"model\": 1}", (1, 1), "", "expected key");
}

#[test]
fn lines_that_end_as_on_other_systems() {
    let text = edited(TWO_MASS, "steps = 125", "steps = 0").replace('\n', "\r\n");
    meet(&text, position(&text, "0\r\ntime"), "tasks[0].steps", "must be from 1");
}

#[test]
fn text_that_is_not_unicode() {
    let (before, after) = TWO_MASS.split_at(TWO_MASS.find("steps").unwrap_or_default());
    let folder = Folder::with_task([before.as_bytes(), b"\xff", after.as_bytes()].concat());
    let (line, column) = position(TWO_MASS, "steps");
    let run = folder.run(&["evaluate", "task.toml", "--json"]);
    assert!(run.error().starts_with(&format!("error: task.toml:{line}:{column}: must be UTF-8")), "{run:?}");
}

#[test]
fn files_that_cannot_be_read() {
    let folder = Folder::new();
    for command in ["design", "evaluate", "check"] {
        let run = folder.run(&[command, "none.toml"]);
        assert!(run.error().starts_with("error: none.toml: cannot be read: "), "{run:?}");
        assert!(folder.run(&[command, "."]).error().starts_with("error: .: cannot be read: "));
    }
    assert!(folder.names().is_empty());
}

#[cfg(target_os = "linux")]
#[test]
fn a_file_without_end_is_not_read_to_its_end() {
    assert!(Folder::new().run(&["evaluate", "/dev/zero"]).error().contains("larger than 64 MiB"));
}

#[test]
fn what_cannot_be_computed() {
    let text = edited(TWO_MASS, "= [0.0, 0.0,", "= [1e200, 0.0,");
    let run = Folder::with_task(text).run(&["evaluate", "task.toml", "--json"]);
    assert!(run.error().contains("not finite"), "{run:?}");
}

/// Every command says the same of a bad file.
#[test]
fn every_command_refuses_a_bad_file() {
    let folder = Folder::with_task(edited(TWO_MASS, "steps = 125", "stepz = 125"));
    let commands: [&[&str]; 5] = [
        &["design", "task.toml"],
        &["design", "task.toml", "--json", "--out", "out"],
        &["evaluate", "task.toml"],
        &["evaluate", "task.toml", "--json", "--gradient", "both", "--rollouts", "5"],
        &["check", "task.toml", "--json"],
    ];
    for command in commands {
        let run = folder.run(command);
        assert!(run.error().contains(":25:1: tasks[0].stepz: unknown key `stepz`; valid: `name`, `steps`"), "{run:?}");
        assert!(run.stderr.contains("stepz = 125"), "the line is shown: {run:?}");
    }
    assert_eq!(folder.names(), ["task.toml"]);
}

#[test]
fn bad_arguments() {
    let folder = Folder::with_task(TWO_MASS);
    let cases: [(&[&str], &str); 36] = [
        (&["evaluate"], "<TASK>"),
        (&["frobnicate"], "unrecognized subcommand 'frobnicate'"),
        (&["evaluate", "task.toml", "more"], "unexpected argument 'more'"),
        (&["evaluate", "task.toml", "--gradient", "totl"], "[possible values: total, frozen, both, none]"),
        (&["evaluate", "task.toml", "--set", "k1"], "--set k1: write NAME=VALUE"),
        (&["evaluate", "task.toml", "--set", "k1="], "the value is not a number"),
        (&["evaluate", "task.toml", "--set", "k1=3 N/m"], "the value is not a number"),
        (&["evaluate", "task.toml", "--set", "k1=1e9"], "`k1` = 1000000000 is outside [20, 120]"),
        (&["evaluate", "task.toml", "--set", "k1=nan"], "`k1` = NaN is outside [20, 120]"),
        (&["evaluate", "task.toml", "--set", "k3=30"], "no parameter `k3`; valid: `k1`, `k2`"),
        (&["evaluate", "task.toml", "--set", "=30"], "no parameter ``"),
        (&["evaluate", "task.toml", "--rollouts", "-1"], "must be a whole number from 0 to 10000000; found -1"),
        (&["evaluate", "task.toml", "--rollouts", "1000000000000000000"], "must be a whole number from 0 to 10000000"),
        (&["evaluate", "task.toml", "--branches", "1000000000000000000"], "must be a whole number from 0 to 10000"),
        (&["evaluate", "task.toml", "--seed", "x"], "invalid value 'x' for '--seed <S>'"),
        (&["evaluate", "task.toml", "--threads", "0"], "must be a whole number from 1 to 1024; found 0"),
        (&["evaluate", "task.toml", "--threads", "1000000"], "must be a whole number from 1 to 1024"),
        (&["evaluate", "task.toml", "--instructions", "sse"], "[possible values: baseline, avx2, avx512]"),
        (&["design", "task.toml", "--starts", "0"], "must be a whole number from 1 to 10000; found 0"),
        (&["design", "task.toml", "--starts", "1000000000000000000"], "must be a whole number from 1 to 10000"),
        (&["design", "task.toml", "--starts", "-1"], "must be a whole number from 1 to 10000; found -1"),
        (&["design", "task.toml", "--starts", "1.5"], "must be a whole number from 1 to 10000; found 1.5"),
        (
            &["evaluate", "task.toml", "--seed", "-1"],
            "invalid value '-1' for '--seed <S>': must be a whole number from 0",
        ),
        (&["--threads", "-1", "evaluate", "task.toml"], "must be a whole number from 1 to 1024; found -1"),
        (&["sensors", "task.toml", "--count", "-1"], "must be a whole number from 0 to 1000000; found -1"),
        (&["explore", "task.toml", "--port", "-1"], "must be a port from 1 to 65535; found -1"),
        (&["evaluate", "task.toml", "--set", "-1"], "--set -1: write NAME=VALUE"),
        (&["design", "task.toml", "--method", "slsqp"], "[possible values: sqp, cobyla, barrier]"),
        (&["design", "task.toml", "--gradient", "both"], "[possible values: total, frozen]"),
        (&["design", "task.toml", "--set", "k1=0"], "is outside [20, 120]"),
        (
            &["design", "task.toml", "--out", "task.toml"],
            "task.toml/result.json: `task.toml` is a file, not a folder; choose another folder, or",
        ),
        (
            &["design", "task.toml", "--out", "task.toml/in"],
            "task.toml/in/result.json: `task.toml` is a file, not a folder",
        ),
        (&["check", "task.toml", "--set", "k9=1"], "no parameter `k9`"),
        (&["completions", "ksh"], "[possible values: bash, elvish, fish, powershell, zsh]"),
        (&["new"], "<NAME>"),
        (&["new", "there/is/no/folder"], "there/is/no/folder.toml: "),
    ];
    for (arguments, says) in cases {
        let run = folder.run(arguments);
        run.error();
        assert!(run.stderr.contains(says), "{arguments:?}: expected {says}\n{}", run.stderr);
    }
    for name in ["", ".toml", "/", "folder/", ".."] {
        assert!(folder.run(&["new", name]).error().contains("is not a file name"));
    }
    assert_eq!(folder.names(), ["task.toml"]);
}

#[test]
fn a_result_that_cannot_be_written_is_known_before_the_search() {
    let folder = Folder::with_task(TWO_MASS);
    std::fs::create_dir_all(folder.path("out/result.json")).ok();
    // The search alone would take minutes.
    let run = folder.run(&["design", "task.toml", "--starts", "10000", "--out", "out"]);
    let error = run.error();
    assert!(error.contains("out/result.json: is a folder; choose another place, or remove it"), "{error}");
}

#[test]
fn a_problem_without_design_parameters_has_nothing_to_design() {
    let text = TWO_MASS.replace("unit = \"N/m\"", "role = \"study\"");
    let folder = Folder::with_task(text);
    let run = folder.run(&["design", "task.toml", "--json", "--out", "out"]);
    assert!(run.error().contains("role = \"design\""), "{run:?}");
    assert_eq!(folder.names(), ["task.toml"]);
    assert_eq!(folder.run(&["evaluate", "task.toml", "--set", "k1=50"]).quiet().0, Some(0));
}
