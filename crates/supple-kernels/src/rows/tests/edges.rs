//! Edge cases of sizes, pivots and lengths, and inputs that must be rejected.

use super::*;

#[test]
fn the_minor_that_fails_is_named() {
    struct Fail<R>(usize, R);
    impl<R: Rows> Job for Fail<R> {
        type Output = Result<(), usize>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let mut a = definite(self.0, 4);
            a.set(0, self.0 - 1, self.0 - 1, -1.0);
            let stride = a.stride();
            factor::<L, R>(ViewMut::new(a.at_mut(0), stride), self.0, stride, &mut [0.0; 32])
        }
    }
    for n in [2, 8, 9, 21] {
        at_every_level(|| Fail(n, Long), |level, found| assert_eq!(found, Err(n - 1), "{level:?}"));
        let mut a = definite(n, 4);
        a.set(0, n - 1, n - 1, f64::NAN);
        let stride = a.stride();
        assert_eq!(cholesky(a.at_mut(0), n, stride), Err(n - 1));
    }
    at_every_level(|| Fail(3, Medium), |level, found| assert_eq!(found, Err(2), "{level:?}"));
    at_every_level(|| Fail(3, Short), |level, found| assert_eq!(found, Err(2), "{level:?}"));
}

/// Neither a pivot of 0 nor one that is infinite is positive, by rows, by entries or in blocks.
#[test]
fn pivots_at_the_edges_are_refused() {
    struct Edge<R>(usize, f64, R);
    impl<R: Rows> Job for Edge<R> {
        type Output = Result<(), usize>;

        #[inline(always)]
        fn run<L: Lanes>(self) -> Self::Output {
            let (mut a, stride) = (unit_with_last(self.0, self.1), R::stride(self.0));
            factor::<L, R>(ViewMut::new(a.at_mut(0), stride), self.0, stride, &mut [0.0; 32])
        }
    }
    fn unit_with_last(n: usize, last: f64) -> Matrices {
        let mut a = Matrices::zeros(1, n, n);
        (0..n).for_each(|i| a.set(0, i, i, if i + 1 == n { last } else { 1.0 }));
        a
    }
    for (last, n) in [0.0, -0.0, f64::INFINITY, f64::NAN].into_iter().flat_map(|last| [1, 4, 8, 13].map(|n| (last, n)))
    {
        at_every_level(|| Edge(n, last, Long), |level, found| assert_eq!(found, Err(n - 1), "{level:?} {last}"));
        at_every_level(|| Edge(n, last, Medium), |level, found| assert_eq!(found, Err(n - 1), "{level:?} {last}"));
        let mut a = unit_with_last(n, last);
        let stride = a.stride();
        assert_eq!(cholesky(a.at_mut(0), n, stride), Err(n - 1));
    }
    at_every_level(|| Edge(4, 0.0, Short), |level, found| assert_eq!(found, Err(3), "{level:?}"));
    at_every_level(|| Edge(4, 1e-300, Short), |level, found| assert_eq!(found, Ok(()), "{level:?}"));
}

/// Rows that are not padded, and determinants.
#[test]
fn matrices_without_padding_are_factored() {
    for n in [0usize, 1, 2, 7, 8, 9, 13, 16, 24] {
        let (a, determinant) = (definite(n, 5), |factor: &[f64], stride| log_determinant(factor, n, stride));
        let mut tight: Vec<f64> = (0..n * n).map(|k| a.get(0, k / n, k % n)).collect();
        cholesky(&mut tight, n, n).unwrap();
        for (i, j) in (0..n).flat_map(|i| (0..=i).map(move |j| (i, j))) {
            let product: f64 = (0..=j).map(|k| tight[i * n + k] * tight[j * n + k]).sum();
            assert!((product - a.get(0, i, j)).abs() < 1e-12 * a.get(0, i, i).max(a.get(0, j, j)), "{n} {i} {j}");
        }
        let mut wide = a.clone();
        cholesky(wide.at_mut(0), n, a.stride()).unwrap();
        let (one, other) = (determinant(&tight, n), determinant(wide.at(0), a.stride()));
        assert!((one - other).abs() < 1e-11, "{n}");
        // Against elimination.
        let mut rest: Vec<Vec<f64>> = (0..n).map(|i| (0..n).map(|j| a.get(0, i, j)).collect()).collect();
        let mut expected = 0.0;
        for k in 0..n {
            expected += rest[k][k].ln();
            for i in k + 1..n {
                let factor = rest[i][k] / rest[k][k];
                (k..n).for_each(|j| rest[i][j] -= factor * rest[k][j]);
            }
        }
        assert!((one - expected).abs() < 1e-11, "{n}: {one} {expected}");
    }
}

#[test]
fn lower_factors_solve_beside_themselves() {
    struct Beside<'a, R>(&'a mut Matrices, &'a mut Matrices, usize, R);
    impl<R: Rows> Job for Beside<'_, R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(matrix, other, n, _) = self;
            let (stride, first, mut reciprocals) = (matrix.stride(), R::stride(n), [0.0; 32]);
            factor::<L, R>(ViewMut::new(matrix.at_mut(0), stride), n, first, &mut reciprocals).unwrap();
            let upper = Factored { upper: View::new(matrix.at(0), stride), reciprocals: &reciprocals, n };
            let width = other.stride();
            solve_lower::<L, R>(upper, ViewMut::new(other.at_mut(0), width));
            let rows = ViewMut::new(matrix.at_mut(0), stride);
            solve_lower_beside::<L, R>(rows, n, (first, stride - first), &reciprocals);
        }
    }
    fn check<R: Rows>(n: usize, cols: usize, kind: R) {
        let (a, b, first) = (definite(n, 3), filled(n, cols, 8), R::stride(n));
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            let (mut matrix, mut other) = (Matrices::zeros(1, n, first + cols), b.clone());
            for i in 0..n {
                (0..=i).for_each(|j| matrix.set(0, i, j, a.get(0, i, j)));
                (0..cols).for_each(|j| matrix.set(0, i, first + j, b.get(0, i, j)));
            }
            // First compute the factor of the matrix alone: the columns beside it do not matter there.
            dispatch(Beside(&mut matrix, &mut other, n, kind));
            for (i, j) in (0..n).flat_map(|i| (0..cols).map(move |j| (i, j))) {
                assert!((matrix.get(0, i, first + j) - other.get(0, i, j)).abs() < 1e-13, "{level:?} {n} {i} {j}");
            }
            assert!(other != b);
        }
    }
    for (n, cols) in [(1, 1), (4, 9), (8, 3), (13, 16), (21, 17)] {
        check(n, cols, Long);
        check(n, cols, Medium);
    }
}

#[test]
fn rows_of_any_length_are_scaled_added_and_cleared() {
    struct Rowwise<'a>(&'a mut [f64], &'a mut [f64], &'a [f64]);
    impl Job for Rowwise<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            add_scaled::<L>(self.0, 3.0, self.2);
            scale::<L>(self.1, -2.0);
        }
    }
    for (len, other) in (0..27).flat_map(|len| [len, len / 2, len + 5].map(|other| (len, other))) {
        let row: Vec<f64> = (0..other).map(|i| i as f64 - 4.0).collect();
        let before: Vec<f64> = (0..len).map(|i| 0.5 * i as f64 + 1.0).collect();
        let added = before.iter().enumerate().map(|(i, v)| v + row.get(i).map_or(0.0, |r| 3.0 * r));
        let (added, scaled): (Vec<f64>, Vec<f64>) = (added.collect(), before.iter().map(|v| -2.0 * v).collect());
        for level in Level::ALL.into_iter().map(Some).chain([None]) {
            let (mut out, mut times) = (before.clone(), before.clone());
            let job = Rowwise(&mut out, &mut times, &row);
            match level {
                Some(level) if !level.force() => continue,
                Some(_) => dispatch(job),
                None => dispatch_portable(job),
            }
            assert_eq!((&out, &times), (&added, &scaled), "{level:?} {len} {other}");
        }
    }
    struct Clear<'a>(&'a mut [f64], usize);
    impl Job for Clear<'_> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            clear_beyond::<L>(self.0, self.1);
        }
    }
    for (width, count) in [0, 8, 24].into_iter().flat_map(|width| (0..=width).map(move |count| (width, count))) {
        let before: Vec<f64> = (0..width).map(|i| i as f64 + 1.0).collect();
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            let mut row = before.clone();
            dispatch(Clear(&mut row, count));
            assert_eq!(row[..count], before[..count], "{level:?}");
            assert!(row[count..].iter().all(|&v| v == 0.0), "{level:?} {count}");
        }
    }
}

#[test]
fn matrices_without_rows_or_columns_have_transposes() {
    struct Empty<R>(usize, usize, R);
    impl<R: Rows> Job for Empty<R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            transpose::<L, R>(ViewMut::new(&mut [], 8), View::new(&[], 8), self.0, self.1);
            symmetrise::<L, R>(ViewMut::new(&mut [], 8), 0);
            mirror::<L, R>(ViewMut::new(&mut [], 8), 0);
            mirror_upper::<L, R>(ViewMut::new(&mut [], 8), 0);
        }
    }
    for (rows, cols) in [(0, 0), (0, 3), (3, 0), (17, 0)] {
        at_every_level(|| Empty(rows, cols, Long), |_, ()| {});
        at_every_level(|| Empty(rows, cols, Medium), |_, ()| {});
    }
}

#[test]
fn transposes_of_oblong_matrices() {
    struct Turn<'a, R>(&'a mut Matrices, &'a Matrices, R);
    impl<R: Rows> Job for Turn<'_, R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(out, a, _) = self;
            let stride = out.stride();
            transpose::<L, R>(ViewMut::new(out.at_mut(0), stride), View::new(a.at(0), a.stride()), a.rows(), a.cols());
        }
    }
    for (rows, cols) in [(1, 5), (8, 3), (3, 8), (16, 9), (11, 25)] {
        let a = filled(rows, cols, 6);
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            let [mut long, mut medium] = [Matrices::zeros(1, cols, rows), Matrices::zeros(1, cols, rows)];
            dispatch(Turn(&mut long, &a, Long));
            dispatch(Turn(&mut medium, &a, Medium));
            for (i, j) in (0..rows).flat_map(|i| (0..cols).map(move |j| (i, j))) {
                assert_eq!((long.get(0, j, i), medium.get(0, j, i)), (a.get(0, i, j), a.get(0, i, j)), "{level:?}");
            }
        }
    }
}

/// Kernels write through pointers: arguments too short for the requested operation must be rejected.
#[test]
fn numbers_that_are_not_there_are_refused() {
    /// A product of 3 x 5 and 5 x 16, a scaled matrix of 3 x 16, or a solve of order 3, with buffers of these lengths.
    struct Short16<R>(usize, [usize; 4], R);
    impl<R: Rows> Job for Short16<R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(which, [left, right, base, out], _) = self;
            let (left, right, base, mut out) = (vec![1.0; left], vec![1.0; right], vec![1.0; base], vec![1.0; out]);
            let (base, out) = (View::new(&base, 16), ViewMut::new(&mut out, 16));
            let product =
                Product { left: Left::plain(&left, 8), right: View::new(&right, 16), rows: 3, inner: 5, width: 16 };
            match which {
                0 => product.add_to::<L, R>(base, out),
                1 => product.lower().subtract_from::<L, R>(base, out),
                2 => {
                    Scaled { from: View::new(&right, 16), factor: 2.0, rows: 3, count: 9 }.add_to::<L, R>(base, out);
                }
                _ => {
                    let upper = Factored { upper: View::new(&left, 8), reciprocals: &right, n: 3 };
                    solve_lower::<L, R>(upper, out);
                }
            }
        }
    }
    let needed = [[2 * 8 + 5, 80, 48, 48], [2 * 8 + 5, 80, 48, 48], [0, 48, 48, 48], [24, 8, 0, 48]];
    for (which, needed) in needed.into_iter().enumerate() {
        at_every_level(|| Short16(which, needed, Long), |_, ()| {});
        at_every_level(|| Short16(which, needed, Medium), |_, ()| {});
        for missing in (0..4).filter(|&k| needed[k] > 0) {
            let mut given = needed;
            given[missing] -= 1;
            let refused = std::panic::catch_unwind(|| dispatch(Short16(which, given, Long))).is_err()
                && std::panic::catch_unwind(|| dispatch(Short16(which, given, Medium))).is_err();
            assert!(refused, "{which} {missing}");
        }
    }
    // A lower triangle of 17 rows needs more than 16 columns, and rows are whole lanes.
    struct Narrow(usize, usize);
    impl Job for Narrow {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let (numbers, mut out) = (vec![1.0; 17 * 24], vec![0.0; 17 * 24]);
            let (left, right) = (Left::plain(&numbers, 24), View::new(&numbers, 24));
            let product = Product { left, right, rows: self.0, inner: 3, width: self.1 };
            product.lower().set::<L, Long>(ViewMut::new(&mut out, 24));
        }
    }
    for ((rows, width), refused) in [((16, 16), false), ((17, 24), false), ((17, 16), true), ((4, 12), true)] {
        assert_eq!(std::panic::catch_unwind(|| dispatch(Narrow(rows, width))).is_err(), refused, "{rows} {width}");
    }
}

#[test]
fn products_without_rows_columns_or_terms() {
    struct Degenerate<'a, R>(&'a mut [f64], [usize; 3], R);
    impl<R: Rows> Job for Degenerate<'_, R> {
        type Output = ();

        #[inline(always)]
        fn run<L: Lanes>(self) {
            let Self(out, [rows, inner, width], _) = self;
            let numbers = [1.0; 24];
            let (left, right) = (Left::transposed(&numbers, 8), View::new(&numbers, 8));
            Product { left, right, rows, inner, width }.set::<L, R>(ViewMut::new(out, 8));
        }
    }
    for (sizes, written) in [([0, 3, 8], 0), ([2, 3, 0], 0), ([0, 0, 0], 0), ([2, 0, 8], 16)] {
        for level in Level::ALL.into_iter().filter(|level| level.force()) {
            let mut all = [[-7.0; 24]; 3];
            let [short, medium, long] = &mut all;
            dispatch(Degenerate(short, sizes, Short));
            dispatch(Degenerate(medium, sizes, Medium));
            dispatch(Degenerate(long, sizes, Long));
            for out in all {
                assert!(out[..written].iter().all(|&v| v == 0.0), "{level:?} {sizes:?}: sums of no terms");
                assert!(out[written..].iter().all(|&v| v == -7.0), "{level:?} {sizes:?}");
            }
        }
    }
}
