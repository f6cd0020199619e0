//! Lambert's formula.

use num_dual::{Dual64, DualNum};

use crate::dual::Vector3;

/// Below this tan² Θ, nine terms of the series leave an error below rounding.
const SMALL: f64 = 1e-2;

/// ∫ n·ω dω over the cone of a polygon that lies above the horizon of n and is counterclockwise
/// around its cone, and the sum of the absolute values of the derivative's terms:
///
/// ```text
/// ½ Σ Θ_k Γ_k·n,   Θ_k the angle between corners k and k + 1, Γ_k the unit vector along d_k × d_{k+1}
/// ```
///
/// (Lambert 1760; Baum, Rushmeier and Winget 1989, equation 8). The corners d_k need no unit length.
pub(super) fn cosine_integral(polygon: &[Vector3], normal: Vector3) -> (Dual64, f64) {
    let mut sum = Dual64::from(0.0);
    let mut absolute = 0.0;
    for (k, &a) in polygon.iter().enumerate() {
        let b = polygon[(k + 1) % polygon.len()];
        // a × b from the difference b − a, which stays accurate when b is near a.
        let cross = a.cross(b - a);
        let term = angle_over_sine(cross.dot(cross), a.dot(b)) * cross.dot(normal) * 0.5;
        sum += term;
        absolute += term.eps.abs();
    }
    (sum, absolute)
}

/// Θ/s with s² = |a × b|² and c = a·b, Θ = atan2(s, c): smooth where s = 0, where √(s²) is not.
fn angle_over_sine(squared_sine: Dual64, cosine: Dual64) -> Dual64 {
    let squared_tangent = squared_sine / (cosine * cosine);
    if cosine.re > 0.0 && squared_tangent.re < SMALL {
        // atan(t)/t = 1 − t²/3 + t⁴/5 − …
        let series = (0..9)
            .rev()
            .fold(Dual64::from(0.0), |sum, k| -(sum * squared_tangent) + 1.0 / f64::from(2 * k + 1));
        return series / cosine;
    }
    let sine = squared_sine.sqrt();
    sine.atan2(cosine) / sine
}
