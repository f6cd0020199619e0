//! Gauss–Legendre nodes on [0, 1].

use std::sync::LazyLock;

/// Nodes and weights of the n-point rule, exact for polynomials of degree 2n − 1.
pub type Rule = Vec<(f64, f64)>;

static RULES: LazyLock<Vec<Rule>> = LazyLock::new(|| (0..=40).map(gauss_legendre).collect());

/// The rule of n ≤ 40 points.
pub fn rule(n: usize) -> &'static Rule {
    &RULES[n]
}

/// Newton's iteration on the Legendre polynomial Pₙ from Chebyshev-like guesses; the weights are
/// 2/((1 − t²) Pₙ'²) on [−1, 1].
fn gauss_legendre(n: usize) -> Rule {
    let degree = f64::from(u8::try_from(n).expect("few points"));
    let mut rule = vec![];
    for i in (0..u8::try_from(n).expect("few points")).rev() {
        let mut t = (std::f64::consts::PI * (f64::from(i) + 0.75) / (degree + 0.5)).cos();
        let mut slope = 0.0;
        for _ in 0..20 {
            let (mut last, mut p) = (1.0, t);
            for k in 2..=u8::try_from(n).expect("few points") {
                let k = f64::from(k);
                (last, p) = (p, ((2.0 * k - 1.0) * t * p - (k - 1.0) * last) / k);
            }
            slope = if n == 1 { 1.0 } else { degree * (t * p - last) / (t * t - 1.0) };
            t -= p / slope;
        }
        rule.push((0.5 * (1.0 + t), 1.0 / ((1.0 - t * t) * slope * slope)));
    }
    let sum: f64 = rule.iter().map(|(_, w)| w).sum();
    rule.into_iter().map(|(t, w)| (t, w / sum)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn monomials_are_exact_up_to_their_degree() {
        for n in 1..=10_u8 {
            for power in 0..2 * n {
                let integral: f64 = rule(n.into()).iter().map(|(t, w)| w * t.powi(i32::from(power))).sum();
                let exact = 1.0 / (f64::from(power) + 1.0);
                assert!((integral - exact).abs() < 4e-16, "n {n} power {power}: {integral} for {exact}");
            }
        }
    }
}
