//! Sampling patterns of auxiliary points.

use rand::{Rng, RngExt};

use super::domain::{Domain, Draw};
use crate::random::open01;

/// Sampling pattern of the auxiliary points of one estimate. Each point alone has the kernel's density,
/// whatever the pattern.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AuxiliaryPoints {
    /// Independent points.
    Independent,
    /// Pairs u ± δ (line, plane) or reflections through u (circle, sphere): the odd part of ∇w cancels. With
    /// an odd number of points the last one is unpaired.
    #[default]
    Antithetic,
    /// Antithetic pairs in a Latin hypercube: radii and angles of the pairs fill equal strata.
    Stratified,
}

impl AuxiliaryPoints {
    /// Number of a batch's points that are drawn jointly: 1, a pair, or the whole batch.
    pub(super) fn unit(self, batch: usize) -> usize {
        match self {
            Self::Independent => 1,
            Self::Antithetic if batch.is_multiple_of(2) => 2,
            Self::Antithetic | Self::Stratified => batch,
        }
    }

    /// Draws `count` points around u and appends them to `draws`.
    pub(super) fn draw<D: Domain>(
        self,
        u: D::Vector,
        kappa: f64,
        radial_exponent: f64,
        count: usize,
        rng: &mut impl Rng,
        draws: &mut Vec<Draw<D::Vector>>,
    ) {
        let pairs = count.div_ceil(2);
        match self {
            Self::Independent => {
                for _ in 0..count {
                    let xi = [open01(rng), open01(rng)];
                    draws.push(D::draw(u, kappa, radial_exponent, xi));
                }
            }
            Self::Antithetic => {
                for i in 0..pairs {
                    let xi = [open01(rng), open01(rng)];
                    push_pair::<D>(u, D::draw(u, kappa, radial_exponent, xi), 2 * i + 1 < count, draws);
                }
            }
            Self::Stratified => {
                // Both orders are random: with an odd count the last point is unpaired, and must not always
                // come from the same stratum.
                let (radii, angles) = (permutation(pairs, rng), permutation(pairs, rng));
                let width = 1.0 / pairs as f64;
                for (i, (radius, angle)) in radii.into_iter().zip(angles).enumerate() {
                    let radius = (radius as f64 + open01(rng)) * width;
                    // Pairs need only half a rotation.
                    let half_turn = (angle as f64 + open01(rng)) * width * 0.5;
                    // The order within a pair must be fair if only one point is used.
                    let angle = half_turn + if rng.random() { 0.5 } else { 0.0 };
                    let draw = D::draw(u, kappa, radial_exponent, [radius, angle]);
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
    use crate::warp::Plane;

    #[test]
    fn every_pattern_has_the_same_marginal() {
        for points in [AuxiliaryPoints::Independent, AuxiliaryPoints::Antithetic, AuxiliaryPoints::Stratified]
        {
            let mut rng = stream(4, &[]);
            let mut draws = vec![];
            for _ in 0..20_000 {
                points.draw::<Plane>(DVec2::X, 5.0, 1.0, 9, &mut rng, &mut draws);
            }
            assert_eq!(draws.len(), 180_000);
            // x is exponential with mean 1, and directions are uniform.
            let n = draws.len() as f64;
            assert!((draws.iter().map(|d| d.exponent).sum::<f64>() / n - 1.0).abs() < 0.015, "{points:?}");
            let drift = draws.iter().map(|d| d.tangent).sum::<DVec2>() / n;
            assert!(drift.length() < 5e-3, "{points:?} {drift}");
        }
    }
}
