//! Lengths and indices in a result that must agree. They are checked once, when a folder is read, so that pages, figures,
//! reports and exports can rely on them.

use supple::scene::{Scene, Track};
use supple::simulate::Sample;
use supple::{Evaluation, GradientReport, Named, TaskEvaluation, TrajectoryReport};

use crate::bound::BoundStudy;
use crate::design::DesignReport;
use crate::pareto::Pareto;
use crate::robustness::Robustness;
use crate::sensors::Sensors;
use crate::sweep::Sweep;
use crate::trace::Trace;
use crate::{About, AboutTask, StudyResult};

/// What is wrong, or nothing.
type Found = Result<(), String>;

/// Checks that the parts of a result are consistent with one another and with the task it refers to.
///
/// # Errors
/// What does not fit.
pub(crate) fn check(about: &About, result: &StudyResult) -> Found {
    match result {
        StudyResult::Design(report) => design(about, report),
        StudyResult::Evaluate(report) => evaluation("the evaluation", about, &report.evaluation),
        StudyResult::Sweep(sweep) => of_sweep(about, sweep),
        StudyResult::Robustness(study) => robustness(about, study),
        StudyResult::Pareto(front) => pareto(about, front),
        StudyResult::Trace(study) => trace(about, study),
        StudyResult::Sensors(study) => sensors(about, study),
        StudyResult::Bound(study) => bound(about, study),
        // Its steps have folders of their own.
        StudyResult::Study(_) => Ok(()),
    }
}

/// A list has as many entries as it must.
fn length(what: &str, found: usize, expected: usize) -> Found {
    if found == expected { Ok(()) } else { Err(format!("{what} has {found} entries instead of {expected}")) }
}

/// A list has as many entries as it must, or none, as in results of versions that did not keep it.
fn length_or_none(what: &str, found: usize, expected: usize) -> Found {
    if found == 0 { Ok(()) } else { length(what, found, expected) }
}

/// A place is one of a list.
fn place(what: &str, found: usize, count: usize) -> Found {
    if found < count { Ok(()) } else { Err(format!("{what} {found} does not exist: there are {count}")) }
}

/// All rows have as many entries as they must.
fn rows(what: &str, rows: &[Vec<f64>], expected: usize) -> Found {
    rows.iter().try_for_each(|row| length(&format!("a row of {what}"), row.len(), expected))
}

/// A matrix has as many rows and columns as it must.
fn matrix(what: &str, found: &[Vec<f64>], count: usize, width: usize) -> Found {
    length(what, found.len(), count)?;
    rows(what, found, width)
}

/// The parameters are those of the task, in its order.
fn parameters(what: &str, about: &About, found: &Named) -> Found {
    length(&format!("the parameters of {what}"), found.0.len(), about.parameters.iter().count())?;
    let differs = found.0.iter().zip(about.parameters.iter()).find(|((name, _), parameter)| *name != parameter.name);
    match differs {
        Some(((name, _), parameter)) => {
            Err(format!("{what} has the parameter `{name}` instead of `{}`", parameter.name))
        }
        None => Ok(()),
    }
}

/// A task exists.
fn task(what: &str, about: &About, name: &str) -> Found {
    match about.tasks.iter().any(|task| task.name == name) {
        true => Ok(()),
        false => Err(format!("{what} is of a task `{name}` that does not exist")),
    }
}

fn design(about: &About, report: &DesignReport) -> Found {
    evaluation("the start", about, &report.start)?;
    evaluation("the optimum", about, &report.optimum)?;
    at_most("the list of shadow prices", report.bound_prices.len(), about.tasks.len())?;
    length_or_none("the list of causes", report.split.len(), about.tasks.len())?;
    for start in &report.starts {
        parameters("a start", about, &start.from)?;
        parameters("a start", about, &start.to)?;
        length_or_none("the costs of a start", start.expected_costs.len(), about.tasks.len())?;
    }
    if let Some(catalogue) = &report.catalogue {
        parameters("the design without catalogues", about, &catalogue.continuous.parameters)?;
        length_or_none("its costs", catalogue.continuous.expected_costs.len(), about.tasks.len())?;
        catalogue.best.iter().try_for_each(|one| parameters("a combination", about, &one.parameters))?;
    }
    Ok(())
}

fn evaluation(what: &str, about: &About, found: &Evaluation) -> Found {
    parameters(what, about, &found.parameters)?;
    length(&format!("the list of tasks of {what}"), found.tasks.len(), about.tasks.len())?;
    for (of, found) in about.tasks.iter().zip(&found.tasks) {
        evaluated(about, of, found).map_err(|why| format!("in task `{}` of {what}, {why}", of.name))?;
    }
    Ok(())
}

fn evaluated(about: &About, of: &AboutTask, found: &TaskEvaluation) -> Found {
    let steps = of.steps;
    if found.name != of.name {
        return Err(format!("the name is `{}`", found.name));
    }
    length("the cost of the estimation error by step", found.cost.belief_per_step.len(), steps)?;
    length("the value of information by step", found.cost.value_of_information_per_step.len(), steps)?;
    length("the information by step", found.information.per_step_nats.len(), steps.saturating_add(1))?;
    if let Some(used) = &found.information.used {
        length("the information used by step", used.per_step_nats.len(), steps)?;
    }
    found.gradient.as_ref().map_or(Ok(()), |gradient| of_gradient(about, gradient))?;
    found.trajectory.as_ref().map_or(Ok(()), |trajectory| of_trajectory(steps, trajectory))
}

fn of_gradient(about: &About, GradientReport { total, frozen }: &GradientReport) -> Found {
    if let Some(total) = total {
        let costs = [&total.nominal_cost, &total.belief_cost, &total.process_cost, &total.initial_cost];
        let all = [&total.information_nats, &total.expected_cost].into_iter().chain(costs);
        all.into_iter().try_for_each(|gradient| parameters("a total gradient", about, gradient))?;
    }
    if let Some(frozen) = frozen {
        parameters("a frozen gradient", about, &frozen.information_nats)?;
        parameters("a frozen gradient", about, &frozen.belief_cost)?;
    }
    Ok(())
}

fn of_trajectory(steps: usize, found: &TrajectoryReport) -> Found {
    let (n, m, p) = (found.state_names.len(), found.control_names.len(), found.measurements.len());
    let times = steps.saturating_add(1);
    length("the list of units of states", found.state_units.len(), n)?;
    length("the list of units of controls", found.control_units.len(), m)?;
    length("the list of times", found.time.len(), times)?;
    matrix("the states", &found.states, times, n)?;
    matrix("the deviations", &found.deviations, times, n)?;
    matrix("the controls", &found.controls, steps, m)?;
    length_or_none("the feedforward", found.feedforward.len(), steps)?;
    rows("the feedforward", &found.feedforward, m)?;
    length("the feedback", found.feedback.len(), steps)?;
    found.feedback.iter().try_for_each(|gains| matrix("the feedback of a step", gains, m, n))?;
    for measurement in &found.measurements {
        length("the information of a measurement", measurement.alone_nats.len(), times)?;
        length("the information of a measurement", measurement.beyond_others_nats.len(), times)?;
        length_or_none("the cost that a measurement saves", measurement.saved_cost.len(), steps)?;
    }
    of_sample(times, (n, m, p), &found.sample)?;
    for run in &found.threads {
        at_most("a run", run.len(), times)?;
        rows("a run", run, n)?;
    }
    for curve in &found.contacts {
        let along = [curve.force.len(), curve.clearance_m.len(), curve.touches.len()];
        along.into_iter().try_for_each(|found| length("a contact along the plan", found, times))?;
        length("a contact along the run", curve.run_clearance_m.len(), curve.run_force.len())?;
        at_most("a contact along the run", curve.run_force.len(), times)?;
    }
    found.costs.iter().try_for_each(|curve| length("a term of the cost", curve.per_step.len(), times))?;
    for curve in &found.quantities {
        at_most("a quantity along the plan", curve.values.len(), times)?;
        at_most("a quantity along the run", curve.run_values.len(), times)?;
    }
    found.scene.as_ref().map_or(Ok(()), of_scene)
}

/// A list has no more entries than it may.
fn at_most(what: &str, found: usize, most: usize) -> Found {
    if found <= most { Ok(()) } else { Err(format!("{what} has {found} entries instead of {most} at most")) }
}

/// A run in closed loop, which ends early where it diverged.
fn of_sample(times: usize, (n, m, p): (usize, usize, usize), found: &Sample) -> Found {
    let count = found.states.len();
    at_most("the run", count, times)?;
    matrix("the states of the run", &found.states, count, n)?;
    matrix("the estimates of the run", &found.estimates, count, n)?;
    matrix("the deviations of the run", &found.deviations, count, n)?;
    at_most("the controls of the run", found.controls.len(), count)?;
    rows("the controls of the run", &found.controls, m)?;
    length_or_none("the measurements of the run", found.measurements.len(), count)?;
    rows("the measurements of the run", &found.measurements, p)
}

fn of_scene(scene: &Scene) -> Found {
    let frames = scene.time.0.len();
    let track = |found: usize| match found {
        1 => Ok(()),
        found => length("a motion of the scene", found, frames),
    };
    let rows = |of: &dyn Fn() -> Vec<usize>| of().into_iter().try_for_each(track);
    fn count<const N: usize>(track: &Track<N>) -> usize {
        track.0.len()
    }
    rows(&|| scene.bodies.iter().flat_map(|body| [count(&body.position), count(&body.rotation)]).collect())?;
    rows(&|| {
        let ends = scene.connections.iter().flat_map(|one| [count(&one.from), count(&one.to)]);
        ends.chain(scene.connections.iter().flat_map(|one| [count(&one.force), count(&one.torque)])).collect()
    })?;
    rows(&|| scene.beliefs.iter().flat_map(|belief| [count(&belief.position), count(&belief.covariance)]).collect())
}

fn of_sweep(about: &About, sweep: &Sweep) -> Found {
    if about.tasks.is_empty() {
        return Err("it has no tasks".into());
    }
    for axis in &sweep.options.axes {
        if !about.parameters.iter().any(|parameter| parameter.name == axis.parameter) {
            return Err(format!("an axis is of a parameter `{}` that does not exist", axis.parameter));
        }
    }
    sweep.table.rows.iter().try_for_each(|row| length("a row of the table", row.len(), sweep.table.columns.len()))
}

fn robustness(about: &About, study: &Robustness) -> Found {
    let (designs, tasks, levels) = (study.designs.len(), about.tasks.len(), study.options.vary.values.len());
    study.designs.iter().try_for_each(|one| parameters("a design", about, &one.parameters))?;
    for cell in &study.cells {
        place("design", cell.design, designs)?;
        place("task", cell.task, tasks)?;
        place("level", cell.level, levels)?;
    }
    for one in &study.comparisons {
        [one.design, one.other].into_iter().try_for_each(|design| place("design", design, designs))?;
        place("task", one.task, tasks)?;
        one.levels.into_iter().try_for_each(|level| place("level", level, levels))?;
    }
    Ok(())
}

fn pareto(about: &About, front: &Pareto) -> Found {
    let tasks = about.tasks.len();
    length("the list of limits", front.bounds.len(), tasks)?;
    for point in &front.points {
        parameters("a point", about, &point.parameters)?;
        for (what, found) in [
            ("the limits of a point", point.bounds.len()),
            ("the information of a point", point.task_nats.len()),
            ("the costs of a point", point.costs.len()),
            ("the prices of a point", point.prices.len()),
        ] {
            length(what, found, tasks)?;
        }
    }
    Ok(())
}

fn trace(about: &About, study: &Trace) -> Found {
    for run in &study.runs {
        for point in run.path.iter().chain([&run.end]) {
            parameters("a design of a path", about, &point.parameters)?;
            length_or_none("the costs of a design of a path", point.costs.len(), about.tasks.len())?;
        }
        run.steps.iter().try_for_each(|&step| place("design of a path", step, run.path.len()))?;
    }
    Ok(())
}

fn sensors(about: &About, study: &Sensors) -> Found {
    parameters("the design", about, &study.parameters)?;
    study.tasks.iter().try_for_each(|name| task("the choice of sensors", about, name))?;
    let sets = [&study.none, &study.all, &study.chosen].into_iter().chain(&study.greedy).chain(&study.best);
    for sensor in sets.flat_map(|set| &set.sensors) {
        if !study.sensors.iter().any(|one| one.name == *sensor) {
            return Err(format!("a set has a sensor `{sensor}` that does not exist"));
        }
    }
    Ok(())
}

fn bound(about: &About, study: &BoundStudy) -> Found {
    parameters("the design", about, &study.report.parameters)?;
    length_or_none("the list of curves", study.curves.len(), study.report.tasks.len())?;
    study.curves.iter().try_for_each(|curve| task("a curve", about, &curve.task))?;
    for found in &study.report.tasks {
        task("a bound", about, &found.name)?;
        let steps = found.steps;
        length_or_none("the minimum by step", found.minimum_per_step_bits.len(), steps)?;
        length_or_none("the information used by step", found.control_per_step_bits.len(), steps)?;
        length_or_none("the information measured by step", found.measurement_per_step_bits.len(), steps)?;
        let (sensor, n) = (&found.virtual_sensor, found.virtual_sensor.states.len());
        length("the list of units", sensor.units.len(), n)?;
        for (what, count) in [
            ("the ranks by step", sensor.rank_per_step.len()),
            ("the sensor by step", sensor.measurement.len()),
            ("the variances by step", sensor.variances.len()),
            ("the gains by step", sensor.gain.len()),
        ] {
            length_or_none(what, count, steps)?;
        }
        sensor.measurement.iter().try_for_each(|c| rows("the sensor", c, n))?;
        for window in &sensor.windows {
            [window.first, window.last, window.strongest]
                .into_iter()
                .try_for_each(|at| place("decision", at, steps))?;
            window.directions.iter().try_for_each(|one| length("a direction", one.coefficients.len(), n))?;
        }
    }
    Ok(())
}
