use supple::TrajectoryReport;
use supple::parameters::Scale;
use supple_study::{Folder, clipped};

use super::results::{Shown, designs};
use crate::figure::{Axis, Colour, Dash, Figure, Grid, Panel, Series, Shape, Style};
use crate::{FigureError, words};

/// The label of planned states.
const PLAN: &str = "plan";
/// The most states that are shown: of one design, of several.
const MOST: [usize; 2] = [12, 8];

/// States over time, with one closed-loop run: plan, true state, estimate and two standard deviations around it. One
/// column of panels per design.
///
/// Where there are more than twelve states, or eight of several designs, half of those that are shown are those whose planned
/// mean moves furthest, and the others those whose standard deviation changes most, both in mean standard deviations; the
/// title stored in the file says how many there are.
///
/// # Errors
/// Where there is no evaluated design, or no task of the name.
///
/// ```
/// use supple_figures::{MOST_ENTRIES, belief, gains, information};
/// use supple_study::evaluate::EvaluateOptions;
/// use supple_study::study::Work;
/// use supple_study::{Folder, LoadedTask, Made, Source, Watch};
/// # let text = r#"
/// #     model = { kind = "linear", A = [[1.0]], B = [[1.0]], C = [[1.0]] }
/// #     [[tasks]]
/// #     name = "hold"
/// #     steps = 20
/// #     time_step = 0.1
/// #     initial_state = [1.0]
/// #     noise = { initial = [1e-2], process = [1e-3], measurement = [1e-3] }
/// #     costs = [{ kind = "quadratic", Q = [[1.0]], R = [[1.0]] }]
/// # "#;
/// # let source = Source { path: "hold.toml".to_owned(), text: text.to_owned() };
/// # let task = LoadedTask::restore(&[source])?;
///
/// // The evaluation of the front page, of a task with one state.
/// let work = Work::Evaluate(EvaluateOptions { trajectories: true, ..Default::default() });
/// let result = work.run(&task, None, Watch::default())?;
/// let folder = Folder { path: "hold".into(), made: Made::of(&task, work), result };
/// let folders = [folder];
/// assert_eq!(belief(&folders, Some("hold"))?.panels.len(), 1);
/// assert!(gains(&folders, None)?.entries().len() <= MOST_ENTRIES);
/// assert_eq!(information(&folders, None)?.panels.len(), 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn belief(folders: &[Folder], task: Option<&str>) -> Result<Figure, FigureError> {
    let shown = designs("belief", folders, task)?;
    let columns = shown.len();
    let mut panels = Vec::new();
    let (names, all) = (chosen(&shown), shown[0].trajectory.state_names.len());
    let of = if names.len() < all { format!(" ({} of {all})", names.len()) } else { String::new() };
    for (row, name) in names.into_iter().enumerate() {
        let states: Vec<_> = shown.iter().map(|design| state(design.trajectory, &name)).collect();
        let unit = unit(shown[0].trajectory, &name);
        let y = upright(words::name(&name), unit, &states);
        for (design, series) in shown.iter().zip(states) {
            let title = if row == 0 && columns > 1 { design.design.clone() } else { String::new() };
            let x = Axis::within("time", "s", Scale::Linear, &design.trajectory.time);
            panels.push(Panel { title, x, y: y.clone(), series });
        }
    }
    let single = columns == 1;
    let grid = |alone: usize, aspect: f64| Grid { columns: if single { alone } else { columns }, aspect };
    Ok(Figure {
        name: "belief".into(),
        title: format!("States over time of the task {}{of}: plan, and one run in closed loop", shown[0].task.name),
        panels,
        column: grid(2, 0.6),
        page: grid(3, if columns > 2 { 0.5 } else { 0.36 }),
        shared_x: !single,
        shared_y: !single,
    })
}

/// The vertical axis of a state; about the plans where a run diverges, which its label then says.
fn upright(label: String, unit: String, states: &[Vec<Series>]) -> Axis {
    let of = |is_plan: bool| -> Vec<f64> {
        let series = states.iter().flatten().filter(|series| (series.label.as_deref() == Some(PLAN)) == is_plan);
        series.flat_map(Series::ordinates).collect()
    };
    let (plans, runs) = (of(true), of(false));
    match clipped(&plans, &runs) {
        Some((range, worst)) => {
            let label = format!("{label}, clipped (run to {worst:.1e})");
            Axis::over(label, unit, Scale::Linear, range)
        }
        None => Axis::around(label, unit, Scale::Linear, &[plans, runs].concat()),
    }
}

/// The names of the states to show, in the order of the task.
fn chosen(shown: &[Shown]) -> Vec<String> {
    let names = &shown[0].trajectory.state_names;
    let most = MOST[usize::from(shown.len() > 1)];
    let ranked = |of: fn(&TrajectoryReport) -> &[Vec<f64>]| {
        let interest = |name: &String| {
            let found = shown.iter().filter_map(|design| Some((design, index_of(design.trajectory, name)?)));
            found.map(|(design, index)| change(design.trajectory, of, index)).fold(0.0, f64::max)
        };
        let mut order: Vec<(usize, f64)> = names.iter().map(interest).enumerate().collect();
        order.sort_by(|a, b| b.1.total_cmp(&a.1));
        order.into_iter().map(|(index, _)| index).collect::<Vec<_>>()
    };
    let (moved, learnt) = (ranked(|of| &of.states), ranked(|of| &of.deviations));
    let mut some: Vec<usize> = Vec::new();
    for index in moved.into_iter().zip(learnt).flat_map(|(one, other)| [one, other]) {
        if some.len() < most && !some.contains(&index) {
            some.push(index);
        }
    }
    some.sort_unstable();
    some.into_iter().map(|index| names[index].clone()).collect()
}

/// The range over time of a state's mean or deviation, in its mean standard deviations. Where nothing is uncertain, all that
/// moves comes first, and all that rests last.
fn change(trajectory: &TrajectoryReport, of: fn(&TrajectoryReport) -> &[Vec<f64>], index: usize) -> f64 {
    let values = of(trajectory).iter().map(|row| row[index]);
    let range = values.clone().fold(f64::NEG_INFINITY, f64::max) - values.fold(f64::INFINITY, f64::min);
    let mean = trajectory.deviations.iter().map(|row| row[index]).sum::<f64>() / trajectory.deviations.len() as f64;
    if range > 0.0 { range / mean.max(f64::MIN_POSITIVE) } else { 0.0 }
}

fn index_of(trajectory: &TrajectoryReport, name: &str) -> Option<usize> {
    trajectory.state_names.iter().position(|other| other == name)
}

fn unit(trajectory: &TrajectoryReport, name: &str) -> String {
    index_of(trajectory, name).and_then(|index| trajectory.state_units.get(index).cloned()).unwrap_or_default()
}

/// A state of a design: nothing where the design has no such state.
fn state(trajectory: &TrajectoryReport, name: &str) -> Vec<Series> {
    let Some(index) = index_of(trajectory, name) else { return Vec::new() };
    let of = |rows: &[Vec<f64>]| -> Vec<f64> { rows.iter().map(|row| row[index]).collect() };
    let (time, sample) = (&trajectory.time, &trajectory.sample);
    let (estimate, deviation) = (of(&sample.estimates), of(&sample.deviations));
    let bound = |sign: f64| estimate.iter().zip(&deviation).map(|(mean, sigma)| mean + sign * 2.0 * sigma).collect();
    let line = |y: Vec<f64>| Shape::Line { x: time[..y.len().min(time.len())].to_vec(), y };
    let count = estimate.len().min(time.len());
    let band = Shape::Band { x: time[..count].to_vec(), low: bound(-1.0), high: bound(1.0) };
    let plan = Style { dash: Dash::Dashed, width: 0.8, ..Style::line(Colour::Black) };
    let estimated = Style { dash: Dash::DashDotted, ..Style::line(Colour::Vermilion) };
    vec![
        Series::named("estimate ± 2 std. dev.", Style::area(Colour::Vermilion, 0.22), band),
        Series::named("true state", Style { width: 1.3, ..Style::line(Colour::Blue) }, line(of(&sample.states))),
        Series::named("estimate ± 2 std. dev.", estimated, line(estimate)),
        Series::named(PLAN, plan, line(of(&trajectory.states))),
    ]
}

#[cfg(test)]
mod tests {
    use super::{PLAN, upright};
    use crate::figure::{Colour, Series, Shape, Style};

    #[test]
    fn a_run_that_diverges_does_not_flatten_the_plan() {
        let line = |label: &str, y: Vec<f64>| {
            Series::named(label, Style::line(Colour::Black), Shape::Line { x: vec![0.0, 1.0, 2.0], y })
        };
        let axis = |last: f64| {
            let states = [vec![line("true state", vec![0.0, 1.0, last]), line(PLAN, vec![0.0, 1.0, 2.0])]];
            upright("q".into(), "rad".into(), &states)
        };
        let (usual, clipped) = (axis(2.5), axis(-4.2e12));
        assert_eq!(usual.label, "q");
        assert!(usual.range[0] < 0.0 && (2.5..3.0).contains(&usual.range[1]), "{:?}", usual.range);
        assert_eq!(clipped.label, "q, clipped (run to -4.2e12)");
        assert_eq!(clipped.range, [-2.0, 4.0]);
    }
}
