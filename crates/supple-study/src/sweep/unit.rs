use std::ops::Range;

use serde::{Deserialize, Serialize};
use supple::Stop;

use super::codec;
use super::done::{Done, Started};
use super::options::SweepOptions;
use super::point::{Evaluator, Study};
use super::work::along;
use crate::{LoadedTask, StudyError};

/// Segments of a sweep to evaluate elsewhere.
///
/// Example: the [module](crate::sweep).
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct SweepUnit {
    /// Numbers of the segments.
    pub segments: Range<usize>,
    /// Of those that are begun: the number, and the last point that is done with the plans to continue from.
    pub(super) begun: Vec<(usize, Vec<u8>)>,
}

/// Does units of a sweep, one after the other.
///
/// Example: the [module](crate::sweep).
pub struct SweepUnits {
    study: Study,
}

impl SweepUnits {
    /// Of a sweep of a task.
    ///
    /// # Errors
    /// Where something is wrong with the grid, or there is nothing to design.
    pub fn new(task: &LoadedTask, options: &SweepOptions) -> Result<Self, StudyError> {
        Ok(Self { study: Study::new(task, options)? })
    }

    /// The rows of a unit's points that are not done, in their order, each as a JSON list; the same to the last bit as
    /// those of [`run`](super::run).
    ///
    /// # Errors
    /// If it is stopped, or the unit is none of this sweep.
    pub fn work(&self, unit: &SweepUnit, stop: Stop) -> Result<Vec<String>, StudyError> {
        if unit.segments.end > self.study.grid.segments() {
            return Err(StudyError::usage("these segments belong to another sweep"));
        }
        let mut evaluator = Evaluator::new(&self.study, stop);
        let mut rows = Vec::new();
        for segment in unit.segments.clone() {
            let begun = unit.begun.iter().find(|(begun, _)| *begun == segment);
            let started = begun.map(|(_, bytes)| self.started(segment, bytes)).transpose()?;
            let keep = |done: Done| {
                rows.push(codec::row_text(&done.row));
                true
            };
            if !along(&mut evaluator, segment, started.as_ref(), keep) {
                return Err(StudyError::Stopped);
            }
        }
        Ok(rows)
    }

    /// How far a segment is, by the bytes of its plans.
    fn started(&self, segment: usize, bytes: &[u8]) -> Result<Started, StudyError> {
        let points = self.study.grid.segment(segment);
        match codec::plan(bytes, &self.study.problem) {
            Some((point, neighbour)) if points.contains(&point) => Ok(Started { next: point + 1, neighbour }),
            _ => Err(StudyError::usage("the plans of a begun segment are not of this sweep")),
        }
    }
}
