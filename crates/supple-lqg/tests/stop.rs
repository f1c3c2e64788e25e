//! A stop ends bounds of large systems within moments, wherever they are.
#![allow(clippy::unwrap_used)]

use std::time::{Duration, Instant};

use nalgebra::DMatrix;
use supple_kernels::halt;
use supple_lqg::bound::{BoundSettings, Stationary, regulator_distance, stationary_minimum};
use supple_lqg::dense::store;
use supple_lqg::{Error, Matrices};

fn matrices(a: &DMatrix<f64>) -> Matrices {
    let mut out = Matrices::constant(a.nrows(), a.ncols());
    store(&mut out, 0, a);
    out
}

#[test]
fn a_stop_ends_bounds_of_large_systems_at_once() {
    // A chain of modes, each of which drives the next.
    let n = 48;
    let a = DMatrix::from_fn(n, n, |i, j| if i == j { 0.71 } else { f64::from(u8::from(j + 1 == i)) });
    let mut f = a.resize(n, 2 * n, 0.0);
    f.columns_mut(n, n).copy_from(&DMatrix::identity(n, n));
    let (f, w) = (matrices(&f), matrices(&DMatrix::identity(n, n)));
    let l = matrices(&(DMatrix::identity(2 * n, 2 * n) * 2.0));
    let system = Stationary::new(&f, &w, &l).unwrap();
    let cost = 1.2 * system.base_cost;
    for after in [0, 200, 1500, 4000] {
        let (began, asked) = (Instant::now(), Duration::from_millis(after));
        let watch = std::thread::spawn(move || {
            std::thread::sleep(asked);
            halt::request(true);
        });
        let proof = regulator_distance(&system, &f, &l);
        let found = stationary_minimum(&system, cost, &BoundSettings::default());
        let took = began.elapsed();
        watch.join().unwrap();
        halt::request(false);
        if took < asked {
            continue;
        }
        assert!(took - asked < Duration::from_secs(2), "{after} ms: {took:?}");
        assert!(matches!(found, Err(Error::Stopped)), "{after} ms: {:?}", found.map(|found| found.nats));
        assert!(after > 0 || proof.is_err());
    }
}
