use std::fmt::Write;

use supple::PlanCheck;
use supple_study::About;
use supple_study::sensors::{Certificate, Search, SensorGoal, SensorSet, Sensors, SetBy};

use crate::tables::{align_right, heading, number, table};
use crate::trust;

/// The page of `supple sensors`.
pub fn sensors_page(about: &About, study: &Sensors) -> String {
    let mut page = heading(about) + &asked(about, study) + &sets(study);
    page.push_str(&values(study));
    study.remarks.iter().for_each(|remark| page.extend(["Note: ", remark, ".\n"]));
    page.push_str(&certificate(study));
    for plan in &study.plans {
        page.push_str(&plan_lines(plan, study.plans.len() > 1));
    }
    page.push_str(next(study));
    page
}

/// What speaks against the plan with all sensors, about which sets are compared; `named` where there are several tasks.
fn plan_lines(plan: &PlanCheck, named: bool) -> String {
    let task = if named { format!(" of {}", plan.task) } else { String::new() };
    trust::of_plan(&format!("Roll-outs{task} with all sensors"), &plan.warnings, plan.trust.as_ref())
}

/// What to try next, where nothing speaks against choosing every sensor.
fn next(study: &Sensors) -> &'static str {
    let options = &study.options;
    let is_limited = options.budget.is_some() || options.count.is_some() || options.cost.is_some();
    let is_free = study.sensors.iter().all(|sensor| sensor.price == 0.0);
    if is_limited || !is_free || study.sensors.len() < 3 {
        return "";
    }
    "Next: without prices, every sensor is worth adding. Use `--count 2` for the best two, `--cost` for the fewest that meet a cost limit, or a catalogue with prices (docs/sensors.md).\n"
}

/// What was asked for, in a sentence.
fn asked(about: &About, study: &Sensors) -> String {
    let options = &study.options;
    let what = match (options.cost, options.goal) {
        (Some(cost), _) => format!("The cheapest sensors with an expected cost of at most {}", number(cost)),
        (None, SensorGoal::Cost) => "The sensors with the lowest expected cost".to_owned(),
        (None, SensorGoal::Information) => "The sensors with the most information".to_owned(),
    };
    let mut limits = Vec::new();
    limits.extend(options.budget.map(|budget| format!("a budget of {}", number(budget))));
    limits.extend(options.count.map(|count| format!("a count of {count}")));
    let within = if limits.is_empty() { String::new() } else { format!(" within {}", limits.join(" and ")) };
    let from = if study.catalogue { "the catalogue" } else { "the task's own measurements" };
    let mut tasks = String::new();
    if study.tasks.len() > 1 {
        let _ = write!(tasks, ", all of {} together", study.tasks.join(", "));
        if about.tasks.iter().any(|task| task.information_weight != 1.0) {
            tasks.push_str(", their bits weighted by `information_weight`");
        }
    }
    format!("{what}{within}, from {from}{tasks}:\n\n")
}

fn sets(study: &Sensors) -> String {
    let mut rows = table(&["", "expected cost", "information, bits", "price", "sensors"]);
    let mut row = |name: &str, set: &SensorSet, sensors: String| {
        let numbers = [set.expected_cost, set.information_bits, set.price].map(number);
        rows.add_row([name.to_owned()].into_iter().chain(numbers).chain([sensors]));
    };
    let names = |set: &SensorSet| if set.sensors.is_empty() { "none".to_owned() } else { set.sensors.join(", ") };
    row("none of them", &study.none, String::new());
    if let Some(greedy) = &study.greedy {
        let by = if greedy.by == SetBy::GainPerPrice { "greedy, by gain per price" } else { "greedy, by gain" };
        row(by, greedy, names(greedy));
    }
    if let Some(best) = &study.best {
        row(if study.certificate.proved { "the best" } else { "the best found" }, best, names(best));
    }
    row("all of them", &study.all, String::new());
    align_right(&mut rows, 1..4);
    format!("{rows}\n\n")
}

/// What every sensor is worth, the most valuable one alone first.
fn values(study: &Sensors) -> String {
    let header = [
        "sensor",
        "price",
        "saves alone",
        "per price",
        "in the set",
        "beyond the others",
        "bits alone",
        "bits beyond the others",
        "",
    ];
    let mut rows = table(&header);
    let mut sensors: Vec<_> = study.sensors.iter().collect();
    sensors.sort_by(|a, b| b.saved_alone.total_cmp(&a.saved_alone));
    for sensor in sensors {
        let numbers = [sensor.saved_in_set, sensor.saved_beyond_others, sensor.bits_alone, sensor.bits_beyond_others];
        let per_price = sensor.saved_alone_per_price.map(number).unwrap_or_default();
        let first = [sensor.name.clone(), number(sensor.price), number(sensor.saved_alone), per_price];
        let last = if sensor.chosen { "chosen" } else { "" };
        rows.add_row(first.into_iter().chain(numbers.map(number)).chain([last.to_owned()]));
    }
    align_right(&mut rows, 1..8);
    let note = "Cost saved and bits gained by each sensor: as the only candidate, in the chosen set, and beyond all \
                other sensors.";
    format!("{rows}\n\n{note}\n")
}

fn certificate(study: &Sensors) -> String {
    let Certificate { bound, certified_ratio, search, searched_bound, proved, ratio, tried } = study.certificate;
    let beyond = |bound: f64| match (study.options.cost, study.options.goal) {
        (Some(_), _) => format!("is cheaper than a price of {}", number(bound)),
        (None, SensorGoal::Cost) => format!("is better than an expected cost of {}", number(bound)),
        (None, SensorGoal::Information) => format!("gives more than {} bits", number(bound)),
    };
    let mut text = match searched_bound.filter(|_| proved) {
        Some(best) => format!(
            "No set within the limits {}. Without a search, the relaxation shows that none {}.\n",
            beyond(best),
            beyond(bound)
        ),
        None => format!("No set within the limits {}.\n", beyond(bound)),
    };
    if study.options.cost.is_some() {
        let _ = writeln!(text, "{}", of_prices(study));
        return text;
    }
    // Rounded down: a share is certified.
    let share = |ratio: f64| format!("{:.2} %", (1e4 * ratio).floor() / 100.0);
    if let Some(certified) = certified_ratio {
        let _ = writeln!(
            text,
            "Greedy choice is certified to have at least {} of the best possible gain.",
            share(certified)
        );
    }
    if let (Some(search), Some(searched), Some(ratio)) = (search, searched_bound, ratio) {
        let _ = match (search, proved) {
            (Search::Exhaustive, _) => writeln!(text, "Exhaustive search shows that it achieves {}.", share(ratio)),
            (_, true) => writeln!(text, "Branch and bound proves that it has {}.", share(ratio)),
            (_, false) => writeln!(
                text,
                "Branch and bound stopped early. It proves that no set {}, so the greedy set achieves at least {}.",
                beyond(searched),
                share(ratio)
            ),
        };
    }
    let _ = writeln!(text, "{}", effort(tried, search));
    text
}

/// How far from the least price the greedy one can be.
fn of_prices(study: &Sensors) -> String {
    let Certificate { bound, search, searched_bound, proved, tried, .. } = study.certificate;
    let price = study.greedy.as_ref().map_or(study.chosen.price, |greedy| greedy.price);
    if price <= 0.0 {
        return format!("No sensors are required: the limit is met without any.\n{}", effort(tried, search));
    }
    let above =
        |bound: f64| if bound > 0.0 { format!("{:.4} times", price / bound) } else { "any multiple of".to_owned() };
    let mut text = format!("Greedy choice is certified to cost at most {} the least price.", above(bound));
    if let Some(searched) = searched_bound {
        let how = if proved { "The search proves" } else { "The search, which was not finished, shows" };
        let _ = write!(text, " {how} at most {}.", above(searched));
    }
    format!("{text}\n{}", effort(tried, search))
}

/// What the searches took: each may have evaluated the same sets as others.
fn effort(tried: usize, search: Option<Search>) -> String {
    let regions = if search == Some(Search::BranchAndBound) { " and branch-and-bound regions" } else { "" };
    format!("All searches together took {tried} evaluations of sensor sets{regions}.")
}
