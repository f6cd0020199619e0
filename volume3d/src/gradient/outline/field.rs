//! The field at one direction, linear in the velocities of the ends of edges.

use std::f64::consts::TAU;
use std::ops::Range;

use flatland::warp::Field;
use glam::DVec3;

use super::arc::{Arc, Moments, Reach};
use super::tree::{Cone, Edge, HalfSpace, Tree};
use crate::Sphere;
use crate::gradient::auxiliary::Seen;
use crate::scene::Scene;
use flatland::warp::Domain as _;

/// Where silhouettes are looked for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Edges<'e> {
    /// Among all.
    Tree(&'e Tree),
    /// Among some that are all silhouettes, with none missing that may be near.
    Listed(&'e [Edge]),
}

impl Edges<'_> {
    fn for_each(self, cone: &Cone<'_>, mut f: impl FnMut(&Edge)) {
        match self {
            Self::Tree(tree) => tree.for_each(cone, f),
            Self::Listed(edges) => edges.iter().for_each(&mut f),
        }
    }
}

/// What is looked at.
#[derive(Clone, Debug)]
pub(crate) struct View<'p> {
    pub(crate) origin: DVec3,
    /// Where what is seen is nothing but silhouettes before these planes.
    pub(crate) planes: &'p [HalfSpace],
    /// The triangle whose edges are jumps as well.
    pub(crate) triangle: Option<u32>,
    /// Positions of which no edge counts.
    pub(crate) without: Range<usize>,
}

/// The end of an arc, with its part of the field.
#[derive(Clone, Copy, Debug)]
pub(crate) struct End {
    seen: Seen,
    /// V is the sum of this times the velocity, projected.
    part: f64,
    /// ∇·V is the sum of this dotted with the velocity.
    divergence: DVec3,
}

/// V and ∇·V at a direction, from the velocities of ends of arcs.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    point: DVec3,
    ends: Vec<End>,
}

/// An arc's ends and moments, until all are known.
struct Piece {
    seen: [Seen; 2],
    moments: Moments,
}

impl Outline {
    /// The field at u; nothing if no arc is near.
    pub(crate) fn new(
        scene: &Scene,
        edges: Edges<'_>,
        view: &View<'_>,
        u: DVec3,
        reach: Reach,
    ) -> Option<Self> {
        let mut pieces: Vec<Piece> = vec![];
        let mut own = [u32::MAX; 3];
        if let Some(t) = view.triangle {
            own = scene.triangles[t as usize].positions;
            for k in 0..3 {
                let ends = [own[k], own[(k + 1) % 3]];
                let places = ends.map(|i| scene.positions[i as usize]);
                pieces.extend(piece(ends, places, view, u, reach));
            }
        }
        let cone = Cone { origin: view.origin, axis: u, reach, planes: view.planes };
        edges.for_each(&cone, |edge| {
            let left_out = edge.ends.iter().all(|&i| view.without.contains(&(i as usize)));
            if !left_out && !edge.ends.iter().all(|i| own.contains(i)) {
                pieces.extend(piece(edge.ends, edge.places, view, u, reach));
            }
        });
        Self::mean(&pieces, u, reach)
    }

    fn mean(pieces: &[Piece], u: DVec3, reach: Reach) -> Option<Self> {
        if pieces.is_empty() {
            return None;
        }
        // 2π/R, with the chord of R.
        let floor = TAU / (2.0 * reach.versine).sqrt();
        let mut whole = floor;
        let mut slope = DVec3::ZERO;
        for p in pieces {
            whole += p.moments.whole.value;
            slope += p.moments.whole.gradient;
        }
        let slope = slope / whole;
        let ends = pieces.iter().flat_map(|p| p.seen.into_iter().zip(p.moments.ends));
        let ends = ends
            .map(|(seen, moment)| {
                let part = moment.value / whole;
                let gradient = moment.gradient / whole;
                // ∇·(F − (F·u) u) = tr ∇F − 2 F·u on the sphere.
                End { seen, part, divergence: gradient - part * (slope + 2.0 * u) }
            })
            .collect();
        Some(Self { point: u, ends })
    }

    /// Whether all coefficients are.
    pub(crate) fn is_finite(&self) -> bool {
        self.ends.iter().all(|end| end.part.is_finite() && end.divergence.is_finite())
    }

    /// V and ∇·V.
    pub(crate) fn field(&self, mut velocity: impl FnMut(&Seen) -> DVec3) -> Field<DVec3> {
        let (mut value, mut divergence) = (DVec3::ZERO, 0.0);
        for end in &self.ends {
            let v = velocity(&end.seen);
            value += end.part * v;
            divergence += end.divergence.dot(v);
        }
        Field { value: Sphere::project(self.point, value), divergence }
    }

    /// The transpose: hands each end its covector in a·V + b ∇·V.
    pub(crate) fn scatter(&self, a: DVec3, b: f64, mut add: impl FnMut(&Seen, DVec3)) {
        let a = Sphere::project(self.point, a);
        for end in &self.ends {
            add(&end.seen, end.part * a + b * end.divergence);
        }
    }
}

/// The part of an edge before all planes, as an arc around u.
fn piece(ends: [u32; 2], places: [DVec3; 2], view: &View<'_>, u: DVec3, reach: Reach) -> Option<Piece> {
    let [p, q] = places.map(|p| p - view.origin);
    let pole = p.cross(places[1] - places[0]);
    let squared = pole.length_squared();
    // Most edges end here: the whole great circle is out of reach.
    if u.dot(pole).powi(2) >= reach.sine * reach.sine * squared {
        return None;
    }
    // The part of the edge that is left, from 0 to 1.
    let (mut low, mut high) = (0.0_f64, 1.0_f64);
    for plane in view.planes {
        let [a, b] = places.map(|p| plane.height(p));
        match (a > 0.0, b > 0.0) {
            (true, true) => {}
            (false, false) => return None,
            (true, false) => high = high.min(a / (a - b)),
            (false, true) => low = low.max(a / (a - b)),
        }
    }
    if low >= high {
        return None;
    }
    let pole = pole / squared.sqrt();
    let end = |along: f64| {
        let way = p + along * (places[1] - places[0]);
        let way = if along == 1.0 { q } else { way };
        let distance = way.length();
        let corners = Some([(ends[0], 1.0 - along), (ends[1], along), (ends[1], 0.0)]);
        Seen { corners, direction: way / distance, distance, nearness: 1.0 }
    };
    let seen = [end(low), end(high)];
    let moments = Arc { ends: seen.map(|s| s.direction), pole }.moments(u, reach)?;
    Some(Piece { seen, moments })
}
