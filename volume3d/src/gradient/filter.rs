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
        }
    }
}
