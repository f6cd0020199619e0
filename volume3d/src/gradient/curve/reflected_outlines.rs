//! Silhouettes and borders of emitters as seen from path vertices after at least one bounce, with paths
//! traced from the emitter.
//!
//! The terms are those of [`outlines`](super::outlines) with V = 0 (Theory 9). With paths from the camera x
//! slides with 1/cos of the angle at which the previous vertex sees it, and the mean square of that diverges
//! near contact; backward paths meet such points less often, in proportion to that cosine.
//!
//! Opposite sides of an emitter contribute with opposite signs, which almost cancel far from it. If its
//! outline is symmetric about its centre, x is therefore also lit from the point y′ opposite the edge point
//! y. With p and p′ the area densities with which x is sampled from either, and q that of the edge points,
//!
//! > (F(x, y) + F(x, y′))/(q (p + p′))
//!
//! has the mean ∫∫ F, as q is equal for both.

use glam::DVec3;

use super::address::{Address, BACKWARDS, REFLECTED_OUTLINE};
use super::drawing::{
    CameraSubpath, Directions, Edge, EdgeList, Sensor, Sides, Table, Vertex, Wedge, aside, look_past, near,
};
use super::field::Zero;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use super::seen_edge::SeenEdge;
use crate::gradient::modes::differential::Differential;
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
struct View {
    edge: SeenEdge,
    /// Density of its directions times cos θ/t²: the density of shading points by area.
    found: f64,
    /// cos θ/t² divided by the density of edge points.
    measure: f64,
    sides: Option<Sides>,
}

/// A point of an outline.
#[derive(Debug)]
pub(super) struct Point {
    edge: SeenEdge,
    /// Difference of radiance divided by the density.
    light: DVec3,
}

impl<'a> ReflectedOutlines<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &Moving) -> Self {
        let scene = paths.scene;
        let limit = scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let emits = |shape: u32| scene.description.shapes[shape as usize].radiance.is_some();
        let outline = |i: u32| {
            let edge = &list.edges[i as usize];
            let counts =
                limit > 2 && edge.shapes.into_iter().any(emits) && list.may_be_discontinuous(scene, edge);
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
        moving.limit_still(&mut weights, moves);
        let table = Table::new(weights);
        Self { sensor: Sensor::new(paths), list, outlines, table, longest: limit.saturating_sub(1) }
    }

    /// A point of an outline as seen from a shading point, unless it lies in that point's plane.
    fn view(&self, which: usize, along: f64, x: &Vertex) -> Option<View> {
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
        let edge = SeenEdge { span: edge.span, along, direction, distance, normal };
        Some(View { edge, found, measure: projected / density, sides }).filter(|view| view.found > 0.0)
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
        (_, Some(wedge)) if !(textured && edge.is_discontinuity || edge.crossed) => Directions::Wedge(wedge),
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

impl Curve for ReflectedOutlines<'_> {
    type Field = Zero;
    type Point = Point;

    fn field(&self) -> &Zero {
        &Zero
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Every camera path whose last vertex sees emission end at a sampled point of an outline, or at the
    /// opposite point.
    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Point)) {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let mut numbers = address.numbers(REFLECTED_OUTLINE);
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
        for View { edge, measure, sides, .. } in [Some(view), opposite].into_iter().flatten() {
            let Some(sides) = sides else { continue };
            let [before, behind] = sides.hits.map(|hit| paths.lit_by_all(hit, edge.direction));
            let light = (before - behind) * (sides.share_of_emission(scene) * measure / density);
            if light == DVec3::ZERO {
                continue;
            }
            // Shared by both points.
            let mut backwards = address.numbers(BACKWARDS);
            self.sensor.each_subpath(x, edge.direction, self.longest, &mut backwards, |path| {
                // First hits are handled with paths from the camera.
                if path.vertices.len() > 1 {
                    found(&path, &Point { edge, light });
                }
            });
        }
    }

    fn difference(&self, path: &CameraSubpath<'_>, point: &Point) -> Difference {
        Difference::of(point.light * path.weight)
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        point: &Point,
    ) -> C::Number {
        point.edge.speed::<Zero, C>(self.sensor.paths, calculus, frame, path, None)
    }
}
