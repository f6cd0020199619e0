//! Pixel filters.

use flatland::calculus::Number;

use crate::scene::{Filter, GAUSSIAN_CUT};

/// The filter along one axis, normalised to integral 1.
#[inline]
pub(in crate::gradient) fn weight<T: Number>(filter: Filter, x: T) -> T {
    match filter {
        Filter::Box => T::constant(1.0),
        Filter::Tent { radius } => (T::constant(radius) - x.abs()).positive() * (1.0 / (radius * radius)),
        Filter::Gaussian { deviation } => {
            let floor = (-0.5 * GAUSSIAN_CUT * GAUSSIAN_CUT).exp();
            let bell = (x.squared() * (-0.5 / (deviation * deviation))).exp();
            (bell - T::constant(floor)).positive() * (1.0 / gaussian_integral(deviation, floor))
        }
        Filter::Cubic { b, c } => {
            let (value, slope) = cubic([b, c], x.value().abs());
            x.chain(value, slope * x.value().signum())
        }
        Filter::Lanczos { lobes } => {
            let (value, slope) = lanczos(lobes, x.value());
            x.chain(value, slope)
        }
    }
}

/// [`weight`] at N points.
#[inline(always)]
pub(in crate::gradient) fn weights<const N: usize>(filter: Filter, x: &[f64; N]) -> [f64; N] {
    // The match stands outside the loop, which has no branch.
    match filter {
        Filter::Box => [1.0; N],
        Filter::Tent { radius } => x.map(|x| weight(Filter::Tent { radius }, x)),
        Filter::Gaussian { deviation } => x.map(|x| weight(Filter::Gaussian { deviation }, x)),
        Filter::Cubic { .. } | Filter::Lanczos { .. } => x.map(|x| weight(filter, x)),
    }
}

/// ∫ of the filter along one axis from `low` to `high`.
pub(in crate::gradient) fn integral(filter: Filter, low: f64, high: f64) -> f64 {
    match filter {
        Filter::Box => (high.min(0.5) - low.max(-0.5)).max(0.0),
        Filter::Tent { radius } => {
            let below = |x: f64| {
                let rest = 0.5 * ((radius - x.abs()).max(0.0) / radius).powi(2);
                if x < 0.0 { rest } else { 1.0 - rest }
            };
            below(high) - below(low)
        }
        Filter::Gaussian { deviation } => {
            let cut = GAUSSIAN_CUT * deviation;
            let (low, high) = (low.max(-cut), high.min(cut));
            if low >= high {
                return 0.0;
            }
            // Simpson's rule with steps of σ/512: error 3/180 (1/512)⁴ per standard deviation, 2 · 10⁻¹³.
            let pairs = ((high - low) / deviation * 256.0).ceil() as usize;
            let step = (high - low) / (2 * pairs) as f64;
            let at = |k: usize| weight(filter, low + k as f64 * step);
            let odd: f64 = (0..pairs).map(|k| at(2 * k + 1)).sum();
            let even: f64 = (1..pairs).map(|k| at(2 * k)).sum();
            (at(0) + 4.0 * odd + 2.0 * even + at(2 * pairs)) * step / 3.0
        }
        Filter::Cubic { .. } | Filter::Lanczos { .. } => {
            // Simpson's rule between integers: exact for cubics, error (π/2048)⁴/180 per interval for sines.
            let (low, high) = (low.max(-filter.radius()), high.min(filter.radius()));
            let mut knots: Vec<f64> = vec![low];
            knots.extend((-16..=16).map(f64::from).filter(|k| *k > low && *k < high));
            knots.push(high);
            let pieces = knots.windows(2).filter(|w| w[1] > w[0]);
            pieces.map(|w| simpson(|x| weight(filter, x), w[0], w[1])).sum()
        }
    }
}

fn simpson(f: impl Fn(f64) -> f64, low: f64, high: f64) -> f64 {
    const PAIRS: usize = 1024;
    let step = (high - low) / (2 * PAIRS) as f64;
    let at = |k: usize| f(low + k as f64 * step);
    let odd: f64 = (0..PAIRS).map(|k| at(2 * k + 1)).sum();
    let even: f64 = (1..PAIRS).map(|k| at(2 * k)).sum();
    (at(0) + 4.0 * odd + 2.0 * even + at(2 * PAIRS)) * step / 3.0
}

/// The cubic of Mitchell and Netravali (1988, equation 8) and its slope, for x ≥ 0.
fn cubic([b, c]: [f64; 2], x: f64) -> (f64, f64) {
    let [k, l, m, n] = if x < 1.0 {
        [12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b]
    } else if x < 2.0 {
        [-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c]
    } else {
        return (0.0, 0.0);
    };
    ((((k * x + l) * x + m) * x + n) / 6.0, ((3.0 * k * x + 2.0 * l) * x + m) / 6.0)
}

/// sinc(x) sinc(x/a)/I and its slope.
fn lanczos(lobes: u32, x: f64) -> (f64, f64) {
    use std::f64::consts::PI;
    let a = f64::from(lobes);
    if x.abs() >= a {
        return (0.0, 0.0);
    }
    let [(wide, wide_slope), (narrow, narrow_slope)] = [sinc(PI * x), sinc(PI * x / a)];
    let scale = 1.0 / LANCZOS_INTEGRALS[lobes as usize - 1];
    (scale * wide * narrow, scale * PI * (wide_slope * narrow + wide * narrow_slope / a))
}

/// sin t/t and its slope. For |t| < 0.01 by series, whose first omitted terms are t⁶/5040 < 10⁻¹⁵ and
/// t⁵/840 < 10⁻¹².
fn sinc(t: f64) -> (f64, f64) {
    if t.abs() < 0.01 {
        let squared = t * t;
        (1.0 - squared / 6.0 * (1.0 - squared / 20.0), -t / 3.0 * (1.0 - squared / 10.0))
    } else {
        let (sin, cos) = t.sin_cos();
        (sin / t, (cos - sin / t) / t)
    }
}

/// ∫ sinc(x) sinc(x/a) over ±a = ((a + 1) Si(π(a + 1)) − (a − 1) Si(π(a − 1)))/π for a from 1 to 16.
const LANCZOS_INTEGRALS: [f64; 16] = [
    0.902_823_333_580_28,
    1.009_789_840_618_734_4,
    0.997_055_345_954_342_3,
    1.001_256_108_101_722_2,
    0.999_352_625_451_851_6,
    1.000_376_158_906_582,
    0.999_762_495_476_064_2,
    1.000_159_393_869_835,
    0.999_887_911_076_222_3,
    1.000_081_788_357_395,
    0.999_938_508_484_412_9,
    1.000_047_389_472_960_2,
    0.999_962_711_224_028_6,
    1.000_029_865_516_826_3,
    0.999_975_711_604_305_2,
    1.000_020_017_511_817_5,
];

/// ∫ over ±4σ of e^{−x²/2σ²} − e^{−8}.
fn gaussian_integral(deviation: f64, floor: f64) -> f64 {
    let whole = (2.0 * std::f64::consts::PI).sqrt() * deviation * ERF_OF_CUT;
    whole - 2.0 * GAUSSIAN_CUT * deviation * floor
}

/// erf(4/√2).
const ERF_OF_CUT: f64 = 0.999_936_657_516_333_8;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn filters_integrate_to_one() {
        for filter in [
            Filter::Tent { radius: 1.0 },
            Filter::Tent { radius: 2.5 },
            Filter::Gaussian { deviation: 0.5 },
            Filter::Cubic { b: 1.0 / 3.0, c: 1.0 / 3.0 },
            Filter::Cubic { b: 0.0, c: 0.5 },
            Filter::Lanczos { lobes: 1 },
            Filter::Lanczos { lobes: 3 },
            Filter::Lanczos { lobes: 4 },
        ] {
            let n = 40_000;
            let sum: f64 =
                (0..n).map(|i| weight(filter, -5.0 + 10.0 * (f64::from(i) + 0.5) / f64::from(n))).sum();
            assert!((sum * 10.0 / f64::from(n) - 1.0).abs() < 1e-7, "{filter:?}");
            assert!((integral(filter, -5.0, 5.0) - 1.0).abs() < 1e-12, "{filter:?}");
            let part =
                (0..n).map(|i| weight(filter, 0.3 + 0.9 * (f64::from(i) + 0.5) / f64::from(n))).sum::<f64>();
            assert!((part * 0.9 / f64::from(n) - integral(filter, 0.3, 1.2)).abs() < 1e-7, "{filter:?}");
        }
    }

    #[test]
    fn every_number_of_lobes_has_its_integral() {
        for lobes in 1..=16 {
            let filter = Filter::Lanczos { lobes };
            assert!((integral(filter, -20.0, 20.0) - 1.0).abs() < 1e-12, "{lobes}");
        }
    }

    /// Reference values: `mi.load_dict({'type': …}).eval(x)` of Mitsuba 3.9.1, which does not divide by the
    /// integral.
    #[test]
    fn filters_with_negative_lobes_are_those_of_mitsuba() {
        let third = 1.0 / 3.0;
        let cases = [
            (Filter::Cubic { b: third, c: third }, 1.0, [0.88889, 0.53472, -0.01422, -0.0195, 0.0]),
            (Filter::Cubic { b: 0.2, c: 0.6 }, 1.0, [0.93333, 0.57083, -0.05973, -0.0369, 0.0]),
            (Filter::Cubic { b: 0.0, c: 0.5 }, 1.0, [1.0, 0.5625, -0.064, -0.0315, 0.0]),
            (Filter::Lanczos { lobes: 3 }, LANCZOS_INTEGRALS[2], [1.0, 0.60793, -0.118, -0.08323, 0.02432]),
            (Filter::Lanczos { lobes: 2 }, LANCZOS_INTEGRALS[1], [1.0, 0.57316, -0.07867, -0.02575, 0.0]),
        ];
        for (filter, whole, expected) in cases {
            for (x, expected) in [0.0, 0.5, 1.2, 1.7, 2.5].into_iter().zip(expected) {
                for x in [x, -x] {
                    assert!((weight(filter, x) * whole - expected).abs() < 1e-5, "{filter:?} {x}");
                }
            }
        }
    }

    /// Slopes of the pieces against finite differences, on both sides of the centre and at the knots.
    #[test]
    fn slopes_are_those_of_the_values() {
        let filters = [Filter::Cubic { b: 0.3, c: 0.4 }, Filter::Lanczos { lobes: 3 }];
        for filter in filters {
            for k in -320..=320 {
                let (x, h) = (f64::from(k) * 0.01, 1e-6);
                let difference = (weight(filter, x + h) - weight(filter, x - h)) / (2.0 * h);
                let slope = weight(filter, flatland::calculus::Dual::new(x, [1.0])).tangent[0];
                assert!((slope - difference).abs() < 1e-5, "{filter:?} {x}: {slope} {difference}");
            }
        }
    }
}
