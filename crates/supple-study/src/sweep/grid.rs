use std::ops::Range;

use supple::settings::DesignSettings;

use super::axis::too_many;
use super::axis::{Axis, MOST_POINTS};
use super::options::SweepOptions;
use crate::{LoadedTask, StudyError};

/// Points of a segment at most: along it plans are continued from point to point. It is fixed, so that results do not
/// depend on the number of threads.
const SEGMENT: usize = 16;

/// The points of a sweep, in the order of the rows: the last axis changes fastest.
pub(super) struct Grid {
    axes: Vec<Axis>,
    /// The index of each axis's parameter.
    pub indices: Vec<usize>,
    /// How many points there are.
    pub points: usize,
    /// Points of the last axis.
    line: usize,
    /// Points of a segment at most.
    segment: usize,
}

impl Grid {
    /// The grid of the options.
    ///
    /// # Errors
    /// Where it is empty or too large, or something is wrong with an axis.
    pub fn new(task: &LoadedTask, options: &SweepOptions) -> Result<Self, StudyError> {
        let axes = options.axes.clone();
        let Some(last) = axes.last() else {
            return Err(StudyError::usage("the grid is empty: a sweep has at least one axis"));
        };
        let mut indices = Vec::new();
        for axis in &axes {
            axis.check(task).map_err(|what| StudyError::usage(format!("axis `{}`: {what}", axis.parameter)))?;
            let index = task.problem.parameters.index(&axis.parameter)?;
            if indices.contains(&index) {
                let message = format!("parameter `{}` is on two axes; it may be on one", axis.parameter);
                return Err(StudyError::Usage(message));
            }
            indices.push(index);
        }
        supple::check_rollouts(options.rollouts)?;
        supple::check_branches(options.branches)?;
        if options.starts > 0 {
            let settings = DesignSettings { starts: options.starts, ..task.problem.design.clone() };
            settings.check().map_err(|unfit| StudyError::usage(unfit.to_string()))?;
        }
        if options.starts > 0 && options.branches > 0 {
            let message = "branches and starts exclude each other: searches for designs look for other local minima by \
                           themselves, as often as `branch_attempts` in [design] says";
            return Err(StudyError::usage(message));
        }
        let points: f64 = axes.iter().map(|axis| axis.values.len() as f64).product();
        if points > MOST_POINTS as f64 {
            return Err(StudyError::Usage(too_many(points)));
        }
        // Searches for designs do not continue one another.
        let segment = if options.starts > 0 { 1 } else { SEGMENT };
        let points = axes.iter().map(|axis| axis.values.len()).product();
        let line = last.values.len();
        Ok(Self { axes, indices, points, line, segment })
    }

    /// Sets the parameters on axes to those of a point.
    pub fn write_point(&self, point: usize, phi: &mut [f64]) {
        let mut rest = point;
        for (axis, &index) in self.axes.iter().zip(&self.indices).rev() {
            phi[index] = axis.values[rest % axis.values.len()];
            rest /= axis.values.len();
        }
    }

    /// How many segments there are.
    pub fn segments(&self) -> usize {
        self.points / self.line * self.line.div_ceil(self.segment)
    }

    /// The segment of a point.
    pub fn segment_of(&self, point: usize) -> usize {
        let (line, part) = (point / self.line, point % self.line / self.segment);
        line * self.line.div_ceil(self.segment) + part
    }

    /// The points of a segment: neighbours along the last axis.
    pub fn segment(&self, segment: usize) -> Range<usize> {
        let by_line = self.line.div_ceil(self.segment);
        let (line, part) = (segment / by_line, segment % by_line);
        let start = line * self.line + part * self.segment;
        start..(start + self.segment).min((line + 1) * self.line)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used)]

    use supple::parameters::Scale;

    use super::*;
    use crate::sweep::tests::{options, task};

    #[test]
    fn segments_hold_every_point_once_and_never_leave_a_line() {
        let task = task();
        for (first, last) in [(1, 1), (3, 15), (2, 16), (2, 17), (5, 40), (40, 1)] {
            let mut options = options(&task, &["k1=50:600:5", "k2=100:600:5"]);
            options.axes[0] = range("k1", first);
            options.axes[1] = range("k2", last);
            for starts in [0, 1] {
                options.starts = starts;
                let grid = Grid::new(&task, &options).unwrap();
                let segments: Vec<_> = (0..grid.segments()).map(|segment| grid.segment(segment)).collect();
                let points: Vec<usize> = segments.iter().cloned().flatten().collect();
                assert_eq!(points, (0..first * last).collect::<Vec<_>>());
                assert!(segments.iter().all(|s| !s.is_empty() && s.start / last == (s.end - 1) / last));
                assert!((0..grid.points).all(|point| segments[grid.segment_of(point)].contains(&point)));
                assert!(segments.iter().all(|s| s.len() <= if starts > 0 { 1 } else { SEGMENT }));
            }
        }
    }

    fn range(parameter: &str, count: usize) -> Axis {
        let values = (0..count).map(|i| 100.0 + i as f64).collect();
        Axis { parameter: parameter.into(), unit: String::new(), scale: Scale::Linear, values }
    }

    #[test]
    fn the_last_axis_changes_fastest() {
        let task = task();
        let options = options(&task, &["k2=200,300", "k1=60,70,80"]);
        let grid = Grid::new(&task, &options).unwrap();
        let point = |point| {
            let mut phi = task.phi.clone();
            grid.write_point(point, &mut phi);
            [phi[0], phi[1]]
        };
        let found: Vec<_> = (0..grid.points).map(point).collect();
        let expected = [[60.0, 200.0], [70.0, 200.0], [80.0, 200.0], [60.0, 300.0], [70.0, 300.0], [80.0, 300.0]];
        assert_eq!(found, expected);
    }

    #[test]
    fn grids_that_cannot_be_are_refused() {
        let task = task();
        let twice = options(&task, &["k1=50,60", "k2=100", "k1=70"]);
        let large = options(&task, &["k1=50:600:4000", "k2=100:600:4000"]);
        let mut empty = options(&task, &["k1=50,60"]);
        empty.axes[0].values.clear();
        let mut outside = options(&task, &["k1=50,60"]);
        outside.axes[0].values[1] = 1e3;
        let mut unknown = options(&task, &["k1=50,60"]);
        unknown.axes[0].parameter = "k_1".into();
        for (options, said) in [
            (options(&task, &[]), "a sweep has at least one axis"),
            (twice, "parameter `k1` is on two axes"),
            (large, "16000000 points are too many; a grid has at most 10000000"),
            (empty, "axis `k1`: there are no values"),
            (outside, "axis `k1`: 1000 is outside the bounds"),
            (unknown, "axis `k_1`: no parameter `k_1`; valid: `k1`"),
        ] {
            let error = Grid::new(&task, &options).map(|_| ()).unwrap_err().to_string();
            assert!(error.contains(said), "{error}");
        }
    }
}
