use supple_kernels::Matrices;

use supple_lqg::Dimensions;

use supple_lqg::Error;

/// The numbers of a linear problem over N steps. Each array has as many matrices as there are steps, or one that is
/// [constant](Matrices::constant); vectors are matrices of one row.
///
/// Example: [`Sequence`](crate::system::Sequence).
#[derive(Clone, Debug)]
#[allow(non_snake_case)]
pub struct Arrays {
    /// Dynamics, n x n, N of them.
    pub A: Matrices,
    /// Input, n x m, N of them.
    pub B: Matrices,
    /// Measurement, p x n, N + 1 of them.
    pub C: Matrices,
    /// What is added to the next state, length n, N of them; default: 0.
    pub c: Option<Matrices>,
    /// What is added to the measurement, length p, N + 1 of them; default: 0.
    pub d: Option<Matrices>,
    /// Weight of the state, n x n, N of them. Of this and other weights `x'Mx`, only the symmetric part matters.
    pub Q: Matrices,
    /// Weight of state and control together, n x m, N of them; default: 0.
    pub S: Option<Matrices>,
    /// Weight of the control, m x m, N of them.
    pub R: Matrices,
    /// Linear cost of the state, length n, N of them; default: 0.
    pub q: Option<Matrices>,
    /// Linear cost of the control, length m, N of them; default: 0.
    pub r: Option<Matrices>,
    /// Weight of the last state, n x n, one; default: the last of `Q`.
    pub QN: Option<Matrices>,
    /// Linear cost of the last state, length n, one; default: the last of `q`.
    pub qN: Option<Matrices>,
}

/// The arrays as a system uses them.
pub(super) struct Checked {
    pub size: Dimensions,
    /// `[A B]`, n x (n + m).
    pub dynamics: Matrices,
    /// `[l_zz | l_z at z = 0]`, (n + m) x (n + m + 1).
    pub cost: Matrices,
    /// The same of the final cost, one.
    pub last: Matrices,
}

/// An array's name, and its description for errors about non-finite entries.
struct Named {
    name: &'static str,
    what: &'static str,
}

macro_rules! named {
    ($name:literal) => {
        Named { name: $name, what: concat!("the array ", $name) }
    };
}

/// Checks one array: number and shape of matrices, and that all are finite.
fn check(array: &Matrices, named: Named, count: usize, (rows, cols): (usize, usize)) -> Result<(), Error> {
    let Named { name, what } = named;
    let counted = if array.is_constant() { count } else { array.count() };
    let parts = [
        (format!("the array {name}"), counted, count),
        (format!("each column of {name}"), array.rows(), rows),
        (format!("each row of {name}"), array.cols(), cols),
    ];
    for (what, found, expected) in parts {
        if found != expected {
            return Err(Error::Shape { what, found, expected });
        }
    }
    let bad = (0..array.count()).find(|&step| array.at(step).iter().any(|entry| !entry.is_finite()));
    bad.map_or(Ok(()), |step| Err(Error::NotFinite { what, step }))
}

impl Arrays {
    /// `A`, `B`, `C`, `Q` and `R`, with everything else left at its default.
    #[allow(non_snake_case)]
    #[must_use]
    pub fn new([A, B, C, Q, R]: [Matrices; 5]) -> Self {
        Self { A, B, C, c: None, d: None, Q, S: None, R, q: None, r: None, QN: None, qN: None }
    }

    /// Checks all arrays over `steps` steps, and puts them together.
    pub(super) fn check(&self, steps: usize) -> Result<Checked, Error> {
        let (n, m, p) = (self.A.rows(), self.B.cols(), self.C.rows());
        let size = Dimensions { states: n, controls: m, measurements: p };
        for (what, found) in [("steps", steps), ("states", n), ("controls", m), ("measurements", p)] {
            if found == 0 {
                return Err(Error::Shape { what: format!("the list of {what}"), found, expected: 1 });
            }
        }
        check(&self.A, named!("A"), steps, (n, n))?;
        check(&self.B, named!("B"), steps, (n, m))?;
        check(&self.C, named!("C"), steps + 1, (p, n))?;
        check(&self.Q, named!("Q"), steps, (n, n))?;
        check(&self.R, named!("R"), steps, (m, m))?;
        let optional = [
            (&self.c, named!("c"), steps, (1, n)),
            (&self.d, named!("d"), steps + 1, (1, p)),
            (&self.S, named!("S"), steps, (n, m)),
            (&self.q, named!("q"), steps, (1, n)),
            (&self.r, named!("r"), steps, (1, m)),
            (&self.QN, named!("QN"), 1, (n, n)),
            (&self.qN, named!("qN"), 1, (1, n)),
        ];
        for (array, named, count, shape) in optional {
            array.as_ref().map_or(Ok(()), |array| check(array, named, count, shape))?;
        }
        Ok(Checked { size, dynamics: self.dynamics(steps, size), cost: self.cost(steps, size), last: self.last(size) })
    }

    fn dynamics(&self, steps: usize, size: Dimensions) -> Matrices {
        let mut dynamics = together(&[Some(&self.A), Some(&self.B)], steps, size.states, size.joint());
        for t in 0..dynamics.count() {
            write(&mut dynamics, t, 0, &self.A);
            write(&mut dynamics, t, size.states, &self.B);
        }
        dynamics
    }

    fn cost(&self, steps: usize, size: Dimensions) -> Matrices {
        let Self { Q, S, R, q, r, .. } = self;
        let (n, joint) = (size.states, size.joint());
        let parts = [Some(Q), S.as_ref(), Some(R), q.as_ref(), r.as_ref()];
        let mut cost = together(&parts, steps, joint, joint + 1);
        for t in 0..cost.count() {
            write_symmetric(&mut cost, t, 0, Q, t);
            write_symmetric(&mut cost, t, n, R, t);
            if let Some(cross) = S {
                for (i, a) in (0..n).flat_map(|i| (0..joint - n).map(move |a| (i, a))) {
                    let weight = 2.0 * cross.get(t, i, a);
                    cost.set(t, i, n + a, weight);
                    cost.set(t, n + a, i, weight);
                }
            }
            for (vectors, first) in [(q, 0), (r, n)] {
                let entries = vectors.iter().flat_map(|vectors| vectors.vector(t)).enumerate();
                entries.for_each(|(i, &entry)| cost.set(t, first + i, joint, entry));
            }
        }
        cost
    }

    fn last(&self, size: Dimensions) -> Matrices {
        let joint = size.joint();
        let mut last = Matrices::constant(joint, joint + 1);
        let end = |array: &Matrices| array.count() - 1;
        let weights = self.QN.as_ref().unwrap_or(&self.Q);
        write_symmetric(&mut last, 0, 0, weights, end(weights));
        if let Some(vectors) = self.qN.as_ref().or(self.q.as_ref()) {
            let entries = vectors.vector(end(vectors)).iter().enumerate();
            entries.for_each(|(i, &entry)| last.set(0, i, joint, entry));
        }
        last
    }
}

/// Zeros into which arrays are combined: a constant matrix if all of them are constant.
fn together(parts: &[Option<&Matrices>], steps: usize, rows: usize, cols: usize) -> Matrices {
    let is_constant = parts.iter().flatten().all(|part| part.is_constant());
    if is_constant { Matrices::constant(rows, cols) } else { Matrices::zeros(steps, rows, cols) }
}

/// Writes a matrix of step `t` into columns of another one.
fn write(out: &mut Matrices, t: usize, col: usize, from: &Matrices) {
    for (i, j) in (0..from.rows()).flat_map(|i| (0..from.cols()).map(move |j| (i, j))) {
        out.set(t, i, col + j, from.get(t, i, j));
    }
}

/// Writes the second derivative of `x'Mx`, `M + M'`, into a part on the diagonal.
fn write_symmetric(out: &mut Matrices, t: usize, first: usize, from: &Matrices, index: usize) {
    for (i, j) in (0..from.rows()).flat_map(|i| (0..from.rows()).map(move |j| (i, j))) {
        out.set(t, first + i, first + j, from.get(index, i, j) + from.get(index, j, i));
    }
}
