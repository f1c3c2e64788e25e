use supple::parameters::{Parameter, Role, Scale};
use supple_study::pareto::{Pareto, ParetoPoint};
use supple_study::{Folder, StudyResult};

use super::grouping::grouped;
use super::results::{NATS, folder_name, lacking, misses_contact, task_index};
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Marker, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// The most parameters that are shown.
const MOST: usize = 6;

/// A front with its name, and the task whose cost it shows.
struct Front<'a> {
    folder: &'a Folder,
    front: &'a Pareto,
    name: Option<String>,
    task: usize,
    /// Whether it is drawn over the expected cost, or else over the factor of all bounds.
    over_cost: bool,
}

/// Information against expected cost along a front, or against the factor of all bounds where there are several tasks
/// and none is named; below it the design parameters, of which the first six are shown.
///
/// Points whose search did not converge have white markers; crosses mark those whose plans never make a contact whose force
/// a cost tracks.
///
/// # Errors
/// Where there is no front, or no task of the name.
///
/// ```
/// use supple_figures::pareto;
/// use supple_study::pareto::ParetoOptions;
/// use supple_study::study::Work;
/// use supple_study::{Folder, LoadedTask, Made, Source, Watch};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.variance = { initial = 1e-2, bounds = [1e-4, 1.0] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     bound = 2.0
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = ["variance"] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
/// # let task = LoadedTask::restore(&[source])?;
///
/// // The task of the front page, with the variance of its measurement as a parameter and a cost limit of 2.
/// let work = Work::Pareto(ParetoOptions { points: 3, starts: 1, seed: 0 });
/// let result = work.run(&task, None, Watch::default())?;
/// let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
/// let figure = pareto(&[folder], None)?;
/// assert_eq!(figure.panels[0].x.label, "expected cost of hold");
/// assert_eq!(figure.panels.len(), 2, "the information and one parameter");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn pareto(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let found = folders.iter().filter_map(|folder| match &folder.result {
        StudyResult::Pareto(front) => Some((folder, &**front)),
        _ => None,
    });
    let found: Vec<_> = found.collect();
    let over_cost = task.is_some() || found.iter().all(|(folder, _)| folder.made.about.tasks.len() == 1);
    let mut fronts = Vec::new();
    for (folder, front) in &found {
        let name = (found.len() > 1).then(|| folder_name(folder));
        fronts.push(Front { folder, front, name, task: task_index(folder, task)?, over_cost });
    }
    let Some(first) = fronts.first() else {
        return Err(lacking("pareto", "a folder of `supple pareto`", folders));
    };
    let about = &first.folder.made.about;
    let task_name = about.tasks.get(first.task).map_or("", |task| task.name.as_str());
    let x_label = if over_cost {
        format!("expected cost of {task_name}")
    } else {
        "cost limits, relative to the task file".into()
    };
    let all: Vec<f64> =
        fronts.iter().flat_map(Front::abscissae).chain(fronts.iter().filter_map(Front::bound)).collect();
    let x = Axis::around(x_label, "", Scale::Linear, &all);
    let bits = |point: &ParetoPoint, front: &Front| match (over_cost && task.is_some(), point.task_nats.get(front.task))
    {
        (true, Some(nats)) => nats / NATS,
        _ => point.information_nats / NATS,
    };
    let mut panels = vec![panel(&fronts, &x, "directed information", "bits", Scale::Linear, &bits)];
    let designed = about.parameters.iter().filter(|parameter| parameter.role == Role::Design);
    for parameter in designed.take(MOST) {
        let value = |point: &ParetoPoint, _: &Front| point.parameters.get(&parameter.name).unwrap_or(f64::NAN);
        let Parameter { name, unit, scale, .. } = parameter;
        panels.push(panel(&fronts, &x, &words::name(name), unit, *scale, &value));
    }
    let wide = panels.len().min(3);
    let figure = Figure {
        name: "pareto".into(),
        title: "Minimum directed information against the cost limit".into(),
        panels,
        column: Grid { columns: 1, aspect: 0.42 },
        page: Grid { columns: wide, aspect: 0.75 },
        shared_x: true,
        shared_y: false,
    };
    Ok(grouped(figure, &[]))
}

impl Front<'_> {
    fn abscissa(&self, point: &ParetoPoint) -> f64 {
        if self.over_cost { point.costs.get(self.task).copied().unwrap_or(f64::NAN) } else { point.factor }
    }

    fn abscissae(&self) -> Vec<f64> {
        self.front.points.iter().map(|point| self.abscissa(point)).collect()
    }

    /// The cost limit in the task file.
    fn bound(&self) -> Option<f64> {
        let bound = self.folder.made.about.tasks.get(self.task).and_then(|task| task.bound);
        if self.over_cost { bound } else { Some(1.0) }
    }
}

fn panel(
    fronts: &[Front],
    x: &Axis,
    label: &str,
    unit: &str,
    scale: Scale,
    value: &dyn Fn(&ParetoPoint, &Front) -> f64,
) -> Panel {
    let mut series = Vec::new();
    for (index, front) in fronts.iter().enumerate() {
        if let (0, Some(bound)) = (index, front.bound()) {
            let style = Style { dash: Dash::Dashed, width: 0.8, ..Style::line(Colour::Black) };
            series.push(Series::named("cost limit in the task file", style, Shape::Vertical { x: bound }));
        }
        let label = front.name.clone().unwrap_or_else(|| "Pareto front".into());
        let style = Style::of_set(index);
        let marked = style.marked(Marker::of_set(index));
        let of = |points: &[&ParetoPoint]| -> (Vec<f64>, Vec<f64>) {
            points.iter().map(|point| (front.abscissa(point), value(point, front))).unzip()
        };
        let all: Vec<&ParetoPoint> = front.front.points.iter().collect();
        let converged = |point: &&ParetoPoint| point.status == supple::design::DesignStatus::Converged;
        let (found, missed): (Vec<&ParetoPoint>, Vec<&ParetoPoint>) = all.iter().partition(|point| converged(point));
        let (line_x, line_y) = of(&all);
        series.push(Series::named(label.clone(), style, Shape::Line { x: line_x, y: line_y }));
        let (points_x, points_y) = of(&found);
        series.push(Series::named(label, marked, Shape::Points { x: points_x, y: points_y }));
        if !missed.is_empty() {
            let (x, y) = of(&missed);
            series.push(Series::named(
                "search not converged",
                Style { filled: false, ..marked },
                Shape::Points { x, y },
            ));
        }
        let untouched: Vec<&ParetoPoint> = all.into_iter().filter(|point| !point.warnings.is_empty()).collect();
        if !untouched.is_empty() {
            let (x, y) = of(&untouched);
            series.push(misses_contact(x, y));
        }
    }
    let all: Vec<f64> = series.iter().flat_map(Series::ordinates).collect();
    Panel { title: String::new(), x: x.clone(), y: Axis::around(label, unit, scale, &all), series }
}
