use supple::Named;
use supple::parameters::{Parameter, Role, Scale};
use supple_study::sweep::{Axis as SweepAxis, Sweep};
use supple_study::{AboutTask, Folder, StudyResult};
use supple_text::capitalised;

use super::grouping::grouped;
use super::overlay::{Spot, Track, tracks};
use super::results::{MISSES_CONTACT, NATS, content, lacking, misses_contact, of_task, task_index};
use crate::draw::step;
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Map, Marker, Panel, Series, Shape, Style, Values};
use crate::{FigureError, words};

/// What a landscape shows.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Quantity {
    Information,
    Cost,
}

impl Quantity {
    const ALL: [Self; 2] = [Self::Information, Self::Cost];

    fn of(self, spot: &Spot) -> f64 {
        match self {
            Self::Information => spot.bits,
            Self::Cost => spot.cost,
        }
    }
}

/// Information and expected cost over the one or two parameters of a sweep. The line on which the cost is at its bound
/// is drawn on both, and so are paths of traces, starts and optima of designs, and fronts, where they are given. Crosses
/// mark points whose plans never make a contact whose force a cost tracks.
///
/// Of a trace, the path goes through the designs that are better than all before them.
///
/// The information is that of the objective, or of the task that is named; the cost is that of the task.
///
/// # Errors
/// Where there is no sweep over one or two parameters, or several, or no task of the name.
///
/// ```
/// use supple_figures::landscape;
/// use supple_study::study::Work;
/// use supple_study::sweep::{Axis, SweepOptions};
/// use supple_study::{Folder, LoadedTask, Made, Source, Watch};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
/// # let task = LoadedTask::restore(&[source])?;
///
/// // The task of the front page, with the variance of its measurement as a parameter.
/// let axes = vec![Axis::parse("variance=log:1e-3:1e-1:3", &task)?];
/// let work = Work::Sweep(SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 });
/// let result = work.run(&task, None, Watch::default())?;
/// let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
/// let figure = landscape(&[folder], None)?;
/// let labels: Vec<_> = figure.panels.iter().map(|panel| panel.y.label.as_str()).collect();
/// assert_eq!(labels, ["directed information", "expected cost"]);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn landscape(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let sweeps = folders.iter().filter_map(|folder| match &folder.result {
        StudyResult::Sweep(sweep) => Some((folder, &**sweep)),
        _ => None,
    });
    let [(folder, sweep)] = sweeps.collect::<Vec<_>>()[..] else {
        return Err(lacking(
            "landscape",
            "one folder of `supple sweep`, and folders of other results to overlay",
            folders,
        ));
    };
    let index = task_index(folder, task)?;
    let about = &folder.made.about.tasks[index];
    let [bits, costs] = columns(folder, sweep, task, &about.name)?;
    let tracks = tracks(folders, &about.name, task.is_some(), &held(folder, sweep))?;
    let others = other_limits(folder, sweep, index)?;
    let untouched = sweep.contacts_made().into_iter().map(|made| !made).collect();
    let cost = of_task("expected cost", folder, index);
    let several = folder.made.about.tasks.len() > 1;
    let information = match task {
        None if several => "directed information of all tasks".to_owned(),
        _ => of_task("directed information", folder, index),
    };
    let names: Vec<String> = others.iter().map(|other| other.label.clone()).collect();
    let view = View { folder, sweep, bits, information, costs, cost, untouched, bound: about.bound, others, tracks };
    let axes: Vec<&SweepAxis> = sweep.options.axes.iter().filter(|axis| axis.values.len() > 1).collect();
    let (panels, aspect) = match axes[..] {
        [axis] => (view.curves(axis)?, [0.5, 0.62]),
        [x, y] => (view.fields(x, y)?, [0.8, 0.8]),
        _ => {
            let message = format!(
                "has {} axes with more than one value; a landscape shows one or two: sweep fewer parameters at once",
                axes.len()
            );
            return Err(content(folder, message));
        }
    };
    let swept: Vec<String> = axes.iter().map(|axis| words::name(&axis.parameter)).collect();
    let marks = [MISSES_CONTACT, "optimum", "initial design", "Pareto front", "end", "start"].map(str::to_owned);
    let important: Vec<String> = about.bound.map(bound_label).into_iter().chain(names).chain(marks).collect();
    let figure = Figure {
        name: "landscape".into(),
        title: format!("Directed information and expected cost of {} over {}", about.name, swept.join(" and ")),
        panels,
        column: Grid { columns: 1, aspect: aspect[0] },
        page: Grid { columns: 2, aspect: aspect[1] },
        shared_x: false,
        shared_y: false,
    };
    Ok(grouped(figure, &important))
}

/// Bits and expected cost by row.
fn columns(folder: &Folder, sweep: &Sweep, task: Option<&str>, name: &str) -> Result<[Vec<f64>; 2], FigureError> {
    let information = if task.is_some() { format!("{name}.information_nats") } else { "information_nats".to_owned() };
    let column = |column: &str| {
        let missing = || content(folder, format!("its table has no column `{column}`; recompute the result"));
        sweep.table.numbers(column).ok_or_else(missing)
    };
    let nats = column(&information)?;
    Ok([nats.into_iter().map(|nats| nats / NATS).collect(), column(&format!("{name}.expected_cost"))?])
}

/// Parameters that are the same at all points of a sweep, with their values.
fn held(folder: &Folder, sweep: &Sweep) -> Named {
    // With starts, all others are designed at every point.
    let is_swept = |name: &str| sweep.options.axes.iter().any(|axis| axis.parameter == name);
    let set = |name: &str| folder.made.study.as_ref()?.set.get(name);
    let held = folder.made.about.parameters.iter().filter(|parameter| {
        !is_swept(&parameter.name) && (sweep.options.starts == 0 || parameter.role != Role::Design)
    });
    let value = |parameter: &Parameter| set(&parameter.name).unwrap_or(parameter.initial);
    Named(held.map(|parameter| (parameter.name.clone(), value(parameter))).collect())
}

/// The cost limits of all tasks but one.
fn other_limits(folder: &Folder, sweep: &Sweep, index: usize) -> Result<Vec<OtherLimit>, FigureError> {
    let tasks = folder.made.about.tasks.iter().enumerate().filter(|&(other, _)| other != index);
    let of_task = |(_, task): (usize, &AboutTask)| {
        let level = task.bound?;
        let found = columns(folder, sweep, None, &task.name);
        Some(found.map(|[_, costs]| OtherLimit { label: format!("limit of {}", task.name), level, costs }))
    };
    tasks.filter_map(of_task).collect()
}

/// The cost limit of a task whose costs are not drawn.
struct OtherLimit {
    label: String,
    level: f64,
    /// Its expected cost by row.
    costs: Vec<f64>,
}

/// What a landscape is drawn of.
struct View<'a> {
    folder: &'a Folder,
    sweep: &'a Sweep,
    bits: Vec<f64>,
    /// What the bits are.
    information: String,
    costs: Vec<f64>,
    /// What the costs are.
    cost: String,
    /// Whether a plan of a point never makes a contact whose force a cost tracks.
    untouched: Vec<bool>,
    bound: Option<f64>,
    others: Vec<OtherLimit>,
    tracks: Vec<Track>,
}

impl View<'_> {
    fn values(&self, quantity: Quantity) -> &[f64] {
        match quantity {
            Quantity::Information => &self.bits,
            Quantity::Cost => &self.costs,
        }
    }

    /// The value of an axis at every row of the table.
    fn along(&self, axis: &SweepAxis) -> Result<Vec<f64>, FigureError> {
        let missing = || content(self.folder, format!("its table has no column `{}`", axis.parameter));
        self.sweep.table.numbers(&axis.parameter).ok_or_else(missing)
    }

    /// Over one parameter: curves.
    fn curves(&self, axis: &SweepAxis) -> Result<Vec<Panel>, FigureError> {
        let at = self.along(axis)?;
        let mut order: Vec<usize> = (0..at.len()).collect();
        order.sort_by(|&a, &b| at[a].total_cmp(&at[b]));
        let sorted = |values: &[f64]| -> Vec<f64> { order.iter().map(|&row| values[row]).collect() };
        let x = sorted(&at);
        let panel = |quantity: Quantity| {
            let y = sorted(self.values(quantity));
            let style = if x.len() <= 40 { marked(Colour::Blue) } else { Style::line(Colour::Blue) };
            let mut series = vec![Series::plain(style, Shape::Line { x: x.clone(), y })];
            if let (Quantity::Cost, Some(y)) = (quantity, self.bound) {
                series.insert(0, Series::named(bound_label(y), bound_style(), Shape::Horizontal { y }));
            }
            series.extend(self.without_contact(&at, self.values(quantity)));
            let place = |spot: &Spot| (spot.at(&axis.parameter), quantity.of(spot));
            series.extend(self.tracks.iter().flat_map(|track| track.series(&place)));
            let all: Vec<f64> = series.iter().flat_map(Series::ordinates).collect();
            let (label, unit) = match quantity {
                Quantity::Information => (&*self.information, "bits"),
                Quantity::Cost => (&*self.cost, ""),
            };
            Panel { title: String::new(), x: axis_of(axis), y: Axis::around(label, unit, tall(&all), &all), series }
        };
        Ok(Quantity::ALL.map(panel).to_vec())
    }

    /// Over two parameters: filled contours.
    fn fields(&self, x: &SweepAxis, y: &SweepAxis) -> Result<Vec<Panel>, FigureError> {
        let cost = self.grid(x, y, &self.costs)?;
        let mut panels = Vec::new();
        for quantity in Quantity::ALL {
            let grid = self.grid(x, y, self.values(quantity))?;
            let map = if quantity == Quantity::Information { Map::Viridis } else { Map::Cividis };
            let field = Shape::Field { levels: levels(self.values(quantity)), grid, map };
            let mut series = vec![Series::plain(Style::line(Colour::Black), field)];
            // A line beyond all costs of the sweep would be in the legend only.
            let (low, high) = ends(&self.costs);
            if let Some(level) = self.bound.filter(|level| (low..=high).contains(level)) {
                let shape = Shape::Contour { grid: cost.clone(), level };
                series.push(Series::named(bound_label(level), Style { rim: true, ..bound_style() }, shape));
            }
            if quantity == Quantity::Information {
                series.extend(self.contours_of_others(x, y)?);
            }
            series.extend(self.without_contact(&self.along(x)?, &self.along(y)?));
            let place = |spot: &Spot| (spot.at(&x.parameter), spot.at(&y.parameter));
            series.extend(self.tracks.iter().flat_map(|track| track.series(&place)));
            let title = match quantity {
                Quantity::Information => format!("{} (bits)", capitalised(&self.information)),
                Quantity::Cost => capitalised(&self.cost),
            };
            panels.push(Panel { title, x: axis_of(x), y: axis_of(y), series });
        }
        Ok(panels)
    }

    /// Where the costs of other tasks are at their limits.
    fn contours_of_others(&self, x: &SweepAxis, y: &SweepAxis) -> Result<Vec<Series>, FigureError> {
        let crosses = |other: &&OtherLimit| {
            let (low, high) = ends(&other.costs);
            (low..=high).contains(&other.level)
        };
        let contour = |(place, other): (usize, &OtherLimit)| {
            let shape = Shape::Contour { grid: self.grid(x, y, &other.costs)?, level: other.level };
            let dash = [Dash::Dotted, Dash::DashDotted][place % 2];
            Ok(Series::named(other.label.clone(), Style { rim: true, dash, ..bound_style() }, shape))
        };
        self.others.iter().filter(crosses).enumerate().map(contour).collect()
    }

    /// Crosses where plans miss contacts, by the coordinates of all points.
    fn without_contact(&self, x: &[f64], y: &[f64]) -> Option<Series> {
        let missed = || self.untouched.iter().enumerate().filter(|(_, missed)| **missed).map(|(row, _)| row);
        let of = |values: &[f64]| missed().map(|row| values[row]).collect::<Vec<_>>();
        missed().next().map(|_| misses_contact(of(x), of(y)))
    }

    /// Rows of the table by the values of two axes.
    fn grid(&self, x: &SweepAxis, y: &SweepAxis, values: &[f64]) -> Result<Values, FigureError> {
        let (xs, ys) = (rising(&x.values), rising(&y.values));
        let mut rows = vec![vec![f64::NAN; xs.len()]; ys.len()];
        for ((at_x, at_y), value) in self.along(x)?.into_iter().zip(self.along(y)?).zip(values) {
            if let (Some(i), Some(j)) = (find(&xs, at_x), find(&ys, at_y)) {
                rows[j][i] = *value;
            }
        }
        Ok(Values { x: xs, y: ys, rows })
    }
}

fn marked(colour: Colour) -> Style {
    Style::line(colour).marked(Marker::Circle)
}

fn bound_label(bound: f64) -> String {
    format!("cost at its limit, {}", words::typeset(bound))
}

fn bound_style() -> Style {
    Style { dash: Dash::Dashed, width: 1.3, ..Style::line(Colour::Black) }
}

fn axis_of(axis: &SweepAxis) -> Axis {
    Axis::within(words::name(&axis.parameter), axis.unit.clone(), axis.scale, &axis.values)
}

fn rising(values: &[f64]) -> Vec<f64> {
    let mut values = values.to_vec();
    values.sort_by(f64::total_cmp);
    values.dedup();
    values
}

/// The index of a value, up to rounding of what was written and read again.
fn find(values: &[f64], value: f64) -> Option<usize> {
    let above = values.partition_point(|other| *other < value);
    let near = |index: &usize| values.get(*index).is_some_and(|other| (other - value).abs() <= 1e-9 * value.abs());
    [above, above.wrapping_sub(1)].into_iter().find(near)
}

/// The scale of an axis for values that may spread over decades.
fn tall(values: &[f64]) -> Scale {
    let (low, high) = ends(values);
    if low > 0.0 && high / low > 50.0 { Scale::Log } else { Scale::Linear }
}

fn ends(values: &[f64]) -> (f64, f64) {
    let finite = values.iter().copied().filter(|value| value.is_finite());
    finite.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| (low.min(value), high.max(value)))
}

/// Where colours change: about ten round values; by ratios where the values spread over more than a decade.
fn levels(values: &[f64]) -> Vec<f64> {
    let (low, high) = ends(values);
    if low == high {
        return vec![low];
    }
    if low > high || !(high - low).is_finite() {
        return Vec::new();
    }
    if low > 0.0 && high / low > 15.0 {
        let decades = low.log10().floor() as i32..=high.log10().ceil() as i32;
        let sets: [&[f64]; 4] = [&[1.0, 1.5, 2.0, 3.0, 5.0, 7.0], &[1.0, 2.0, 5.0], &[1.0, 3.0], &[1.0]];
        let of_set = |set: &[f64]| -> Vec<f64> {
            let all = decades.clone().flat_map(|power| set.iter().map(move |factor| factor * 10f64.powi(power)));
            all.filter(|level| *level > low && *level < high).collect()
        };
        let found = sets.iter().map(|set| of_set(set)).find(|levels| levels.len() <= 14);
        return found.unwrap_or_else(|| of_set(&[1.0]));
    }
    let step = step(high - low, 12);
    let first = (low / step).floor() + 1.0;
    let count = ((high / step).ceil() - first).max(0.0) as usize;
    (0..count).map(|index| (first + index as f64) * step).collect()
}

#[cfg(test)]
mod tests {
    use super::{find, levels};

    #[test]
    fn levels_are_round_and_within() {
        assert_eq!(levels(&[20.0, 31.0, f64::NAN]), [21.0, 22.0, 23.0, 24.0, 25.0, 26.0, 27.0, 28.0, 29.0, 30.0]);
        assert_eq!(levels(&[1.5, 900.0]), [2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0, 500.0]);
        assert_eq!(levels(&[3.0, 3.0]), [3.0], "the colour bar tells a constant");
        assert!(levels(&[f64::NAN]).is_empty());
    }

    #[test]
    fn values_are_found_up_to_rounding() {
        let values = [1.0, 2.0, 3.0];
        assert_eq!([2.0 + 1e-12, 2.0 - 1e-12, 3.0, 2.5].map(|v| find(&values, v)), [Some(1), Some(1), Some(2), None]);
    }
}
