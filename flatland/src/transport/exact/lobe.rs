//! Integrals of the glossy lobe times a cosine over an interval of directions, in closed form.
//!
//! With g_w(α) = sinh w / (2π (cosh w − cos α)), Poisson's kernel, and Δ for the difference between the ends
//! of the interval,
//!
//! ```text
//! ∫ g dα       = 1/π Δ atan(coth(w/2) tan(α/2))                 =: G
//! ∫ g cos α dα = cosh w G − sinh w Δα / 2π                      =: C
//! ∫ g sin α dα = sinh w / 2π Δ ln(cosh w − cos α)               =: S
//! ```
//!
//! Every difference is transformed to avoid cancellation, so that intervals may be arbitrarily short and
//! lobes arbitrarily narrow.

use std::f64::consts::{PI, TAU};

use crate::transport::Gloss;

/// The lobe over the angles α from `first` to `last`, with a known difference.
#[derive(Clone, Copy, Debug)]
pub(super) struct LobeArc {
    sinh: f64,
    cosh: f64,
    /// sinh²(w/2).
    base: f64,
    width: f64,
    /// Sine of the middle angle, its cosine, and sine of half the width.
    sin_middle: f64,
    cos_middle: f64,
    sin_half: f64,
    /// sin² of half the middle angle.
    half_middle: f64,
    /// (cosh w − cos α)/2 at both ends.
    spread: [f64; 2],
    /// G.
    mass: f64,
    /// Δ ln(cosh w − cos α).
    logarithm: f64,
}

impl LobeArc {
    pub(super) fn new(gloss: &Gloss, first: f64, width: f64) -> Self {
        let w = gloss.width;
        let base = (0.5 * w).sinh().powi(2);
        let (sinh, cosh) = (w.sinh(), w.cosh());
        let (sin_half, cos_half) = (0.5 * width).sin_cos();
        let middle = first + 0.5 * width;
        let ((sin_middle, cos_middle), half_middle) = (middle.sin_cos(), (0.5 * middle).sin().powi(2));
        let [low, high] = [first, first + width].map(|a| (0.5 * a).sin());
        let spread = [base + low * low, base + high * high];
        // The angle between (sinh w/2 cos α/2, cosh w/2 sin α/2) at both ends.
        let mass = (0.5 * sinh * sin_half).atan2(base * cos_half + low * high) / PI;
        let difference = sin_middle * sin_half;
        let logarithm = if difference > -0.5 * spread[0] {
            (difference / spread[0]).ln_1p()
        } else {
            -(-difference / spread[1]).ln_1p()
        };
        Self {
            sinh,
            cosh,
            base,
            width,
            sin_middle,
            cos_middle,
            sin_half,
            half_middle,
            spread,
            mass,
            logarithm,
        }
    }

    /// C and S.
    pub(super) fn moments(&self) -> [f64; 2] {
        let cos = self.cosh * self.mass - self.sinh * self.width / TAU;
        [cos, self.sinh * self.logarithm / TAU]
    }

    /// ∂C/∂w and ∂S/∂w.
    pub(super) fn moments_by_width(&self) -> [f64; 2] {
        // ∂G/∂w = −Δ (sin α / (cosh w − cos α)) / 2π.
        let quarter = (0.25 * self.width).sin().powi(2);
        let numerator = self.base * self.cos_middle + quarter - self.half_middle;
        let mass = -self.sin_half * numerator / (self.spread[0] * self.spread[1]) / TAU;
        let cos = self.sinh * self.mass + self.cosh * mass - self.cosh * self.width / TAU;
        let sin = (self.cosh * self.logarithm + 0.5 * self.sinh * self.sinh * self.reciprocals()) / TAU;
        [cos, sin]
    }

    /// g at both ends, and the difference of the two.
    pub(super) fn ends(&self) -> ([f64; 2], f64) {
        let factor = self.sinh / (2.0 * TAU);
        (self.spread.map(|s| factor / s), factor * self.reciprocals())
    }

    /// Δ 1/spread.
    fn reciprocals(&self) -> f64 {
        -self.sin_middle * self.sin_half / (self.spread[0] * self.spread[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::quadrature::adaptive;

    /// Reference by quadrature: ∫ of g cos α, g sin α, and their slopes in w, and ∫ |g| for the scale.
    fn by_quadrature(gloss: &Gloss, first: f64, last: f64) -> [f64; 4] {
        let mut ends = vec![first];
        if first < 0.0 && last > 0.0 {
            ends.push(0.0);
        }
        ends.push(last);
        let pieces: Vec<[f64; 2]> = ends.windows(2).map(|e| [e[0], e[1]]).collect();
        let values = |a: f64| {
            let (g, by_width) = (gloss.density(a), gloss.density_gradient(a)[1]);
            let (sin, cos) = a.sin_cos();
            let scale = g.abs() + by_width.abs();
            ([g * cos, g * sin, by_width * cos, by_width * sin], scale)
        };
        adaptive(&pieces, values, 1e-13).value
    }

    #[test]
    fn moments_agree_with_quadrature() {
        for width in [1e-6, 1e-4, 0.01, 0.3, 1.0, 3.0] {
            let gloss = Gloss { strength: 1.0, width };
            for (first, last) in [
                (-1.0, 1.5),
                (0.2, 0.7),
                (-3.0, -0.1),
                (-0.5 * width, 2.0 * width),
                (width, 1.001 * width),
                (1.0, 1.0 + 1e-9),
            ] {
                let arc = LobeArc::new(&gloss, first, last - first);
                let ([c, s], [cw, sw]) = (arc.moments(), arc.moments_by_width());
                let expected = by_quadrature(&gloss, first, last);
                // The mass of the interval, and that divided by the width of the lobe.
                let scale = [1.0, 1.0, 1.0 / width, 1.0 / width].map(|s| s * arc.mass);
                for (i, (found, expected)) in [c, s, cw, sw].into_iter().zip(expected).enumerate() {
                    let error = (found - expected).abs() / scale[i];
                    assert!(error < 1e-11, "{i} {width} {first}..{last}: {found} {expected}");
                }
            }
        }
    }
}
