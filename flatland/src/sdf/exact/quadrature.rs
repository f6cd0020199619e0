//! Adaptive Gauss–Legendre quadrature for integrands with square roots at their ends.

use std::f64::consts::PI;

use crate::quadrature::gauss_legendre;

/// Points of a sum.
const POINTS: usize = 20;

/// Largest number of halvings of an interval.
const DEPTH: usize = 9;

/// Largest number of halvings towards an end: closer to it, the rounding of α makes 1/√(α − a) noise.
const DEPTH_AT_ENDS: usize = 7;

/// Tolerance on the difference between one sum and two over halves, relative to the integral of the
/// magnitude.
const AGREEMENT: f64 = 1e-11;

/// A rule that is refined where an integrand asks for it.
#[derive(Debug)]
pub(super) struct Quadrature {
    /// Nodes and weights on [0, 1].
    nodes: Vec<(f64, f64)>,
}

/// ∫f and ∫|f|.
#[derive(Clone, Copy)]
struct Sum {
    value: f64,
    size: f64,
}

impl Quadrature {
    pub(super) fn new() -> Self {
        Self { nodes: gauss_legendre(POINTS) }
    }

    /// ∫ f dα from a to b, where f may behave like a power of ½ or −½ of the distance to either end.
    pub(super) fn integrate(&self, a: f64, b: f64, f: impl Fn(f64) -> f64) -> f64 {
        if b <= a {
            return 0.0;
        }
        let width = b - a;
        // dα = (π/2) (b − a) sin πs ds, written so that α − a does not cancel near either end.
        let g = |s: f64| {
            let near = (0.5 * PI * s).sin();
            f(a + width * near * near) * 0.5 * PI * width * (PI * s).sin()
        };
        let whole = self.sum(0.0, 1.0, &g);
        // Angles are rounded to ε, which limits the agreement in a narrow interval.
        let rounding = 16.0 * f64::EPSILON * (1.0 + a.abs()) / width;
        self.halve((0.0, 1.0), whole, AGREEMENT.max(rounding) * whole.size, &g, 0)
    }

    fn sum(&self, a: f64, b: f64, f: &impl Fn(f64) -> f64) -> Sum {
        let mut sum = Sum { value: 0.0, size: 0.0 };
        for &(t, w) in &self.nodes {
            let value = w * (b - a) * f(a + t * (b - a));
            sum.value += value;
            sum.size += value.abs();
        }
        sum
    }

    /// Halves until two sums agree with one to within `tolerance`.
    fn halve(
        &self,
        (a, b): (f64, f64),
        whole: Sum,
        tolerance: f64,
        f: &impl Fn(f64) -> f64,
        depth: usize,
    ) -> f64 {
        let middle = 0.5 * (a + b);
        let (left, right) = (self.sum(a, middle, f), self.sum(middle, b, f));
        let value = left.value + right.value;
        let deepest = if a == 0.0 || b == 1.0 { DEPTH_AT_ENDS } else { DEPTH };
        let agree = (value - whole.value).abs() <= tolerance.max(AGREEMENT * (left.size + right.size));
        // Non-finite values never agree.
        if depth >= deepest || agree || !value.is_finite() {
            return value;
        }
        self.halve((a, middle), left, tolerance, f, depth + 1)
            + self.halve((middle, b), right, tolerance, f, depth + 1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn square_roots_at_the_ends_do_no_harm() {
        let quadrature = Quadrature::new();
        // ∫ √(1 − x²) = π/2 and ∫ 1/√(1 − x²) = π over [−1, 1]; smooth and nearly singular ones.
        let found = [
            (quadrature.integrate(-1.0, 1.0, |x| ((1.0 - x) * (1.0 + x)).max(0.0).sqrt()), PI / 2.0),
            (quadrature.integrate(0.0, 1.0, |x| x.sqrt().recip()), 2.0),
            (quadrature.integrate(0.0, 2.0, f64::exp), 2.0_f64.exp() - 1.0),
            (quadrature.integrate(-1.0, 1.0, |x| 1e-2 / (1e-4 + x * x)), 2.0 * 1e2_f64.atan()),
        ];
        for (found, expected) in found {
            assert!((found - expected).abs() < 1e-12 * expected, "{found} {expected}");
        }
    }
}
