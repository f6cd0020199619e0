//! Filters of pixels.

use flatland::calculus::Number;

use crate::scene::Filter;

/// Mitsuba 3 cuts its Gaussian off at this many standard deviations.
pub(super) const GAUSSIAN_CUT: f64 = 4.0;

/// The filter along one axis, with integral 1.
#[inline]
pub(super) fn weight<T: Number>(filter: Filter, x: T) -> T {
    match filter {
        Filter::Box => T::constant(1.0),
        Filter::Tent { radius } => (T::constant(radius) - x.abs()).positive() * (1.0 / (radius * radius)),
        Filter::Gaussian { deviation } => {
            let floor = (-0.5 * GAUSSIAN_CUT * GAUSSIAN_CUT).exp();
            let bell = (x.squared() * (-0.5 / (deviation * deviation))).exp();
            (bell - T::constant(floor)).positive() * (1.0 / gaussian_integral(deviation, floor))
        }
    }
}

/// The same of points side by side.
#[inline(always)]
pub(super) fn weights<const N: usize>(filter: Filter, x: &[f64; N]) -> [f64; N] {
    // The filter is known before the loop, which has no branch.
    match filter {
        Filter::Box => [1.0; N],
        Filter::Tent { radius } => x.map(|x| weight(Filter::Tent { radius }, x)),
        Filter::Gaussian { deviation } => x.map(|x| weight(Filter::Gaussian { deviation }, x)),
    }
}

/// ∫ of the filter along an axis from `low` to `high`.
pub(super) fn integral(filter: Filter, low: f64, high: f64) -> f64 {
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
            // Simpson's rule with steps of σ/512: an error of 3/180 (1/512)⁴ a standard deviation, 2 · 10⁻¹³.
            let pairs = ((high - low) / deviation * 256.0).ceil() as usize;
            let step = (high - low) / (2 * pairs) as f64;
            let at = |k: usize| weight(filter, low + k as f64 * step);
            let odd: f64 = (0..pairs).map(|k| at(2 * k + 1)).sum();
            let even: f64 = (1..pairs).map(|k| at(2 * k)).sum();
            (at(0) + 4.0 * odd + 2.0 * even + at(2 * pairs)) * step / 3.0
        }
    }
}

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
        for filter in
            [Filter::Tent { radius: 1.0 }, Filter::Tent { radius: 2.5 }, Filter::Gaussian { deviation: 0.5 }]
        {
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
}
