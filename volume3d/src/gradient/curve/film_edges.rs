//! Edges and crossings on the film, ∮ h Δ[(L − L₀)(v − V)]·ν dl (Theory 6 and 7).
//!
//! With V = 0 both sides of an edge have its speed, and the integrand is h (L⁻ − L⁺) v·ν. A softened field
//! follows the border of the visible surface, and silhouettes in front of it in part. With V⁻ and V⁺ its
//! limits on the two sides of a silhouette, the integrand is
//!
//! > h [(L⁻ − L₀) (v − V⁻) − (L⁺ − L₀) (v − V⁺)]·ν.
//!
//! On the side of the surface that ends there, V⁻ = v: only one side counts, except at crossings, which are
//! no surface's border. Every difference is at most twice the largest nearby velocity, whatever the gap to
//! the next silhouette.
//!
//! Points are sampled by length, contrast and visibility, independently of velocities except for which shapes
//! move.

use flatland::calculus::Vec3;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::address::{Address, FILM_EDGE};
use super::drawing::{CameraSubpath, Edge, EdgeList, Sides, Table, Vertex, aside, look_past};
use super::eye::Eye;
use super::field::WarpField;
use super::integral::{Curve, Difference};
use super::moving::Moving;
use crate::gradient::film::FilmPlane;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, Paths, Sequence};
use crate::scene::Span;

/// Least distance, in pixels, of the rays on either side from a projected edge: a thousand times the rounding
/// error of directions and of film coordinates below 1,000.
const ASIDE_PIXELS: f64 = 1e-9;

/// Angle, in radians, up to which a face counts as seen edge-on, where its width may vanish in rounding. It
/// far exceeds the rounding at any well-shaped face; a superfluous edge costs only a sample.
const EDGE_ON: f64 = 1e-4;

/// Least contrast assumed at a crease, as reflected light may be discontinuous for reasons other than the
/// normal.
const LEAST: f64 = 0.02;

/// Least contrast assumed at the border of a narrow face: a softened field leaves part of its motion,
/// whatever the contrast.
const LEAST_OF_NARROW: f64 = 0.25;

/// Weight of a fold with smooth shading, relative to a crease.
const SMOOTH: f64 = 0.5;

/// Largest length of a piece of an edge, in pixels, unless [`MOST_PIECES`] would be exceeded: visibility is
/// tested for each piece. Whole edges that are partly visible, but not in the middle, caused most of the
/// noise.
const PIECE: f64 = 2.0;
const MOST_PIECES: f64 = 64.0;

/// Weight factor of a piece whose midpoint is occluded, and the amount added to it in proportion to the
/// piece's length: other parts of it may be visible.
const HIDDEN: f64 = 0.05;
const HIDDEN_IF_LONG: f64 = 0.25;

/// Fraction of the distance to an edge beyond which its own surface does not occlude it. It affects only
/// weights, none of which is 0.
const NEARLY: f64 = 1e-6;

/// A piece of an edge on the film.
#[derive(Clone, Copy, Debug)]
struct Line {
    edge: u32,
    /// Film points of both ends.
    ends: [DVec2; 2],
    /// Positions of the ends along the edge, and their depths.
    along: [f64; 2],
    depth: [f64; 2],
}

/// All edges on the film, by length and contrast.
#[derive(Debug)]
pub(super) struct FilmEdges<'a, V> {
    paths: &'a Paths<'a>,
    film: FilmPlane,
    frame: Frame<f64>,
    list: &'a EdgeList,
    field: V,
    lines: Vec<Line>,
    table: Table,
}

impl<'a, V: WarpField> FilmEdges<'a, V> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &Moving, field: V) -> Self {
        let scene = paths.scene;
        let film = FilmPlane::new(scene);
        let mut all =
            Self { paths, film, frame: film.still, list, field, lines: vec![], table: Table::default() };
        let moves = |edge: &Edge| moving.camera || moving.has_any(edge.shapes);
        for (index, edge) in list.edges.iter().enumerate() {
            // Relative to a field what rests moves as well.
            let counts = if V::IS_ZERO {
                moves(edge) && list.may_be_discontinuous(scene, edge)
            } else if film.has_lens() {
                // Silhouettes and narrow faces differ between points of a lens.
                list.may_be_discontinuous(scene, edge) || list.bounds_faces(edge)
            } else {
                all.may_be_silhouette(edge) && list.may_be_discontinuous(scene, edge)
                    || all.bounds_narrow(edge)
            };
            if counts {
                let pieces = all.project(index as u32, edge).map(|line| all.pieces(line));
                all.lines.extend(pieces.into_iter().flatten());
            }
        }
        let mut weights: Vec<f64> = all.lines.par_iter().map(|line| all.weight(line)).collect();
        moving.limit_still(&mut weights, |i| moves(&list.edges[all.lines[i].edge as usize]));
        all.table = Table::new(weights);
        all
    }

    /// Whether an edge may be a silhouette from the centre of the lens; true for all borders, crossings and
    /// edges along which these run.
    fn may_be_silhouette(&self, edge: &Edge) -> bool {
        if edge.crossed {
            return true;
        }
        let Some([u, v]) = edge.limits else { return true };
        let [a, b] = edge.span(self.paths.scene);
        let way = self.frame.origin.value() - a;
        let facing = [u, v].map(|u| u.cross(b - a).dot(way));
        // In front of a face narrower than the offset of the rays, the other edge represents both.
        let edge_on = facing.iter().any(|f| f.abs() <= EDGE_ON * a.distance(b) * way.length());
        edge_on || facing[0] * facing[1] <= 0.0
    }

    /// Whether an edge bounds a face so narrow, seen from the centre of the lens, that a softened field
    /// follows its border only in part.
    fn bounds_narrow(&self, edge: &Edge) -> bool {
        !V::IS_ZERO
            && self.list.bounds_faces(edge)
            && self.list.triangles(edge).any(|t| self.is_narrow(&self.film, t))
    }

    fn is_narrow(&self, film: &FilmPlane, triangle: u32) -> bool {
        self.field.border_softness(film, triangle) > 0.0
    }

    /// Approximate importance of an edge: its length on the film times the contrast. Across a crease the
    /// radiance changes in proportion to the normal; across a silhouette, and at a texture seam within a
    /// plane, the contrast is 1.
    fn weight(&self, line: &Line) -> f64 {
        let scene = self.paths.scene;
        let edge = &self.list.edges[line.edge as usize];
        let origin = self.frame.origin.value();
        let contrast = match edge.limits {
            Some([u, v]) => {
                let [a, b] = edge.span(scene);
                let facing = [u, v].map(|u| u.cross(b - a).dot(origin - a));
                let crease = if edge.is_discontinuity { 1.0 } else { SMOOTH };
                let is_silhouette = facing[0] * facing[1] <= 0.0;
                let is_seam = edge.is_discontinuity && self.list.is_flat(scene, edge);
                let least = if self.bounds_narrow(edge) { LEAST_OF_NARROW } else { LEAST };
                if is_silhouette || is_seam { 1.0 } else { crease * (u - v).length().clamp(least, 1.0) }
            }
            None => 1.0,
        };
        let [a, b] = edge.span(scene);
        if self.film.has_lens() {
            // An occluder for one point of the lens may not be one for another, and a near end may appear at
            // any size.
            let [start, end] = line.along;
            let depth = 0.5 * (line.depth[0] + line.depth[1]);
            return a.distance(b) * (end - start) / depth * contrast;
        }
        let (u, s) = line.at(0.5);
        let t = a.lerp(b, s).distance(origin);
        let direction = self.film.direction(&self.frame, [u.x, u.y]).value();
        let hidden = self.paths.scene.hidden_from_camera(origin, direction, t * (1.0 - NEARLY));
        let length = line.ends[0].distance(line.ends[1]);
        let seen = if hidden { HIDDEN + HIDDEN_IF_LONG * (length / PIECE).min(1.0) } else { 1.0 };
        length * contrast * seen
    }

    /// Pieces of a line, whose visibility is tested separately. With a lens the line stays whole.
    fn pieces(&self, line: Line) -> impl Iterator<Item = Line> + use<V> {
        let length = line.ends[0].distance(line.ends[1]);
        let count = if self.film.has_lens() { 1.0 } else { (length / PIECE).ceil().clamp(1.0, MOST_PIECES) };
        (0..count as usize).map(move |i| line.part([i as f64 / count, (i + 1) as f64 / count]))
    }

    /// The part of an edge in front of the camera that projects into the cells of the film, or that a lens
    /// may see there.
    fn project(&self, index: u32, edge: &Edge) -> Option<Line> {
        let [a, b] = edge.span(self.paths.scene).map(|p| {
            let way = p - self.frame.origin.value();
            let axis = |v: Vec3<f64>| way.dot(v.value());
            DVec3::new(
                axis(self.frame.right),
                -axis(self.frame.up) * self.film.aspect(),
                axis(self.frame.forward),
            )
        });
        // x ≥ x₀ z and so on: together they imply z ≥ 0.
        let (low, high) = self.film.bounds();
        let focal = self.frame.focal;
        let [centre] = [self.film.project(&self.frame, self.frame.origin + self.frame.forward)];
        let centre = DVec2::from(centre);
        let (low, high) = ((low - centre) / focal, (high - centre) / focal);
        // Widened by the region that other points of the lens see: these are shifted, and their image planes
        // shifted back.
        let beside = |z: f64| self.film.beside(z);
        let heights = |p: DVec3| {
            let DVec2 { x, y } = beside(p.z);
            let front = if self.film.has_lens() { p.z } else { 0.0 };
            [
                p.x - low.x * p.z + x,
                high.x * p.z - p.x + x,
                p.y - low.y * p.z + y,
                high.y * p.z - p.y + y,
                front,
            ]
        };
        let (mut start, mut end) = (0.0_f64, 1.0_f64);
        for (f, g) in heights(a).into_iter().zip(heights(b)) {
            match (f >= 0.0, g >= 0.0) {
                (false, false) => return None,
                (true, true) => {}
                (false, true) => start = start.max(f / (f - g)),
                (true, false) => end = end.min(f / (f - g)),
            }
        }
        if start.partial_cmp(&end) != Some(std::cmp::Ordering::Less) {
            return None;
        }
        let points = [start, end].map(|s| a + (b - a) * s);
        let ends = points.map(|p| centre + p.truncate() * (focal / p.z));
        let line = Line { edge: index, ends, along: [start, end], depth: points.map(|p| p.z) };
        let seen = ends.iter().all(|e| e.is_finite()) && ends[0] != ends[1];
        (seen || self.film.has_lens()).then_some(line)
    }
}

impl Line {
    /// Film point at a fraction of the projected length, and position along the edge.
    ///
    /// 1/z is linear on the film.
    fn at(&self, fraction: f64) -> (DVec2, f64) {
        let [z, y] = self.depth;
        let w = fraction * z / ((1.0 - fraction) * y + fraction * z);
        (self.ends[0].lerp(self.ends[1], fraction), self.along[0] + w * (self.along[1] - self.along[0]))
    }

    /// The piece between two fractions.
    fn part(&self, fractions: [f64; 2]) -> Self {
        let [(start, from), (end, to)] = fractions.map(|fraction| self.at(fraction));
        let [z, y] = self.depth;
        let depth = fractions.map(|fraction| z * y / ((1.0 - fraction) * y + fraction * z));
        Self { ends: [start, end], along: [from, to], depth, ..*self }
    }
}

/// A visible point of an edge: both of its sides, or one of them.
#[derive(Debug)]
pub(super) struct Point {
    span: Span,
    /// Position along the edge.
    along: f64,
    /// Normal on the film, from the side before to the side behind.
    normal: DVec2,
    sides: Sides,
    directions: [DVec3; 2],
    /// The only side that counts, if the sides have speeds of their own.
    side: Option<usize>,
    /// One over the density by length on the film.
    scale: f64,
    /// Random numbers of the paths on both sides.
    numbers: Sequence,
}

impl<V: WarpField> FilmEdges<'_, V> {
    /// Radiance on one side, at a point off the edge: exactly at the edge a face would not occlude light
    /// below its horizon.
    fn radiance(&self, path: &CameraSubpath<'_>, point: &Point, side: usize) -> DVec3 {
        let (origin, mut numbers) = (path.film.still.origin.value(), point.numbers.clone());
        self.paths.still_radiance(origin, point.directions[side], point.sides.hits[side], 1, &mut numbers)
    }

    /// The part of one over the density that counts on one side of an edge; `None` where a softened field
    /// follows the edge exactly.
    ///
    /// Of two coincident edges of different surfaces, the other may not be among those sampled, unless it
    /// bounds a narrow face. Hence the border of a narrow face carries the whole residual on the face, and
    /// the other edge none of it.
    fn scale_on(&self, film: &FilmPlane, edge: &Edge, point: &Point, side: usize) -> Option<f64> {
        let Point { sides, scale, .. } = point;
        let hit = sides.hits[side];
        let narrow = hit.and_then(|hit| hit.surface.triangle()).is_some_and(|t| self.is_narrow(film, t));
        match (narrow, sides.other) {
            (false, _) if self.list.owns(edge, hit) => None,
            (true, Some(other)) => (other != side).then_some(scale / sides.share),
            _ => Some(*scale),
        }
    }
}

impl<V: WarpField> Curve for FilmEdges<'_, V> {
    type Field = V;
    type Point = Point;

    fn field(&self) -> &V {
        &self.field
    }

    fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// A point of an edge by weight, if it is visible.
    fn draw(&self, address: Address, found: &mut impl FnMut(&CameraSubpath<'_>, &Point)) {
        let scene = self.paths.scene;
        let mut numbers = address.numbers(FILM_EDGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let line = &self.lines[chosen.index];
        let edge = &self.list.edges[line.edge as usize];
        let film = &self.film.through(&mut numbers);
        let origin = film.still.origin.value();
        let [a, b] = edge.span(scene);
        let (at, along, line) = if film.has_lens() {
            // The projection depends on the point of the lens: the point is sampled uniformly in space.
            let [start, end] = line.along;
            let along = start + (end - start) * chosen.rest;
            let way = a.lerp(b, along) - origin;
            if way.dot(film.forward()) <= 0.0 {
                return;
            }
            let (direction, step) = (way.normalize(), (end - start) * (b - a) / way.length());
            let at = DVec2::from(film.project(&film.still, Vec3::constant(origin + way)));
            if film.cell(at).is_none() {
                return;
            }
            (at, along, film.jacobian(direction).apply(step - direction * direction.dot(step)))
        } else {
            let (at, along) = line.at(chosen.rest);
            (at, along, line.ends[1] - line.ends[0])
        };
        let length = line.length();
        let normal = line.perp() / length;
        if !normal.is_finite() {
            // Edge seen end-on.
            return;
        }
        let t = a.lerp(b, along).distance(origin);
        let aside = ASIDE_PIXELS.max(aside([a, b], origin, t) * film.pixels_by_angle());
        let directions = [-aside, aside].map(|e| film.ray(at + e * normal));
        let Some(sides) = look_past(scene, self.list, edge, (origin, None), directions, t) else { return };
        let scale = sides.share * length / chosen.probability;
        let (span, side) = (edge.span, None);
        let both = Point { span, along, normal, sides, directions, side, scale, numbers };
        let path = CameraSubpath { film, at, vertices: &[], weight: DVec3::ONE };
        if V::IS_ZERO {
            return found(&path, &both);
        }
        for (side, direction) in directions.into_iter().enumerate() {
            if let Some(scale) = self.scale_on(film, edge, &both, side) {
                let vertex = sides.hits[side]
                    .map(|hit| Vertex { position: origin + direction * hit.distance, surface: hit.surface });
                let numbers = both.numbers.clone();
                let point = Point { side: Some(side), scale, numbers, ..both };
                found(&CameraSubpath { vertices: vertex.as_slice(), ..path }, &point);
            }
        }
    }

    fn difference(&self, path: &CameraSubpath<'_>, point: &Point) -> Difference {
        match point.side {
            None => {
                let [before, behind] = [0, 1].map(|side| self.radiance(path, point, side));
                Difference::of((before - behind) * point.scale)
            }
            Some(side) => {
                let control_variate = if side == 0 { point.scale } else { -point.scale };
                let radiance = self.radiance(path, point, side) * control_variate;
                Difference { radiance, control_variate }
            }
        }
    }

    fn speed<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        &Point { span, along, normal, .. }: &Point,
    ) -> C::Number {
        let eye = Eye::of::<V, C>(calculus, frame, path);
        let place = span.point(self.paths.scene, along, |i| calculus.position(i));
        let [x, y] = path.film.project(&eye.frame, place);
        let across = |[x, y]: [C::Number; 2]| x * normal.x + y * normal.y;
        if V::IS_ZERO { across([x, y]) } else { across([x, y]) - across(eye.at) }
    }
}
