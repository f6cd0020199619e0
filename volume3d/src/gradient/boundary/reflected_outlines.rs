//! Silhouettes and borders of emitters as seen from path vertices after at least one bounce, with paths
//! traced from the emitter.
//!
//! The terms are those of [`secondary`](super::secondary) (Theory 9). With paths from the camera x slides
//! with 1/cos of the angle at which the previous vertex sees it, and the mean square of that diverges near
//! contact; backward paths meet such points less often, in proportion to that cosine.
//!
//! Opposite sides of an emitter contribute with opposite signs, which almost cancel far from it. If its
//! outline is symmetric about its centre, x is therefore also lit from the point y′ opposite the edge point
//! y. With p and p′ the area densities with which x is sampled from either, and q that of the edge points,
//!
//! > (F(x, y) + F(x, y′))/(q (p + p′))
//!
//! has the mean ∫∫ F, as q is equal for both.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::directions::Directions;
use super::driver::{Address, Boundary, BoundarySample};
use super::list::{Edge, EdgeList};
use super::sensor::{CameraSubpath, Sensor, Vertex};
use super::sides::{Sides, aside, look_past, near};
use super::table::Table;
use super::wedge::Wedge;
use super::{BACKWARDS, Moving, OUTLINE, STILL};
use crate::gradient::differential::Differential;
use crate::path::{Frame, Paths};

/// Edges of emitters from which paths are traced backwards.
#[derive(Debug)]
pub(super) struct ReflectedOutlines<'a> {
    sensor: Sensor<'a>,
    list: &'a EdgeList,
    outlines: Vec<Outline>,
    table: Table,
    /// Largest number of path segments before the discontinuity.
    longest: usize,
}

/// An edge of an emitter.
#[derive(Clone, Debug)]
struct Outline {
    edge: u32,
    directions: Directions,
    /// Index of the opposite edge, and whether it has the same orientation.
    across: Option<(usize, bool)>,
}

/// A point of an outline as seen from a shading point.
struct View<'e> {
    edge: &'e Edge,
    along: f64,
    direction: DVec3,
    /// ω × e.
    normal: DVec3,
    /// Density of its directions times cos θ/t²: the density of shading points by area.
    found: f64,
    /// cos θ/t² divided by the density of edge points.
    measure: f64,
    sides: Option<Sides>,
}

impl<'a> ReflectedOutlines<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &Moving) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let emits = |shape: u32| scene.description.shapes[shape as usize].radiance.is_some();
        let outline = |i: u32| {
            let edge = &list.edges[i as usize];
            let counts = limit > 2 && edge.shapes.into_iter().any(emits) && list.may_jump(scene, edge);
            counts.then(|| Outline { edge: i, directions: directions(paths, list, edge), across: None })
        };
        let mut outlines: Vec<Outline> = (0..list.edges.len() as u32).filter_map(outline).collect();
        let spans: Vec<[DVec3; 2]> =
            outlines.iter().map(|outline| list.edges[outline.edge as usize].span(scene)).collect();
        if outlines.iter().all(|outline| matches!(outline.directions, Directions::Front(_))) {
            for (outline, across) in outlines.iter_mut().zip(across(&spans)) {
                outline.across = across;
            }
        }
        let weight = |(outline, [a, b]): (&Outline, &[DVec3; 2])| a.distance(*b) * outline.directions.whole();
        let mut weights: Vec<f64> = outlines.iter().zip(&spans).map(weight).collect();
        let moves = |i: usize| moving.has_any(list.edges[outlines[i].edge as usize].shapes);
        moving.limit_still(&mut weights, STILL, moves);
        let table = Table::new(weights);
        Self { sensor: Sensor::new(paths), list, outlines, table, longest: limit.saturating_sub(1) }
    }

    /// A point of an outline as seen from a shading point, unless it lies in that point's plane.
    fn view(&self, which: usize, along: f64, x: &Vertex) -> Option<View<'a>> {
        let scene = self.sensor.paths.scene;
        let outline = &self.outlines[which];
        let edge = &self.list.edges[outline.edge as usize];
        let [a, b] = edge.span(scene);
        let way = a.lerp(b, along) - x.position;
        let distance = way.length();
        let direction = way / distance;
        let normal = direction.cross((b - a).normalize_or_zero());
        let across = aside([a, b], x.position, distance) * normal.normalize_or_zero();
        let directions = [-1.0, 1.0].map(|s| (direction + s * across).normalize());
        let start = (x.position, Some(x.surface));
        let projected = scene.normal_of(x.surface, x.position).dot(direction).abs() / (distance * distance);
        let sides = look_past(scene, self.list, edge, start, directions, distance);
        // Per length.
        let density = self.table.weight(which) / (self.table.total() * a.distance(b));
        let found = outline.directions.density(direction) * projected;
        Some(View { edge, along, direction, normal, found, measure: projected / density, sides })
            .filter(|view| view.found > 0.0)
    }

    /// Calls back with every camera path whose last vertex sees emission end at a sampled point of an
    /// outline, or at the opposite point.
    fn each(&self, address: Address, mut found: impl FnMut(&CameraSubpath<'_>, &View<'_>, DVec3)) {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let mut numbers = address.numbers(OUTLINE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let outline = &self.outlines[chosen.index];
        let edge = &self.list.edges[outline.edge as usize];
        let [a, b] = edge.span(scene);
        let point = a.lerp(b, chosen.rest);
        let (c, [s, t]) = (numbers.one(), numbers.pair());
        let direction = outline.directions.sample((b - a).normalize_or_zero(), [c, s, t]);
        let Some(hit) = scene.beyond(point, -direction, near(scene, self.list, edge)) else { return };
        let x = Vertex { position: point - direction * hit.distance, surface: hit.surface };
        let Some(view) = self.view(chosen.index, chosen.rest, &x) else { return };
        let opposite = outline.across.and_then(|(which, same)| {
            let along = if same { chosen.rest } else { 1.0 - chosen.rest };
            self.view(which, along, &x).filter(|view| view.sides.is_some())
        });
        let density = view.found + opposite.as_ref().map_or(0.0, |view| view.found);
        for view in [Some(view), opposite].into_iter().flatten() {
            let Some(sides) = view.sides else { continue };
            let [before, behind] = sides.hits.map(|hit| paths.lit_by_all(hit, view.direction));
            let light = (before - behind) * (sides.share_of_emission(scene) * view.measure / density);
            if light == DVec3::ZERO {
                continue;
            }
            // Shared by both points.
            let mut backwards = address.numbers(BACKWARDS);
            self.sensor.each_subpath(x, view.direction, self.longest, &mut backwards, |subpath| {
                // First hits are handled with paths from the camera.
                if subpath.vertices.len() > 1 {
                    found(&subpath, &view, light * subpath.weight);
                }
            });
        }
    }
}

/// Directions in which emission may be discontinuous at an edge of an emitter.
fn directions(paths: &Paths<'_>, list: &EdgeList, edge: &Edge) -> Directions {
    let scene = paths.scene;
    let [shape, _] = edge.shapes;
    let textured = scene.description.shapes[shape as usize].radiance_texture.is_some();
    let alone = !edge.is_crossing() && paths.lights.is_flat(shape) && paths.lights.is_the_only(shape);
    match (list.triangles(edge).next(), Wedge::of(scene, list, edge)) {
        (Some(triangle), None) if alone => Directions::Front(scene.face_normal(triangle)),
        // A texture may be discontinuous wherever a seam is visible, and so may the view of an object that
        // stands in a fold.
        (_, Some(wedge)) if !(textured && edge.jump || edge.crossed) => Directions::Wedge(wedge),
        _ => Directions::All,
    }
}

/// Number of edges above which opposite ones are not searched.
const MANY: usize = 256;

/// For each edge, the index of its point reflection in the common centre, if all have one, and whether it has
/// the same orientation.
fn across(spans: &[[DVec3; 2]]) -> Vec<Option<(usize, bool)>> {
    let none = vec![None; spans.len()];
    if spans.len() > MANY {
        return none;
    }
    let whole: f64 = spans.iter().map(|[a, b]| a.distance(*b)).sum();
    let centre = spans.iter().map(|&[a, b]| a.midpoint(b) * a.distance(b)).sum::<DVec3>() / whole;
    let near = |p: DVec3, q: DVec3| p.distance(q) < SYMMETRY * whole;
    let image = |&[a, b]: &[DVec3; 2]| {
        let [p, q] = [a, b].map(|x| 2.0 * centre - x);
        spans.iter().enumerate().find_map(|(i, &[c, d])| {
            match (near(p, c) && near(q, d), near(p, d) && near(q, c)) {
                (true, _) => Some((i, true)),
                (_, true) => Some((i, false)),
                _ => None,
            }
        })
    };
    let images: Option<Vec<(usize, bool)>> = spans.iter().map(image).collect();
    images.map_or(none, |images| images.into_iter().map(Some).collect())
}

/// Tolerance for matching an edge with its point reflection, relative to the length of all. If rounding of
/// the input exceeds it, opposite points are not paired, which costs variance but no bias.
const SYMMETRY: f64 = 1e-9;

impl Boundary for ReflectedOutlines<'_> {
    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let scene = self.sensor.paths.scene;
        self.each(address, |subpath, view, light| {
            let point = view.edge.span.point(scene, view.along, |i| calculus.position(i));
            let relative = point - self.sensor.position(calculus, frame, subpath);
            let speed = Vec3::constant(view.normal).dot(relative);
            found(calculus, BoundarySample { at: subpath.at, light, level: 0.0, speed });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn opposite_edges_are_images_in_the_centre() {
        let [a, b, c, d] =
            [[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [1.0, 1.0]].map(|[x, y]| DVec3::new(x, y, 0.5));
        let parallelogram = [[a, b], [b, c], [d, c], [d, a]];
        assert_eq!(
            across(&parallelogram),
            [Some((2, false)), Some((3, true)), Some((0, false)), Some((1, true))]
        );
        assert_eq!(across(&[[a, b], [b, c], [c, a]]), [None; 3]);
    }
}
