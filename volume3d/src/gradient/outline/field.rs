//! The field at one direction, linear in the velocities of the ends of edges.

use std::f64::consts::TAU;
use std::ops::Range;

use flatland::warp::Field;
use glam::DVec3;

use super::arc::{Arc, Graded, Moments, Reach};
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
    Listed(&'e [(Edge, Pole)]),
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
    /// A viewer this near to a plane is within it.
    pub(crate) rounding: f64,
}

/// V and ∇·V at a direction, from the velocities of ends of arcs.
#[derive(Clone, Debug)]
pub(crate) struct Outline {
    point: DVec3,
    pieces: Vec<Piece>,
    /// 1/(∫ K + 2π/R), and that times the gradient of what it is one over.
    inverse: f64,
    slope: DVec3,
}

/// A part of an edge, and what it gives.
#[derive(Clone, Copy, Debug)]
struct Piece {
    /// Positions, and how far the piece's ends are on the way from one to the other.
    ends: [u32; 2],
    along: [f64; 2],
    directions: [DVec3; 2],
    distances: [f64; 2],
    moments: Moments,
}

/// The end of an arc, with its part of the field.
struct End {
    seen: Seen,
    /// V is the sum of this times the velocity, projected.
    part: f64,
    /// ∇·V is the sum of this dotted with the velocity.
    divergence: DVec3,
}

/// Pieces for which there is room at first.
const ROOM: usize = 16;

impl Outline {
    /// The field at u; nothing if no arc is near.
    pub(crate) fn new(
        scene: &Scene,
        edges: Edges<'_>,
        view: &View<'_>,
        u: DVec3,
        reach: Reach,
    ) -> Option<Self> {
        let mut pieces = Vec::with_capacity(ROOM);
        let mut add = |ends: [u32; 2], places: [DVec3; 2], pole: Pole| {
            if let Some(piece) = piece(ends, places, pole, view, u, reach) {
                pieces.push(piece);
            }
        };
        let mut own = [u32::MAX; 3];
        if let Some(t) = view.triangle {
            own = scene.triangles[t as usize].positions;
            for k in 0..3 {
                let ends = [own[k], own[(k + 1) % 3]];
                let places = ends.map(|i| scene.positions[i as usize]);
                add(ends, places, Pole::new(places, view.origin));
            }
        }
        let mut each = |edge: &Edge, pole: Pole| {
            let left_out = edge.ends.iter().all(|&i| view.without.contains(&(i as usize)));
            if !left_out && !edge.ends.iter().all(|i| own.contains(i)) {
                add(edge.ends, edge.places, pole);
            }
        };
        match edges {
            Edges::Tree(tree) => {
                let cone = Cone {
                    origin: view.origin,
                    axis: u,
                    reach,
                    planes: view.planes,
                    rounding: view.rounding,
                };
                tree.for_each(&cone, |edge| each(edge, Pole::new(edge.places, view.origin)));
            }
            Edges::Listed(list) => list.iter().for_each(|(edge, pole)| each(edge, *pole)),
        }
        Self::mean(pieces, u, reach)
    }

    fn mean(pieces: Vec<Piece>, u: DVec3, reach: Reach) -> Option<Self> {
        if pieces.is_empty() {
            return None;
        }
        // 2π/R, with the chord of R.
        let floor = TAU / (2.0 * reach.versine).sqrt();
        let mut whole = floor;
        let mut slope = DVec3::ZERO;
        for p in &pieces {
            whole += p.moments.whole.value;
            slope += p.moments.whole.gradient;
        }
        Some(Self { point: u, pieces, inverse: 1.0 / whole, slope: slope / whole })
    }

    fn ends(&self) -> impl Iterator<Item = End> {
        self.pieces.iter().flat_map(move |piece| {
            [0, 1].map(|k| {
                let Graded { value, gradient } = piece.moments.ends[k];
                let part = value * self.inverse;
                // ∇·(F − (F·u) u) = tr ∇F − 2 F·u on the sphere.
                let divergence = gradient * self.inverse - part * (self.slope + 2.0 * self.point);
                End { seen: piece.seen(k), part, divergence }
            })
        })
    }

    /// Whether all coefficients are.
    pub(crate) fn is_finite(&self) -> bool {
        self.ends().all(|end| end.part.is_finite() && end.divergence.is_finite())
    }

    /// V and ∇·V.
    pub(crate) fn field(&self, mut velocity: impl FnMut(&Seen) -> DVec3) -> Field<DVec3> {
        let (mut value, mut divergence) = (DVec3::ZERO, 0.0);
        for end in self.ends() {
            let v = velocity(&end.seen);
            value += end.part * v;
            divergence += end.divergence.dot(v);
        }
        Field { value: Sphere::project(self.point, value), divergence }
    }

    /// The transpose: hands each end its covector in a·V + b ∇·V.
    pub(crate) fn scatter(&self, a: DVec3, b: f64, mut add: impl FnMut(&Seen, DVec3)) {
        let a = Sphere::project(self.point, a);
        for end in self.ends() {
            add(&end.seen, end.part * a + b * end.divergence);
        }
    }
}

impl Piece {
    fn seen(&self, end: usize) -> Seen {
        let (along, last) = (self.along[end], self.ends[1]);
        let corners = Some([(self.ends[0], 1.0 - along), (last, along), (last, 0.0)]);
        let (direction, distance) = (self.directions[end], self.distances[end]);
        Seen { corners, direction, distance, nearness: 1.0, horizon: None }
    }
}

/// The pole of the great circle of an edge as seen from a point: NaN if it is seen end-on.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Pole(DVec3);

impl Pole {
    pub(crate) fn new(places: [DVec3; 2], origin: DVec3) -> Self {
        let pole = (places[0] - origin).cross(places[1] - places[0]);
        Self(pole / pole.length())
    }
}

/// The part of an edge before all planes, as an arc around u.
fn piece(
    ends: [u32; 2],
    places: [DVec3; 2],
    Pole(pole): Pole,
    view: &View<'_>,
    u: DVec3,
    reach: Reach,
) -> Option<Piece> {
    // Most edges end here: the whole great circle is out of reach, or there is none.
    let within = u.dot(pole).abs() < reach.sine;
    if !within {
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
    let [p, q] = places.map(|p| p - view.origin);
    let along = [low, high];
    let ways = along.map(|along| if along == 1.0 { q } else { p + along * (places[1] - places[0]) });
    let distances = ways.map(DVec3::length);
    let directions = [ways[0] / distances[0], ways[1] / distances[1]];
    let moments = Arc { ends: directions, pole }.moments(u, reach)?;
    Some(Piece { ends, along, directions, distances, moments })
}
