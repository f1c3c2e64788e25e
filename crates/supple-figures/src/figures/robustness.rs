use supple::parameters::Scale;
use supple_study::robustness::{PlannedFor, RobustCell, Robustness};
use supple_study::{Folder, StudyResult};

use super::grouping::grouped;
use super::results::{content, lacking, of_task, task_index};
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Marker, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// Mean cost in closed loop as a noise grows: one line per design with its 95 % confidence interval, and the 5 and 95 %
/// quantiles of single runs in a light tone. One panel for controllers that are planned for the nominal noise, and one
/// for those that are planned for the true one.
///
/// # Errors
/// Where there is no study of robustness, or several, or no task of the name.
///
/// ```
/// use supple_figures::robustness;
/// use supple_study::robustness::{DesignChoice, RobustnessOptions};
/// use supple_study::study::Work;
/// use supple_study::sweep::Axis;
/// use supple_study::{Folder, LoadedTask, Made, Source, Watch};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     parameters.drive = { initial = 1e-3, bounds = [1e-5, 1e-1], role = "study" }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = ["drive"], measurement = [1e-3] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
/// # let task = LoadedTask::restore(&[source])?;
///
/// // The task of the front page, with the variance of its process noise as the parameter `drive`.
/// let vary = Axis::parse("drive=log:1e-4:1e-2:3", &task)?;
/// let designs = vec![DesignChoice::Start];
/// let work = Work::Robustness(RobustnessOptions { designs, vary, rollouts: 20, seed: 1 });
/// let result = work.run(&task, None, Watch::default())?;
/// let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
/// let figure = robustness(&[folder], None)?;
/// assert_eq!(figure.panels.len(), 2, "planned for the nominal noise, and for the true one");
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn robustness(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let studies = folders.iter().filter_map(|folder| match &folder.result {
        StudyResult::Robustness(study) => Some((folder, &**study)),
        _ => None,
    });
    let [(folder, study)] = studies.collect::<Vec<_>>()[..] else {
        return Err(lacking("robustness", "one folder of `supple robustness`", folders));
    };
    let index = task_index(folder, task)?;
    let view = View { study, task: index };
    let planned: Vec<PlannedFor> = [PlannedFor::Nominal, PlannedFor::Truth]
        .into_iter()
        .filter(|planned| study.cells.iter().any(|cell| cell.task == index && cell.planned_for == *planned))
        .collect();
    if planned.is_empty() {
        return Err(content(folder, "has no costs of this task"));
    }
    let series: Vec<Vec<Series>> = planned.iter().map(|planned| view.series(*planned)).collect();
    let all: Vec<f64> = series.iter().flatten().flat_map(Series::ordinates).filter(|value| value.is_finite()).collect();
    let (low, high) = all.iter().fold((f64::INFINITY, 0.0), |(a, b): (f64, f64), v| (a.min(*v), b.max(*v)));
    let scale = if low > 0.0 && high > 20.0 * low { Scale::Log } else { Scale::Linear };
    let y = Axis::around(of_task("cost in closed loop", folder, index), "", scale, &all);
    let vary = &study.options.vary;
    let x = Axis::around(words::name(&vary.parameter), vary.unit.clone(), vary.scale, &vary.values);
    let panel = |(planned, series): (&PlannedFor, Vec<Series>)| {
        let title = match planned {
            PlannedFor::Nominal => "planned for the nominal noise",
            PlannedFor::Truth => "planned for the true noise",
        };
        Panel { title: title.into(), x: x.clone(), y: y.clone(), series }
    };
    let panels: Vec<Panel> = planned.iter().zip(series).map(panel).collect();
    let figure = Figure {
        name: "robustness".into(),
        title: format!("Cost in closed loop over {} by design", words::name(&vary.parameter)),
        page: Grid { columns: panels.len(), aspect: 0.6 },
        panels,
        column: Grid { columns: 1, aspect: 0.5 },
        shared_x: true,
        shared_y: true,
    };
    Ok(grouped(figure, &[]))
}

struct View<'a> {
    study: &'a Robustness,
    task: usize,
}

impl View<'_> {
    /// All lines of a panel: quantiles below, then means, then theory.
    fn series(&self, planned: PlannedFor) -> Vec<Series> {
        let designs = 0..self.study.designs.len();
        // For the legend alone: the bars are in the designs' colours.
        let interval = Shape::Bars { x: Vec::new(), low: Vec::new(), high: Vec::new() };
        let interval = Series::named("95 % interval of the mean", Style::line(Colour::Black), interval);
        let nominal = Style { dash: Dash::Dotted, width: 0.8, ..Style::line(Colour::Grey) };
        let label = "nominal noise";
        let mut series = vec![Series::named(label, nominal, Shape::Vertical { x: self.study.nominal })];
        series.extend(designs.clone().map(|design| self.quantiles(design, planned)));
        series.extend(designs.clone().flat_map(|design| self.means(design, planned)));
        series.push(interval);
        series.extend(designs.filter_map(|design| self.expected(design, planned)));
        series
    }

    /// The cells of a design by rising noise.
    fn cells(&self, design: usize, planned: PlannedFor) -> Vec<(f64, &RobustCell)> {
        let of = |cell: &&RobustCell| cell.design == design && cell.task == self.task && cell.planned_for == planned;
        let values = &self.study.options.vary.values;
        let mut cells: Vec<(f64, &RobustCell)> = self
            .study
            .cells
            .iter()
            .filter(of)
            .filter_map(|cell| values.get(cell.level).map(|value| (*value, cell)))
            .collect();
        cells.sort_by(|a, b| a.0.total_cmp(&b.0));
        cells
    }

    fn quantiles(&self, design: usize, planned: PlannedFor) -> Series {
        let cells = self.cells(design, planned);
        let at = |index: usize| cells.iter().map(|(_, cell)| cell.quantiles[index]).collect();
        let x = cells.iter().map(|(x, _)| *x).collect();
        let style = Style::area(Style::of_set(design).colour, 0.14);
        Series::named("5 to 95 % of runs", style, Shape::Band { x, low: at(0), high: at(4) })
    }

    fn means(&self, design: usize, planned: PlannedFor) -> [Series; 2] {
        let cells = self.cells(design, planned);
        let name = &self.study.designs[design].name;
        let of = |part: &dyn Fn(&RobustCell) -> f64| -> Vec<f64> { cells.iter().map(|(_, cell)| part(cell)).collect() };
        let x: Vec<f64> = cells.iter().map(|(x, _)| *x).collect();
        let bars = Shape::Bars {
            x: x.clone(),
            low: of(&|cell| cell.mean - cell.half_width_95),
            high: of(&|cell| cell.mean + cell.half_width_95),
        };
        let style = Style::of_set(design).marked(Marker::of_set(design));
        let line = Shape::Line { x, y: of(&|cell| cell.mean) };
        [Series::plain(style, bars), Series::named(name.clone(), style, line)]
    }

    /// What the theory expects, where it says something.
    fn expected(&self, design: usize, planned: PlannedFor) -> Option<Series> {
        let cells = self.cells(design, planned);
        cells.iter().any(|(_, cell)| cell.expected.is_some()).then(|| {
            let (x, y) = cells.iter().map(|(x, cell)| (*x, cell.expected.unwrap_or(f64::NAN))).unzip();
            let style = Style { dash: Dash::Dotted, width: 0.8, ..Style::line(Colour::Black) };
            Series::named("predicted by theory", style, Shape::Line { x, y })
        })
    }
}
