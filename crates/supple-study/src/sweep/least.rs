//! The design of least information on a sweep's grid.

use super::columns::misses_contact;
use super::result::Sweep;

/// The point of least information: among those within all cost limits whose plans converged and make their contacts, or,
/// where there is none, among all.
///
/// Example: the [module](crate::sweep).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LeastPoint {
    /// Its row in the table.
    pub row: usize,
    /// Its information.
    pub bits: f64,
    /// How many points are within all cost limits, with plans that converged and make their contacts; 0 if this point
    /// is not either.
    pub among: usize,
}

impl Sweep {
    /// Whether the plans of each point make all contacts whose force a cost tracks.
    ///
    /// Example: the [module](crate::sweep).
    #[must_use]
    pub fn contacts_made(&self) -> Vec<bool> {
        let mut made = vec![true; self.table.rows.len()];
        for column in self.table.columns.iter().filter(|column| misses_contact(column).is_some()) {
            for (made, missed) in made.iter_mut().zip(self.table.numbers(&column.name).unwrap_or_default()) {
                *made &= missed != 1.0;
            }
        }
        made
    }

    /// The point of least information; `None` if no point has any.
    ///
    /// Example: the [module](crate::sweep).
    #[must_use]
    pub fn least(&self) -> Option<LeastPoint> {
        let [bits, feasible] = ["information_bits", "feasible"].map(|name| self.table.numbers(name));
        let (bits, feasible, made) = (bits?, feasible?, self.contacts_made());
        let meets: Vec<usize> = (0..bits.len()).filter(|&row| feasible[row] == 1.0 && made[row]).collect();
        let least = |rows: &mut dyn Iterator<Item = usize>| {
            rows.filter(|&row| bits[row].is_finite()).min_by(|&a, &b| bits[a].total_cmp(&bits[b]))
        };
        let (row, among) = match least(&mut meets.iter().copied()) {
            Some(row) => (row, meets.len()),
            None => (least(&mut (0..bits.len()))?, 0),
        };
        Some(LeastPoint { row, bits: bits[row], among })
    }
}
