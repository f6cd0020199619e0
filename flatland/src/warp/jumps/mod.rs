//! The warp field V and its divergence from the jumps themselves, exactly.
//!
//! Where the jumps around a point u are known (the edges of polygons, the ends of segments, the silhouettes of meshes)
//! no auxiliary points are needed. With b the points of the jumps within the reach R of u and ḃ their velocities,
//!
//! ```text
//! V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + c₀),
//!
//! n = 1:  K = (1/s − 1/R)₊,        c₀ = 1/R,    a sum over points at distances s = |b − u|
//! n = 2:  K = (2/s² − 2/R²)₊,      c₀ = 2π/R,   db is arc length
//! ```
//!
//! K has no bound at a jump, so that V is its velocity there; K is 0 beyond R, and so is V. These are inverse
//! distance weights (Shepard 1968), integrated along curves: cutting an edge in two changes nothing. Over
//! straight segments both integrals and their gradients are elementary, so that V and ∇·V are exact: nothing
//! is random, and nothing is left to be debiased.
//!
//! # What continuity asks
//!
//! *Lemma (Theory 5).* Let the domain be cut into open sets by jumps C, and let S(u), the jumps that are used
//! at u, be the same throughout a set. If every C is in S on both of its sides, and no other jump of S on
//! either side has another normal velocity and lies on C along a part of it, then V·ν = v·ν on both sides of
//! every C, and V is continuous in every set; for n = 2 both up to single points.
//!
//! Jumps that something else hides may be in S, on both sides or on one: where they are alone on one side
//! only of C, C outweighs them. They bend V where nothing jumps, which costs some variance and makes no bias.
//! Where a jump of *another* velocity coincides with C and is seen when they part, the integral has two
//! one-sided derivatives and no other.
//!
//! # Softened
//!
//! Where jumps of different velocities cross, or run a gap g apart, ∇·V ~ |Δv|/s between them, and ∫ (∇·V)²
//! has no bound: the price of following both. A jump may be followed in part instead (Theory 6). With a
//! softness ε
//!
//! ```text
//! n = 1:  K = (1/√(s² + ε²) − 1/R)₊
//! n = 2:  K = (2/(s² + ε²) − 2/R²)₊
//! ```
//!
//! ∫ K is bounded, by 1/ε and 2π/ε, and so is ∇·V, by a constant times |v|/ε. On the jump V falls short of v, and what is
//! missing is left to the boundary: the [residual theorem](crate::boundary), for the limits of V on both sides,
//!
//! ```text
//! Σ ∮ [f⁻ (v − V⁻) − f⁺ (v − V⁺)]·ν dl,
//! ```
//!
//! f including whatever was subtracted from it as a control variate. ε = 0 is the exact field, which leaves
//! nothing; as ε grows beyond R the field vanishes: edge sampling. A shape that is seen follows *its own*
//! border exactly, so that the residual is one-sided: V⁻ = v on the side of the shape that ends. In flat
//! worlds that is so for segments that are seen wider than ε; where one is seen from near its own line, its
//! two ends are a gap as well, and are softened.
//!
//! # Which reach
//!
//! Any R > 0 that is the same for the whole integral gives the same mean. V falls from v to 0 over R, so that
//! |∇·V| ~ |v|/R: a small R takes few edges into each sum and is steep, a large one is smooth but mixes jumps of
//! different velocities, between which ∇·V ~ |Δv|/gap whatever R. In between the variance hardly depends on it. In the
//! plane, on a film of tent pixels, it is least at 0.6 pixels, and 0.3 to 8 are within a quarter of that, at a time that
//! grows with the edges within reach. In flat worlds it is least at 1.2 pixels on the film, and over directions at about
//! four times the width of the lobe or light that is integrated over, and within half again of that for half and twice as
//! much. In space a smaller reach is better over directions: see `volume3d::gradient::Field`.

mod segment;
#[cfg(test)]
mod tests;

use std::f64::consts::TAU;

use glam::DVec2;

use super::domain::{Domain, Line, Plane, Vector};
use super::parameters::WarpError;
use super::stencil::{Stencil, Term};

/// The mean of the velocities of the jumps within reach.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct JumpMean {
    /// R, in the unit of the domain: jumps farther away do not count.
    pub reach: f64,
}

/// A jump nearer than this part of the reach is taken to be as far: u is known no better. V is continuous there, and
/// ∇·V then has an error of its own size.
const NEAREST: f64 = 1e-16;

/// A jump near a point, and how it is followed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Jump<P, H> {
    /// Where it is: the offset b − u of a point of the line, or the ends of a segment of the plane.
    pub place: P,
    /// What moves it: one thing that moves a point, one for each end of a segment.
    pub moved_by: H,
    /// ε, in the unit of the domain: 0 where V is the jump's velocity on it.
    pub softness: f64,
}

/// ∫ K, or a part of it that goes with one velocity, and its gradient by u; lengths in units of the reach.
#[derive(Clone, Copy, Debug)]
struct Share<V> {
    value: f64,
    gradient: V,
}

impl JumpMean {
    /// Checks the reach once, so that nothing else need.
    ///
    /// # Errors
    /// [`WarpError::Reach`] if it is not positive and finite.
    pub fn check(&self) -> Result<(), WarpError> {
        let good = self.reach > 0.0 && self.reach.is_finite();
        if good { Ok(()) } else { Err(WarpError::Reach { reach: self.reach }) }
    }

    /// The coefficients of (V, ∇·V) at a point of the line, or of the circle by its angle: from every jump by its
    /// offset b − u and by what moves it. Those out of reach have no part.
    pub fn of_points<H>(&self, jumps: impl IntoIterator<Item = Jump<f64, H>>) -> Stencil<Line, H> {
        let share = |offset: f64, softness: f64| {
            let [along, softness] = [offset, softness].map(|x| x / self.reach);
            let s = along.hypot(softness);
            // What is not a number is out of reach.
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

    /// The coefficients of (V, ∇·V) at a point of the plane: from every straight jump by its ends and by what moves
    /// these. In between, velocities are linear. Those out of reach have no part.
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
