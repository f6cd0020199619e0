//! Softplus and its derivatives for the neurons of a layer, in double precision.
//!
//! Branchless arithmetic that the compiler vectorises where it is inlined into
//! [`Instructions::run`](crate::lanes::Instructions::run). Nothing is fused: results have the same bits on
//! all machines.

use std::f64::consts::LOG2_E;

use crate::lanes::{Instructions, Lanes, Task};

/// e^r on [−½ ln 2, ½ ln 2], to 2·10⁻¹⁷ (interpolation at Chebyshev points), from the highest power.
const EXP: [f64; 12] = [
    2.511_003_760_596_377_7e-8,
    2.763_263_963_904_103e-7,
    2.755_724_091_857_897e-6,
    2.480_148_548_232_849_4e-5,
    1.984_126_989_004_711_3e-4,
    1.388_888_895_231_477_5e-3,
    8.333_333_333_319_601e-3,
    0.041_666_666_666_488_1,
    0.166_666_666_666_666_8,
    0.500_000_000_000_001_9,
    1.0,
    1.0,
];

/// Polynomial in s² for 2 artanh(s)/s, s² in [0, 1/9], highest power first; error 3·10⁻¹⁸ (interpolation at
/// Chebyshev points).
const ARTANH: [f64; 11] = [
    0.170_441_635_627_813_97,
    0.083_245_065_118_608_2,
    0.121_101_687_280_692_18,
    0.133_003_740_326_746_25,
    0.153_866_140_423_040_1,
    0.181_817_408_325_048_06,
    0.222_222_240_807_476_74,
    0.285_714_285_454_545_14,
    0.400_000_000_001_857_5,
    0.666_666_666_666_661_5,
    2.0,
];

/// ln 2 as a number of few bits, whose multiples are exact, and the remainder.
const LN_2: [f64; 2] = [0.693_147_180_485_539_1, 7.440_617_110_012_397e-11];

/// 1.5 · 2⁵²: adding it rounds to an integer, which is in the low bits.
const ROUND: f64 = 6_755_399_441_055_744.0;

/// Lower bound on t: below it e^t is less than 10⁻³⁰⁷.
const LEAST: f64 = -707.0;

/// Bits of a fraction.
const MANTISSA: u32 = 52;

/// σ(z), σ′(z) and σ″(z) of a layer's neurons, with softplus σ.
#[derive(Debug)]
pub(super) struct Neurons {
    pub(super) value: Vec<f64>,
    pub(super) slope: Vec<f64>,
    pub(super) curvature: Vec<f64>,
}

impl Neurons {
    pub(super) fn new(instructions: Instructions, sharpness: f64, z: Vec<f64>) -> Self {
        let (slope, curvature) = (vec![0.0; z.len()], vec![0.0; z.len()]);
        let mut neurons = Self { value: z, slope, curvature };
        instructions.run(All { sharpness, neurons: &mut neurons });
        neurons
    }
}

/// Softplus in place, without derivatives.
pub(super) fn bend(instructions: Instructions, sharpness: f64, z: &mut [f64]) {
    instructions.run(Values { sharpness, z });
}

struct Values<'n> {
    sharpness: f64,
    z: &'n mut [f64],
}

impl Task for Values<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self { sharpness, z } = self;
        let reciprocal = sharpness.recip();
        for z in z {
            let t = sharpness * *z;
            *z = reciprocal * softplus(t, exp(-t.abs()));
        }
    }
}

struct All<'n> {
    sharpness: f64,
    neurons: &'n mut Neurons,
}

impl Task for All<'_> {
    type Output = ();

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) {
        let Self { sharpness, neurons: Neurons { value, slope, curvature } } = self;
        let reciprocal = sharpness.recip();
        for ((value, slope), curvature) in value.iter_mut().zip(slope).zip(curvature) {
            let t = sharpness * *value;
            let e = exp(-t.abs());
            let larger = 1.0 / (1.0 + e);
            let smaller = e * larger;
            *value = reciprocal * softplus(t, e);
            *slope = if t >= 0.0 { larger } else { smaller };
            // σ′(1 − σ′), without cancellation.
            *curvature = sharpness * smaller * larger;
        }
    }
}

/// Softplus ln(1 + e^t) = max(t, 0) + ln(1 + e) from t and e = e^{−|t|}. Here max(t, 0) = (t + |t|)/2, which
/// propagates NaN, and ln(1 + e) = 2 artanh(e/(2 + e)).
#[inline(always)]
fn softplus(t: f64, e: f64) -> f64 {
    let s = e / (2.0 + e);
    0.5 * (t + t.abs()) + s * polynomial(&ARTANH, s * s)
}

/// e^t for t ≤ 0: 2ⁿ e^r with integer n and |r| ≤ ½ ln 2.
#[inline(always)]
fn exp(t: f64) -> f64 {
    // Not a maximum, which loses NaN.
    let t = if t < LEAST { LEAST } else { t };
    let shifted = t * LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = (t - n * LN_2[0]) - n * LN_2[1];
    // The bits of ROUND above n are shifted out.
    f64::from_bits(polynomial(&EXP, r).to_bits().wrapping_add(shifted.to_bits() << MANTISSA))
}

#[inline(always)]
fn polynomial<const N: usize>(coefficients: &[f64; N], x: f64) -> f64 {
    let mut sum = coefficients[0];
    for coefficient in &coefficients[1..] {
        sum = sum * x + coefficient;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Comparison with the library's functions, over the range of double precision.
    #[test]
    fn neurons_are_softplus() {
        let sharpness = 100.0;
        let tiny = [0.0, -0.0, 1e-300, -1e-300, 5e-324, 1e300, -1e300, 7.2, -7.2, 8.0, -8.0];
        let z: Vec<f64> = (-4000..4000).map(|i| 0.002 * f64::from(i) + 1e-4).chain(tiny).collect();
        let neurons = Neurons::new(Instructions::detect(), sharpness, z.clone());
        let mut values = z.clone();
        bend(Instructions::detect(), sharpness, &mut values);
        assert_eq!(values, neurons.value);
        let portable = Neurons::new(Instructions::Portable, sharpness, z.clone());
        assert_eq!((&portable.value, &portable.slope), (&neurons.value, &neurons.slope));
        for (i, &z) in z.iter().enumerate() {
            let t = sharpness * z;
            let e = (-t.abs()).exp();
            let slope = if t >= 0.0 { 1.0 } else { e } / (1.0 + e);
            let value = (t.max(0.0) + e.ln_1p()) / sharpness;
            let curvature = sharpness * e / (1.0 + e) / (1.0 + e);
            let pairs =
                [(neurons.value[i], value), (neurons.slope[i], slope), (neurons.curvature[i], curvature)];
            for (found, expected) in pairs {
                let near = (found - expected).abs() <= 2e-15 * expected.abs() + 1e-300;
                assert!(near, "{t}: {found} for {expected}");
            }
        }
        let nothing = Neurons::new(Instructions::detect(), sharpness, vec![f64::NAN]);
        assert!([nothing.value[0], nothing.curvature[0]].iter().all(|x| x.is_nan()));
    }
}
