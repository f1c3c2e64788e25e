use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

use super::codec;
use super::columns::columns;
use super::done::{Done, Started, points_done};
use super::journal::{Rows, identity};
use super::options::SweepOptions;
use super::point::Study;
use super::result::Sweep;
use super::store::Store;
use super::unit::SweepUnit;
use crate::journal::Journal;
use crate::{Column, LoadedTask, StudyError, Table};

/// A sweep whose points are evaluated by others: it hands out units of work, keeps rows in memory or in the journal, and
/// makes the table. That is the same, to the last bit, wherever and in whatever order the units are done.
///
/// Example: the [module](crate::sweep).
pub struct Collector {
    pub(super) study: Study,
    columns: Vec<Column>,
    pub(super) store: Store,
    /// Segments that were begun when it was opened.
    pub(super) started: BTreeMap<usize, Started>,
    /// The first segment that was not given out.
    next: usize,
    /// Segments that were given out and are not kept yet.
    out: BTreeSet<usize>,
}

impl Collector {
    /// Opens a sweep; with a folder, its journal, or a new one.
    ///
    /// # Errors
    /// Where a grid is empty, or the journal cannot be written, is damaged, or belongs to something else.
    pub fn open(task: &LoadedTask, options: &SweepOptions, folder: Option<&Path>) -> Result<Self, StudyError> {
        let study = Study::new(task, options)?;
        let columns = columns(task, options)?;
        let (store, started) = match folder {
            None => (Store::Memory(BTreeMap::new()), BTreeMap::new()),
            Some(folder) => {
                let layout = Rows { study: &study, columns: columns.len() };
                let identity = identity(task, options, &study.grid);
                let (journal, started) = Journal::open(folder, &layout, &identity)?;
                (Store::Journal(journal), started.unwrap_or_default())
            }
        };
        Ok(Self { study, columns, store, started, next: 0, out: BTreeSet::new() })
    }

    /// Points that were done before, and all points.
    #[must_use]
    pub fn points(&self) -> (usize, usize) {
        (points_done(&self.study.grid, &self.started), self.study.grid.points)
    }

    /// Segments that were not given out yet; some of them may be done.
    #[must_use]
    pub fn segments_left(&self) -> usize {
        self.study.grid.segments() - self.next
    }

    /// The next unit, of so many segments at most; `None` if all were given out.
    pub fn next_unit(&mut self, most: usize) -> Option<SweepUnit> {
        let grid = &self.study.grid;
        let is_done =
            |segment: usize| self.started.get(&segment).is_some_and(|of| of.next == grid.segment(segment).end);
        let first = (self.next..grid.segments()).find(|&segment| !is_done(segment));
        let Some(first) = first else {
            self.next = grid.segments();
            return None;
        };
        let most = first.saturating_add(most.max(1)).min(grid.segments());
        let end = (first + 1..most).find(|&segment| is_done(segment)).unwrap_or(most);
        let begun = self.started.range(first..end);
        let begun = begun.map(|(&segment, of)| (segment, codec::plan_bytes(of.next - 1, &of.neighbour))).collect();
        self.next = end;
        self.out.extend(first..end);
        Some(SweepUnit { segments: first..end, begun })
    }

    /// Keeps the rows of units, all of them or none; with a journal, they are on the disk on return. How many points
    /// these are.
    ///
    /// # Errors
    /// Where rows do not belong to their unit, or the journal cannot be written.
    pub fn keep(&mut self, units: &[(SweepUnit, Vec<String>)]) -> Result<usize, StudyError> {
        let mut batch = Vec::new();
        let mut kept: BTreeSet<usize> = BTreeSet::new();
        for (unit, rows) in units {
            let points = self.points_of(unit);
            let fits = points.len() == rows.len();
            let fresh = unit.segments.clone().all(|segment| self.out.contains(&segment) && kept.insert(segment));
            if !fits || !fresh {
                return Err(self.foreign(unit));
            }
            for ((segment, point), text) in points.into_iter().zip(rows) {
                let row = codec::row(text).filter(|row| row.len() == self.columns.len());
                let row = row.ok_or_else(|| self.foreign(unit))?;
                // Whole segments are stored at once, so that no plans are needed to continue from these points.
                batch.push(Done { segment, point, row, neighbour: Vec::new() });
            }
        }
        let count = batch.len();
        self.store.keep(&self.study.grid, batch)?;
        self.out.retain(|segment| !kept.contains(segment));
        Ok(count)
    }

    /// The table of all that is done.
    ///
    /// # Errors
    /// Where the journal cannot be read.
    pub fn finish(self) -> Result<Sweep, StudyError> {
        let Self { study, columns, store, .. } = self;
        let rows = store.rows()?;
        let complete = rows.len() == study.grid.points;
        let table = Table { columns: columns.clone(), rows };
        Ok(Sweep { options: study.options, columns, table, complete })
    }

    /// The points of a unit in words: their numbers, and where the first one is.
    #[must_use]
    pub fn describe(&self, unit: &SweepUnit) -> String {
        let points = self.points_of(unit);
        let (Some((_, first)), Some((_, last))) = (points.first(), points.last()) else {
            return "no points".to_owned();
        };
        let mut phi = self.study.phi.clone();
        self.study.grid.write_point(*first, &mut phi);
        let value = |&index: &usize| format!("{} = {:?}", self.study.problem.parameters.get(index).name, phi[index]);
        let at: Vec<String> = self.study.grid.indices.iter().map(value).collect();
        match first == last {
            true => format!("point {first} at {}", at.join(", ")),
            false => format!("points {first} to {last}, the first at {}", at.join(", ")),
        }
    }

    /// The points of a unit that are not done, each with its segment.
    fn points_of(&self, unit: &SweepUnit) -> Vec<(usize, usize)> {
        let grid = &self.study.grid;
        let segments = unit.segments.start..unit.segments.end.min(grid.segments());
        let points = |segment: usize| {
            let points = grid.segment(segment);
            let next = self.started.get(&segment).map_or(points.start, |of| of.next);
            (next..points.end).map(move |point| (segment, point))
        };
        segments.flat_map(points).collect()
    }

    fn foreign(&self, unit: &SweepUnit) -> StudyError {
        StudyError::Usage(format!("rows do not belong to {} of this sweep", self.describe(unit)))
    }
}
