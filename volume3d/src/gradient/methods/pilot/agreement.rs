//! Test whether trials of two methods agree on the derivative.
//!
//! The standard error of a method does not include features that none of its samples found. An independent
//! second estimate reveals them: with g₁ and g₂ estimates of one image μ,
//!
//! > E g₁·g₂ = |μ|² and E |g₁ − g₂|² = E |g₁ − μ|² + E |g₂ − μ|²,
//!
//! summed over pixels: the second, less the squared standard errors of both, is what one of them misses.

use super::trial::Trial;

/// Sums over pixels, with their squared standard errors; views add up.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Agreement {
    /// Squared derivative common to both.
    common: Sum,
    /// Squared difference beyond the standard errors.
    beyond: Sum,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    value: f64,
    square: f64,
}

/// Side of the squares of pixels from whose spread the error of a sum over the film is estimated: the
/// contribution of one sample lies within one square, or four.
const SQUARE: usize = 4;
/// Standard errors from 0 at which a quantity counts as known.
const SIGNIFICANT: f64 = 3.0;
/// Standard errors sufficient for a confirmation, which also bounds what one of the two may miss.
const SEEN: f64 = 2.0;

impl Agreement {
    /// One trial: squared derivative less its noise.
    pub(super) fn alone(one: &Trial<'_>) -> Self {
        Self::by_pixel(one, |pixel| {
            let (gradient, variance) = one.pixel(pixel);
            [gradient.length_squared() - variance, 0.0]
        })
    }

    /// Two independent trials.
    pub(super) fn of(one: &Trial<'_>, other: &Trial<'_>) -> Self {
        Self::by_pixel(one, |pixel| {
            let ((a, of_a), (b, of_b)) = (one.pixel(pixel), other.pixel(pixel));
            [a.dot(b), (a - b).length_squared() - of_a - of_b]
        })
    }

    fn by_pixel(one: &Trial<'_>, of: impl Fn(usize) -> [f64; 2]) -> Self {
        let sum = |which: usize| {
            let sums = by_square(SQUARE, one.image.gradient.size(), |pixel| of(pixel)[which]);
            Sum { value: sums.iter().sum(), square: sums.iter().map(|sum| sum * sum).sum() }
        };
        Self { common: sum(0), beyond: sum(1) }
    }

    /// The sum with another view.
    pub(super) fn and(&self, other: &Self) -> Self {
        let both = |a: Sum, b: Sum| Sum { value: a.value + b.value, square: a.square + b.square };
        Self { common: both(self.common, other.common), beyond: both(self.beyond, other.beyond) }
    }

    /// Whether one of the two certainly misses something.
    pub(super) fn is_refuted(&self) -> bool {
        self.beyond.value > SIGNIFICANT * self.beyond.square.sqrt()
    }

    /// Whether both found the same derivative: their common part is significant and larger than what one of
    /// them may miss.
    pub(super) fn is_confirmed(&self) -> bool {
        let lacks = self.beyond.value.max(0.0) + self.beyond.square.sqrt();
        self.common.value > SEEN * self.common.square.sqrt() && lacks < self.common.value
    }

    /// Upper bound on the squared derivative.
    pub(super) fn most(&self) -> f64 {
        self.common.value.max(0.0) + SIGNIFICANT * self.common.square.sqrt()
    }
}

/// Sums of a per-pixel quantity over squares of the film with this side.
pub(super) fn by_square(side: usize, (width, height): (usize, usize), of: impl Fn(usize) -> f64) -> Vec<f64> {
    let columns = width.div_ceil(side);
    let mut sums = vec![0.0; columns * height.div_ceil(side)];
    for pixel in 0..width * height {
        sums[pixel / width / side * columns + pixel % width / side] += of(pixel);
    }
    sums
}
