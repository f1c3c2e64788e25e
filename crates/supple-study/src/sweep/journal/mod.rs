//! The journal of a sweep: the rows that are done, and what its segments need to go on.

use std::collections::BTreeMap;
use std::fmt::Write;
use std::path::Path;

use redb::{ReadTransaction, ReadableTable, TableDefinition, WriteTransaction};
use supple::parameters::Scale;

use super::axis::Axis;
use super::codec;
use super::done::{Done, Started};
use super::grid::Grid;
use super::options::SweepOptions;
use super::point::Study;
use crate::journal::{Identity, Journal, Layout, count, fingerprint};
use crate::{Cell, LoadedTask, StudyError};

/// Rows by the number of their point, as JSON.
const ROWS: TableDefinition<u64, &str> = TableDefinition::new("rows");

/// By the number of an unfinished segment: its last point that is done, and the plans to continue from.
const PLANS: TableDefinition<u64, &[u8]> = TableDefinition::new("plans");

/// What the journal of a sweep holds.
pub(super) struct Rows<'a> {
    pub study: &'a Study,
    /// How many columns a row has.
    pub columns: usize,
}

impl Layout for Rows<'_> {
    /// For every segment that has begun: where it resumes.
    type Done = BTreeMap<usize, Started>;

    fn create(&self, change: &WriteTransaction) -> Result<(), redb::Error> {
        change.open_table(ROWS)?;
        change.open_table(PLANS)?;
        Ok(())
    }

    fn read(&self, journal: &ReadTransaction) -> Result<Option<Self::Done>, redb::Error> {
        let Study { grid, problem, .. } = self.study;
        let (rows, plans) = (journal.open_table(ROWS)?, journal.open_table(PLANS)?);
        let mut started: BTreeMap<usize, Started> = BTreeMap::new();
        for entry in rows.iter()? {
            let (key, row) = entry?;
            let point = usize::try_from(key.value()).ok().filter(|&point| point < grid.points);
            let fits = |_: &usize| codec::row(row.value()).is_some_and(|row| row.len() == self.columns);
            let Some(point) = point.filter(fits) else { return Ok(None) };
            let segment = grid.segment_of(point);
            let begin = Started { next: grid.segment(segment).start, neighbour: Vec::new() };
            let of = started.entry(segment).or_insert(begin);
            // Points of a segment are done one after the other.
            if of.next != point {
                return Ok(None);
            }
            of.next += 1;
        }
        for (&segment, of) in started.iter_mut().filter(|(segment, of)| of.next < grid.segment(**segment).end) {
            let kept = plans.get(segment as u64)?.and_then(|bytes| codec::plan(bytes.value(), problem));
            match kept {
                Some((point, neighbour)) if point + 1 == of.next => of.neighbour = neighbour,
                _ => return Ok(None),
            }
        }
        Ok(Some(started))
    }
}

/// Keeps points that are done, all of them or none; on return they are on the disk.
///
/// # Errors
/// Where the disk is full or fails; what was kept before still is.
pub(super) fn keep(journal: &Journal, grid: &Grid, batch: &[Done]) -> Result<(), StudyError> {
    journal.keep(|change| {
        let mut rows = change.open_table(ROWS)?;
        let mut plans = change.open_table(PLANS)?;
        for Done { segment, point, row, neighbour } in batch {
            rows.insert(*point as u64, &*codec::row_text(row))?;
            if point + 1 == grid.segment(*segment).end {
                plans.remove(*segment as u64)?;
            } else {
                plans.insert(*segment as u64, &*codec::plan_bytes(*point, neighbour))?;
            }
        }
        Ok(())
    })
}

/// All rows, in the order of the points.
///
/// # Errors
/// Where the journal cannot be read.
pub(super) fn rows(journal: &Journal) -> Result<Vec<Vec<Cell>>, StudyError> {
    let texts = journal.read(|journal| {
        let rows = journal.open_table(ROWS)?;
        rows.iter()?.map(|entry| Ok(entry?.1.value().to_owned())).collect::<Result<Vec<String>, redb::Error>>()
    })?;
    let rows = texts.iter().map(|text| codec::row(text));
    rows.collect::<Option<_>>().ok_or_else(|| journal.damaged("a row in it cannot be read"))
}

/// How many points of a sweep are kept in its folder, finished or not. Changes nothing.
///
/// # Errors
/// Where there is no journal, or it is in use or damaged.
///
/// ```
/// use supple_study::sweep::{Axis, SweepOptions, kept_points, run};
/// use supple_study::{LoadedTask, Source, Watch};
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
///
/// // The task of the front page.
/// let task = LoadedTask::restore(&[source])?;
/// let axes = vec![Axis::parse("variance=log:1e-3:1e-1:3", &task)?];
/// let folder = tempfile::tempdir()?;
/// let options = SweepOptions { axes, rollouts: 0, starts: 0, branches: 0, seed: 0 };
/// run(&task, &options, Some(folder.path()), Watch::default())?;
/// assert_eq!(kept_points(folder.path())?, 3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn kept_points(folder: &Path) -> Result<u64, StudyError> {
    count(folder, ROWS)
}

/// Values of an axis that are written out; of a longer one, its ends and a fingerprint.
const SHOWN: usize = 64;

/// What a sweep of a task is.
pub(super) fn identity(task: &LoadedTask, options: &SweepOptions, grid: &Grid) -> Identity {
    let SweepOptions { axes, rollouts, starts, branches, seed } = options;
    let mut text = String::new();
    for axis in axes {
        let _ = writeln!(text, "grid {}", axis_text(axis));
    }
    let _ = writeln!(text, "rollouts {rollouts}\nstarts {starts}\nseed {seed}");
    if *branches > 0 {
        let _ = writeln!(text, "branches {branches}");
    }
    Identity::of("sweep", task, &text, &grid.indices)
}

fn axis_text(axis: &Axis) -> String {
    let Axis { parameter, scale, values, .. } = axis;
    let scale = match scale {
        Scale::Linear => "linear",
        Scale::Log => "logarithmic",
    };
    let count = values.len();
    match &values[..] {
        [first, .., last] if count > SHOWN => {
            let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
            let fingerprint = fingerprint(&bytes);
            format!("{parameter} ({scale}): {count} values from {first:?} to {last:?}, fingerprint {fingerprint}")
        }
        _ => format!("{parameter} ({scale}): {values:?}"),
    }
}

#[cfg(test)]
mod tests;
