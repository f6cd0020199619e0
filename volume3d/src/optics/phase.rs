//! Phase functions: scattering densities of directions, which are also the sampling densities.

use std::f64::consts::PI;

/// Density per steradian of the scattering angle θ (Henyey and Greenstein 1941),
///
/// ```text
/// p(cos θ) = (1 − g²)/(4π (1 + g² − 2 g cos θ)^{3/2}),
/// ```
///
/// with mean cosine g in (−1, 1): 0 is isotropic.
pub(crate) fn henyey_greenstein(g: f64, cosine: f64) -> f64 {
    // 1 + g² − 2 g cos θ, without cancellation at small angles.
    let squared = (1.0 - g).powi(2) + 2.0 * g * (1.0 - cosine);
    (1.0 - g * g) / (4.0 * PI * squared * squared.sqrt())
}

/// Samples a cosine with that density from a number in (0, 1): the inverse of the cumulative distribution,
/// with g cancelled, so that it holds at 0 as well.
pub(crate) fn sample_cosine(g: f64, xi: f64) -> f64 {
    let u = 2.0 * xi - 1.0;
    let a = 1.0 + g * u;
    let sum = 2.0 * u + g * (3.0 + u * u) + 2.0 * g * g * u + g.powi(3) * (u * u - 1.0);
    (sum / (2.0 * a * a)).clamp(-1.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// ∫ f(cos θ) p dω by the midpoint rule, in 1 − cos θ = 2 sin²(θ/2), whose steps are even in θ.
    fn integral(g: f64, f: impl Fn(f64) -> f64) -> f64 {
        let n = 200_000;
        let step = PI / f64::from(n);
        let at = |i: i32| (f64::from(i) + 0.5) * step;
        (0..n)
            .map(|i| f(at(i).cos()) * henyey_greenstein(g, at(i).cos()) * 2.0 * PI * at(i).sin() * step)
            .sum()
    }

    #[test]
    fn the_density_is_one_whose_mean_cosine_is_g() {
        for g in [-0.9, -0.3, 0.0, 1e-9, 0.5, 0.95] {
            assert!((integral(g, |_| 1.0) - 1.0).abs() < 1e-6, "{g}: {}", integral(g, |_| 1.0));
            assert!((integral(g, |x| x) - g).abs() < 1e-6, "{g}: {}", integral(g, |x| x));
        }
    }

    /// The fraction of light below a sampled cosine is the number from which it was sampled.
    #[test]
    fn cosines_are_sampled_by_their_density() {
        for g in [-0.9, -0.3, 0.0, 1e-9, 0.5, 0.95] {
            for xi in [1e-6, 0.1, 0.5, 0.77, 1.0 - 1e-6] {
                let cosine = sample_cosine(g, xi);
                let below = if g.abs() < 1e-6 {
                    0.5 * (1.0 + cosine)
                } else {
                    let root = (1.0 + g * g - 2.0 * g * cosine).sqrt();
                    (1.0 - g * g) / (2.0 * g) * (1.0 / root - 1.0 / (1.0 + g))
                };
                assert!((below - xi).abs() < 1e-9, "{g} {xi}: {below}");
            }
        }
    }
}
