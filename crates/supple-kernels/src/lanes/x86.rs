//! Lanes in vector registers of x86-64.

use std::arch::x86_64::*;

use super::*;
use crate::fused::Fused;

/// Eight numbers in `PARTS` vector registers.
macro_rules! lanes {
    ($(#[$doc:meta])* $name:ident, $register:ty, $parts:literal, $width:literal, {
        $add:ident $sub:ident $mul:ident $div:ident $sqrt:ident $splat:ident $load:ident $store:ident
    }, $(instructions: $instructions:literal,)? single: $single:ty, fma: $fma:expr, negative_fma: $negative_fma:expr, $(transpose: $transpose:ident, followed_by: $followed_by:ident,)? $(transpose_four: $four:ident,)? negate: $negate:expr, select: $select:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $name([$register; $parts]);

        lanes!(@operator $name, Add, add, $add);
        lanes!(@operator $name, Sub, sub, $sub);
        lanes!(@operator $name, Mul, mul, $mul);
        lanes!(@operator $name, Div, div, $div);

        impl Neg for $name {
            type Output = Self;
            #[inline(always)]
            fn neg(self) -> Self {
                // SAFETY: values of this type are made only where `dispatch` found the instructions.
                lanes!(@each self, i => unsafe { $negate(self.0[i]) })
            }
        }

        common!($name);

        impl Lanes for $name {
            type Single = $single;
            const WIDE: bool = $parts == 1;
            #[inline(always)]
            fn apart<J: Job>(job: J) -> J::Output {
                $(#[target_feature(enable = $instructions)])?
                unsafe fn run<J: Job>(job: J) -> J::Output {
                    job.run::<$name>()
                }
                // Compilers heed `inline(never)` only on functions without target features, and do not inline those with
                // target features into functions without.
                #[inline(never)]
                fn alone<J: Job>(job: J) -> J::Output {
                    // SAFETY: instructions as in `neg`.
                    unsafe { run(job) }
                }
                alone(job)
            }
            #[inline(always)]
            fn from_array(values: [f64; LANES]) -> Self {
                // SAFETY: the array holds eight numbers.
                unsafe { Self::load(values.as_ptr()) }
            }
            #[inline(always)]
            fn to_array(self) -> [f64; LANES] {
                let mut values = [0.0; LANES];
                // SAFETY: the array holds eight numbers.
                unsafe { self.store(values.as_mut_ptr()) };
                values
            }
            #[inline(always)]
            fn neg_mul_add(self, factor: Self, term: Self) -> Self {
                // SAFETY: instructions as in `neg`.
                lanes!(@each self, i => unsafe { $negative_fma(self.0[i], factor.0[i], term.0[i]) })
            }
            #[inline(always)]
            unsafe fn load(from: *const f64) -> Self {
                let mut parts = Self::constant(0.0);
                for i in 0..$parts {
                    // SAFETY: the caller's, and instructions as in `neg`.
                    parts.0[i] = unsafe { $load(from.add($width * i)) };
                }
                parts
            }
            $(#[inline(always)]
            unsafe fn transpose_four(from: (*const f64, usize), to: (*mut f64, usize)) {
                // SAFETY: the caller's, and instructions as in `neg`.
                unsafe { $four(from, to) }
            })?
            $(#[inline(always)]
            fn transposed(rows: [Self; LANES]) -> [Self; LANES] {
                // SAFETY: instructions as in `neg`.
                unsafe { $transpose(rows) }
            }
            #[inline(always)]
            fn followed_by(self, rest: Self, count: usize) -> Self {
                // SAFETY: instructions as in `neg`.
                unsafe { $followed_by(self, rest, count) }
            })?
            #[inline(always)]
            unsafe fn store(self, to: *mut f64) {
                for i in 0..$parts {
                    // SAFETY: the caller's, and instructions as in `neg`.
                    unsafe { $store(to.add($width * i), self.0[i]) };
                }
            }
        }

        impl Scalar for $name {
            #[inline(always)]
            fn constant(value: f64) -> Self {
                // SAFETY: instructions as in `neg`.
                Self([unsafe { $splat(value) }; $parts])
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                // SAFETY: instructions as in `neg`.
                lanes!(@each self, i => unsafe { $fma(self.0[i], factor.0[i], term.0[i]) })
            }
            #[inline(always)]
            fn recip(self) -> Self {
                Self::constant(1.0) / self
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                // SAFETY: instructions as in `neg`.
                lanes!(@each self, i => unsafe { $sqrt(self.0[i]) })
            }
            #[inline(always)]
            fn sin_cos(self) -> (Self, Self) {
                lane_sin_cos(self)
            }
            #[inline(always)]
            fn exp(self) -> Self {
                Self::from_array(self.to_array().map(math::exp))
            }
            #[inline(always)]
            fn ln(self) -> Self {
                Self::from_array(self.to_array().map(math::ln))
            }
            #[inline(always)]
            fn tanh(self) -> Self {
                Self::from_array(self.to_array().map(math::tanh))
            }
            #[inline(always)]
            fn exp_m1(self) -> Self {
                Self::from_array(self.to_array().map(math::exp_m1))
            }
            #[inline(always)]
            fn ln_1p(self) -> Self {
                Self::from_array(self.to_array().map(math::ln_1p))
            }
            #[inline(always)]
            fn atan2(self, x: Self) -> Self {
                let (mut y, x) = (self.to_array(), x.to_array());
                for i in 0..LANES {
                    y[i] = math::atan2(y[i], x[i]);
                }
                Self::from_array(y)
            }
            #[inline(always)]
            fn select(self, positive: Self, otherwise: Self) -> Self {
                // SAFETY: instructions as in `neg`.
                lanes!(@each self, i => unsafe { $select(self.0[i], positive.0[i], otherwise.0[i]) })
            }
        }
    };
    // A loop, not a closure: a closure does not inherit the instructions of run-time dispatch.
    (@each $self:ident, $i:ident => $part:expr) => {{
        let mut parts = $self;
        #[allow(clippy::needless_range_loop)]
        for $i in 0..$self.0.len() {
            parts.0[$i] = $part;
        }
        parts
    }};
    (@operator $name:ident, $trait:ident, $method:ident, $intrinsic:ident) => {
        impl $trait for $name {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                // SAFETY: values of this type are made only where `dispatch` found the instructions.
                lanes!(@each self, i => unsafe { $intrinsic(self.0[i], other.0[i]) })
            }
        }
    };
}

#[inline(always)]
unsafe fn fma_sse2(a: __m128d, b: __m128d, c: __m128d) -> __m128d {
    // SAFETY: SSE2 is part of every x86-64.
    unsafe { _mm_add_pd(_mm_mul_pd(a, b), c) }
}
#[inline(always)]
unsafe fn negative_fma_sse2(a: __m128d, b: __m128d, c: __m128d) -> __m128d {
    // SAFETY: as above.
    unsafe { _mm_sub_pd(c, _mm_mul_pd(a, b)) }
}
#[inline(always)]
unsafe fn negate_sse2(v: __m128d) -> __m128d {
    // SAFETY: as above.
    unsafe { _mm_xor_pd(v, _mm_set1_pd(-0.0)) }
}
#[inline(always)]
unsafe fn select_sse2(condition: __m128d, positive: __m128d, otherwise: __m128d) -> __m128d {
    // SAFETY: as above.
    unsafe {
        let mask = _mm_cmpgt_pd(condition, _mm_setzero_pd());
        _mm_or_pd(_mm_and_pd(mask, positive), _mm_andnot_pd(mask, otherwise))
    }
}
#[inline(always)]
unsafe fn negate_avx(v: __m256d) -> __m256d {
    // SAFETY: the caller's level has AVX.
    unsafe { _mm256_xor_pd(v, _mm256_set1_pd(-0.0)) }
}
#[inline(always)]
unsafe fn select_avx(condition: __m256d, positive: __m256d, otherwise: __m256d) -> __m256d {
    // SAFETY: the caller's level has AVX.
    unsafe {
        let mask = _mm256_cmp_pd::<_CMP_GT_OQ>(condition, _mm256_setzero_pd());
        _mm256_blendv_pd(otherwise, positive, mask)
    }
}
#[inline(always)]
unsafe fn negate_avx512(v: __m512d) -> __m512d {
    // SAFETY: the caller's level has AVX-512 DQ.
    unsafe { _mm512_xor_pd(v, _mm512_set1_pd(-0.0)) }
}
#[inline(always)]
unsafe fn select_avx512(condition: __m512d, positive: __m512d, otherwise: __m512d) -> __m512d {
    // SAFETY: the caller's level has AVX-512 F.
    unsafe {
        let mask = _mm512_cmp_pd_mask::<_CMP_GT_OQ>(condition, _mm512_setzero_pd());
        _mm512_mask_blend_pd(mask, otherwise, positive)
    }
}

/// Pairs of neighbours first, then halves.
#[inline(always)]
unsafe fn transpose_four_avx((from, from_stride): (*const f64, usize), (to, to_stride): (*mut f64, usize)) {
    // SAFETY: the caller's level has AVX, and its numbers exist.
    unsafe {
        let (a, b) = (_mm256_loadu_pd(from), _mm256_loadu_pd(from.add(from_stride)));
        let (c, d) = (_mm256_loadu_pd(from.add(2 * from_stride)), _mm256_loadu_pd(from.add(3 * from_stride)));
        let (ab0, ab1) = (_mm256_unpacklo_pd(a, b), _mm256_unpackhi_pd(a, b));
        let (cd0, cd1) = (_mm256_unpacklo_pd(c, d), _mm256_unpackhi_pd(c, d));
        _mm256_storeu_pd(to, _mm256_permute2f128_pd::<0x20>(ab0, cd0));
        _mm256_storeu_pd(to.add(to_stride), _mm256_permute2f128_pd::<0x20>(ab1, cd1));
        _mm256_storeu_pd(to.add(2 * to_stride), _mm256_permute2f128_pd::<0x31>(ab0, cd0));
        _mm256_storeu_pd(to.add(3 * to_stride), _mm256_permute2f128_pd::<0x31>(ab1, cd1));
    }
}

#[inline(always)]
unsafe fn followed_by_avx512(v: Avx512, rest: Avx512, count: usize) -> Avx512 {
    let ([v], [rest], mask) = (v.0, rest.0, (1_u32 << count.min(LANES)) - 1);
    // SAFETY: the caller's level has AVX-512 F.
    unsafe { Avx512([_mm512_mask_blend_pd(mask as u8, rest, v)]) }
}

/// Pairs of neighbours first, then pairs of pairs, then halves.
#[inline(always)]
unsafe fn transpose_avx512(rows: [Avx512; LANES]) -> [Avx512; LANES] {
    let [[a], [b], [c], [d], [e], [f], [g], [h]] = rows.map(|row| row.0);
    // SAFETY: the caller's level has AVX-512 F.
    unsafe {
        let (ab0, ab1) = (_mm512_unpacklo_pd(a, b), _mm512_unpackhi_pd(a, b));
        let (cd0, cd1) = (_mm512_unpacklo_pd(c, d), _mm512_unpackhi_pd(c, d));
        let (ef0, ef1) = (_mm512_unpacklo_pd(e, f), _mm512_unpackhi_pd(e, f));
        let (gh0, gh1) = (_mm512_unpacklo_pd(g, h), _mm512_unpackhi_pd(g, h));
        // Lanes of 128 bits: (0, 2) and (1, 3) of both operands.
        let (p0, p1) = (_mm512_shuffle_f64x2::<0x88>(ab0, cd0), _mm512_shuffle_f64x2::<0x88>(ab1, cd1));
        let (p2, p3) = (_mm512_shuffle_f64x2::<0xdd>(ab0, cd0), _mm512_shuffle_f64x2::<0xdd>(ab1, cd1));
        let (q0, q1) = (_mm512_shuffle_f64x2::<0x88>(ef0, gh0), _mm512_shuffle_f64x2::<0x88>(ef1, gh1));
        let (q2, q3) = (_mm512_shuffle_f64x2::<0xdd>(ef0, gh0), _mm512_shuffle_f64x2::<0xdd>(ef1, gh1));
        [
            Avx512([_mm512_shuffle_f64x2::<0x88>(p0, q0)]),
            Avx512([_mm512_shuffle_f64x2::<0x88>(p1, q1)]),
            Avx512([_mm512_shuffle_f64x2::<0x88>(p2, q2)]),
            Avx512([_mm512_shuffle_f64x2::<0x88>(p3, q3)]),
            Avx512([_mm512_shuffle_f64x2::<0xdd>(p0, q0)]),
            Avx512([_mm512_shuffle_f64x2::<0xdd>(p1, q1)]),
            Avx512([_mm512_shuffle_f64x2::<0xdd>(p2, q2)]),
            Avx512([_mm512_shuffle_f64x2::<0xdd>(p3, q3)]),
        ]
    }
}

lanes!(
    /// Eight numbers in four SSE2 registers, without fused multiply-add.
    Sse2, __m128d, 4, 2,
    { _mm_add_pd _mm_sub_pd _mm_mul_pd _mm_div_pd _mm_sqrt_pd _mm_set1_pd _mm_loadu_pd _mm_storeu_pd },
    single: f64, fma: fma_sse2, negative_fma: negative_fma_sse2, negate: negate_sse2, select: select_sse2
);
lanes!(
    /// Eight numbers in two AVX2 registers, with fused multiply-add.
    Avx2, __m256d, 2, 4,
    { _mm256_add_pd _mm256_sub_pd _mm256_mul_pd _mm256_div_pd _mm256_sqrt_pd _mm256_set1_pd _mm256_loadu_pd _mm256_storeu_pd },
    instructions: "avx2,fma", single: Fused, fma: _mm256_fmadd_pd, negative_fma: _mm256_fnmadd_pd,
    transpose_four: transpose_four_avx, negate: negate_avx, select: select_avx
);
lanes!(
    /// Eight numbers in one AVX-512 register, with fused multiply-add.
    Avx512, __m512d, 1, 8,
    { _mm512_add_pd _mm512_sub_pd _mm512_mul_pd _mm512_div_pd _mm512_sqrt_pd _mm512_set1_pd _mm512_loadu_pd _mm512_storeu_pd },
    instructions: "avx2,fma,avx512f,avx512dq,avx512vl", single: Fused, fma: _mm512_fmadd_pd, negative_fma: _mm512_fnmadd_pd,
    transpose: transpose_avx512, followed_by: followed_by_avx512, negate: negate_avx512, select: select_avx512
);
