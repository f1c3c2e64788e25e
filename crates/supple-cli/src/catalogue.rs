//! What was chosen from catalogues, as text.

use std::fmt::Write;

use supple::design::CatalogueMethod;
use supple_study::design::CatalogueReport;

use crate::tables::{align_right, number, table};

/// The chosen entries, and the gap between this design and the optimum without catalogues.
pub(crate) fn page(report: &CatalogueReport) -> String {
    let mut page = String::new();
    let mut rows = table(&["catalogue", "chosen", "name", "price", "without catalogues"]);
    for entry in &report.chosen {
        let price = entry.price.map_or_else(String::new, number);
        let name = entry.name.clone().unwrap_or_default();
        rows.add_row([entry.parameter.clone(), number(entry.value), name, price, number(entry.continuous)]);
    }
    if let Some(price) = report.price.filter(|_| report.chosen.len() > 1) {
        rows.add_row(["total".into(), String::new(), String::new(), number(price), String::new()]);
    }
    align_right(&mut rows, 1..2);
    align_right(&mut rows, 3..5);
    let _ = writeln!(page, "{rows}\n");
    let _ = writeln!(page, "{} {}", how(report), report.distance(number));
    if let Some(error) = &report.error {
        let _ = writeln!(page, "{} of them could not be designed; first error: {error}.", report.failed);
    }
    page
}

/// How the entries were chosen.
fn how(report: &CatalogueReport) -> String {
    let CatalogueReport { method, designed, failed, feasible, complete, .. } = report;
    let combinations = match report.combinations {
        u64::MAX => "more than 1e19".to_owned(),
        count => count.to_string(),
    };
    let meet = match feasible {
        0 => "none is within all cost limits; this is the closest.".to_owned(),
        1 => "1 is within all cost limits.".to_owned(),
        count => format!("{count} are within all cost limits."),
    };
    match (method, complete) {
        (CatalogueMethod::AllCombinations, true) if ((designed + failed) as u64) < report.combinations => {
            format!("Chosen from all {designed} combinations within the budget, of {combinations}; {meet}")
        }
        (CatalogueMethod::AllCombinations, true) => {
            format!("Chosen from all {combinations} combinations of entries; {meet}")
        }
        (CatalogueMethod::AllCombinations, false) => {
            format!("Stopped after {designed} of {combinations} combinations of entries; {meet}")
        }
        (CatalogueMethod::Neighbourhood, true) => format!(
            "The best of {designed} of {combinations} combinations, searched for around the best ones; no change in one catalogue improves it, nor does a neighbour; {meet}"
        ),
        (CatalogueMethod::Neighbourhood, false) => format!(
            "The best of {designed} of {combinations} combinations; better ones may remain next to it ([design] \
             max_combinations); {meet}"
        ),
    }
}
