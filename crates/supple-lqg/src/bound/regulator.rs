//! The optimal regulator of a time-invariant system.

use supple_kernels::{Matrices, halt};

use super::free::{costly, matrix, of_matrix};
use super::horizon::{Stationary, check_growth};
use super::verify::{Quotient, SteadyLaw, Unsettled, steady_law};
use crate::Error;
use crate::dense::{Dense, congruence, dense, store};
use crate::given::{Given, PROCESS, root_of};

impl Stationary {
    /// The problem `x+ = A x + B u + w`, `w` of covariance `process`, with the cost `1/2 z' L z` per step of `z = (x, u)`:
    /// `dynamics` is `[A, B]`, n x (n + m), and `cost` is `L`, (n + m) x (n + m), cross terms included.
    ///
    /// If several regulators keep the cost finite, uses the one of least cost, which need not stabilise states that
    /// cost nothing (theory, equation L.14).
    ///
    /// # Errors
    /// Where shapes do not fit, numbers are not finite, `L` is not positive semidefinite, or no regulator keeps the
    /// cost finite.
    pub fn new(dynamics: &Matrices, process: &Matrices, cost: &Matrices) -> Result<Self, Error> {
        let n = dynamics.rows();
        let joint = dynamics.cols();
        if joint < n {
            return Err(Error::Shape { what: "a row of [A, B]".into(), found: joint, expected: n });
        }
        let arrays = [
            Given { what: "[A, B]", array: dynamics, shape: (n, joint), count: 1 },
            Given { what: PROCESS, array: process, shape: (n, n), count: 1 },
            Given { what: "the cost", array: cost, shape: (joint, joint), count: 1 },
        ];
        arrays.iter().try_for_each(Given::check_finite)?;
        check_growth(dynamics)?;
        let (f, l, w) = (dense(dynamics, 0), dense(cost, 0), dense(process, 0));
        root_of("the cost of states and controls", cost, 0)?;
        let found = regulator(&f, &l, &w)?;
        let (mut price, mut system) = (Matrices::constant(n, n), Matrices::constant(n, n));
        store(&mut price, 0, &found.price);
        store(&mut system, 0, &f.columns(0, n).into_owned());
        let mut unpriced = Matrices::constant(n, found.unpriced.ncols());
        store(&mut unpriced, 0, &found.unpriced);
        let mut costly = Matrices::constant(found.costly.nrows(), n);
        store(&mut costly, 0, &found.costly);
        Ok(Self { dynamics: system, process: process.clone(), price, base_cost: found.least, unpriced, costly })
    }

    /// The map to coordinates of the states that cost something beyond rounding; `None` if all states do.
    pub(super) fn quotient(&self) -> Option<Quotient> {
        if self.costly.rows() == 0 {
            return None;
        }
        Quotient::new(&matrix(&dense(&self.costly, 0)))
    }
}

/// The least-cost regulator of `x+ = F z + w`, where `w` has covariance `process` (theory, equation L.14).
pub(super) fn regulator(dynamics: &Dense, cost: &Dense, process: &Dense) -> Result<Regulator, Error> {
    let n = dynamics.nrows();
    let rows = costly(dynamics, cost, process);
    let quotient = rows.as_ref().and_then(|rows| Quotient::new(&matrix(rows)));
    let (Some(rows), Some(quotient)) = (rows, quotient) else { return all_of(dynamics, cost, process) };
    let fewer = quotient.of(&matrix(dynamics), &matrix(cost), &matrix(process));
    let [dynamics_of, cost_of, process_of] = [&fewer.dynamics, &fewer.cost, &fewer.process].map(of_matrix);
    let found = match all_of(&dynamics_of, &cost_of, &process_of) {
        Err(Error::NoBound { .. }) => return all_of(dynamics, cost, process),
        found => found?,
    };
    // The states left out, by columns, and those of the others that cost nothing.
    let beside = quotient.beside();
    let place = |i: usize| quotient.kept().iter().position(|&kept| kept == i);
    let unpriced = Dense::from_fn(n, beside.cols + found.unpriced.ncols(), |i, k| match k.checked_sub(beside.cols) {
        None => beside.at(i, k),
        Some(k) => place(i).map_or(0.0, |row| found.unpriced[(row, k)]),
    });
    let back = rows.transpose();
    Ok(Regulator {
        s: congruence(&back, &found.s),
        price: congruence(&back, &found.price),
        least: found.least,
        unpriced,
        costly: rows,
    })
}

/// The regulator with no state left out.
fn all_of(dynamics: &Dense, cost: &Dense, process: &Dense) -> Result<Regulator, Error> {
    let SteadyLaw { s, price, least, unpriced } = steady_law(
        &matrix(dynamics),
        &matrix(cost),
        &matrix(process),
        &halt::is_requested,
    )
    .map_err(|why| match why {
        Unsettled::Stopped => Error::Stopped,
        Unsettled::Grows => Error::NoBound {
            what: "no regulator achieves a finite expected cost per step from every first state".into(),
            advice: "let the controls act on every unstable state that costs something, and leave out constant states \
                             that controls have to balance at a cost",
        },
        Unsettled::Digits => Error::NoBound {
            what: "the optimal regulator is too sensitive to rounding".into(),
            advice: "scale the states to similar sizes, or give every control a cost",
        },
    })?;
    let [s, price, unpriced] = [&s, &price, &unpriced].map(of_matrix);
    Ok(Regulator { s, price, least, unpriced, costly: Dense::zeros(0, dynamics.nrows()) })
}

/// Costs under the optimal regulator.
pub(super) struct Regulator {
    /// `S`.
    pub s: Dense,
    /// `Theta`, half of `Xi`.
    pub price: Dense,
    /// The expected cost per step with the state known.
    pub least: f64,
    /// States that never cost anything, by columns.
    pub unpriced: Dense,
    /// `R` of [`Stationary::costly`], r x n.
    pub costly: Dense,
}
