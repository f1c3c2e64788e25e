use proptest::prelude::*;

use super::*;
use crate::{Job, Level, Matrices, dispatch, dispatch_portable, padded};

struct Product<'a> {
    out: &'a mut Matrices,
    left: &'a Matrices,
    right: &'a Matrices,
    transposed: bool,
    into: Into<'a>,
}

impl Job for Product<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let left = if self.transposed { Left::transposed } else { Left::plain };
        let shape = (self.out.rows(), self.right.rows());
        let left = left(self.left.as_slice(), self.left.stride());
        multiply::<L>(self.out.at_mut(0), left, self.right.at(0), self.right.stride(), shape, self.into);
    }
}

fn filled(rows: usize, cols: usize, seed: usize) -> Matrices {
    let mut m = Matrices::zeros(1, rows, cols);
    for i in 0..rows {
        for j in 0..cols {
            m.set(0, i, j, ((seed * 31 + i * 7 + j * 13) % 17) as f64 - 8.0);
        }
    }
    m
}

proptest! {
    #[test]
    fn products_equal_plain_loops(
        rows in 0..19usize, inner in 0..19usize, cols in 1..19usize, seed in 0..100usize,
        transposed: bool, which in 0..5usize,
    ) {
        let left = if transposed { filled(inner, rows, seed) } else { filled(rows, inner, seed) };
        let right = filled(inner, cols, seed + 1);
        let before = filled(rows, cols, seed + 2);
        // Every level that this machine has, and plain arrays.
        for level in Level::ALL.into_iter().map(Some).chain([None]) {
            if level.is_some_and(|level| !level.force()) {
                continue;
            }
            let into = [
                Into::Set,
                Into::Add,
                Into::Subtract,
                Into::AddTo(before.at(0)),
                Into::SubtractFrom(before.at(0)),
            ][which];
            let mut out = before.clone();
            if which > 2 {
                out.clear();
            }
            let job = Product { out: &mut out, left: &left, right: &right, transposed, into };
            if level.is_some() { dispatch(job) } else { dispatch_portable(job) }
            for i in 0..rows {
                for j in 0..cols {
                    let sum: f64 = (0..inner)
                        .map(|k| right.get(0, k, j) * if transposed { left.get(0, k, i) } else { left.get(0, i, k) })
                        .sum();
                    let expected = match into {
                        Into::Set => sum,
                        Into::Add | Into::AddTo(_) => before.get(0, i, j) + sum,
                        Into::Subtract | Into::SubtractFrom(_) => before.get(0, i, j) - sum,
                    };
                    prop_assert_eq!(out.get(0, i, j), expected);
                }
            }
        }
    }

    #[test]
    fn cholesky_solves(n in 1..12usize, seed in 0..100usize) {
        struct Solve<'a>(&'a Matrices, &'a mut Matrices);
        impl Job for Solve<'_> {
            type Output = ();

            #[inline(always)]
            fn run<L: Lanes>(self) {
                let (n, stride) = (self.0.rows(), self.0.stride());
                cholesky_solve::<L>(self.0.at(0), stride, self.1.at_mut(0), stride, n);
            }
        }
        let root = filled(n, n, seed);
        let mut a = Matrices::zeros(1, n, n);
        for i in 0..n {
            for j in 0..n {
                let product: f64 = (0..n).map(|k| root.get(0, i, k) * root.get(0, j, k)).sum();
                a.set(0, i, j, product + if i == j { 50.0 } else { 0.0 });
            }
        }
        let (b, mut factor) = (filled(n, n, seed + 3), a.clone());
        let stride = a.stride();
        cholesky(factor.at_mut(0), n, stride).unwrap();
        let mut x = b.clone();
        dispatch(Solve(&factor, &mut x));
        for i in 0..n {
            for j in 0..n {
                let product: f64 = (0..n).map(|k| a.get(0, i, k) * x.get(0, k, j)).sum();
                prop_assert!((product - b.get(0, i, j)).abs() < 1e-9);
            }
        }
    }
}

/// Rows of a product as far apart as those of wider matrices: what lies behind stays as it was.
#[test]
fn products_of_rows_apart_are_those_of_rows_together() {
    struct Apart<'a>(&'a Matrices, &'a mut Matrices, &'a mut Matrices);
    impl Job for Apart<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(a, narrow, wide) = self;
            let (n, stride, apart) = (a.rows(), narrow.stride(), wide.stride());
            let square = Left::plain(a.at(0), a.stride());
            multiply_strided::<L>(narrow.at_mut(0), square, (a.at(0), a.stride()), stride, (n, n));
            multiply_into_strided::<L>((wide.at_mut(0), apart), square, narrow.at(0), stride, (n, n), 2.0);
        }
    }
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        for n in [1, 5, 8, 13, 22] {
            // Square, in rows that are wider than they are.
            let mut a = Matrices::zeros(1, n, n + 9);
            let given = filled(n, n, 3);
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                a.set(0, i, j, given.get(0, i, j));
            }
            let (mut squared, mut doubled) = (Matrices::zeros(1, n, n), filled(n, n + 9, 5));
            let before = doubled.clone();
            dispatch(Apart(&a, &mut squared, &mut doubled));
            let product = |left: &Matrices, right: &Matrices, i: usize, j: usize| -> f64 {
                (0..n).map(|k| left.get(0, i, k) * right.get(0, k, j)).sum()
            };
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                assert_eq!(squared.get(0, i, j), product(&given, &given, i, j), "{level:?}");
                assert_eq!(doubled.get(0, i, j), 2.0 * product(&given, &squared, i, j), "{level:?}");
            }
            for (i, j) in (0..n).flat_map(|i| (padded(n)..n + 9).map(move |j| (i, j))) {
                assert_eq!(doubled.get(0, i, j), before.get(0, i, j), "{level:?}");
            }
        }
    }
}

#[test]
fn symmetry_and_transposes_at_every_level() {
    struct Both<'a>(&'a mut Matrices, &'a mut Matrices);
    impl Job for Both<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let (n, stride) = (self.0.rows(), self.0.stride());
            transpose::<L>(self.1.at_mut(0), stride, self.0.at(0), stride, (n, n));
            symmetrise::<L>(self.0.at_mut(0), n, stride);
        }
    }
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        for n in [1, 5, 8, 13, 16, 24] {
            let (before, mut out) = (filled(n, n, 7), Matrices::zeros(1, n, n));
            let mut mean = before.clone();
            dispatch(Both(&mut mean, &mut out));
            for i in 0..n {
                for j in 0..n {
                    let (here, there) = (before.get(0, i, j), before.get(0, j, i));
                    assert_eq!(out.get(0, i, j), there, "{level:?}");
                    assert_eq!(mean.get(0, i, j), 0.5 * (here + there), "{level:?}");
                }
            }
        }
    }
}

#[test]
fn cholesky_names_the_minor_that_fails() {
    let mut a = Matrices::zeros(1, 2, 2);
    a.set(0, 0, 0, 1.0);
    let stride = a.stride();
    assert_eq!(cholesky(a.at_mut(0), 2, stride), Err(1));
}
