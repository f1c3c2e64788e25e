//! Rows and plans as journals and units of work have them.

use supple::{Matrices, Problem};

use super::point::Neighbour;
use crate::Cell;

/// A row as JSON.
pub(super) fn row_text(row: &[Cell]) -> String {
    let cells: Vec<serde_json::Value> = row
        .iter()
        .map(|cell| match cell {
            Cell::Number(number) => (*number).into(),
            Cell::Text(text) => text.as_str().into(),
            Cell::Missing => serde_json::Value::Null,
        })
        .collect();
    serde_json::Value::from(cells).to_string()
}

/// The row of a text; `None` if it is no row.
pub(super) fn row(text: &str) -> Option<Vec<Cell>> {
    serde_json::from_str(text).ok()
}

/// A point and the plans of its tasks: the controls, each vector after the other, in little-endian bytes.
pub(super) fn plan_bytes(point: usize, neighbour: &Neighbour) -> Vec<u8> {
    let mut bytes = (point as u64).to_le_bytes().to_vec();
    for controls in neighbour {
        bytes.push(u8::from(controls.is_some()));
        if let Some(controls) = controls {
            for t in 0..controls.count() {
                bytes.extend(controls.vector(t).iter().flat_map(|u| u.to_le_bytes()));
            }
        }
    }
    bytes
}

/// The point and plans of these bytes; `None` if they are not of this problem.
pub(super) fn plan(mut bytes: &[u8], problem: &Problem) -> Option<(usize, Neighbour)> {
    let point = u64::from_le_bytes(*take(&mut bytes)?);
    let mut neighbour = Neighbour::new();
    for task in &problem.tasks {
        let [there] = *take(&mut bytes)?;
        let mut controls = (there == 1).then(|| Matrices::vectors(task.steps, task.system.dimensions().controls));
        if let Some(controls) = &mut controls {
            for t in 0..task.steps {
                for u in controls.vector_mut(t) {
                    *u = f64::from_le_bytes(*take(&mut bytes)?);
                }
            }
        }
        neighbour.push(controls);
    }
    bytes.is_empty().then_some((usize::try_from(point).ok()?, neighbour))
}

fn take<'a, const N: usize>(bytes: &mut &'a [u8]) -> Option<&'a [u8; N]> {
    let (first, rest) = bytes.split_first_chunk()?;
    *bytes = rest;
    Some(first)
}
