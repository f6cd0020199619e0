//! Bias, variance and slope of independent gradient images against independent images of a reference.
//!
//! With ⟨a, b⟩ the mean of products over pixels and channels, X₁ … X_R images of a method and Y₁ … Y_K images
//! of a reference, all independent, means over *different* images are unbiased estimates:
//!
//! ```text
//! power     ⟨g, g⟩        = mean over k ≠ l of ⟨Y_k, Y_l⟩
//! variance  E⟨X − EX, X − EX⟩ = mean of ⟨X_r, X_r⟩ − mean over r ≠ s of ⟨X_r, X_s⟩
//! bias²     ⟨EX − g, EX − g⟩  = mean over r ≠ s of ⟨X_r, X_s⟩ − 2 mean of ⟨X_r, Y_k⟩ + power
//! slope     ⟨EX, g⟩/⟨g, g⟩    = mean of ⟨X_r, Y_k⟩/power
//! ```
//!
//! where g = EY. They contain no noise of the runs or of the reference; bias² may be negative. Standard
//! errors are those of the jackknife over whole images, because noise is correlated between pixels.

use glam::DVec3;

/// A number with its standard error.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Measure {
    /// The number.
    pub value: f64,
    /// Its standard error.
    pub error: f64,
}

impl Measure {
    /// Multiplied by an exact factor.
    pub(super) fn scaled(self, factor: f64) -> Self {
        Self { value: factor * self.value, error: factor * self.error }
    }
}

/// Independent images with the same mean, and the products of all pairs.
#[derive(Clone, Debug)]
pub struct Images {
    images: Vec<Vec<DVec3>>,
    products: Vec<Vec<f64>>,
}

/// The statistics of a method's images, relative to a reference. All but the slope are in units of a squared
/// gradient; relative ones are divided by the power of the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// The variance of one image, per pixel and channel.
    pub variance: Measure,
    /// `variance` divided by the power of the reference.
    pub relative_variance: Measure,
    /// bias² divided by the power of the reference.
    pub relative_bias2: Measure,
    /// The slope of the mean on the reference; below 1, gradients are too small.
    pub slope: Measure,
}

impl Images {
    pub(super) fn new(images: Vec<Vec<DVec3>>) -> Self {
        let products = images.iter().map(|a| images.iter().map(|b| product(a, b)).collect()).collect();
        Self { images, products }
    }

    /// ⟨g, g⟩ of the common mean g.
    #[must_use]
    pub fn power(&self) -> Measure {
        jackknife(self.images.len(), |skipped| [self.between(skipped)])[0]
    }

    /// The variance of one image, per pixel and channel.
    #[must_use]
    pub fn variance(&self) -> Measure {
        jackknife(self.images.len(), |skipped| [self.within(skipped) - self.between(skipped)])[0]
    }

    /// Whether all pixels of all images are 0.
    #[must_use]
    pub fn are_zero(&self) -> bool {
        self.images.iter().flatten().all(|p| *p == DVec3::ZERO)
    }

    /// The statistics of these images relative to those of a reference.
    pub(super) fn beside(&self, reference: &Self) -> Statistics {
        let cross: Vec<Vec<f64>> =
            self.images.iter().map(|x| reference.images.iter().map(|y| product(x, y)).collect()).collect();
        // The statistics without one image of the method, or of the reference.
        let all = |run: Option<usize>, of_reference: Option<usize>| {
            let (within, between) = (self.within(run), self.between(run));
            let power = reference.between(of_reference);
            let rows = kept(&cross, run);
            let mixed = mean(rows.flat_map(|row| kept(row, of_reference).copied()));
            let variance = within - between;
            [variance, variance / power, (between - 2.0 * mixed + power) / power, mixed / power]
        };
        let of_runs = jackknife(self.images.len(), |skipped| all(skipped, None));
        let of_reference = jackknife(reference.images.len(), |skipped| all(None, skipped));
        let both = |i: usize| Measure {
            value: of_runs[i].value,
            error: of_runs[i].error.hypot(of_reference[i].error),
        };
        Statistics { variance: both(0), relative_variance: both(1), relative_bias2: both(2), slope: both(3) }
    }

    /// The mean of ⟨X_r, X_r⟩.
    fn within(&self, skipped: Option<usize>) -> f64 {
        mean(kept(&(0..self.images.len()).map(|r| self.products[r][r]).collect::<Vec<_>>(), skipped).copied())
    }

    /// The mean of ⟨X_r, X_s⟩ over r ≠ s.
    fn between(&self, skipped: Option<usize>) -> f64 {
        let count = self.images.len();
        let pairs = (0..count).flat_map(|r| (0..r).map(move |s| (r, s)));
        let pairs = pairs.filter(|&(r, s)| Some(r) != skipped && Some(s) != skipped);
        mean(pairs.map(|(r, s)| self.products[r][s]))
    }
}

/// The mean of a·b over pixels and channels.
fn product(a: &[DVec3], b: &[DVec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(*b)).sum::<f64>() / (3 * a.len()) as f64
}

/// All elements but one.
fn kept<T>(all: &[T], skipped: Option<usize>) -> impl Iterator<Item = &T> {
    all.iter().enumerate().filter(move |(i, _)| Some(*i) != skipped).map(|(_, x)| x)
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (mut sum, mut count) = (0.0, 0.0);
    for value in values {
        sum += value;
        count += 1.0;
    }
    sum / count
}

/// Statistics of all images, with jackknife standard errors.
fn jackknife<const N: usize>(count: usize, of: impl Fn(Option<usize>) -> [f64; N]) -> [Measure; N] {
    let whole = of(None);
    let parts: Vec<[f64; N]> = (0..count).map(|skipped| of(Some(skipped))).collect();
    std::array::from_fn(|i| {
        let centre = mean(parts.iter().map(|p| p[i]));
        let spread: f64 = parts.iter().map(|p| (p[i] - centre).powi(2)).sum();
        Measure { value: whole[i], error: (spread * (count as f64 - 1.0) / count as f64).sqrt() }
    })
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    const PIXELS: usize = 1000;

    /// Images with a known mean, and uniform noise of a known standard deviation.
    fn images(count: u64, seed: u64, mean: impl Fn(usize) -> f64, deviation: f64) -> Images {
        let image = |k| {
            let mut numbers = stream(seed, &[k]);
            let mut noise = || deviation * 12.0_f64.sqrt() * (open01(&mut numbers) - 0.5);
            (0..PIXELS).map(|i| mean(i) + DVec3::new(noise(), noise(), noise())).collect()
        };
        Images::new((0..count).map(image).collect())
    }

    fn truth(i: usize) -> f64 {
        (i as f64).sin()
    }

    #[test]
    fn what_is_known_is_found() {
        let reference = images(16, 1, truth, 0.5);
        let found = images(16, 2, |i| 0.8 * truth(i) + 0.3, 2.0).beside(&reference);
        let power = (0..PIXELS).map(|i| truth(i).powi(2)).sum::<f64>() / PIXELS as f64;
        let bias2 = (0..PIXELS).map(|i| (0.3 - 0.2 * truth(i)).powi(2)).sum::<f64>() / PIXELS as f64 / power;
        let slope =
            (0..PIXELS).map(|i| (0.8 * truth(i) + 0.3) * truth(i)).sum::<f64>() / PIXELS as f64 / power;
        for (measure, expected) in
            [(found.variance, 4.0), (found.relative_bias2, bias2), (found.slope, slope)]
        {
            // Six standard errors, which are themselves known to 20 %.
            let off = (measure.value - expected).abs();
            assert!(off < 6.0 * measure.error && measure.error < 0.2 * expected, "{measure:?} {expected}");
        }
        assert!((reference.power().value - power).abs() < 6.0 * reference.power().error);
        assert!((reference.variance().value - 0.25).abs() < 6.0 * reference.variance().error);
    }

    /// Noise is not counted as bias: over many seeds, estimates of a bias of 0 are as often negative as
    /// positive, and within their errors of 0.
    #[test]
    fn noise_is_no_bias() {
        let (mut sum, mut negative, mut far) = (0.0, 0, 0);
        for seed in 0..40 {
            let reference = images(16, 100 + seed, truth, 0.5);
            let bias2 = images(16, 200 + seed, truth, 2.0).beside(&reference).relative_bias2;
            sum += bias2.value / bias2.error;
            negative += i32::from(bias2.value < 0.0);
            far += i32::from(bias2.value > 4.0 * bias2.error);
        }
        assert!(
            (sum / 40.0).abs() < 1.0 && (8..=32).contains(&negative) && far == 0,
            "{sum} {negative} {far}"
        );
    }
}
