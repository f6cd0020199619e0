//! Materials: a diffuse part, a glossy lobe, and emission.

use std::f64::consts::{PI, TAU};

use crate::calculus::Number;

/// An opaque material, equal on both sides.
///
/// Its scattering function is
///
/// ```text
/// f(ω_i, ω_o) = ρ/2 + s g_w(α),
/// ```
///
/// where α is the angle from the mirror direction of ω_o to ω_i, and it emits the radiance L in all
/// directions. In the plane ∫ cos φ dφ over a hemisphere is 2, hence ρ/2.
///
/// `T` is a [`Number`]: within an integrand the parameters may carry derivatives.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Material<T = f64> {
    /// ρ, the diffuse reflectance, in [0, 1].
    pub reflectance: T,
    /// The glossy lobe, if any.
    pub gloss: Option<Gloss<T>>,
    /// L, the emitted radiance.
    pub emission: T,
}

/// A reciprocal lobe around the mirror direction.
///
/// ```text
/// g_w(α) = sinh w / (2π (cosh w − cos α)),   ∫ g_w dα = 1:
/// ```
///
/// the wrapped Cauchy distribution, which is Poisson's kernel of radius e⁻ʷ. Its tails resemble those of
/// measured gloss rather than of a Gaussian; its integral, its inverse and its product with a cosine are
/// elementary, in the limit of a mirror too.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Gloss<T = f64> {
    /// s, the fraction of the light in the lobe, in [0, 1 − ρ]. A part of the lobe may be below the surface,
    /// where it is lost.
    pub strength: T,
    /// w, the lobe's half width at half maximum in radians while it is small; in (0, [`Gloss::WIDEST`]].
    pub width: T,
}

impl Material {
    /// Replaces the numbers ρ, L, s and w. Without gloss, s and w are ignored.
    pub(crate) fn with<T>(&self, numbers: impl FnOnce([f64; 4]) -> [T; 4]) -> Material<T> {
        let Gloss { strength, width } = self.gloss.unwrap_or(Gloss { strength: 0.0, width: 1.0 });
        let [reflectance, emission, strength, width] =
            numbers([self.reflectance, self.emission, strength, width]);
        Material { reflectance, gloss: self.gloss.map(|_| Gloss { strength, width }), emission }
    }

    /// A diffuse material with reflectance ρ.
    #[must_use]
    pub fn diffuse(reflectance: f64) -> Self {
        Self { reflectance, ..Self::default() }
    }

    /// A black material that emits the radiance L.
    #[must_use]
    pub fn emitter(emission: f64) -> Self {
        Self { emission, ..Self::default() }
    }

    /// A material with only a glossy lobe.
    #[must_use]
    pub fn glossy(strength: f64, width: f64) -> Self {
        Self { gloss: Some(Gloss { strength, width }), ..Self::default() }
    }

    /// Sets the emitted radiance L.
    #[must_use]
    pub fn with_emission(self, emission: f64) -> Self {
        Self { emission, ..self }
    }

    /// Whether any light is scattered.
    #[must_use]
    pub fn scatters(&self) -> bool {
        self.albedo() > 0.0
    }

    /// ρ + s, an upper bound on the scattered fraction of the light.
    #[must_use]
    pub fn albedo(&self) -> f64 {
        self.reflectance + self.gloss.map_or(0.0, |g| g.strength)
    }

    /// Checks the parameters; returns the violation.
    pub(super) fn check(&self) -> Result<(), &'static str> {
        let unit = 0.0..=1.0;
        let gloss = self.gloss.unwrap_or(Gloss { strength: 0.0, width: 1.0 });
        if !unit.contains(&self.reflectance) {
            Err("its reflectance is not in [0, 1]")
        } else if !unit.contains(&gloss.strength) {
            Err("its gloss strength is not in [0, 1]")
        } else if !unit.contains(&self.albedo()) {
            Err("its reflectance and gloss strength add up to more than 1")
        } else if !(gloss.width > 0.0 && gloss.width <= Gloss::WIDEST) {
            Err("its gloss width is not in (0, 3]")
        } else if !(self.emission >= 0.0 && self.emission.is_finite()) {
            Err("its emission is negative or not finite")
        } else {
            Ok(())
        }
    }
}

impl<T: Number> Gloss<T> {
    /// g_w(α), given sin²(α/2): a quarter of the squared distance between the mirror direction and ω_i.
    pub(crate) fn density_at_chord(&self, sin_squared: T) -> T {
        // cosh w − cos α without cancellation: 2 sinh²(w/2) + 2 sin²(α/2).
        let spread = (self.width * 0.5).sinh().squared() + sin_squared;
        self.width.sinh() / (spread * (2.0 * TAU))
    }
}

impl Gloss {
    /// Largest width: g_w is then constant to within ±10 %.
    pub const WIDEST: f64 = 3.0;

    /// g_w(α).
    #[must_use]
    pub fn density(&self, alpha: f64) -> f64 {
        self.density_at_chord((0.5 * alpha).sin().powi(2))
    }

    /// ∂g/∂α and ∂g/∂w.
    #[must_use]
    pub(crate) fn density_gradient(&self, alpha: f64) -> [f64; 2] {
        let spread = (0.5 * self.width).sinh().powi(2) + (0.5 * alpha).sin().powi(2);
        let g = self.density(alpha);
        // coth w − sinh w/(cosh w − cos α) cancels where α is small.
        let w = self.width;
        let by_width = (0.5 * alpha).sin().powi(2) * w.cosh() - (0.5 * w).sinh().powi(2);
        [-0.5 * g * alpha.sin() / spread, g * by_width / (w.sinh() * spread)]
    }

    /// The angle α below which the fraction ξ of the lobe lies, in (−π, π).
    #[must_use]
    pub fn quantile(&self, xi: f64) -> f64 {
        2.0 * ((0.5 * self.width).tanh() * (PI * (xi - 0.5)).tan()).atan()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_lobe_integrates_to_one_and_its_quantile_inverts_it() {
        for width in [1e-6, 1e-3, 0.1, 1.0, 3.0] {
            let gloss = Gloss { strength: 1.0, width };
            // At equal steps of the distribution: ∫ g dα = Σ g dα/dξ Δξ.
            let n = 4000;
            let mut sum = 0.0;
            for i in 0..n {
                let at = |x: f64| gloss.quantile(x / f64::from(n));
                let (a, b) = (at(f64::from(i)), at(f64::from(i) + 1.0));
                if i > 0 && i < n - 1 {
                    sum += gloss.density(at(f64::from(i) + 0.5)) * (b - a);
                }
            }
            let expected = 1.0 - 2.0 / f64::from(n);
            assert!((sum - expected).abs() < 2e-4, "{width} {sum}");
        }
    }

    #[test]
    fn the_slopes_are_those_of_the_lobe() {
        for width in [1e-4_f64, 0.1, 1.0, 3.0] {
            for alpha in [0.0, 0.3 * width, -2.0 * width, 1.0, -3.0] {
                let g = |alpha: f64, width: f64| Gloss { strength: 1.0, width }.density(alpha);
                let h = 1e-5 * width;
                let by_angle = (g(alpha + h, width) - g(alpha - h, width)) / (2.0 * h);
                let by_width = (g(alpha, width + h) - g(alpha, width - h)) / (2.0 * h);
                let scale = g(alpha, width) / width;
                let [a, w] = Gloss { strength: 1.0, width }.density_gradient(alpha);
                assert!((a - by_angle).abs() < 1e-6 * scale, "{width} {alpha}: {a} {by_angle}");
                assert!((w - by_width).abs() < 1e-6 * scale, "{width} {alpha}: {w} {by_width}");
            }
        }
    }
}
