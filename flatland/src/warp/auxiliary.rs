//! Patterns of auxiliary points.

use rand::{Rng, RngExt};

use super::domain::{Domain, Draw};
use crate::random::open01;

/// How the auxiliary points of one estimate are arranged. Each alone has the kernel's density,
/// whatever the pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AuxiliaryPoints {
    /// Independent points.
    Independent,
    /// Pairs u ± δ (plane) or reflections through u (circle, sphere): the odd part of ∇w cancels.
    /// An odd number of points leaves the last one alone.
    #[default]
    Antithetic,
    /// Antithetic pairs in a Latin hypercube: radii and angles of the pairs fill equal strata.
    Stratified,
}

impl AuxiliaryPoints {
    /// Draws `count` points around u into `draws`, after what is already there.
    pub(super) fn draw<D: Domain>(
        self,
        u: D::Vector,
        kappa: f64,
        count: usize,
        rng: &mut impl Rng,
        draws: &mut Vec<Draw<D::Vector>>,
    ) {
        let pairs = count.div_ceil(2);
        match self {
            Self::Independent => {
                for _ in 0..count {
                    let xi = [open01(rng), open01(rng)];
                    draws.push(D::draw(u, kappa, xi, rng));
                }
            }
            Self::Antithetic => {
                for i in 0..pairs {
                    let xi = [open01(rng), open01(rng)];
                    push_pair::<D>(u, D::draw(u, kappa, xi, rng), 2 * i + 1 < count, draws);
                }
            }
            Self::Stratified => {
                // Both orders are random: with an odd count the last point is alone, and must not
                // always come from the same stratum.
                let (radii, angles) = (permutation(pairs, rng), permutation(pairs, rng));
                let width = 1.0 / pairs as f64;
                for (i, (radius, angle)) in radii.into_iter().zip(angles).enumerate() {
                    let radius = (radius as f64 + open01(rng)) * width;
                    // Pairs need only half a turn.
                    let half_turn = (angle as f64 + open01(rng)) * width * 0.5;
                    // Which of the two comes first must be fair where only one is used.
                    let angle = half_turn + if rng.random() { 0.5 } else { 0.0 };
                    let draw = D::draw(u, kappa, [radius, angle], rng);
                    push_pair::<D>(u, draw, 2 * i + 1 < count, draws);
                }
            }
        }
    }
}

/// A random order of 0 .. n (Fisher–Yates).
fn permutation(n: usize, rng: &mut impl Rng) -> Vec<usize> {
    let mut order: Vec<usize> = (0..n).collect();
    for i in (1..n).rev() {
        order.swap(i, rng.random_range(0..=i));
    }
    order
}

fn push_pair<D: Domain>(u: D::Vector, draw: Draw<D::Vector>, both: bool, draws: &mut Vec<Draw<D::Vector>>) {
    draws.push(draw);
    if both {
        draws.push(D::reflect(u, &draw));
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::random::stream;
    use crate::warp::{Circle, Plane};

    fn mean_exponent<D: Domain<Vector = DVec2>>(points: AuxiliaryPoints, kappa: f64) -> f64 {
        let mut rng = stream(4, &[]);
        let mut draws = vec![];
        for _ in 0..20_000 {
            points.draw::<D>(DVec2::X, kappa, 9, &mut rng, &mut draws);
        }
        assert_eq!(draws.len(), 180_000);
        draws.iter().map(|d| d.exponent).sum::<f64>() / draws.len() as f64
    }

    #[test]
    fn every_pattern_has_the_kernel_as_its_marginal() {
        for points in [AuxiliaryPoints::Independent, AuxiliaryPoints::Antithetic, AuxiliaryPoints::Stratified]
        {
            // Plane: x is exponential with mean 1. Circle: mean κ(1 − I₁/I₀) at κ = 2.
            assert!((mean_exponent::<Plane>(points, 5.0) - 1.0).abs() < 0.015, "{points:?}");
            let circle = mean_exponent::<Circle>(points, 2.0);
            assert!((circle - 2.0 * (1.0 - 0.697_774_658_0)).abs() < 0.01, "{points:?} {circle}");
        }
    }
}
