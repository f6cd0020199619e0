//! Whether trials of two methods found the same derivative.
//!
//! The standard error of a method knows nothing of what none of its samples found. Another, independent
//! estimate does: with g₁ and g₂ of one image μ,
//!
//! > E g₁·g₂ = |μ|² and E |g₁ − g₂|² = E |g₁ − μ|² + E |g₂ − μ|²,
//!
//! summed over pixels: the second, less the squared errors that both state, is what one of them lacks.

use super::trial::Trial;

/// Sums over pixels, with the squares of their standard errors; of views that are summed.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Agreement {
    /// The squared derivative that both found.
    common: Sum,
    /// The squared difference less what both state.
    beyond: Sum,
}

#[derive(Clone, Copy, Debug, Default)]
struct Sum {
    value: f64,
    square: f64,
}

/// The side of squares of pixels whose spread says how well a sum over the film is known: what one sample
/// adds is within one, or four.
const SQUARE: usize = 4;
/// A quantity counts as known if it is this many standard errors from 0.
const SIGNIFICANT: f64 = 3.0;
/// For a confirmation, which also bounds what one of the two may lack, this many are enough.
const SEEN: f64 = 2.0;

impl Agreement {
    /// One trial: the squared derivative less its noise.
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

    /// With that of another view.
    pub(super) fn and(&self, other: &Self) -> Self {
        let both = |a: Sum, b: Sum| Sum { value: a.value + b.value, square: a.square + b.square };
        Self { common: both(self.common, other.common), beyond: both(self.beyond, other.beyond) }
    }

    /// Whether one of them is known to lack something.
    pub(super) fn is_refuted(&self) -> bool {
        self.beyond.value > SIGNIFICANT * self.beyond.square.sqrt()
    }

    /// Whether both found the same derivative: what they have in common is seen, and more than what one of
    /// them may lack.
    pub(super) fn is_confirmed(&self) -> bool {
        let lacks = self.beyond.value.max(0.0) + self.beyond.square.sqrt();
        self.common.value > SEEN * self.common.square.sqrt() && lacks < self.common.value
    }

    /// The squared derivative at most.
    pub(super) fn most(&self) -> f64 {
        self.common.value.max(0.0) + SIGNIFICANT * self.common.square.sqrt()
    }
}

/// Sums of what pixels have over squares of the film with this side.
pub(super) fn by_square(side: usize, (width, height): (usize, usize), of: impl Fn(usize) -> f64) -> Vec<f64> {
    let columns = width.div_ceil(side);
    let mut sums = vec![0.0; columns * height.div_ceil(side)];
    for pixel in 0..width * height {
        sums[pixel / width / side * columns + pixel % width / side] += of(pixel);
    }
    sums
}
