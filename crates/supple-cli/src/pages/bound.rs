use std::fmt::Write;

use supple::bound::{SensorWindow, TaskBound};
use supple_study::About;
use supple_study::bound::{BoundStudy, Curve};
use supple_text::saves;

use crate::tables::{Rows, align_right, heading, number, table, with_unit};
use crate::trust;

/// Directions of the virtual sensor shown per time window.
const SHOWN: usize = 2;

/// The page of `supple bound`.
pub fn bound_page(about: &About, study: &BoundStudy) -> String {
    let mut page = heading(about);
    for (index, task) in study.report.tasks.iter().enumerate() {
        let limit = about.tasks.iter().find(|one| one.name == task.name).and_then(|one| one.bound);
        page.push_str(&task_page(task, limit));
        if let Some(curve) = study.curves.get(index) {
            page.push_str(&curve_page(task, curve));
        }
    }
    page
}

/// The bounds of a task, of which the task file has this cost limit.
fn task_page(task: &TaskBound, limit: Option<f64>) -> String {
    let mut page = String::new();
    let over = match task.stationary {
        true => "in the steady state, per step".to_owned(),
        false => format!("over {} decisions of {} s", task.steps, number(task.time_step_s)),
    };
    let _ = writeln!(page, "{}: {over}\n", task.name);
    let mut costs = table(&["expected cost", "", ""]);
    let same = |other: f64| (other - task.cost).abs() <= 1e-9 * task.cost.abs();
    let note = match limit.filter(|_| !task.stationary) {
        Some(limit) if same(limit) => "the cost limit of the task".to_owned(),
        Some(limit) => format!("the cost limit of the task is {0}: `--cost {0}`", number(limit)),
        None => String::new(),
    };
    costs.add_row(["to be kept, D", &number(task.cost), &note]);
    let known = |cost: Option<f64>, else_: &str| cost.map_or_else(|| else_.to_owned(), number);
    costs.add_row(["of this design", &known(task.own_cost, "none"), ""]);
    costs.add_row(["minimum, with the state known exactly", &number(task.minimum_cost), ""]);
    costs.add_row(["without measurements", &known(task.open_loop_cost, "unbounded"), ""]);
    align_right(&mut costs, 1..2);
    let _ = writeln!(page, "{costs}\n");
    let mut rows = table(&["information", "bits per step", "bits", "for"]);
    for line in &task.order {
        let rate = line.bits_per_step;
        let total = rate.filter(|_| !task.stationary).map(|rate| rate * task.steps as f64);
        let shown = |bits: Option<f64>, else_: &str| bits.map_or_else(|| else_.to_owned(), number);
        rows.add_row([line.what.clone(), shown(rate, "unknown"), shown(total, ""), line.assumption.clone()]);
    }
    align_right(&mut rows, 1..3);
    let _ = writeln!(page, "{rows}\n");
    summary(&mut page, task);
    sensor(&mut page, task);
    for remark in &task.remarks {
        let _ = writeln!(page, "Note: {remark}.");
    }
    page.push_str(&trust::of_plan("Roll-outs", &task.warnings, task.trust.as_ref()));
    page
}

fn summary(page: &mut String, task: &TaskBound) {
    if let Some(efficiency) = task.efficiency {
        let of_controls = task
            .control_efficiency
            .map_or_else(String::new, |share| format!(", and {} % of the information used", number(100.0 * share)));
        let _ = writeln!(
            page,
            "Efficiency: the minimum is {} % of the information measured{of_controls}.",
            number(100.0 * efficiency)
        );
    }
    let _ = match (&task.not_proved, task.not_certified()) {
        (None, Some(reason)) => writeln!(page, "The minimum is NOT CERTIFIED: {reason}."),
        (None, None) if task.newton_steps == 0 => {
            writeln!(page, "The lower bound is certified by interval arithmetic.")
        }
        (None, None) => writeln!(
            page,
            "The lower bound is certified by interval arithmetic, {:.1e} bits per step below the minimum, which took \
             {} Newton steps.",
            task.duality_gap_bits, task.newton_steps
        ),
        (Some(reason), _) => writeln!(page, "The lower bound is NOT PROVED: {reason}."),
    };
    let _ = writeln!(page, "{}.", saves("cost", task.price_bits_per_cost, task.minimum_bits, number));
    let _ = writeln!(
        page,
        "Prefix-free codes with scalar quantisers require at most {} bits per step for the virtual sensor.",
        number(task.quantiser_bits_per_step)
    );
    if let Some(last) = task.last_measurement_bits {
        let _ = writeln!(page, "The final measurement, after the last decision, gives {} more bits.", number(last));
    }
    page.push('\n');
}

fn sensor(page: &mut String, task: &TaskBound) {
    let sensor = &task.virtual_sensor;
    if sensor.rank == 0 {
        let why = match task.open_loop_cost {
            Some(open) if open <= task.cost => "the cost limit is met without measurements",
            _ if task.minimum_bits_per_step == 0.0 => "the cost limit is met without measurements",
            _ => "none that stays within the cost limit was found",
        };
        let _ = writeln!(page, "Virtual sensor: none; {why}.\n");
        return;
    }
    let numbers = if sensor.rank == 1 { "number" } else { "numbers" };
    let _ = writeln!(page, "Virtual sensor: at most {} {numbers} per decision.", sensor.rank);
    let total: f64 = sensor.measured.iter().map(|one| one.bits).sum();
    let shares = sensor.measured.iter().filter(|one| one.bits >= 0.05 * total);
    let shares: Vec<_> = shares.map(|one| format!("{} {:.0} %", one.state, 100.0 * one.bits / total)).collect();
    let _ = writeln!(page, "Its information by state: {}.\n", shares.join(", "));
    let mut rows = table(&["time, s", "bits", "peak at, s", "bits at peak", "measures", "standard deviation"]);
    for window in &sensor.windows {
        window_rows(&mut rows, window, task);
    }
    align_right(&mut rows, 1..4);
    let _ = writeln!(page, "{rows}\n");
}

fn window_rows(rows: &mut Rows, window: &SensorWindow, task: &TaskBound) {
    let span = match task.stationary {
        true => "any".to_owned(),
        false => format!("{} to {}", number(window.from_s), number(window.until_s)),
    };
    let at = if task.stationary { String::new() } else { number(window.strongest as f64 * task.time_step_s) };
    if window.directions.is_empty() {
        rows.add_row([
            span.clone(),
            number(window.bits),
            String::new(),
            String::new(),
            "nothing".to_owned(),
            String::new(),
        ]);
    }
    for (place, direction) in window.directions.iter().take(SHOWN).enumerate() {
        let first = |text: String| if place == 0 { text } else { String::new() };
        rows.add_row([
            first(span.clone()),
            first(number(window.bits)),
            first(at.clone()),
            number(direction.bits),
            direction.text.clone(),
            with_unit(direction.deviation, &direction.unit),
        ]);
    }
}

fn curve_page(task: &TaskBound, curve: &Curve) -> String {
    let mut page = String::new();
    let mut rows = table(&["cost", "minimum, bits per step", "certified from", ""]);
    for point in &curve.points {
        let own = if point.cost == task.cost { "D" } else { "" };
        let note = point.error.as_deref().unwrap_or(own);
        rows.add_row([
            number(point.cost),
            number(point.minimum_bits_per_step),
            number(point.minimum_lower_bits_per_step),
            note.to_owned(),
        ]);
    }
    align_right(&mut rows, 0..3);
    let _ = writeln!(page, "{rows}\n");
    page
}
