//! What holds for a whole process: the level of its instructions, and the request that long work end. Other tests choose
//! levels too, so these have a process of their own.
#![allow(clippy::unwrap_used)]

use supple_kernels::{Band, Job, Lanes, Level, dispatch, halt};

/// The lanes that work is done with.
struct Name;

impl Job for Name {
    type Output = &'static str;

    #[inline(always)]
    fn run<L: Lanes>(self) -> &'static str {
        std::any::type_name::<L>().rsplit("::").next().unwrap()
    }
}

#[cfg(target_arch = "x86_64")]
#[test]
fn levels_are_what_the_machine_has_and_the_best_is_used() {
    let has_avx2 = is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma");
    let has_avx512 = has_avx2
        && is_x86_feature_detected!("avx512f")
        && is_x86_feature_detected!("avx512dq")
        && is_x86_feature_detected!("avx512vl");
    let has = [true, has_avx2, has_avx512];
    assert_eq!(Level::ALL.map(Level::is_available), has);
    let best = Level::ALL.into_iter().zip(has).rfind(|(_, has)| *has).unwrap().0;
    assert_eq!((Level::current(), Level::current()), (best, best), "found, and remembered");
    for (level, (name, has)) in Level::ALL.into_iter().zip(["Sse2", "Avx2", "Avx512"].into_iter().zip(has)) {
        let before = Level::current();
        assert_eq!(level.force(), has);
        assert_eq!(Level::current(), if has { level } else { before });
        assert!(!has || dispatch(Name) == name, "{level:?}");
    }
}

#[test]
fn work_ends_when_that_is_requested() {
    let solve = || {
        let mut band = Band::zeros(&[1, 1]);
        for t in 0..2 {
            band.row_mut(t, 0).diagonal[0] = 4.0;
            band.row_mut(t, 0).right[0] = 2.0;
        }
        let mut out = [vec![], vec![]];
        band.solve(&mut out).map(|()| out[0].concat())
    };
    assert_eq!(solve(), Ok(vec![0.5, 0.5]));
    halt::request(true);
    assert!(halt::is_requested());
    assert_eq!(solve(), Err(0), "the block that was next");
    halt::request(false);
    assert!(!halt::is_requested());
    assert_eq!(solve(), Ok(vec![0.5, 0.5]));
}
