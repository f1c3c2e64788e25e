//! Covariances that rounding made indefinite.

use supple_lqg::dense::{Dense, dense, store};
use supple_lqg::{Matrices, mend};

use crate::random_problem::Random;

/// What rounding made indefinite becomes the nearest semidefinite matrix; all else stays to the last bit.
#[test]
fn covariances_are_mended_to_the_nearest_one() {
    let mut random = Random(17);
    for n in [1, 2, 3, 7, 31, 32, 33, 40] {
        for unit in [1.0, 1e-8, 1e6] {
            let root = random.matrix(n, n.div_ceil(3)) * unit;
            let mut list = Matrices::zeros(1, n, n);
            store(&mut list, 0, &(&root * root.transpose()));
            let (before, stride) = (list.clone(), list.stride());
            assert!(!mend(list.at_mut(0), n, stride), "{n} {unit}");
            assert_eq!(list.to_rows(), before.to_rows());
            let direction = random.matrix(n, 1) * unit;
            let indefinite = dense(&list, 0) - &direction * direction.transpose() * 0.5;
            store(&mut list, 0, &indefinite);
            let eigen = indefinite.clone().symmetric_eigen();
            if eigen.eigenvalues.min() > -1e-3 * unit * unit {
                continue;
            }
            assert!(mend(list.at_mut(0), n, stride), "{n} {unit}");
            let kept = Dense::from_diagonal(&eigen.eigenvalues.map(|v| v.max(0.0)));
            let nearest = &eigen.eigenvectors * kept * eigen.eigenvectors.transpose();
            let worst = (dense(&list, 0) - &nearest).amax();
            assert!(worst < 1e-13 * indefinite.norm(), "{n} {unit}: {worst:e}");
        }
    }
    // Around the threshold, as shares of the variance that is left over; and rows beside a variance of 0.
    let of = |entries: [f64; 4]| mend(&mut entries.clone(), 2, 2);
    for unit in [1.0, 1e-12, 1e12] {
        assert!(!of([unit, unit, unit, unit * (1.0 - 5e-14)]), "rounding");
        assert!(of([unit, unit, unit, unit * (1.0 - 1e-12)]), "no rounding");
        assert!(!of([4.0 * unit, 2.0 * unit, 2.0 * unit, unit]));
        assert!(!of([0.0, 0.0, 0.0, unit]) && !of([unit, 0.0, 0.0, 0.0]));
        assert!(of([0.0, 1e-6 * unit, 1e-6 * unit, unit]), "a state that is known is correlated with none");
        assert!(of([-unit, 0.0, 0.0, unit]) && of([unit, 0.0, 0.0, -unit]));
    }
}

/// Large matrices count as semidefinite up to 1e-13 of their greatest eigenvalue.
#[test]
fn large_covariances_are_mended_from_the_same_share_on() {
    for (unit, less, mended) in [(1.0, 1e-12, true), (1.0, 2.5e-13, false), (1e6, 1e-12, true), (1e-8, 2.5e-13, false)]
    {
        let mut list = Matrices::zeros(1, 40, 40);
        (0..40).for_each(|i| list.set(0, i, i, if i < 38 { 0.5 * unit } else { unit }));
        list.set(0, 39, 38, unit);
        list.set(0, 38, 39, unit);
        list.set(0, 39, 39, unit * (1.0 - less));
        let stride = list.stride();
        assert_eq!(mend(list.at_mut(0), 40, stride), mended, "{unit} {less}");
        // A state that is known exactly is no reason.
        let mut known = Matrices::zeros(1, 40, 40);
        (1..40).for_each(|i| known.set(0, i, i, unit));
        assert!(!mend(known.at_mut(0), 40, stride));
    }
}
