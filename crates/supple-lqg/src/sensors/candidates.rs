use supple_kernels::Matrices;

/// A sensor that may be selected.
///
/// Example: [`Selection`](crate::sensors::Selection).
#[derive(Clone, Debug, PartialEq)]
pub struct Candidate {
    /// Its name.
    pub name: String,
    /// Its price, in the units of budgets; at least 0.
    pub price: f64,
    /// Indices of its entries in the measurement.
    pub rows: Vec<usize>,
}

/// Joins candidates whose noises are correlated at any step: a set has both or neither.
///
/// # Panics
/// If a candidate has a measurement that `v` has not.
///
/// ```
/// use supple_lqg::sensors::{Candidate, join_correlated};
///
/// let candidate = |name: &str, row| Candidate { name: name.into(), price: 1.0, rows: vec![row] };
/// let mut candidates = vec![candidate("left", 0), candidate("right", 1)];
/// join_correlated(&mut candidates, &supple_lqg::constant(&[[1.0, 0.2], [0.2, 1.0]]));
/// assert_eq!((candidates[0].name.as_str(), candidates[0].price), ("left, right", 2.0));
/// ```
pub fn join_correlated(candidates: &mut Vec<Candidate>, v: &Matrices) {
    let shares = |a: &Candidate, b: &Candidate| {
        let entry = |t: usize| a.rows.iter().any(|&i| b.rows.iter().any(|&j| v.get(t, i, j) != 0.0));
        (0..v.count()).any(entry)
    };
    let mut at = 0;
    while at < candidates.len() {
        match (at + 1..candidates.len()).find(|&other| shares(&candidates[at], &candidates[other])) {
            Some(other) => {
                let joined = candidates.remove(other);
                let one = &mut candidates[at];
                one.name = format!("{}, {}", one.name, joined.name);
                one.price += joined.price;
                one.rows.extend(joined.rows);
            }
            None => at += 1,
        }
    }
}
