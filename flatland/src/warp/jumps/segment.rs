//! A straight discontinuity in the plane: ∫ K and its parts by the velocities of both ends, in closed form.

use glam::DVec2;

use super::{NEAREST, Share};

/// Parts of both ends of the segment from a to b with softness ε, relative to u and in units of the reach;
/// `None` if no point of it is within reach.
///
/// With x along the segment from the foot of u, s² = d² + ε² for the distance d from its line, and
/// ρ² = s² + x², all integrals are elementary:
///
/// ```text
/// ∫ dx/ρ² = T/s,  T = Δ atan(x/s),      ∫ x dx/ρ² = ½ Δ ln ρ²,
/// ∫ x dx/ρ⁴ = −½ Δ 1/ρ²,   ∫ x² dx/ρ⁴ = ½ (T/s − Δ x/ρ²),   ∫ dx/ρ⁴ = (T/s + Δ x/ρ²)/(2s²),
/// ```
///
/// where Δ is the difference between the ends of the part within reach. K is 0 where the reach cuts the
/// segment, so that the cuts add nothing to the gradient.
pub(super) fn shares([a, b]: [DVec2; 2], softness: f64) -> Option<[Share<DVec2>; 2]> {
    let edge = b - a;
    let length = edge.length();
    // A segment of zero or NaN length has no part.
    if length.is_nan() || length <= 0.0 {
        return None;
    }
    let along = edge / length;
    let across = along.perp();
    let height = -across.dot(a);
    let s = height.hypot(softness).max(NEAREST);
    let half = (1.0 - s) * (1.0 + s);
    if half <= 0.0 {
        return None;
    }
    let limit = half.sqrt();
    let first = along.dot(a);
    let last = first + length;
    let (low, high) = (first.max(-limit), last.min(limit));
    if low >= high {
        return None;
    }
    let i = Integrals::new(s, low, high);
    // K = 2/ρ² − 2 and ∇K = 4 (b − u)/ρ⁴; u moves across the segment by its height, which is at least s on an
    // exact discontinuity.
    let rise = if softness > 0.0 { height } else { s.copysign(height) };
    let [whole, moment] =
        [2.0 * (i.inverse_square - (high - low)), 2.0 * i.logarithm - (high - low) * (high + low)];
    let gradient = |x: f64, one: f64| 4.0 * x * along - 4.0 * rise * one * across;
    let [whole_gradient, moment_gradient] = [gradient(i.x4, i.one4), gradient(i.xx4, i.x4)];
    let share = |sign: f64, end: f64| Share {
        value: sign * (moment - end * whole) / length,
        gradient: sign * (moment_gradient - end * whole_gradient) / length,
    };
    Some([share(-1.0, last), share(1.0, first)])
}

/// Integrals over x with ρ² = s² + x².
struct Integrals {
    /// ∫ dx/ρ².
    inverse_square: f64,
    /// ∫ x dx/ρ².
    logarithm: f64,
    /// ∫ dx/ρ⁴, ∫ x dx/ρ⁴, ∫ x² dx/ρ⁴.
    one4: f64,
    x4: f64,
    xx4: f64,
}

impl Integrals {
    fn new(s: f64, low: f64, high: f64) -> Self {
        let squared = s * s;
        let (between, sum) = (high - low, high + low);
        let [near, far] = [low, high].map(|x| squared + x * x);
        let inverse_square = (s * between).atan2(squared + low * high) / s;
        // Differences of 1/ρ² and x/ρ², without cancellation.
        let steep = -between * sum / (near * far);
        let slope = between * (squared - low * high) / (near * far);
        // From the smaller ρ; otherwise the difference of logarithms might contain the logarithm of 0.
        let rise = if sum > 0.0 { between * sum / near } else { -between * sum / far };
        let nearest = if low * high > 0.0 { low.abs().min(high.abs()) } else { 0.0 };
        let one4 = if squared > SERIES * nearest * nearest {
            (inverse_square + slope) / (2.0 * squared)
        } else {
            end_on(squared, low, high)
        };
        Self {
            inverse_square,
            logarithm: 0.5 * rise.ln_1p().copysign(sum),
            one4,
            x4: -0.5 * steep,
            xx4: 0.5 * (inverse_square - slope),
        }
    }
}

/// ∫ dx/ρ⁴ if u is nearly on the segment's line but far along it: the closed form loses digits as s²/x²
/// there, the series in it does not.
fn end_on(squared: f64, low: f64, high: f64) -> f64 {
    let antiderivative = |x: f64| {
        let ratio = squared / (x * x);
        let (mut sum, mut power) = (0.0, 1.0);
        for k in 0..TERMS {
            let k = k as f64;
            sum -= (k + 1.0) * power / (2.0 * k + 3.0);
            power *= -ratio;
        }
        sum / (x * x * x)
    };
    antiderivative(high) - antiderivative(low)
}

/// s²/x² below which the series is used: the closed form has lost three of sixteen digits there.
pub(super) const SERIES: f64 = 1e-3;
/// Terms of the series: (10⁻³)⁶ is below rounding.
const TERMS: usize = 6;
