//! Running means and variances.

use std::ops::{Add, Mul, Sub};

/// Mean and variance of a stream of numbers, or of each component of a stream of vectors, by the recurrence
/// of Welford (1962), which subtracts no sums of squares.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments<T = f64> {
    count: u64,
    mean: T,
    /// Σ (x − mean)².
    squares: T,
}

impl<T> Moments<T>
where
    T: Copy + Add<Output = T> + Sub<Output = T> + Mul<Output = T> + Mul<f64, Output = T>,
{
    /// Adds a sample.
    pub fn push(&mut self, x: T) {
        self.count += 1;
        let before = x - self.mean;
        self.mean = self.mean + before * (1.0 / self.count as f64);
        self.squares = self.squares + before * (x - self.mean);
    }

    /// The mean; 0 without samples.
    #[must_use]
    pub fn mean(&self) -> T {
        self.mean
    }

    /// Unbiased estimate of the variance of the mean of independent samples: Σ (x − mean)²/(n (n − 1)). NaN
    /// for fewer than two.
    #[must_use]
    pub fn variance_of_mean(&self) -> T {
        let n = self.count as f64;
        self.squares * (1.0 / (n * (n - 1.0)))
    }
}

impl Moments {
    /// The root of [`variance_of_mean`](Self::variance_of_mean).
    #[must_use]
    pub fn standard_error(&self) -> f64 {
        self.variance_of_mean().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn they_are_those_of_the_textbook_far_from_zero_too() {
        for offset in [0.0, 1e9] {
            let values = [1.0, 2.0, 4.0, 9.0].map(|x: f64| x + offset);
            let mut moments = Moments::default();
            values.iter().for_each(|x| moments.push(*x));
            assert!((moments.mean() - (4.0 + offset)).abs() < 1e-6);
            // Σ (x − 4)² = 9 + 4 + 0 + 25 = 38, over 4 · 3.
            assert!((moments.variance_of_mean() - 38.0 / 12.0).abs() < 1e-5, "{offset}");
        }
        let mut vectors = Moments::default();
        [DVec3::X, DVec3::new(3.0, 2.0, 0.0)].iter().for_each(|v| vectors.push(*v));
        assert_eq!(
            (vectors.mean(), vectors.variance_of_mean()),
            (DVec3::new(2.0, 1.0, 0.0), DVec3::new(1.0, 1.0, 0.0))
        );
        let mut one = Moments::default();
        one.push(1.0);
        assert!(one.standard_error().is_nan());
    }
}
