//! z-tests of unbiasedness over many comparisons, and rates of convergence.
//!
//! A mean of n samples is compared with an exact value by z = (mean − exact)/standard error. With m
//! comparisons and a false-alarm rate α for all of them, |z| may reach the two-sided normal quantile of α/m
//! (Bonferroni). The test assumes normality and a standard error that has converged: n must be large.

use statrs::distribution::{ContinuousCDF, Normal, StudentsT};

/// Rejection threshold on |z| of every statistical test of the suite. The suite makes at most 12,000
/// comparisons, including thorough ones; the probability that any of them is a false alarm is 10⁻³. Seeds are
/// fixed, so a false alarm can appear only when code or random numbers change. A smaller probability would
/// cost more samples for the same power: at 10⁻⁶, 1.5 times as many.
pub fn suite_threshold() -> f64 {
    threshold(1e-3, 12_000)
}

/// Mean and variance of a stream of numbers, by Welford's recurrence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Moments {
    count: u64,
    mean: f64,
    /// Σ (x − mean)².
    squares: f64,
}

impl Moments {
    /// The moments of an empty stream.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one number.
    pub fn push(&mut self, x: f64) {
        self.count += 1;
        let before = x - self.mean;
        self.mean += before / self.count as f64;
        self.squares += before * (x - self.mean);
    }

    /// The moments of both streams together (Chan, Golub and LeVeque 1979).
    pub fn merge(self, other: Self) -> Self {
        if self.count == 0 || other.count == 0 {
            return if self.count == 0 { other } else { self };
        }
        let count = self.count + other.count;
        let (n, m) = (self.count as f64, other.count as f64);
        let difference = other.mean - self.mean;
        Self {
            count,
            mean: self.mean + difference * m / (n + m),
            squares: self.squares + other.squares + difference * difference * n * m / (n + m),
        }
    }

    /// The count of numbers.
    pub fn count(&self) -> u64 {
        self.count
    }

    /// Their mean; 0 if empty.
    pub fn mean(&self) -> f64 {
        self.mean
    }

    /// The unbiased estimate of their variance; infinite for fewer than two.
    pub fn variance(&self) -> f64 {
        if self.count < 2 { f64::INFINITY } else { self.squares / (self.count - 1) as f64 }
    }

    /// The standard error of the mean, √(variance/count).
    pub fn standard_error(&self) -> f64 {
        (self.variance() / self.count.max(1) as f64).sqrt()
    }
}

impl Extend<f64> for Moments {
    fn extend<T: IntoIterator<Item = f64>>(&mut self, samples: T) {
        samples.into_iter().for_each(|x| self.push(x));
    }
}

impl FromIterator<f64> for Moments {
    fn from_iter<T: IntoIterator<Item = f64>>(samples: T) -> Self {
        let mut moments = Self::new();
        moments.extend(samples);
        moments
    }
}

/// The |z| that the largest of `comparisons` normal deviates exceeds with probability at most
/// `false_alarm`: the two-sided normal quantile, corrected by Bonferroni.
pub fn threshold(false_alarm: f64, comparisons: usize) -> f64 {
    assert!(false_alarm > 0.0 && false_alarm < 1.0, "false-alarm rate {false_alarm}");
    assert!(comparisons > 0, "no comparison");
    // The lower tail: 1 minus a small number would round it away.
    -Normal::standard().inverse_cdf(0.5 * false_alarm / comparisons as f64)
}

/// Rejection threshold on |z| for a mean whose standard error comes from repetitions: Student's distribution
/// with `freedom` degrees of freedom exceeds it as rarely as the normal one exceeds the threshold of the
/// suite.
pub fn student(freedom: u64) -> f64 {
    let normal = Normal::standard();
    let student = StudentsT::new(0.0, 1.0, freedom as f64).expect("degrees of freedom");
    let rare = normal.cdf(-suite_threshold());
    // Bisection, in the lower tail: 1 minus a small number would round it away.
    let (mut low, mut high) = (suite_threshold(), 1e3);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if student.cdf(-middle) > rare { low = middle } else { high = middle }
    }
    high
}

/// The slope of the least-squares line through (x, y): for logarithms, the rate of a power law.
pub fn regression_slope(x: &[f64], y: &[f64]) -> f64 {
    assert_eq!(x.len(), y.len(), "one y per x");
    assert!(x.len() >= 2, "a line needs two points");
    let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
    let (mx, my) = (mean(x), mean(y));
    let (sxy, sxx) = x
        .iter()
        .zip(y)
        .fold((0.0, 0.0), |(sxy, sxx), (x, y)| (sxy + (x - mx) * (y - my), sxx + (x - mx) * (x - mx)));
    assert!(sxx > 0.0, "all x are equal");
    sxy / sxx
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_are_those_of_the_numbers() {
        let numbers = [1e9 + 4.0, 1e9 + 7.0, 1e9 + 13.0, 1e9 + 16.0];
        let all: Moments = numbers.into_iter().collect();
        assert_eq!((all.count(), all.mean(), all.variance()), (4, 1e9 + 10.0, 30.0));
        assert_eq!(all.standard_error(), 7.5_f64.sqrt());
        for cut in 0..=4 {
            let part = |s: &[f64]| s.iter().copied().collect::<Moments>();
            let merged = part(&numbers[..cut]).merge(part(&numbers[cut..]));
            assert_eq!((merged.count(), merged.mean(), merged.variance()), (4, 1e9 + 10.0, 30.0));
        }
        assert_eq!(Moments::new().standard_error(), f64::INFINITY);
    }

    #[test]
    fn thresholds_are_normal_quantiles() {
        // 95% and the "five sigma" of physics, two-sided; and 1e-6 over 100 comparisons.
        for (rate, comparisons, z) in [
            (0.05, 1, 1.959_963_984_540_054),
            (5.733_031_437_583_87e-7, 1, 5.0),
            (0.1, 2, 1.959_963_984_540_054),
            (1e-6, 100, 5.730_728_868_235_683),
        ] {
            let found = threshold(rate, comparisons);
            assert!((found - z).abs() < 1e-8, "{rate} of {comparisons}: {found} for {z}");
        }
    }

    #[test]
    fn slopes_of_power_laws() {
        let x: Vec<f64> = (1..8).map(|k| f64::from(k).ln()).collect();
        let y: Vec<f64> = x.iter().map(|x| 3.0 - 0.5 * x).collect();
        assert!((regression_slope(&x, &y) + 0.5).abs() < 1e-14);
    }
}
