//! The mean over discontinuities at one direction, linear in the velocities of edge ends.

use std::f64::consts::TAU;

use flatland::sdf::{Jet, Trace};
use flatland::warp::{Domain as _, Field, LinearField};
use glam::DVec3;

use super::arc::{AngularSupport, Arc, Graded, Moments};
use super::edge::{Cone, Edge, HalfSpace, Pole};
use super::level_set::{LevelSetTap, NearLevelSet, Sight};
use super::listed::Listed;
use super::scene_edges::SceneEdges;
use crate::Sphere;
use crate::gradient::warp::followed::{Followed, FollowedPoint};
use crate::path::VisibilityDomain;
use crate::scene::{Scene, Span};

/// Candidate silhouettes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Silhouettes<'e> {
    /// All edges of the scene.
    All,
    /// None: they are sampled as curves.
    None,
    /// A given list of silhouettes from the viewpoint, complete near the direction.
    Listed(&'e Listed),
}

/// Viewpoint and integrand.
#[derive(Clone, Debug)]
pub(crate) struct View<'p> {
    pub(crate) origin: DVec3,
    /// Half spaces to which the relevant edges are confined.
    pub(crate) planes: &'p [HalfSpace],
    pub(crate) domain: VisibilityDomain,
    /// The visible triangle, if radiance ends at the border of its face.
    pub(crate) seen: Option<u32>,
    /// The face on which the viewer lies, whose horizon it sees.
    pub(crate) left: Option<u32>,
    /// Softness with which a softened field follows the border of the visible face, in radians.
    pub(crate) border_softness: f64,
    /// Distance to a plane within which a viewer counts as in it.
    pub(crate) rounding: f64,
}

/// V and ∇·V at a direction, linear in the velocities of arc ends.
#[derive(Clone, Debug)]
pub(crate) struct JumpMean {
    point: DVec3,
    pieces: Vec<Piece>,
    level_sets: Vec<LevelSetTap>,
    /// 1/(∫ K + 2π/R), and that times the gradient of the denominator.
    inverse: f64,
    slope: DVec3,
}

/// A part of an edge, with its moments.
#[derive(Clone, Copy, Debug)]
struct Piece {
    span: Span,
    /// Positions of the piece's ends along the edge.
    along: [f64; 2],
    directions: [DVec3; 2],
    distances: [f64; 2],
    moments: Moments,
    /// Whether it is continuous there.
    seam: bool,
}

/// Typical largest number of pieces of a nonempty field.
const OFTEN: usize = 8;

/// Coefficients of an arc's end in the field.
struct Part {
    /// V is the projected sum of velocities with this weight.
    value: f64,
    /// ∇·V is the sum of the dot products of this vector with the velocity.
    divergence: DVec3,
}

impl JumpMean {
    /// The field at u; `None` if no arc and no implicit surface is near.
    #[expect(
        clippy::too_many_arguments,
        reason = "view, direction, reach and scratch memory are independent"
    )]
    pub(crate) fn new(
        scene: &Scene,
        tree: &SceneEdges,
        silhouettes: Silhouettes<'_>,
        view: &View<'_>,
        u: DVec3,
        reach: AngularSupport,
        sight: &Sight,
        trace: &mut Trace<DVec3>,
    ) -> Option<Self> {
        // Many queries find none, and allocate nothing.
        let mut pieces = vec![];
        let face = view.seen.map(|triangle| tree.plane(triangle));
        let followed = if reach.shrinkage > 0.0 { [face, view.left] } else { [None; 2] };
        let mut add = |edge: &Edge, pole: Pole, seam: bool| {
            // The visible face's own border is followed exactly unless it is narrow, whatever passes in front
            // of it, and so is that of the face on which the viewer lies; at seams both sides must agree.
            let border = seam || followed.into_iter().flatten().any(|face| edge.owners.contains(&face));
            let reach = if border { reach.softened(view.border_softness) } else { reach };
            if let Some(piece) = piece(edge, pole, seam, view, u, reach) {
                if pieces.is_empty() {
                    pieces.reserve(OFTEN);
                }
                pieces.push(piece);
            }
        };
        let View { origin, planes, rounding, .. } = *view;
        let cone = Cone { origin, axis: u, reach, planes, rounding };
        if let Some(triangle) = view.seen {
            tree.for_each_of_face(triangle, &cone, |edge| {
                add(edge, Pole::new(edge.places, origin), edge.seam);
            });
        }
        match silhouettes {
            Silhouettes::All => tree.for_each(&cone, |edge| {
                if view.domain.has(scene, edge.span) {
                    add(edge, Pole::new(edge.places, origin), false);
                }
            }),
            Silhouettes::None => {}
            Silhouettes::Listed(list) => list.for_each(&cone, |edge, pole| add(edge, pole, false)),
        }
        yield_to_jumps(&mut pieces, reach);
        let near = sight.near(scene, u, floor(reach), trace);
        Self::mean(pieces, (sight.origin, &near), u, reach)
    }

    fn mean(
        pieces: Vec<Piece>,
        (origin, near): (DVec3, &[NearLevelSet]),
        u: DVec3,
        reach: AngularSupport,
    ) -> Option<Self> {
        if pieces.is_empty() && near.is_empty() {
            return None;
        }
        let floor = floor(reach);
        let mut whole = floor;
        let mut slope = DVec3::ZERO;
        for p in &pieces {
            whole += p.moments.whole.value;
            slope += p.moments.whole.gradient;
        }
        for n in near {
            whole += floor * n.kernel.value;
            slope += floor * n.kernel.gradient;
        }
        let slope = slope / whole;
        let level_sets = near.iter().map(|n| {
            let value = floor * n.kernel.value / whole;
            let gradient = n.kernel.gradient * (floor / whole) - slope * value;
            n.tap(origin, u, Graded { value, gradient })
        });
        Some(Self { point: u, pieces, level_sets: level_sets.collect(), inverse: 1.0 / whole, slope })
    }

    /// Contribution of implicit surfaces to V and ∇·V, from φ̇ and ∇φ̇ relative to the viewer.
    pub(crate) fn level_set_field(&self, mut rate: impl FnMut(&LevelSetTap) -> Jet<DVec3>) -> Field<DVec3> {
        let (mut value, mut divergence) = (DVec3::ZERO, 0.0);
        for tap in &self.level_sets {
            let (v, d) = tap.field(rate(tap));
            value += v;
            divergence += d;
        }
        Field { value: Sphere::project(self.point, value), divergence }
    }

    /// Transpose of [`level_set_field`](Self::level_set_field): hands each surface its covector in a·V + b
    /// ∇·V.
    pub(crate) fn scatter_level_sets(&self, a: DVec3, b: f64, mut add: impl FnMut(&LevelSetTap, Jet<DVec3>)) {
        let a = Sphere::project(self.point, a);
        self.level_sets.iter().for_each(|tap| add(tap, tap.covector(a, b)));
    }

    /// Calls back with both ends of every piece.
    #[inline]
    fn for_each_end(&self, mut f: impl FnMut(&FollowedPoint, Part)) {
        for piece in &self.pieces {
            for k in 0..2 {
                f(&piece.seen(k), self.part(piece, k));
            }
        }
    }

    #[inline]
    fn part(&self, piece: &Piece, end: usize) -> Part {
        let Graded { value, gradient } = piece.moments.ends[end];
        let value = value * self.inverse;
        // ∇·(F − (F·u) u) = tr ∇F − 2 F·u on the sphere.
        Part { value, divergence: gradient * self.inverse - value * (self.slope + 2.0 * self.point) }
    }

    /// Cost: one, plus one for each piece.
    pub(crate) fn work(&self) -> u64 {
        1 + self.pieces.len() as u64
    }

    /// Whether all coefficients are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let is_finite = |part: Part| part.value.is_finite() && part.divergence.is_finite();
        self.pieces.iter().all(|piece| (0..2).all(|k| is_finite(self.part(piece, k))))
            && self.level_sets.iter().all(LevelSetTap::is_finite)
    }
}

/// 2π/R, with R as a chord.
fn floor(reach: AngularSupport) -> f64 {
    TAU / (2.0 * reach.versine).sqrt()
}

impl LinearField for JumpMean {
    type Vector = DVec3;
    type Source = FollowedPoint;
    type Rate = DVec3;

    /// V and ∇·V.
    fn field(&self, mut velocity: impl FnMut(&FollowedPoint) -> DVec3) -> Field<DVec3> {
        let (mut value, mut divergence) = (DVec3::ZERO, 0.0);
        self.for_each_end(|seen, part| {
            let v = velocity(seen);
            value += part.value * v;
            divergence += part.divergence.dot(v);
        });
        Field { value: Sphere::project(self.point, value), divergence }
    }

    /// Transpose of `field`: hands each end its covector in a·V + b ∇·V.
    fn scatter(&self, a: DVec3, b: f64, mut add: impl FnMut(&FollowedPoint, DVec3)) {
        let a = Sphere::project(self.point, a);
        self.for_each_end(|seen, part| add(seen, part.value * a + b * part.divergence));
    }
}

/// Distance to a discontinuity, relative to the reach, at which a seam has half its weight. Seams make a warp
/// over a curved surface move with the material and are not discontinuities: V must agree on both of their
/// sides, but may have any value. V at a discontinuity exactly in front of a seam must be that of the
/// discontinuity alone; otherwise V would differ between its two sides, of which only one sees the seam.
const YIELDS: f64 = 0.05;

/// Reduces the weight of seams near discontinuities by the factor 1/(1 + ∫ K/K₀), with the integral over all
/// discontinuities and K₀ its value at a distance of [`YIELDS`] times the reach from one. At a discontinuity
/// the integral diverges, and V is that of the discontinuity alone; at a seam that is only near one, V is
/// still that of the seam.
fn yield_to_jumps(pieces: &mut [Piece], reach: AngularSupport) {
    if pieces.iter().all(|p| !p.seam) || pieces.iter().all(|p| p.seam) {
        return;
    }
    // ∫ K of a line at a distance s is about 2π/s.
    let level = YIELDS * (2.0 * reach.versine).sqrt() / TAU;
    let mut jumps = Graded { value: 1.0, gradient: DVec3::ZERO };
    for p in pieces.iter().filter(|p| !p.seam) {
        jumps.value += level * p.moments.whole.value;
        jumps.gradient += level * p.moments.whole.gradient;
    }
    let value = 1.0 / jumps.value;
    let factor = Graded { value, gradient: jumps.gradient * (-value * value) };
    for p in pieces.iter_mut().filter(|p| p.seam) {
        p.moments = p.moments.times(factor);
    }
}

impl Piece {
    #[inline]
    fn seen(&self, end: usize) -> FollowedPoint {
        let along = self.along[end];
        let followed = match self.span {
            Span::Edge(ends) => Followed::Edge { ends, along },
            Span::Crossing(index) => Followed::Crossing { index, along },
        };
        let (direction, distance) = (self.directions[end], self.distances[end]);
        FollowedPoint { followed, direction, distance, falloff: 1.0, horizon: None }
    }
}

/// The part of an edge in front of all planes, as an arc around u.
fn piece(
    edge: &Edge,
    Pole(pole): Pole,
    seam: bool,
    view: &View<'_>,
    u: DVec3,
    reach: AngularSupport,
) -> Option<Piece> {
    let places = edge.places;
    // Most edges end here: the great circle is out of reach or undefined.
    let within = u.dot(pole).abs() < reach.sine;
    if !within {
        return None;
    }
    // The remaining part of the edge, from 0 to 1.
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
    Some(Piece { span: edge.span, along, directions, distances, moments, seam })
}
