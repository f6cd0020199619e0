//! Discontinuities on the film: ∮ h (L⁻ − L⁺) v·ν dl along projected edges.

use flatland::calculus::Vec3;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::driver::{Address, Boundary, BoundarySample};
use super::list::{Edge, EdgeList};
use super::sides::{Sides, aside, look_past};
use super::table::Table;
use super::{Moving, PRIMARY_EDGE, STILL};
use crate::gradient::differential::Differential;
use crate::gradient::film::FilmPlane;
use crate::gradient::jump_mean::SceneEdges;
use crate::path::{Frame, Paths, Sequence};

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

/// Selection of the edges that are sampled.
#[derive(Clone, Copy, Debug)]
pub(super) enum Lines<'a> {
    /// Edges of moving shapes at which radiance may be discontinuous.
    Jumps,
    /// Edges that a field with a softness in pixels follows only in part: silhouettes, borders and crossings,
    /// and all borders of narrow faces; static ones as well, as the field moves relative to them.
    Left { edges: &'a SceneEdges, softness: f64 },
}

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
pub(super) struct Primary<'a> {
    paths: &'a Paths<'a>,
    film: FilmPlane,
    frame: Frame<f64>,
    list: &'a EdgeList,
    which: Lines<'a>,
    lines: Vec<Line>,
    table: Table,
}

impl<'a> Primary<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &Moving, which: Lines<'a>) -> Self {
        let scene = paths.scene;
        let film = FilmPlane::new(scene);
        let mut primary =
            Self { paths, film, frame: film.still, list, which, lines: vec![], table: Table::default() };
        let moves = |edge: &Edge| moving.camera || moving.has_any(edge.shapes);
        for (index, edge) in list.edges.iter().enumerate() {
            let counts = match which {
                Lines::Jumps => moves(edge) && list.may_jump(scene, edge),
                // Silhouettes and narrow faces differ between points of a lens.
                Lines::Left { .. } if film.has_lens() => {
                    list.may_jump(scene, edge) || list.bounds_faces(edge)
                }
                Lines::Left { .. } => {
                    primary.may_be_silhouette(edge) && list.may_jump(scene, edge)
                        || primary.bounds_narrow(edge)
                }
            };
            if counts {
                let pieces = primary.project(index as u32, edge).map(|line| primary.pieces(line));
                primary.lines.extend(pieces.into_iter().flatten());
            }
        }
        let mut weights: Vec<f64> = primary.lines.par_iter().map(|line| primary.weight(line)).collect();
        moving.limit_still(&mut weights, STILL, |i| moves(&list.edges[primary.lines[i].edge as usize]));
        primary.table = Table::new(weights);
        primary
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
        self.list.bounds_faces(edge) && self.list.triangles(edge).any(|t| self.is_narrow(&self.film, t))
    }

    fn is_narrow(&self, film: &FilmPlane, triangle: u32) -> bool {
        let Lines::Left { edges, softness } = self.which else { return false };
        edges.border_softness(triangle, film.still.origin.value(), softness * film.pixel_angle()) > 0.0
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
                let crease = if edge.jump { 1.0 } else { SMOOTH };
                let is_silhouette = facing[0] * facing[1] <= 0.0;
                let is_seam = edge.jump && self.list.is_flat(scene, edge);
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
    fn pieces(&self, line: Line) -> impl Iterator<Item = Line> + use<> {
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

/// A visible point of an edge, and the surfaces on both sides of it.
#[derive(Debug)]
pub(super) struct EdgePoint<'e> {
    edge: &'e Edge,
    /// Position along the edge.
    along: f64,
    pub(super) film: FilmPlane,
    pub(super) at: DVec2,
    /// Normal, from the side before to the side behind.
    pub(super) normal: DVec2,
    pub(super) sides: Sides,
    directions: [DVec3; 2],
    /// One over the density by length on the film.
    pub(super) scale: f64,
    /// Random numbers of the paths on both sides.
    numbers: Sequence,
}

impl Primary<'_> {
    /// Whether there is nothing to sample.
    pub(super) fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Samples a point of an edge by weight; `None` if it is not visible.
    pub(super) fn draw(&self, address: Address) -> Option<EdgePoint<'_>> {
        let scene = self.paths.scene;
        let mut numbers = address.numbers(PRIMARY_EDGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let line = &self.lines[chosen.index];
        let edge = &self.list.edges[line.edge as usize];
        let film = self.film.through(&mut numbers);
        let origin = film.still.origin.value();
        let [a, b] = edge.span(scene);
        let (u, s, line) = if film.has_lens() {
            // The projection depends on the point of the lens: the point is sampled uniformly in space.
            let [start, end] = line.along;
            let s = start + (end - start) * chosen.rest;
            let way = a.lerp(b, s) - origin;
            if way.dot(film.forward()) <= 0.0 {
                return None;
            }
            let (direction, step) = (way.normalize(), (end - start) * (b - a) / way.length());
            let u = DVec2::from(film.project(&film.still, Vec3::constant(origin + way)));
            film.cell(u)?;
            (u, s, film.jacobian(direction).apply(step - direction * direction.dot(step)))
        } else {
            let (u, s) = line.at(chosen.rest);
            (u, s, line.ends[1] - line.ends[0])
        };
        let length = line.length();
        let normal = line.perp() / length;
        if !normal.is_finite() {
            // Edge seen end-on.
            return None;
        }
        let t = a.lerp(b, s).distance(origin);
        let aside = ASIDE_PIXELS.max(aside([a, b], origin, t) * film.pixels_by_angle());
        let directions = [-aside, aside].map(|e| film.ray(u + e * normal));
        let sides = look_past(self.paths.scene, self.list, edge, (origin, None), directions, t)?;
        let scale = sides.share * length / chosen.probability;
        Some(EdgePoint { edge, along: s, film, at: u, normal, sides, directions, scale, numbers })
    }

    /// Radiance on one side, at a point off the edge: exactly at the edge a face would not occlude light
    /// below its horizon.
    pub(super) fn radiance(&self, point: &EdgePoint<'_>, side: usize) -> DVec3 {
        let (origin, mut numbers) = (point.film.still.origin.value(), point.numbers.clone());
        self.paths.still_radiance(origin, point.directions[side], point.sides.hits[side], 1, &mut numbers)
    }

    /// A number whose derivative is v·ν.
    pub(super) fn speed<C: Differential>(
        &self,
        calculus: &C,
        frame: &Frame<C::Number>,
        EdgePoint { edge, along, film, normal, .. }: &EdgePoint<'_>,
    ) -> C::Number {
        let place = edge.span.point(self.paths.scene, *along, |i| calculus.position(i));
        let [x, y] = film.project(&film.frame_through(calculus, frame), place);
        x * normal.x + y * normal.y
    }

    /// The part of one over the density that counts on one side of an edge; `None` where a softened field
    /// follows the edge exactly.
    ///
    /// Of two coincident edges of different surfaces, the other may not be among those sampled, unless it
    /// bounds a narrow face. Hence the border of a narrow face carries the whole residual on the face, and
    /// the other edge none of it.
    pub(super) fn scale_on(&self, point: &EdgePoint<'_>, side: usize) -> Option<f64> {
        let EdgePoint { edge, film, sides, scale, .. } = point;
        let hit = sides.hits[side];
        let narrow = hit.and_then(|hit| hit.surface.triangle()).is_some_and(|t| self.is_narrow(film, t));
        match (narrow, sides.other) {
            (false, _) if self.list.owns(edge, hit) => None,
            (true, Some(other)) => (other != side).then_some(scale / sides.share),
            _ => Some(*scale),
        }
    }
}

impl Boundary for Primary<'_> {
    fn is_empty(&self) -> bool {
        Primary::is_empty(self)
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let Some(point) = self.draw(address) else { return };
        let [before, behind] = [0, 1].map(|side| self.radiance(&point, side));
        if before == behind {
            return;
        }
        let speed = self.speed(calculus, frame, &point);
        let light = (before - behind) * point.scale;
        found(calculus, BoundarySample { at: point.at, light, level: 0.0, speed });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Pieces are consecutive along the line, in position and depth.
    #[test]
    fn pieces_make_a_line() {
        let ends = [DVec2::new(1.0, 2.0), DVec2::new(4.0, -3.0)];
        let line = Line { edge: 7, ends, along: [0.1, 0.8], depth: [2.0, 9.0] };
        let pieces =
            [[0.0, 0.25], [0.25, 0.7], [0.7, 1.0]].map(|fractions| (fractions, line.part(fractions)));
        for pair in pieces.windows(2) {
            let [(_, before), (_, behind)] = [&pair[0], &pair[1]];
            assert_eq!(
                (before.ends[1], before.along[1], before.depth[1]),
                (behind.ends[0], behind.along[0], behind.depth[0])
            );
        }
        for ([start, end], piece) in pieces {
            assert_eq!(piece.edge, 7);
            for fraction in [0.0, 0.3, 1.0] {
                let (u, s) = piece.at(fraction);
                let (whole_u, whole_s) = line.at(start + fraction * (end - start));
                assert!(
                    u.distance(whole_u) < 1e-14 && (s - whole_s).abs() < 1e-14,
                    "{u} {whole_u}, {s} {whole_s}"
                );
            }
        }
    }
}
