//! Every construction of the warp field over a flat world: on the circle of directions at a point, and
//! on the film.
//!
//! On a one-dimensional domain V is a number, the rate of an angle or of a film coordinate. All
//! constructions are linear in the velocities of what they see, and are kept as their coefficients, a
//! [`LinearField`]: forward mode applies them, reverse mode their transpose.

use std::f64::consts::TAU;

use glam::DVec2;

use super::{Camera, CameraTangent, Gloss, Hit, Origin, World};
use crate::plane::MaterialPoint;
use crate::random::{Stream, open01};
use crate::warp::{Circle, Line, Warp};

/// A construction of the warp field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Construction {
    /// A weighted mean over auxiliary rays: boundary-aware or Gaussian.
    Auxiliary(Warp),
    /// The same over directions, of velocities that fade away from jumps: V_i (1 − B_i) in place of V_i.
    /// Only what is near a jump has to move, and a narrow lobe that sees none is left alone: with V_i
    /// itself, the slope of the lobe times V has a variance ∝ 1/width² wherever anything moves. On the
    /// film, where the filter is as wide as the kernel, nothing fades.
    Local(Warp),
    /// Linear between the jumps that are seen, all of which are searched for: ΔV = 0 in one
    /// dimension. The cost grows with the number of vertices.
    Harmonic,
    /// The velocity of what is seen, as it is: jumps at silhouettes, and so is wrong.
    Direct,
    /// One rigid motion per kernel, that of the nearest of a few points seen in it (Loubet et al.
    /// 2019): biased.
    Followed {
        /// Points from which the nearest is chosen.
        candidates: usize,
    },
    /// No motion: what is left is the interior term alone.
    Still,
}

impl Default for Construction {
    /// Local, debiased, with the weights of [`Warp::one_dimensional`].
    fn default() -> Self {
        Self::Local(Warp::one_dimensional())
    }
}

/// V and ∇·V at one point as a linear form in velocities ẏ of material points, relative to the
/// velocity ẋ of the point they are seen from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LinearField {
    /// The material points with their coefficients.
    pub terms: Vec<FieldTerm>,
    /// The coefficients of the camera's rates in V and in ∇·V; only on the film.
    pub camera: [CameraTangent; 2],
    /// How many rays it took.
    pub rays: u64,
}

/// A material point y with its coefficients: V = Σ value·(ẏ − ẋ), ∇·V = Σ divergence·(ẏ − ẋ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldTerm {
    /// y.
    pub point: MaterialPoint,
    /// Its covector in V.
    pub value: DVec2,
    /// Its covector in ∇·V.
    pub divergence: DVec2,
}

impl LinearField {
    /// V and ∇·V, given the velocity of every vertex, of the origin, and of the camera.
    #[must_use]
    pub fn at(&self, vertices: &[DVec2], origin: DVec2, camera: &CameraTangent) -> [f64; 2] {
        let mut sum = self.camera.map(|c| c.dot(camera));
        for term in &self.terms {
            let relative = term.point.velocity(vertices) - origin;
            sum[0] += term.value.dot(relative);
            sum[1] += term.divergence.dot(relative);
        }
        sum
    }

    /// Adds `weight` times the rate `covector`·(ẏ − ẋ) to V and `divergence` times it to ∇·V.
    fn push(&mut self, point: MaterialPoint, covector: DVec2, weight: f64, divergence: f64) {
        let (value, divergence) = (weight * covector, divergence * covector);
        self.terms.push(FieldTerm { point, value, divergence });
    }

    fn push_camera(&mut self, rate: &CameraTangent, weight: f64, divergence: f64) {
        self.camera[0].add(weight, rate);
        self.camera[1].add(divergence, rate);
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
    ) -> LinearField {
        let mut field = LinearField::default();
        match self {
            Self::Auxiliary(warp) | Self::Local(warp) => {
                let is_local = matches!(self, Self::Local(_));
                let stencil = warp.stencil::<Circle, _>(direction, kappa, rng, |d| {
                    let hit = world.trace(origin, d);
                    let distance =
                        hit.as_ref().map_or(f64::INFINITY, |h| jump_angle(world, origin.point, d, h));
                    let share = if is_local { warp.nearness(distance, kappa) } else { 1.0 };
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
    ) -> LinearField {
        let origin = Origin::free(camera.position);
        let trace = |u: f64| world.trace(origin, camera.direction(u));
        let mut field = LinearField::default();
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
                    field.push_camera(&without_position(jump.camera), weight, slope);
                });
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
}

/// The rate of the direction d towards a hit: its material point y and the covector of ẏ − ẋ.
fn seen(world: &World, direction: DVec2, hit: &Hit) -> (MaterialPoint, DVec2) {
    (world.segments()[hit.segment].material_point(hit.s), direction.perp() / hit.distance)
}

/// Adds the rate of what is seen at u. What is infinitely far moves with the camera's angle and field
/// of view only.
fn push_on_film(
    field: &mut LinearField,
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
    field.push_camera(&without_position(by_camera), weight, divergence);
}

/// The camera's position enters as the velocity of the origin.
fn without_position(rate: CameraTangent) -> CameraTangent {
    CameraTangent { position: DVec2::ZERO, ..rate }
}

/// The velocity of what is seen and its derivative, dV/dψ of V(ψ) = τ·(ẏ − ẋ)/r.
fn push_direct(field: &mut LinearField, world: &World, direction: DVec2, hit: &Hit) {
    let segment = &world.segments()[hit.segment];
    let (r, tangent) = (hit.distance, direction.perp());
    let slide = Slide::of(segment.edge, direction, r);
    // dτ/dψ = −ω
    let divergence = -direction / r - tangent * (slide.distance / (r * r));
    let along = tangent / r * slide.s;
    push_ends(field, segment.vertices, hit.s, tangent / r, divergence, along);
}

fn push_direct_on_film(field: &mut LinearField, world: &World, camera: &Camera, u: f64, hit: &Hit) {
    let segment = &world.segments()[hit.segment];
    let (direction, r) = (camera.direction(u), hit.distance);
    let (turn, _) = camera.direction_rate(u);
    let slide = Slide::of(segment.edge, direction, r);
    let (rate, by_camera) = camera.film_rate(u, r);
    let (turning, slope) = camera.film_rate_slope(u, r, slide.distance * turn);
    push_ends(field, segment.vertices, hit.s, rate, turning, rate * slide.s * turn);
    field.push_camera(&without_position(by_camera), 1.0, 0.0);
    field.push_camera(&without_position(slope), 0.0, 1.0);
}

/// How the point seen slides along a segment as the direction turns: ds/dψ and dr/dψ.
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

/// The covectors of ẏ = (1 − s) ȧ + s ḃ, split between both ends; `along` is that of ḃ − ȧ in ∇·V.
fn push_ends(
    field: &mut LinearField,
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

/// The distance, in film coordinates, from what is seen at u to its nearer end.
fn jump_on_film(world: &World, camera: &Camera, u: f64, hit: &Hit) -> f64 {
    let ends = world.segments()[hit.segment].ends();
    ends.into_iter()
        .filter_map(|p| camera.project(p))
        .map(|end| (end - u).abs())
        .fold(f64::INFINITY, f64::min)
}

/// The distance, in radians to first order, from what is seen in a direction to its nearer end: the
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

/// A jump that is seen: where on the domain, the vertex that moves it, and its rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Jump {
    pub(crate) at: f64,
    pub(crate) vertex: usize,
    pub(crate) rate: DVec2,
    pub(crate) camera: CameraTangent,
}

/// All vertices visible from a point, by angle. The ends of its own segment are not: they lie on the
/// horizon.
pub(crate) fn jumps_around(world: &World, origin: Origin) -> Vec<Jump> {
    let own = origin.segment.map(|s| world.segments()[s].vertices);
    let mut jumps: Vec<Jump> = world
        .vertices()
        .enumerate()
        .filter(|(v, p)| !own.is_some_and(|own| own.contains(v)) && is_visible(world, origin, *v, *p))
        .map(|(vertex, p)| {
            let d = p - origin.point;
            let rate = d.perp() / d.length_squared();
            Jump { at: d.to_angle(), vertex, rate, camera: CameraTangent::default() }
        })
        .collect();
    jumps.sort_by(|a, b| a.at.total_cmp(&b.at));
    jumps
}

/// All vertices that the camera sees, by film coordinate, on the film and beside it.
pub(crate) fn jumps_on_film(world: &World, camera: &Camera) -> Vec<Jump> {
    let origin = Origin::free(camera.position);
    let visible = |&(v, p): &(usize, DVec2)| is_visible(world, origin, v, p);
    let jump = |(vertex, p): (usize, DVec2)| {
        let at = camera.project(p)?;
        let (rate, camera) = camera.film_rate(at, p.distance(origin.point));
        Some(Jump { at, vertex, rate, camera })
    };
    let mut jumps: Vec<Jump> = world.vertices().enumerate().filter(visible).filter_map(jump).collect();
    jumps.sort_by(|a, b| a.at.total_cmp(&b.at));
    jumps
}

/// Whether nothing lies between a point and a vertex, which is then an end of what is seen there.
pub(crate) fn is_visible(world: &World, origin: Origin, vertex: usize, at: DVec2) -> bool {
    let d = at - origin.point;
    let distance = d.length();
    distance > 0.0
        && world
            .trace(origin, d / distance)
            .is_none_or(|h| h.distance >= distance || world.segments()[h.segment].vertices.contains(&vertex))
}

/// Linear interpolation between jumps in order, periodic or constant beyond the last. Calls `add` with
/// a jump, its weight and the weight's slope.
fn interpolate(jumps: &[Jump], at: f64, period: Option<f64>, mut add: impl FnMut(&Jump, f64, f64)) {
    let Some((first, last)) = jumps.first().zip(jumps.last()) else { return };
    let next = jumps.partition_point(|j| j.at <= at);
    let (a, b, from, to) = match (next, period) {
        (n, _) if n > 0 && n < jumps.len() => (&jumps[n - 1], &jumps[n], jumps[n - 1].at, jumps[n].at),
        (0, Some(period)) => (last, first, last.at - period, first.at),
        (_, Some(period)) => (last, first, last.at, first.at + period),
        (0, None) => return add(first, 1.0, 0.0),
        (_, None) => return add(last, 1.0, 0.0),
    };
    if to <= from {
        return add(a, 1.0, 0.0);
    }
    let (t, slope) = ((at - from) / (to - from), 1.0 / (to - from));
    add(a, 1.0 - t, -slope);
    add(b, t, slope);
}

/// The nearest of some hits.
fn nearest<T>(hits: impl Iterator<Item = (Hit, T)>) -> Option<(Hit, T)> {
    hits.min_by(|a, b| a.0.distance.total_cmp(&b.0.distance))
}

/// A normal deviate (Box and Muller 1958).
fn normal(rng: &mut Stream) -> f64 {
    (-2.0 * open01(rng).ln()).sqrt() * (TAU * open01(rng)).cos()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plane::Filter;
    use crate::random::stream;
    use crate::transport::{Film, Material, Shape, Tangent};

    fn world() -> (World, Camera, Tangent) {
        let p = DVec2::new;
        let shapes = vec![
            Shape::open([p(-3.0, 0.0), p(3.0, 0.3)], Material::diffuse(0.5)),
            Shape::closed([p(-0.5, 1.0), p(0.4, 1.2), p(-0.1, 1.7)], Material::diffuse(0.5)),
        ];
        let world = World::new(0.0, shapes).expect("a world");
        let film = Film { pixels: 6, filter: Filter::Tent };
        let camera = Camera { position: p(0.3, 3.0), angle: -1.6, field_of_view: 1.4, film };
        let mut change = Tangent::moving(&world, [0, 1], |p| DVec2::new(0.3 * p.y + 0.1, p.x * p.x - 0.4));
        change.camera = CameraTangent { position: p(0.2, -0.5), angle: 0.7, field_of_view: -0.4 };
        (world, camera, change)
    }

    /// V and ∇·V of a construction at a film coordinate, and at an angle around a free point.
    fn both(construction: Construction, at: f64) -> [[f64; 2]; 2] {
        let (world, camera, change) = world();
        let mut rng = stream(1, &[]);
        let film = construction.over_film(&world, &camera, at, 44.0, &mut rng);
        let (origin, moves) = (Origin::free(camera.position), change.camera.position);
        let direction = DVec2::from_angle(-2.1 + 0.2 * at);
        let around = construction.around(&world, origin, direction, 20.0, &mut rng);
        let still = CameraTangent::default();
        [film.at(&change.vertices, moves, &change.camera), around.at(&change.vertices, moves, &still)]
    }

    #[test]
    fn divergences_are_slopes() {
        for construction in [Construction::Direct, Construction::Harmonic] {
            for at in [0.7, 2.1, 3.4, 4.9] {
                let h = 1e-6;
                let (plus, here, minus) =
                    (both(construction, at + h), both(construction, at), both(construction, at - h));
                for (domain, step) in [(0, 2.0 * h), (1, 0.4 * h)] {
                    let slope = (plus[domain][0] - minus[domain][0]) / step;
                    let found = here[domain][1];
                    assert!(
                        (slope - found).abs() < 1e-6 * (1.0 + found.abs()),
                        "{construction:?} {at} {domain}: {slope} {found}"
                    );
                }
            }
        }
    }

    #[test]
    fn the_direct_field_is_the_velocity_of_what_is_seen() {
        // Followed by a displaced camera, the point seen at u is seen at u + V θ.
        let (world, camera, change) = world();
        for u in [0.7, 2.9, 4.9] {
            let hit = world.trace(Origin::free(camera.position), camera.direction(u)).expect("a hit");
            let velocity = world.segments()[hit.segment].material_point(hit.s).velocity(&change.vertices);
            let project = |theta: f64| {
                let moved = change.displaced_camera(&camera, theta);
                moved.project(world.point(&hit) + theta * velocity).expect("in front")
            };
            let rate = (project(1e-6) - project(-1e-6)) / 2e-6;
            assert!((rate - both(Construction::Direct, u)[0][0]).abs() < 1e-7);
        }
    }

    /// E ∇·V of the followed motion is the slope of E V: the kernel's own slope is all there is.
    #[test]
    fn a_followed_motion_has_the_slope_of_its_mean() {
        let construction = Construction::Followed { candidates: 2 };
        let (world, camera, change) = world();
        let origin = Origin::free(camera.position);
        let mean = |angle: f64| {
            let mut sum = [0.0; 2];
            for i in 0..200_000 {
                let mut rng = stream(2, &[i]);
                let direction = DVec2::from_angle(angle);
                let field = construction.around(&world, origin, direction, 20.0, &mut rng);
                let at = field.at(&change.vertices, change.camera.position, &CameraTangent::default());
                sum = [sum[0] + at[0] / 2e5, sum[1] + at[1] / 2e5];
            }
            sum
        };
        let (plus, here, minus) = (mean(-1.65), mean(-1.7), mean(-1.75));
        let slope = (plus[0] - minus[0]) / 0.1;
        assert!((slope - here[1]).abs() < 0.1 * (1.0 + slope.abs()), "{slope} {here:?}");
    }
}
