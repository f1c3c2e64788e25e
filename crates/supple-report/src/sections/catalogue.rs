//! What designs chose from catalogues.

use maud::{Markup, html};
use supple_study::design::CatalogueReport;

use super::context::Context;
use crate::html::{table, words};
use crate::numbers::number;

/// The entries that were chosen and what came next, for each search with catalogues.
pub fn section(context: &mut Context) -> Option<Markup> {
    let searches = context.part.searches();
    let found: Vec<_> =
        searches.iter().filter_map(|(folder, report)| Some((folder, report.catalogue.as_ref()?))).collect();
    let several = found.len() > 1;
    (!found.is_empty()).then(|| {
        html! {
            @for (folder, catalogue) in found {
                (chosen(catalogue, &if several { format!(", {folder}") } else { String::new() }))
            }
        }
    })
}

fn chosen(catalogue: &CatalogueReport, of: &str) -> Markup {
    let entries = catalogue.chosen.iter().map(|entry| {
        let price = entry.price.map_or_else(|| "not given".to_owned(), number);
        vec![entry.parameter.clone(), number(entry.value), entry.name.clone().unwrap_or_default(), price]
    });
    let best = catalogue.best.iter().map(|one| {
        let values = one.parameters.0.iter().map(|(name, value)| format!("{name} = {}", number(*value)));
        let remark = if one.status.meets_bounds() { "" } else { "misses a bound" };
        vec![values.collect::<Vec<_>>().join(", "), number(one.information_bits), remark.to_owned()]
    });
    html! {
        (table(
            &format!("Chosen from catalogues{of}"),
            &words(["parameter", "value", "name", "price"]),
            &entries.collect::<Vec<_>>(),
        ))
        p {
            (catalogue.designed) " of " (catalogue.combinations) " combinations were designed, and "
            (catalogue.feasible) " of them are within all cost limits."
            " " (catalogue.distance(number))
        }
        (table(
            &format!("The best combinations{of}"),
            &words(["parameters", "information, bits", "remark"]),
            &best.collect::<Vec<_>>(),
        ))
    }
}
