//! Softplus and its derivative, in SIMD.

use pulp::Simd;

/// e^r on [−½ ln 2, ½ ln 2], to 2·10⁻⁸ (interpolation at Chebyshev points), from the highest power.
const EXP: [f32; 7] = [0.001_394_111_9, 0.008_375_134, 0.041_666_35, 0.166_664_15, 0.5, 1.0, 1.0];

/// ln(1 + e)/e on [0, 1], to 1.5·10⁻⁸ (interpolation at Chebyshev points), from the highest power.
const LOG: [f32; 10] = [
    -0.003_176_057,
    0.019_542_526,
    -0.056_373_61,
    0.105_436_236,
    -0.152_696_67,
    0.196_632_74,
    -0.249_516_16,
    0.333_297_1,
    -0.499_998_93,
    1.0,
];

/// ln 2 as a number of few bits, whose multiples are exact, and the remainder.
const LN_2: [f32; 2] = [355.0 / 512.0, -2.121_944_4e-4];

/// 1.5 · 2²³: adding it rounds to an integer, which is in the low bits.
const ROUND: f32 = 12_582_912.0;

/// Lower bound on t: below it e^t is less than 10⁻³⁷.
const LEAST: f32 = -86.0;

/// Bits of a fraction.
const MANTISSA: u32 = 23;

/// Softplus of one sharpness.
#[derive(Clone, Copy)]
pub(super) struct Softplus<S: Simd> {
    sharpness: S::f32s,
    reciprocal: S::f32s,
}

impl<S: Simd> Softplus<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, sharpness: f32) -> Self {
        Self { sharpness: simd.splat_f32s(sharpness), reciprocal: simd.splat_f32s(sharpness.recip()) }
    }

    /// σ(z) = (max(βz, 0) + ln(1 + e^{−|βz|}))/β, to a relative error of 3·10⁻⁷.
    #[inline(always)]
    pub(super) fn value(&self, simd: S, z: S::f32s) -> S::f32s {
        let t = simd.mul_f32s(self.sharpness, z);
        let below = simd.or_f32s(t, simd.splat_f32s(-0.0));
        self.finish(simd, t, below, exp(simd, below))
    }

    /// σ(z) and σ′(z) = 1/(1 + e^{−βz}), to a relative error of 3·10⁻⁷.
    #[inline(always)]
    pub(super) fn with_slope(&self, simd: S, z: S::f32s) -> [S::f32s; 2] {
        let (zero, one) = (simd.splat_f32s(0.0), simd.splat_f32s(1.0));
        let t = simd.mul_f32s(self.sharpness, z);
        let below = simd.or_f32s(t, simd.splat_f32s(-0.0));
        let e = exp(simd, below);
        let larger = simd.div_f32s(one, simd.add_f32s(one, e));
        let rises = simd.greater_than_or_equal_f32s(t, zero);
        let slope = simd.select_f32s(rises, larger, simd.mul_f32s(e, larger));
        [self.finish(simd, t, below, e), slope]
    }

    /// σ from t = βz, −|t| and e = e^{−|t|}. Its max(t, 0) is (t + |t|)/2, which keeps NaN.
    #[inline(always)]
    fn finish(&self, simd: S, t: S::f32s, below: S::f32s, e: S::f32s) -> S::f32s {
        let log = simd.mul_f32s(e, polynomial(simd, &LOG, e));
        let twice = simd.sub_f32s(t, below);
        let sum = simd.mul_add_e_f32s(twice, simd.splat_f32s(0.5), log);
        simd.mul_f32s(sum, self.reciprocal)
    }
}

/// e^t for t ≤ 0: 2ⁿ e^r with integer n and |r| ≤ ½ ln 2.
#[inline(always)]
fn exp<S: Simd>(simd: S, t: S::f32s) -> S::f32s {
    let least = simd.splat_f32s(LEAST);
    // Not a maximum, which may lose NaN.
    let t = simd.select_f32s(simd.less_than_f32s(t, least), least, t);
    let round = simd.splat_f32s(ROUND);
    let shifted = simd.mul_add_e_f32s(t, simd.splat_f32s(std::f32::consts::LOG2_E), round);
    let n = simd.sub_f32s(shifted, round);
    let r = simd.mul_add_e_f32s(n, simd.splat_f32s(-LN_2[0]), t);
    let r = simd.mul_add_e_f32s(n, simd.splat_f32s(-LN_2[1]), r);
    let bits = simd.transmute_u32s_f32s(polynomial(simd, &EXP, r));
    // The bits of ROUND above n are shifted out.
    let power = simd.wrapping_dyn_shl_u32s(simd.transmute_u32s_f32s(shifted), simd.splat_u32s(MANTISSA));
    simd.transmute_f32s_u32s(simd.add_u32s(bits, power))
}

#[inline(always)]
fn polynomial<S: Simd>(simd: S, coefficients: &[f32], x: S::f32s) -> S::f32s {
    let mut sum = simd.splat_f32s(coefficients[0]);
    for &coefficient in &coefficients[1..] {
        sum = simd.mul_add_e_f32s(sum, x, simd.splat_f32s(coefficient));
    }
    sum
}
