mod edges;

use std::marker::PhantomData;

use proptest::prelude::*;

use super::*;
use crate::{Job, LANES, Lanes, Level, Matrices, dispatch, dispatch_portable};

/// How a product combines with the old contents of `out`.
#[derive(Clone, Copy, Debug)]
enum Way {
    Set,
    Add,
    Subtract,
    AddTo,
    SubtractFrom,
}

struct Multiply<'a, R> {
    out: &'a mut Matrices,
    left: &'a Matrices,
    right: &'a Matrices,
    base: &'a Matrices,
    transposed: bool,
    way: Way,
    lower: bool,
    rows: PhantomData<R>,
}

impl<R: Rows> Job for Multiply<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let left = if self.transposed { Left::transposed } else { Left::plain };
        let (width, rows) = (self.right.stride(), self.out.rows());
        let product = Product {
            left: left(self.left.as_slice(), self.left.stride()),
            right: View::new(self.right.at(0), width),
            rows,
            inner: self.right.rows(),
            width,
        };
        let (stride, base) = (self.out.stride(), View::new(self.base.at(0), self.base.stride()));
        let out = ViewMut::new(self.out.at_mut(0), stride);
        match (self.way, self.lower) {
            (Way::Set, false) => product.set::<L, R>(out),
            (Way::Add, false) => product.add::<L, R>(out),
            (Way::Subtract, false) => product.subtract::<L, R>(out),
            (Way::AddTo, false) => product.add_to::<L, R>(base, out),
            (Way::SubtractFrom, false) => product.subtract_from::<L, R>(base, out),
            (Way::Set, true) => product.lower().set::<L, R>(out),
            (Way::Add, true) => product.lower().add::<L, R>(out),
            (Way::Subtract, true) => product.lower().subtract::<L, R>(out),
            (Way::AddTo, true) => product.lower().add_to::<L, R>(base, out),
            (Way::SubtractFrom, true) => product.lower().subtract_from::<L, R>(base, out),
        }
    }
}

const WAYS: [Way; 5] = [Way::Set, Way::Add, Way::Subtract, Way::AddTo, Way::SubtractFrom];

fn filled(rows: usize, cols: usize, seed: usize) -> Matrices {
    let mut m = Matrices::zeros(1, rows, cols);
    for i in 0..rows {
        for j in 0..cols {
            m.set(0, i, j, ((seed * 31 + i * 7 + j * 13) % 17) as f64 - 8.0);
        }
    }
    m
}

/// A positive definite matrix.
fn definite(n: usize, seed: usize) -> Matrices {
    let root = filled(n, n, seed);
    let mut a = Matrices::zeros(1, n, n);
    for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
        let product: f64 = (0..n).map(|k| root.get(0, i, k) * root.get(0, j, k)).sum();
        a.set(0, i, j, product + if i == j { 50.0 } else { 0.0 });
    }
    a
}

/// Runs a job at every level that this machine has, and on plain arrays.
fn at_every_level<J: Job>(job: impl Fn() -> J, mut check: impl FnMut(Option<Level>, J::Output)) {
    for level in Level::ALL.into_iter().map(Some).chain([None]) {
        match level {
            Some(level) if !level.force() => continue,
            Some(_) => check(level, dispatch(job())),
            None => check(level, dispatch_portable(job())),
        }
    }
}

fn check_product<R: Rows>(sizes: (usize, usize, usize), seed: usize, transposed: bool, way: Way, lower: bool, _: R) {
    let (rows, inner, cols) = sizes;
    let left = if transposed { filled(inner, rows, seed) } else { filled(rows, inner, seed) };
    let (right, before) = (filled(inner, cols, seed + 1), filled(rows, cols, seed + 2));
    let base = filled(rows, cols + 9, seed + 3);
    for level in Level::ALL.into_iter().map(Some).chain([None]) {
        if level.is_some_and(|level| !level.force()) {
            continue;
        }
        let mut out = before.clone();
        let job = Multiply {
            out: &mut out,
            left: &left,
            right: &right,
            base: &base,
            transposed,
            way,
            lower,
            rows: PhantomData::<R>,
        };
        if level.is_some() {
            dispatch(job)
        } else {
            dispatch_portable(job)
        }
        // Padding is compared too.
        let at = |m: &Matrices, i: usize, j: usize| m.at(0)[i * m.stride() + j];
        for i in 0..rows {
            for j in 0..out.stride() {
                if lower && j >= padded(i + 1) {
                    assert_eq!(at(&out, i, j), at(&before, i, j), "{level:?} {way:?} {i} {j}: as it was");
                    continue;
                }
                let sum: f64 = (0..inner)
                    .map(|k| at(&right, k, j) * if transposed { left.get(0, k, i) } else { left.get(0, i, k) })
                    .sum();
                let expected = match way {
                    Way::Set => sum,
                    Way::Add => at(&before, i, j) + sum,
                    Way::Subtract => at(&before, i, j) - sum,
                    Way::AddTo => at(&base, i, j) + sum,
                    Way::SubtractFrom => at(&base, i, j) - sum,
                };
                assert_eq!(at(&out, i, j), expected, "{level:?} {way:?} {i} {j}");
            }
        }
    }
}

proptest! {
    #[test]
    fn products_equal_plain_loops(
        rows in 0..27usize, inner in 0..19usize, cols in 1..35usize, seed in 0..100usize,
        transposed: bool, which in 0..5usize,
    ) {
        check_product((rows, inner, cols), seed, transposed, WAYS[which], false, Long);
        check_product((rows, inner, rows), seed, transposed, WAYS[which], true, Long);
        let (few, short) = (rows % LANES, inner % LANES);
        check_product((rows, inner, cols), seed, transposed, WAYS[which], false, Medium);
        check_product((rows, inner, rows), seed, transposed, WAYS[which], true, Medium);
        // Lower triangles of rows that are wider than the triangle.
        check_product((rows, inner, rows + cols), seed, transposed, WAYS[which], true, Long);
        check_product((rows, inner, rows + cols), seed, transposed, WAYS[which], true, Medium);
        check_product((few, short, cols % LANES + 1), seed, transposed, WAYS[which], false, Short);
        check_product((few, short, few.max(1)), seed, transposed, WAYS[which], true, Short);
    }

    /// A factor and the columns beside it, solved on both sides.
    #[test]
    fn factors_solve(n in 1..28usize, cols in 1..20usize, seed in 0..100usize) {
        check_solve(n, cols, seed, Long);
        check_solve(n, cols, seed, Medium);
        check_solve(n % LANES + 1, cols % LANES + 1, seed, Short);
    }

    #[test]
    fn dot_products(len in 0..40usize, seed in 0..100usize) {
        let (a, b) = (filled(1, len.max(1), seed), filled(1, len.max(1), seed + 5));
        let expected: f64 = (0..len).map(|i| a.get(0, 0, i) * b.get(0, 0, i)).sum();
        prop_assert_eq!(dot(&a.at(0)[..len], &b.at(0)[..len]), expected);
    }
}

/// `[A | B]` in whole lanes each, solved in place and with the factor elsewhere.
struct Solve<'a, R> {
    beside: &'a mut Matrices,
    others: [&'a mut Matrices; 2],
    n: usize,
    rows: PhantomData<R>,
}

impl<R: Rows> Job for Solve<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self) {
        let Self { beside, others: [once, twice], n, .. } = self;
        let (stride, first, mut reciprocals) = (beside.stride(), R::stride(n), [0.0; 32]);
        // No more numbers than are asked for.
        let reciprocals = &mut reciprocals[..first];
        factor::<L, R>(ViewMut::new(beside.at_mut(0), stride), n, stride, reciprocals).unwrap();
        let reciprocals = &*reciprocals;
        let upper = Factored { upper: View::new(beside.at(0), stride), reciprocals, n };
        let width = once.stride();
        solve_lower::<L, R>(upper, ViewMut::new(once.at_mut(0), width));
        solve_lower::<L, R>(upper, ViewMut::new(twice.at_mut(0), width));
        solve_upper::<L, R>(upper, ViewMut::new(twice.at_mut(0), width));
        let place = (first, stride - first);
        solve_upper_beside::<L, R>(ViewMut::new(beside.at_mut(0), stride), n, place, reciprocals);
    }
}

fn check_solve<R: Rows>(n: usize, cols: usize, seed: usize, _: R) {
    let (a, b, first) = (definite(n, seed), filled(n, cols, seed + 3), R::stride(n));
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        // Rows below the matrix are ignored.
        let mut beside = Matrices::zeros(1, n + LANES, first + cols);
        beside.as_mut_slice()[n * padded(first + cols)..].fill(5.0);
        for i in 0..n {
            (0..=i).for_each(|j| beside.set(0, i, j, a.get(0, i, j)));
            (0..cols).for_each(|j| beside.set(0, i, first + j, b.get(0, i, j)));
        }
        let (mut once, mut twice) = (b.clone(), b.clone());
        dispatch(Solve { beside: &mut beside, others: [&mut once, &mut twice], n, rows: PhantomData::<R> });
        assert!(beside.as_slice()[n * beside.stride()..].iter().all(|&v| v == 5.0), "{level:?} {n}");
        assert!((0..n).all(|i| (n..first).all(|j| beside.get(0, i, j) == 0.0)), "{level:?} {n}: padding");
        let size = a.as_slice().iter().fold(0.0f64, |most, v| most.max(v.abs()));
        for (i, j) in (0..n).flat_map(|i| (0..cols).map(move |j| (i, j))) {
            let product: f64 = (0..n).map(|k| a.get(0, i, k) * twice.get(0, k, j)).sum();
            assert!((product - b.get(0, i, j)).abs() < 1e-12 * size, "{level:?} {n} {i} {j}");
            assert!((beside.get(0, i, first + j) - twice.get(0, i, j)).abs() < 1e-12, "{level:?} {n} {i} {j}");
            let product: f64 = (0..=i).map(|k| beside.get(0, k, i) * once.get(0, k, j)).sum();
            assert!((product - b.get(0, i, j)).abs() < 1e-12 * size, "{level:?} {n} {i} {j}");
        }
        let mut lower = a.clone();
        let stride = lower.stride();
        cholesky(lower.at_mut(0), n, stride).unwrap();
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            assert!((lower.get(0, i, j) - beside.get(0, j, i)).abs() < 1e-12 * size, "{level:?} {n}");
        }
        let mut x: Vec<f64> = (0..n).map(|i| b.get(0, i, 0)).collect();
        solve_column(lower.at(0), stride, &mut x);
        assert!(x.iter().enumerate().all(|(i, x)| (x - twice.get(0, i, 0)).abs() < 1e-11), "{level:?} {n}");
    }
}

#[test]
fn scaled_rows_and_their_sums() {
    struct Scale<'a>(&'a Matrices, &'a Matrices, [&'a mut Matrices; 3], usize);
    impl Job for Scale<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(from, base, [set, add, to], count) = self;
            let rows = from.rows();
            let scaled = Scaled { from: View::new(from.at(0), from.stride()), factor: 3.0, rows, count };
            let stride = set.stride();
            scaled.set::<L, Long>(ViewMut::new(set.at_mut(0), stride));
            scaled.add::<L, Long>(ViewMut::new(add.at_mut(0), stride));
            scaled.add_to::<L, Long>(View::new(base.at(0), base.stride()), ViewMut::new(to.at_mut(0), stride));
        }
    }
    for count in [1, 7, 8, 13, 16, 20] {
        let (from, base, before) = (filled(5, 20, 1), filled(5, 33, 2), filled(5, 20, 3));
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            let [mut set, mut add, mut to] = [before.clone(), before.clone(), before.clone()];
            dispatch(Scale(&from, &base, [&mut set, &mut add, &mut to], count));
            for (i, j) in (0..5).flat_map(|i| (0..20).map(move |j| (i, j))) {
                let scaled = if j < count { 3.0 * from.get(0, i, j) } else { 0.0 };
                if j < padded(count) {
                    assert_eq!(set.get(0, i, j), scaled, "{level:?}");
                    assert_eq!(add.get(0, i, j), before.get(0, i, j) + scaled, "{level:?}");
                    assert_eq!(to.get(0, i, j), base.get(0, i, j) + scaled, "{level:?}");
                } else {
                    assert_eq!(set.get(0, i, j), before.get(0, i, j), "{level:?}");
                }
            }
        }
    }
}

#[test]
fn rows_are_combined_by_weights() {
    struct Weigh<'a, R>(&'a mut Matrices, Option<&'a [f64]>, &'a [f64], &'a Matrices, R);
    impl<R: Rows> Job for Weigh<'_, R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(out, base, weights, a, _) = self;
            combine::<L, R>(out.at_mut(0), base, -2.0, weights, View::new(a.at(0), a.stride()));
        }
    }
    for (rows, cols) in [(0, 3), (1, 8), (4, 13), (7, 40)] {
        let (a, base) = (filled(rows, cols, 1), filled(1, cols, 2));
        let weights: Vec<f64> = (0..rows).map(|k| k as f64 - 1.0).collect();
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            for base in [None, Some(base.at(0))] {
                let [mut out, mut copied] = [Matrices::vectors(1, cols), Matrices::vectors(1, cols)];
                dispatch(Weigh(&mut out, base, &weights, &a, Long));
                dispatch(Weigh(&mut copied, base, &weights, &a, Medium));
                for j in 0..cols {
                    let sum: f64 = (0..rows).map(|k| weights[k] * a.get(0, k, j)).sum();
                    assert_eq!(out.get(0, 0, j), base.map_or(0.0, |base| base[j]) - 2.0 * sum, "{level:?}");
                    assert_eq!(out.get(0, 0, j), copied.get(0, 0, j), "{level:?}");
                }
            }
        }
    }
}

#[test]
fn symmetry_and_transposes_at_every_level() {
    struct All<'a, R>(&'a mut [Matrices; 4], &'a mut Matrices, R);
    impl<R: Rows> Job for All<'_, R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self([mean, lower, upper, single], out, _) = self;
            let (n, stride) = (mean.rows(), mean.stride());
            transpose::<L, R>(ViewMut::new(out.at_mut(0), stride), View::new(mean.at(0), stride), n, n);
            symmetrise::<L, R>(ViewMut::new(mean.at_mut(0), stride), n);
            mirror::<L, R>(ViewMut::new(lower.at_mut(0), stride), n);
            mirror_upper::<L, R>(ViewMut::new(upper.at_mut(0), stride), n);
            mirror_single::<L, R>(ViewMut::new(single.at_mut(0), stride), n);
        }
    }
    for level in Level::ALL.into_iter().filter(|level| level.force()) {
        for (n, called) in [1, 2, 5, 8, 10, 13, 16, 24, 29].map(|n| [(n, true), (n, false)]).into_iter().flatten() {
            let (before, mut out) = (filled(n, n, 7), Matrices::zeros(1, n, n));
            let mut all = [before.clone(), before.clone(), before.clone(), before.clone()];
            // Simulates what a product leaves right of a lower triangle.
            all[1].as_mut_slice().iter_mut().filter(|entry| **entry == 0.0).for_each(|entry| *entry = 3.0);
            if called {
                dispatch(All(&mut all, &mut out, Long));
            } else {
                dispatch(All(&mut all, &mut out, Medium));
            }
            let [mean, lower, upper, single] = &all;
            for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
                let (here, there) = (before.get(0, i, j), before.get(0, j, i));
                let entry = |i: usize, j: usize| if before.get(0, i, j) == 0.0 { 3.0 } else { before.get(0, i, j) };
                assert_eq!(out.get(0, i, j), there, "{level:?}");
                assert_eq!(mean.get(0, i, j), 0.5 * (here + there), "{level:?}");
                assert_eq!(lower.get(0, i, j), entry(i.max(j), i.min(j)), "{level:?} {n} {i} {j}");
                assert_eq!(upper.get(0, i, j), before.get(0, i.min(j), i.max(j)), "{level:?}");
                assert_eq!(single.get(0, i, j), before.get(0, i.max(j), i.min(j)), "{level:?} {n} {i} {j}");
            }
            assert!(
                (0..n).all(|i| lower.at(0)[i * lower.stride() + n..(i + 1) * lower.stride()].iter().all(|&v| v == 0.0))
            );
        }
    }
}
