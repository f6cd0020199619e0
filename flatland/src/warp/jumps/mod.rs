//! Mean over discontinuities: the warp field V and its divergence from the discontinuities themselves, in
//! closed form.
//!
//! If the discontinuities around a point u are known (the edges of polygons, the ends of segments, the
//! silhouettes of meshes) no auxiliary points are needed. With b the points of the discontinuities within the
//! reach R of u and ḃ their velocities,
//!
//! ```text
//! V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + c₀),
//!
//! n = 1:  K = (1/s − 1/R)₊,        c₀ = 1/R,    a sum over points at distances s = |b − u|
//! n = 2:  K = (2/s² − 2/R²)₊,      c₀ = 2π/R,   db is arc length
//! ```
//!
//! K diverges at a discontinuity, so that V is its velocity there; K is 0 beyond R, and so is V. These are
//! inverse distance weights (Shepard 1968), integrated along curves: splitting an edge changes nothing. Over
//! straight segments both integrals and their gradients are elementary, so that V and ∇·V are exact: neither
//! random numbers nor debiasing are involved.
//!
//! # Conditions for continuity
//!
//! *Lemma (Theory 5).* Let the domain be cut into open sets by discontinuities C, and let S(u), the
//! discontinuities that are used at u, be constant in each set. Let every C be in S on both of its sides, and
//! let no other discontinuity of S on either side lie on C along a part of it with another normal velocity.
//! Then V·ν = v·ν on both sides of every C, and V is continuous in every set; for n = 2 both except at single
//! points.
//!
//! Hidden discontinuities may be in S, on both sides or on one: if they are present on one side of C only, C
//! outweighs them. They bend V where nothing is discontinuous, which costs some variance but no bias. If a
//! discontinuity of *another* velocity coincides with C and is visible when they separate, the integral has
//! only two one-sided derivatives.
//!
//! # Softened
//!
//! Where discontinuities of different velocities cross, or run a gap g apart, ∇·V ~ |Δv|/s between them, and
//! ∫ (∇·V)² is unbounded: the price of following both. A discontinuity may instead be followed in part
//! (Theory 6). With a softness ε
//!
//! ```text
//! n = 1:  K = (1/√(s² + ε²) − 1/R)₊
//! n = 2:  K = (2/(s² + ε²) − 2/R²)₊
//! ```
//!
//! ∫ K is bounded, by 1/ε and 2π/ε, and so is ∇·V, by a constant times |v|/ε. On the discontinuity V falls
//! short of v, and the remainder is a boundary term: the [residual theorem](crate::boundary), with the limits
//! of V on both sides,
//!
//! ```text
//! Σ ∮ [f⁻ (v − V⁻) − f⁺ (v − V⁺)]·ν dl,
//! ```
//!
//! where f includes the control variate. ε = 0 is the exact field, without residual; as ε grows beyond R the
//! field vanishes: edge sampling. A visible shape follows *its own* border exactly, so that the residual is
//! one-sided: V⁻ = v on the side of the shape that ends. In flat worlds that applies to segments that appear
//! wider than ε; for one seen from near its own line, its two ends are also a gap, and are softened.
//!
//! # Choice of the reach
//!
//! Any R > 0 that is constant over the integral gives the same mean. V falls from v to 0 over R, so that
//! |∇·V| ~ |v|/R: a small R includes few edges in each sum but is steep; a large one is smooth but mixes
//! discontinuities of different velocities, between which ∇·V ~ |Δv|/gap whatever R. In between the variance
//! hardly depends on it. In the plane, on a film of tent-filtered pixels, it is least at 0.6 pixels, and
//! within a quarter of that from 0.3 to 8, at a cost that grows with the edges within reach. In flat worlds
//! it is least at 1.2 pixels on the film, and over directions at about four times the width of the lobe or
//! light that is integrated over; half and twice as much increase it by up to a half. In space a smaller
//! reach is better over directions: see `volume3d::gradient::Field`.

mod segment;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use glam::DVec2;

use super::domain::{Domain, Line, Plane, Vector};
use super::parameters::WarpError;
use super::stencil::{Stencil, Term};

/// Weighted mean of the velocities of the discontinuities within reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpMean {
    /// R, in the unit of the domain: discontinuities farther away are ignored.
    pub reach: f64,
}

/// Least distance of a discontinuity, relative to the reach: u has no higher precision. V is continuous
/// there, and ∇·V then has an error of its own size.
const NEAREST: f64 = 1e-16;

/// A discontinuity near a point, and its softness.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump<P, H> {
    /// Position: the offset b − u of a point of the line, or the ends of a segment of the plane.
    pub place: P,
    /// Sources of its motion: one for a point, one for each end of a segment.
    pub moved_by: H,
    /// ε, in the unit of the domain: 0 if V equals the discontinuity's velocity on it.
    pub softness: f64,
}

/// ∫ K, or the part of it that multiplies one velocity, and its gradient by u; lengths in units of the reach.
#[derive(Clone, Copy, Debug)]
struct Share<V> {
    value: f64,
    gradient: V,
}

impl JumpMean {
    /// Checks the reach once, so that no other call need.
    ///
    /// # Errors
    /// [`WarpError::Reach`] if it is not positive and finite.
    pub fn check(&self) -> Result<(), WarpError> {
        let good = self.reach > 0.0 && self.reach.is_finite();
        if good { Ok(()) } else { Err(WarpError::Reach { reach: self.reach }) }
    }

    /// Coefficients of (V, ∇·V) at a point of the line, or of the circle by its angle, given the offset b − u
    /// and the source of every discontinuity. Discontinuities out of reach are ignored.
    pub fn of_points<H>(&self, jumps: impl IntoIterator<Item = Jump<f64, H>>) -> Stencil<Line, H> {
        let share = |offset: f64, softness: f64| {
            let [along, softness] = [offset, softness].map(|x| x / self.reach);
            let s = along.hypot(softness);
            // NaN counts as out of reach.
            (s < 1.0).then(|| {
                let s = s.max(NEAREST);
                let slope = if softness > 0.0 { along / s } else { along.signum() };
                Share { value: 1.0 / s - 1.0, gradient: slope / (s * s) }
            })
        };
        let shares =
            jumps.into_iter().filter_map(|jump| Some((share(jump.place, jump.softness)?, jump.moved_by)));
        self.mean(0.0, 1.0, shares.collect())
    }

    /// Coefficients of (V, ∇·V) at a point of the plane, given the ends and their sources for every straight
    /// discontinuity. In between, velocities are linear. Discontinuities out of reach are ignored.
    pub fn of_segments<H>(
        &self,
        u: DVec2,
        jumps: impl IntoIterator<Item = Jump<[DVec2; 2], [H; 2]>>,
    ) -> Stencil<Plane, H> {
        let mut shares = vec![];
        for Jump { place, moved_by, softness } in jumps {
            let ends = place.map(|end| (end - u) / self.reach);
            if let Some(found) = segment::shares(ends, softness / self.reach) {
                shares.extend(found.into_iter().zip(moved_by));
            }
        }
        self.mean(u, TAU, shares)
    }

    /// The quotient of the sums; `floor` is c₀ in units of the reach.
    fn mean<D: Domain, H>(
        &self,
        u: D::Vector,
        floor: f64,
        shares: Vec<(Share<D::Vector>, H)>,
    ) -> Stencil<D, H> {
        let (mut whole, mut gradient) = (floor, D::Vector::ZERO);
        for (share, _) in &shares {
            whole += share.value;
            gradient = gradient + share.gradient;
        }
        let inverse = 1.0 / whole;
        let terms = shares.into_iter().map(|(share, hit)| {
            let weight = share.value * inverse;
            let slope = (share.gradient - gradient * weight) * inverse;
            Term { hit, weight, divergence: slope * (1.0 / self.reach) }
        });
        Stencil::new(u, terms.collect())
    }
}
