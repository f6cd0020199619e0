//! Closed forms of ∫ f cos φ dφ over an interval of directions.

use std::f64::consts::PI;

use num_dual::{Dual64, DualNum};

use super::place::Angles;
use crate::dual::Vector;

/// ∫ cos φ dφ.
pub(super) fn cosine(angles: &Angles) -> Dual64 {
    let Angles { ends, cosines, width } = *angles;
    if width.re > 0.5 * PI {
        return ends[1].sin() - ends[0].sin();
    }
    // sin b − sin a = tan((b − a)/2) (cos a + cos b): no cancellation in narrow intervals.
    (width * 0.5).tan() * (cosines[0] + cosines[1])
}

/// ∫ g_w(φ − μ) cos φ dφ, with g_w(α) = sinh w/(2π (cosh w − cos α)) and the mirror direction μ.
///
/// With G = ∫ g dα: ∫ g cos α dα = cosh w G − sinh w/(2π) Δα, as g cos α = cosh w g − sinh w/(2π);
/// ∫ g sin α dα = sinh w/(2π) Δ log(cosh w − cos α); and G = Δ atan(coth(w/2) tan(α/2))/π.
pub(super) fn gloss(angles: &Angles, mirror: Dual64, width: Dual64) -> Dual64 {
    let half = angles.width * 0.5;
    let (first, last) = (angles.ends[0] - mirror, angles.ends[1] - mirror);
    let (s, c) = ((width * 0.5).sinh(), (width * 0.5).cosh());
    let (sinh, cosh) = (s * c * 2.0, s * s * 2.0 + 1.0);
    let ((sin_a, cos_a), (sin_b, cos_b)) = ((first * 0.5).sin_cos(), (last * 0.5).sin_cos());
    // The difference of both arcs, not of their values: no cancellation in narrow intervals.
    let arc = Vector([s * s * cos_a * cos_b + c * c * sin_a * sin_b, s * c * half.sin()]);
    let part = arc.angle() / PI;
    // (cosh w − cos α)/2.
    let (at_a, at_b) = (s * s + sin_a * sin_a, s * s + sin_b * sin_b);
    let rise = (first + half).sin() * half.sin() / at_a;
    let logarithm = if rise.re.abs() < 0.5 { rise.ln_1p() } else { at_b.ln() - at_a.ln() };
    let even = cosh * part - sinh * angles.width / (2.0 * PI);
    let odd = sinh * logarithm / (2.0 * PI);
    mirror.cos() * even - mirror.sin() * odd
}

/// g_w(α).
pub(super) fn density(alpha: Dual64, width: Dual64) -> Dual64 {
    let (s, sin) = ((width * 0.5).sinh(), (alpha * 0.5).sin());
    width.sinh() / ((s * s + sin * sin) * (4.0 * PI))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::oracle::adaptive::{Precision, integrate};
    use crate::transport::oracle::term::Term;

    /// Both closed forms against quadrature of the integrands, with derivatives with respect to every
    /// argument.
    #[test]
    fn closed_forms_are_integrals() {
        let precision = Precision { relative: 1e-12, halvings: 60, pieces: 10_000 };
        for w in [1e-4, 0.02, 0.5, 3.0] {
            for mirror in [-1.5, -0.3, 0.0, 1.2] {
                for (a, b) in [(-1.5, 1.4), (-0.31, -0.29), (0.1, 0.1001), (-0.5 * PI, 0.5 * PI)] {
                    let (w, mirror) = (Dual64::new(w, 0.7 * w), Dual64::new(mirror, -0.4));
                    let ends = [Dual64::new(a, 0.3), Dual64::new(b, -0.2)];
                    let width = ends[1] - ends[0];
                    let angles = Angles { ends, cosines: ends.map(|phi| phi.cos()), width };
                    let breaks = vec![(mirror.re - a) / width.re];
                    let found = [cosine(&angles), gloss(&angles, mirror, w)];
                    let expected = integrate(breaks, precision, |xi| {
                        let phi = ends[0] + width * xi;
                        [phi.cos(), density(phi - mirror, w) * phi.cos()].map(|f| Term::new(f * width))
                    });
                    for (found, expected) in found.into_iter().zip(expected) {
                        let value = (found.re - expected.value.re).abs();
                        let slope = (found.eps - expected.value.eps).abs();
                        // A peak of height 1/w loses ε/w of its position.
                        let tolerance = 1e-12 + 1e-15 / w.re;
                        assert!(value < tolerance, "{w} {mirror} {a} {b}: {found} {expected:?}");
                        let allowed = tolerance * (1.0 + expected.absolute);
                        assert!(slope < allowed, "{w} {mirror} {a} {b}: {found} {expected:?}");
                    }
                }
            }
        }
    }
}
