//! Uniform directions in which light passes a point of an edge.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::wedge::Wedge;

/// Directions to a point of an edge in which emission may be discontinuous there.
#[derive(Clone, Debug)]
pub(in crate::gradient::curve) enum Directions {
    /// Directions that meet the front of a flat emitter with this normal.
    Front(DVec3),
    /// Directions in which the edge is a silhouette.
    Wedge(Wedge),
    All,
}

impl Directions {
    /// Total solid angle.
    pub(in crate::gradient::curve) fn whole(&self) -> f64 {
        match self {
            Self::Front(_) => TAU,
            Self::Wedge(wedge) => 4.0 * wedge.angle,
            Self::All => 4.0 * PI,
        }
    }

    /// Samples a direction uniformly, for an edge with unit direction `e`.
    pub(in crate::gradient::curve) fn sample(&self, e: DVec3, [c, a, b]: [f64; 3]) -> DVec3 {
        let z = 2.0 * a - 1.0;
        let (s, t) = e.any_orthonormal_pair();
        let (u, v, turn) = match self {
            Self::Wedge(w) => (w.u, w.up, w.angle * b + if c < 0.5 { PI } else { 0.0 }),
            _ => (s, t, TAU * b),
        };
        let (sin, cos) = turn.sin_cos();
        let direction = z * e + (1.0 - z * z).sqrt() * (cos * u + sin * v);
        match self {
            Self::Front(normal) if direction.dot(*normal) > 0.0 => -direction,
            _ => direction,
        }
    }

    /// Probability density of a direction.
    pub(in crate::gradient::curve) fn density(&self, direction: DVec3) -> f64 {
        let holds = match self {
            Self::Front(normal) => direction.dot(*normal) <= 0.0,
            Self::Wedge(wedge) => wedge.holds(direction),
            Self::All => true,
        };
        if holds { self.whole().recip() } else { 0.0 }
    }
}
