//! All constructions of the warp field for a flat world: on the circle of directions at a point, and on the
//! film.
//!
//! On a one-dimensional domain V is a number, the rate of an angle or of a film coordinate. All constructions
//! are linear in the velocities of visible points, and are stored as their coefficients, a [`FieldForm`]:
//! forward mode applies them, reverse mode their transpose.

mod form;
mod near;
mod visible;

pub use form::{FieldForm, FieldTerm};
pub(crate) use near::is_silhouette_from;
pub(crate) use visible::{Jump, is_visible, jumps_around, jumps_on_film};

use std::f64::consts::TAU;

use glam::DVec2;

use super::{Camera, Gloss, Hit, Origin, World};
use crate::plane::MaterialPoint;
use crate::random::{Stream, open01};
use crate::warp::{Circle, JumpMean, Line, Warp};
use near::Near;
use visible::interpolate;

/// A construction of the warp field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Construction {
    /// A weighted mean over auxiliary rays: boundary-aware or Gaussian.
    Auxiliary(Warp),
    /// A weighted mean with, over directions, velocities that fade away from discontinuities: V_i (1 − B_i)
    /// in place of V_i. Only the neighbourhood of a discontinuity must move, and a narrow lobe that sees none
    /// is unaffected: with V_i itself, the slope of the lobe times V has a variance ∝ 1/width² wherever
    /// anything moves. On the film, where the filter is as wide as the kernel, nothing fades.
    Local(Warp),
    /// The [mean over discontinuities](JumpMean) nearby: exact, unbiased, and without auxiliary rays. It
    /// needs a list of all vertices and visits each, but tests none for visibility.
    JumpMean {
        /// R in widths κ^−½ of the kernel that auxiliary rays would have: the variance is least at about 8,
        /// which is 1.2 pixels on the film by default, and at most half as large again from 4 to 16.
        reach: f64,
    },
    /// The [softened](JumpMean#softened) mean, for [`WarpedArea`](crate::estimator::transport::WarpedArea),
    /// which samples the residual: unbiased for every softness from 0, the exact mean, to ∞, edge sampling.
    ///
    /// ```text
    /// V = Σ ḃ K(s)/(Σ K(s) + 1/R),    K(s) = (1/√(s² + ε²) − 1/R)₊
    /// ```
    ///
    /// The ends of the visible segment are followed exactly, ε = 0, if they are more than ε apart: there the
    /// residual is one-sided. All others are softened. Discontinuities that are followed exactly are thus
    /// never nearer than ε to each other. For N discontinuities within reach, |∇·V| is at most about N/ε
    /// times the largest |ḃ|; for the exact mean it is |Δv|/g in a gap g, at the end of a light that a
    /// silhouette crosses, and where a segment is seen along its length. Angles of objects that nearly touch
    /// the surface change as v/r, which no softness removes.
    ///
    /// It requires a path from the far side of one discontinuity for every surface of a path, and from both
    /// sides if the discontinuity is not followed at all: 1.5 to 2 times the time of the exact mean.
    Softened {
        /// R, as for the exact mean: 8.
        reach: f64,
        /// ε, in the same unit: a tenth to a quarter of the reach. Smaller values gain little; from half of
        /// it on the variance grows to the variance of edge sampling.
        softness: f64,
    },
    /// Linear between the visible discontinuities, all of which are searched: ΔV = 0 in one dimension. The
    /// cost grows with the number of vertices.
    Harmonic,
    /// The velocity of the visible point itself: discontinuous at silhouettes, and therefore wrong.
    Direct,
    /// One rigid motion per kernel, the motion of the nearest of several points seen in it (Loubet et al.
    /// 2019): biased.
    Followed {
        /// Number of points from which the nearest is chosen.
        candidates: usize,
    },
    /// No motion: the interior term alone.
    Still,
}

impl Default for Construction {
    /// Local, debiased, with the weights of [`Warp::one_dimensional`].
    fn default() -> Self {
        Self::Local(Warp::one_dimensional())
    }
}

impl Construction {
    /// The field on the circle of directions around `origin`, at `direction`.
    #[must_use]
    pub fn around(
        &self,
        world: &World,
        origin: Origin,
        direction: DVec2,
        kappa: f64,
        rng: &mut Stream,
    ) -> FieldForm {
        let mut field = FieldForm::default();
        match self {
            Self::Auxiliary(warp) | Self::Local(warp) => {
                let is_local = matches!(self, Self::Local(_));
                let stencil = warp.stencil::<Circle, _>(direction, kappa, rng, |d| {
                    let hit = world.trace(origin, d);
                    let distance =
                        hit.as_ref().map_or(f64::INFINITY, |h| jump_angle(world, origin.point, d, h));
                    let share = if is_local { warp.falloff(distance, kappa) } else { 1.0 };
                    (hit.map(|h| (h, d, share)), distance)
                });
                field.rays = stencil.terms().len() as u64;
                for term in stencil.terms() {
                    if let Some((hit, d, share)) = term.hit.as_ref().filter(|(.., share)| *share > 0.0) {
                        let (point, rate) = seen(world, *d, hit);
                        let tangent = d.perp();
                        let weight = term.weight * tangent.dot(direction.perp());
                        field.push(point, rate * *share, weight, term.divergence.dot(tangent));
                    }
                }
            }
            Self::Harmonic => {
                let jumps = jumps_around(world, origin);
                field.rays = world.vertex_count() as u64;
                let at = direction.to_angle();
                interpolate(&jumps, at, Some(TAU), |jump, weight, slope| {
                    field.push(MaterialPoint::vertex(jump.vertex), jump.rate, weight, slope);
                });
            }
            Self::JumpMean { .. } | Self::Softened { .. } => {
                let seen = world.trace(origin, direction);
                field = self.beside(world, origin, direction, kappa, seen.as_ref());
                field.rays = 1;
            }
            Self::Direct => {
                field.rays = 1;
                if let Some(hit) = world.trace(origin, direction) {
                    push_direct(&mut field, world, direction, &hit);
                }
            }
            Self::Followed { candidates } => {
                field.rays = *candidates as u64;
                let lobe = Gloss { strength: 1.0, width: kappa.sqrt().recip().min(Gloss::WIDEST) };
                let turned = |by: f64, from: DVec2| DVec2::from_angle(by).rotate(from);
                let alpha = lobe.quantile(open01(rng));
                let mean = turned(-alpha, direction);
                let hits = (0..*candidates).filter_map(|_| {
                    let d = turned(lobe.quantile(open01(rng)), mean);
                    world.trace(origin, d).map(|h| (h, d))
                });
                if let Some((hit, d)) = nearest(hits) {
                    let (point, rate) = seen(world, d, &hit);
                    let slope = lobe.density_gradient(alpha)[0] / lobe.density(alpha);
                    field.push(point, rate, 1.0, slope);
                }
            }
            Self::Still => {}
        }
        field
    }

    /// The field on the film, at the coordinate u; κ is per pixel².
    #[must_use]
    pub fn over_film(
        &self,
        world: &World,
        camera: &Camera,
        u: f64,
        kappa: f64,
        rng: &mut Stream,
    ) -> FieldForm {
        let origin = Origin::free(camera.position);
        let trace = |u: f64| world.trace(origin, camera.direction(u));
        let mut field = FieldForm::default();
        match self {
            Self::Auxiliary(warp) | Self::Local(warp) => {
                let stencil = warp.stencil::<Line, _>(u, kappa, rng, |at| {
                    let hit = trace(at);
                    let distance = hit.as_ref().map_or(f64::INFINITY, |h| jump_on_film(world, camera, at, h));
                    ((hit, at), distance)
                });
                field.rays = stencil.terms().len() as u64;
                for term in stencil.terms() {
                    let (hit, at) = &term.hit;
                    push_on_film(&mut field, world, camera, *at, hit.as_ref(), term.weight, term.divergence);
                }
            }
            Self::Harmonic => {
                let jumps = jumps_on_film(world, camera);
                field.rays = world.vertex_count() as u64;
                interpolate(&jumps, u, None, |jump, weight, slope| {
                    field.push(MaterialPoint::vertex(jump.vertex), jump.rate, weight, slope);
                    field.push_camera(&jump.camera.without_position(), weight, slope);
                });
            }
            Self::JumpMean { .. } | Self::Softened { .. } => {
                field = self.beside_on_film(world, camera, u, kappa, trace(u).as_ref());
                field.rays = 1;
            }
            Self::Direct => {
                field.rays = 1;
                if let Some(hit) = trace(u) {
                    push_direct_on_film(&mut field, world, camera, u, &hit);
                }
            }
            Self::Followed { candidates } => {
                field.rays = *candidates as u64;
                let width = kappa.sqrt().recip();
                let offset = width * normal(rng);
                let mean = u - offset;
                let hits = (0..*candidates).filter_map(|_| {
                    let at = mean + width * normal(rng);
                    trace(at).map(|h| (h, at))
                });
                if let Some((hit, at)) = nearest(hits) {
                    push_on_film(&mut field, world, camera, at, Some(&hit), 1.0, -kappa * offset);
                }
            }
            Self::Still => {}
        }
        field
    }

    /// [`around`](Self::around) with a known hit, as next to a discontinuity: for means over discontinuities;
    /// 0 for all others.
    #[must_use]
    pub(crate) fn beside(
        &self,
        world: &World,
        origin: Origin,
        direction: DVec2,
        kappa: f64,
        seen: Option<&Hit>,
    ) -> FieldForm {
        self.near(kappa).map_or_else(FieldForm::default, |near| near.around(world, origin, direction, seen))
    }

    /// [`over_film`](Self::over_film) with a known hit, as in [`beside`](Self::beside).
    #[must_use]
    pub(crate) fn beside_on_film(
        &self,
        world: &World,
        camera: &Camera,
        u: f64,
        kappa: f64,
        seen: Option<&Hit>,
    ) -> FieldForm {
        self.near(kappa).map_or_else(FieldForm::default, |near| near.on_film(world, camera, u, seen))
    }

    /// Whether a mean over discontinuities equals the velocity of a segment's ends on the side on which the
    /// segment is visible; false for other fields.
    pub(crate) fn follows_ends(&self, world: &World, origin: Origin, kappa: f64, segment: usize) -> bool {
        self.near(kappa).is_some_and(|near| near.follows_ends_around(world, origin, segment))
    }

    /// [`follows_ends`](Self::follows_ends) on the film.
    pub(crate) fn follows_ends_on_film(
        &self,
        world: &World,
        camera: &Camera,
        kappa: f64,
        segment: usize,
    ) -> bool {
        self.near(kappa).is_some_and(|near| near.follows_ends_on_film(world, camera, segment))
    }

    /// A mean over discontinuities in the unit of its domain.
    fn near(&self, kappa: f64) -> Option<Near> {
        let (reach, softness) = match *self {
            Self::JumpMean { reach } => (reach, 0.0),
            Self::Softened { reach, softness } => (reach, softness),
            _ => return None,
        };
        let width = kappa.sqrt();
        Some(Near { mean: JumpMean { reach: reach / width }, softness: softness / width })
    }
}

/// Rate of the direction d towards a hit: its material point y and the covector of ẏ − ẋ.
fn seen(world: &World, direction: DVec2, hit: &Hit) -> (MaterialPoint, DVec2) {
    (world.segments()[hit.segment].material_point(hit.s), direction.perp() / hit.distance)
}

/// Adds the rate of the point seen at u. A point at infinity moves only with the camera's angle and field of
/// view.
fn push_on_film(
    field: &mut FieldForm,
    world: &World,
    camera: &Camera,
    u: f64,
    hit: Option<&Hit>,
    weight: f64,
    divergence: f64,
) {
    let (rate, by_camera) = camera.film_rate(u, hit.map_or(f64::INFINITY, |h| h.distance));
    if let Some(hit) = hit {
        field.push(world.segments()[hit.segment].material_point(hit.s), rate, weight, divergence);
    }
    field.push_camera(&by_camera.without_position(), weight, divergence);
}

/// The velocity of the visible point and its derivative, dV/dψ of V(ψ) = τ·(ẏ − ẋ)/r.
fn push_direct(field: &mut FieldForm, world: &World, direction: DVec2, hit: &Hit) {
    let segment = &world.segments()[hit.segment];
    let (r, tangent) = (hit.distance, direction.perp());
    let slide = Slide::of(segment.edge, direction, r);
    // dτ/dψ = −ω
    let divergence = -direction / r - tangent * (slide.distance / (r * r));
    let along = tangent / r * slide.s;
    push_ends(field, segment.vertices, hit.s, tangent / r, divergence, along);
}

fn push_direct_on_film(field: &mut FieldForm, world: &World, camera: &Camera, u: f64, hit: &Hit) {
    let segment = &world.segments()[hit.segment];
    let (direction, r) = (camera.direction(u), hit.distance);
    let (turn, _) = camera.direction_rate(u);
    let slide = Slide::of(segment.edge, direction, r);
    let (rate, by_camera) = camera.film_rate(u, r);
    let (turning, slope) = camera.film_rate_slope(u, r, slide.distance * turn);
    push_ends(field, segment.vertices, hit.s, rate, turning, rate * slide.s * turn);
    field.push_camera(&by_camera.without_position(), 1.0, 0.0);
    field.push_camera(&slope.without_position(), 0.0, 1.0);
}

/// Sliding of the visible point along a segment as the direction rotates: ds/dψ and dr/dψ.
struct Slide {
    s: f64,
    distance: f64,
}

impl Slide {
    /// y = x + rω stays on the segment's line: dy/dψ = r τ + r' ω ∥ e.
    fn of(edge: DVec2, direction: DVec2, distance: f64) -> Self {
        let tangent = direction.perp();
        let across = direction.perp_dot(edge);
        let slope = -distance * tangent.perp_dot(edge) / across;
        let moved = distance * tangent + slope * direction;
        Self { s: moved.dot(edge) / edge.length_squared(), distance: slope }
    }
}

/// The covectors of ẏ = (1 − s) ȧ + s ḃ, split between both ends; `along` is the covector of ḃ − ȧ in ∇·V.
fn push_ends(
    field: &mut FieldForm,
    vertices: [usize; 2],
    s: f64,
    value: DVec2,
    divergence: DVec2,
    along: DVec2,
) {
    for (vertex, share, sign) in [(vertices[0], 1.0 - s, -1.0), (vertices[1], s, 1.0)] {
        field.terms.push(FieldTerm {
            point: MaterialPoint::vertex(vertex),
            value: share * value,
            divergence: share * divergence + sign * along,
        });
    }
}

/// Distance, in film coordinates, from u to the nearer end of the segment seen there.
fn jump_on_film(world: &World, camera: &Camera, u: f64, hit: &Hit) -> f64 {
    let ends = world.segments()[hit.segment].ends();
    ends.into_iter()
        .filter_map(|p| camera.project(p))
        .map(|end| (end - u).abs())
        .fold(f64::INFINITY, f64::min)
}

/// Distance, in radians to first order, from a direction to the nearer end of the segment seen there: the
/// sine of the angle, which keeps growing past a right angle.
fn jump_angle(world: &World, from: DVec2, direction: DVec2, hit: &Hit) -> f64 {
    let distance = |end: DVec2| {
        let v = end - from;
        let sine = direction.perp_dot(v).abs() / v.length();
        if direction.dot(v) > 0.0 { sine } else { 2.0 - sine }
    };
    let [a, b] = world.segments()[hit.segment].ends().map(distance);
    a.min(b)
}

/// The nearest of several hits.
fn nearest<T>(hits: impl Iterator<Item = (Hit, T)>) -> Option<(Hit, T)> {
    hits.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance))
}

/// A normal deviate (Box and Muller 1958).
fn normal(rng: &mut Stream) -> f64 {
    (-2.0 * open01(rng).ln()).sqrt() * (TAU * open01(rng)).cos()
}

#[cfg(test)]
mod tests;
