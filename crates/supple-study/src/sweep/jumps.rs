//! Jumps of costs between neighbouring points, where plans are at different local minima.

use super::result::Sweep;

/// Neighbouring costs jump where they differ by more than this many times as much as those on both sides.
const TIMES: f64 = 8.0;
/// Smaller differences, relative to the costs, are no jumps.
const LEAST: f64 = 0.01;

/// Jumps of a task's expected cost along the axes of a sweep.
///
/// Example: the [module](crate::sweep).
#[derive(Clone, Debug, PartialEq)]
pub struct Jumps {
    /// The task.
    pub task: String,
    /// How many there are.
    pub count: usize,
    /// The axis of the largest.
    pub axis: usize,
    /// The rows between which that is.
    pub rows: [usize; 2],
    /// The costs there.
    pub costs: [f64; 2],
}

impl Sweep {
    /// The jumps of the expected cost of each task, where it has any.
    ///
    /// Example: the [module](crate::sweep).
    #[must_use]
    pub fn jumps(&self) -> Vec<Jumps> {
        let is_whole = self.table.rows.len() == self.options.points();
        let names = self.table.columns.iter().filter_map(|column| column.name.strip_suffix(".expected_cost"));
        names.filter(|_| is_whole).filter_map(|task| self.jumps_of(task)).collect()
    }

    fn jumps_of(&self, task: &str) -> Option<Jumps> {
        let costs = self.table.numbers(&format!("{task}.expected_cost"))?;
        let mut found: Option<Jumps> = None;
        let mut stride = 1;
        for (axis, values) in self.options.axes.iter().enumerate().rev().map(|(axis, of)| (axis, of.values.len())) {
            for row in (0..costs.len()).filter(|row| row / stride % values + 1 < values) {
                let place = row / stride % values;
                // The cost so many points farther on the axis, if there is that point.
                let cost = |step: isize| {
                    let there = place.checked_add_signed(step).filter(|there| *there < values)?;
                    Some(costs[row - place * stride + there * stride])
                };
                if !(steps(&cost) || peaks(&cost)) {
                    continue;
                }
                let rows = [row, row + stride];
                let costs = rows.map(|row| costs[row]);
                let jumps = found.get_or_insert_with(|| Jumps { task: task.to_owned(), count: 0, axis, rows, costs });
                jumps.count += 1;
                if (costs[1] - costs[0]).abs() > (jumps.costs[1] - jumps.costs[0]).abs() {
                    (jumps.axis, jumps.rows, jumps.costs) = (axis, rows, costs);
                }
            }
            stride *= values;
        }
        found
    }
}

/// Whether a cost differs much more from the next one than these do from those on both sides.
fn steps(cost: &dyn Fn(isize) -> Option<f64>) -> bool {
    let all = [-1, 0, 1, 2].map(cost);
    let [Some(before), Some(from), Some(to), Some(after)] = all else { return false };
    is_jump(to - from, &[from - before, after - to], from.abs().max(to.abs()))
}

/// Whether the next cost is far from those around it, which are close to one another.
fn peaks(cost: &dyn Fn(isize) -> Option<f64>) -> bool {
    let (Some(from), Some(at), Some(to)) = (cost(0), cost(1), cost(2)) else { return false };
    let outer = [cost(-1).map(|before| from - before), cost(3).map(|after| after - to)];
    let outer: Vec<f64> = outer.into_iter().flatten().collect();
    let beside = [&outer[..], &[to - from]].concat();
    !outer.is_empty() && is_jump(at - 0.5 * (from + to), &beside, from.abs().max(at.abs()))
}

fn is_jump(by: f64, beside: &[f64], size: f64) -> bool {
    let beside = beside.iter().fold(0.0_f64, |most, by| most.max(by.abs()));
    (by + beside).is_finite() && by.abs() > TIMES * beside && by.abs() > LEAST * size
}

#[cfg(test)]
mod tests {
    use super::{peaks, steps};

    fn found(costs: &[f64]) -> Vec<usize> {
        let at = |place: usize| {
            let cost = |step: isize| place.checked_add_signed(step).and_then(|there| costs.get(there).copied());
            steps(&cost) || peaks(&cost)
        };
        (0..costs.len()).filter(|place| at(*place)).collect()
    }

    #[test]
    fn steps_and_peaks_are_jumps_and_smooth_costs_are_not() {
        assert_eq!(found(&[3.0, 3.1, 3.2, 1.0, 1.1, 1.2]), [2]);
        assert_eq!(found(&[3.0, 3.1, 3.2, 9.0, 3.4]), [2]);
        let smooth: [fn(f64) -> f64; 4] =
            [|x| (x - 4.0).powi(2) + 1.0, |x| 1.0 + 1e3 / (1.0 + x).powi(3), |x| (0.5 * x).sin() + 2.0, |_| 7.0];
        for smooth in smooth {
            let costs: Vec<f64> = (0..12).map(|x| smooth(f64::from(x))).collect();
            assert_eq!(found(&costs), [0; 0], "{costs:?}");
        }
        // Too small to matter, and not finite.
        assert_eq!(found(&[3.0, 3.0, 3.001, 3.001]), [0; 0]);
        assert_eq!(found(&[3.0, f64::NAN, 1.0, 1.0, 1.0]), [0; 0]);
    }
}
