//! Limits the length of legends: less important entries are drawn in grey, as one entry.

use crate::figure::{Colour, Dash, Figure, Style};

/// The most entries of a legend.
///
/// Example: [`belief`](crate::belief).
pub const MOST_ENTRIES: usize = 8;

/// The name of the common entry.
const REST: &str = "others";

/// The same figure with at most [`MOST_ENTRIES`] legend entries: the least important ones become
/// one entry in grey, and the title mentions it. The names in `important` rank first, in this order, then those that appear
/// first.
pub fn grouped(mut figure: Figure, important: &[String]) -> Figure {
    let entries: Vec<String> = figure.entries().into_iter().map(str::to_owned).collect();
    if entries.len() <= MOST_ENTRIES {
        return figure;
    }
    // Names may have remarks in brackets.
    let is = |name: &str, other: &String| {
        name.strip_prefix(other.as_str()).is_some_and(|rest| rest.is_empty() || rest.starts_with(" ("))
    };
    let rank = |name: &String| important.iter().position(|other| is(name, other)).unwrap_or(important.len());
    let mut ranked: Vec<&String> = entries.iter().collect();
    ranked.sort_by_key(|name| rank(name));
    let rest = &ranked[MOST_ENTRIES - 1..];
    for panel in &mut figure.panels {
        for series in &mut panel.series {
            if series.label.as_ref().is_some_and(|label| rest.contains(&label)) {
                series.label = Some(REST.to_owned());
                let width = series.style.width.min(0.6);
                // Without a rim, which would set them off from the map below.
                let style = Style { colour: Colour::Grey, dash: Dash::Solid, rim: false, ..series.style };
                series.style = Style { width, opacity: 0.7 * style.opacity, ..style };
            }
        }
        // Below those that have names.
        panel.series.sort_by_key(|series| series.label.as_deref() != Some(REST));
    }
    figure.title = format!("{}; {} less important entries in grey", figure.title, rest.len());
    figure
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{Axis, Grid, Panel, Scale, Series, Shape};

    fn figure(names: &[&str]) -> Figure {
        let axis = Axis::over("", "", Scale::Linear, [0.0, 1.0]);
        let line = |name: &&str| Series::named(*name, Style::line(Colour::Blue), Shape::Horizontal { y: 0.5 });
        let series: Vec<Series> = names.iter().map(line).collect();
        let grid = Grid { columns: 1, aspect: 0.5 };
        let panel = Panel { title: String::new(), x: axis.clone(), y: axis, series };
        Figure {
            name: "lines".into(),
            title: "Lines".into(),
            panels: vec![panel.clone(), panel],
            column: grid,
            page: grid,
            shared_x: true,
            shared_y: true,
        }
    }

    #[test]
    fn eight_entries_stay_and_more_are_grouped_by_importance() {
        let names = ["a", "b", "c", "d", "e", "f", "g", "h", "i", "j"];
        let eight = figure(&names[..8]);
        assert_eq!(grouped(eight.clone(), &[]), eight);
        let found = grouped(figure(&names), &["j".into(), "b".into()]);
        assert_eq!(found.entries(), ["others", "a", "b", "c", "d", "e", "f", "j"]);
        assert_eq!(found.title, "Lines; 3 less important entries in grey");
        let grey = |series: &&Series| series.style.colour == Colour::Grey;
        assert_eq!(found.panels[1].series.iter().filter(grey).count(), 3);
        assert_eq!(found.panels[1].series.len(), 10, "nothing is left out");
    }
}
