use std::sync::atomic::{AtomicU8, Ordering};

#[cfg(target_arch = "x86_64")]
use crate::lanes::x86::{Avx2, Avx512, Sse2};
use crate::lanes::{Job, Lanes, Portable};

/// A set of vector instructions.
///
/// ```
/// use supple_kernels::Level;
///
/// assert!(Level::current().is_available());
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
#[repr(u8)]
#[non_exhaustive]
pub enum Level {
    /// Available on every machine: SSE2 on x86-64, plain arrays elsewhere. No fused multiply-add.
    Baseline = 1,
    /// AVX2 and fused multiply-add.
    Avx2 = 2,
    /// AVX-512 (F, DQ and VL).
    Avx512 = 3,
}

static CHOSEN: AtomicU8 = AtomicU8::new(0);

impl Level {
    /// Every level, from the least to the most.
    pub const ALL: [Self; 3] = [Self::Baseline, Self::Avx2, Self::Avx512];

    /// Whether this machine has the level's instructions.
    #[must_use]
    pub fn is_available(self) -> bool {
        match self {
            Self::Baseline => true,
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => is_x86_feature_detected!("avx2") && is_x86_feature_detected!("fma"),
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                Self::Avx2.is_available()
                    && is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
            }
            #[cfg(not(target_arch = "x86_64"))]
            _ => false,
        }
    }

    /// The level in use: the machine's best, unless [`Level::force`] chose another.
    #[inline]
    pub fn current() -> Self {
        match CHOSEN.load(Ordering::Relaxed) {
            1 => Self::Baseline,
            2 => Self::Avx2,
            3 => Self::Avx512,
            _ => Self::detect(),
        }
    }

    #[cold]
    fn detect() -> Self {
        let best = Self::ALL.into_iter().rev().find(|level| level.is_available()).unwrap_or(Self::Baseline);
        CHOSEN.store(best as u8, Ordering::Relaxed);
        best
    }

    /// Uses this level from now on, in the whole process; returns false, and changes nothing, if the machine lacks it.
    ///
    /// Levels differ by rounding (fused multiply-add). `Baseline` gives the same bits on every x86-64.
    pub fn force(self) -> bool {
        let available = self.is_available();
        if available {
            CHOSEN.store(self as u8, Ordering::Relaxed);
        }
        available
    }
}

/// Runs `job` with the instructions of [`Level::current`]: one branch per call.
///
/// This is the only source of lanes: only jobs that run here use the lanes of a level, on a machine that has its
/// instructions.
///
/// ```
/// use supple_kernels::{Job, LANES, Lanes, Scalar, dispatch};
///
/// /// The roots of eight numbers.
/// struct Roots<'a>(&'a mut [f64; LANES]);
///
/// impl Job for Roots<'_> {
///     type Output = ();
///
///     #[inline(always)]
///     fn run<L: Lanes>(self) {
///         let Self(numbers) = self;
///         *numbers = Scalar::sqrt(L::from_array(*numbers)).to_array();
///     }
/// }
///
/// let mut numbers = [2.25; LANES];
/// dispatch(Roots(&mut numbers));
/// assert_eq!(numbers, [1.5; LANES]);
/// ```
#[inline]
pub fn dispatch<J: Job>(job: J) -> J::Output {
    match Level::current() {
        #[cfg(target_arch = "x86_64")]
        Level::Baseline => Sse2::apart(job),
        #[cfg(target_arch = "x86_64")]
        Level::Avx2 => Avx2::apart(job),
        #[cfg(target_arch = "x86_64")]
        Level::Avx512 => Avx512::apart(job),
        #[cfg(not(target_arch = "x86_64"))]
        _ => Portable::apart(job),
    }
}

/// Runs `job` on plain arrays: the reference that every level is compared with.
///
/// Example: [`dispatch`].
pub fn dispatch_portable<J: Job>(job: J) -> J::Output {
    job.run::<Portable>()
}
