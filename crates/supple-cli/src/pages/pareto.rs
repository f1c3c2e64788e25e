use std::f64::consts::LN_2;
use std::fmt::Write;

use supple::Verdict;
use supple::design::{DesignStatus, InformationWeights};
use supple_study::About;
use supple_study::pareto::{Pareto, ParetoPoint};
use supple_text::capitalised;

use crate::tables::{align_right, heading, number, table, title};

/// The heading of what is minimised.
fn minimised(front: &Pareto) -> String {
    match front.information {
        InformationWeights::MEASURED => "information, bits".to_owned(),
        aim => format!("information {aim}, bits"),
    }
}

/// The page of `supple pareto`.
pub fn pareto_page(about: &About, front: &Pareto) -> String {
    let design = about.parameters.design();
    let mut header = vec!["factor".to_owned(), minimised(front)];
    for (task, bound) in about.tasks.iter().zip(&front.bounds) {
        header.push(format!("cost of {}", task.name));
        if bound.is_finite() {
            header.push("bits per unit of cost limit".into());
        }
    }
    header.extend(design.iter().map(|&i| {
        let parameter = about.parameters.get(i);
        title(&parameter.name, &parameter.unit)
    }));
    let has_prices = front.points.iter().any(|point| point.price.is_some());
    header.extend(has_prices.then(|| "price".into()));
    header.push("status".into());
    let mut rows = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for point in &front.points {
        let mut row = vec![format!("{:.6}", point.factor), number(point.information_nats / LN_2)];
        for ((cost, price), bound) in point.costs.iter().zip(&point.prices).zip(&front.bounds) {
            row.push(number(*cost));
            if bound.is_finite() {
                row.push(if price.is_nan() { "infinite".into() } else { number(price / LN_2) });
            }
        }
        row.extend(design.iter().map(|&i| number(point.parameters.0[i].1)));
        row.extend(has_prices.then(|| number(point.price.unwrap_or(f64::NAN))));
        row.push(point.status.to_string());
        rows.add_row(row);
    }
    align_right(&mut rows, 0..header.len() - 1);
    let mut page = heading(about);
    let _ = writeln!(page, "{rows}\n");
    for remark in &front.remarks {
        let _ = writeln!(page, "{}.", sentence(&remark.text));
    }
    for point in &front.points {
        for warning in &point.warnings {
            let _ = writeln!(page, "Warning: at factor {:.6}, {warning}.", point.factor);
        }
        for trust in point.trust.iter().filter(|trust| trust.verdict != Verdict::Holds) {
            let _ = writeln!(page, "At factor {:.6}, roll-outs: {trust}.", point.factor);
        }
    }
    if let Some(stopped) = stopped_front(front) {
        let _ = writeln!(page, "Warning: {stopped}.");
    }
    let count = |wanted: &dyn Fn(&ParetoPoint) -> bool| front.points.iter().filter(|point| wanted(point)).count();
    let _ = writeln!(
        page,
        "\nAt each point, all cost limits are the limits in the task file times the factor. {} of {} points are local optima; {}, seed {}.",
        count(&|point| point.status == DesignStatus::Converged),
        front.points.len(),
        supple_text::count(front.options.starts, "start"),
        front.options.seed
    );
    page
}

/// How far a front is that was stopped.
pub fn stopped_front(front: &Pareto) -> Option<String> {
    let (found, wanted) = (front.points.len(), front.options.points);
    front.stopped.then(|| {
        format!(
            "stopped: {found} of {wanted} points of the front are stored; not all have been compared with their neighbours"
        )
    })
}

/// A sentence with a capital letter, except where it begins with a parameter name.
fn sentence(text: &str) -> String {
    let begins_with_a_word = ["the ", "no ", "bounds "].iter().any(|word| text.starts_with(word));
    if begins_with_a_word { capitalised(text) } else { text.to_owned() }
}
