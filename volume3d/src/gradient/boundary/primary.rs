//! Jumps on the film: ∮ h (L⁻ − L⁺) v·ν dl along the projected edges.

use flatland::calculus::Vec3;
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::driver::{Address, Boundary, BoundarySample};
use super::list::{Edge, EdgeList};
use super::sides::look_past;
use super::table::Table;
use super::{Moving, PRIMARY_EDGE};
use crate::gradient::differential::Differential;
use crate::gradient::film::FilmPlane;
use crate::path::{Frame, Paths};

/// The ray on either side of a projected edge leaves it by this many pixels.
const ASIDE_PIXELS: f64 = 1e-6;

/// The least contrast a crease is credited with: what is reflected there may jump for other reasons than its normal.
const LEAST: f64 = 0.02;

/// What a fold with smooth shading counts, of what a crease does.
const SMOOTH: f64 = 0.5;

/// What an edge counts whose middle is hidden, of what it counts otherwise: other parts of it may be seen.
const HIDDEN: f64 = 0.1;

/// The part of the way to an edge at which its own surface is no longer in the way.
const NEARLY: f64 = 1e-6;

/// An edge's part on the film.
#[derive(Clone, Copy, Debug)]
struct Line {
    edge: u32,
    /// Film points of both ends.
    ends: [DVec2; 2],
    /// How far along the edge they are, and how deep.
    along: [f64; 2],
    depth: [f64; 2],
}

/// All edges on the film, by length.
#[derive(Debug)]
pub(super) struct Primary<'a> {
    paths: &'a Paths<'a>,
    film: FilmPlane,
    frame: Frame<f64>,
    list: &'a EdgeList,
    lines: Vec<Line>,
    table: Table,
}

impl<'a> Primary<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &Moving) -> Self {
        let scene = paths.scene;
        let film = FilmPlane::new(scene);
        let mut primary =
            Self { paths, film, frame: film.still, list, lines: vec![], table: Table::default() };
        for (index, edge) in list.edges.iter().enumerate() {
            let moves = moving.camera || moving.has_any(edge.shapes);
            if moves && list.may_jump(scene, edge) {
                primary.lines.extend(primary.project(index as u32, edge));
            }
        }
        let weights: Vec<f64> = primary.lines.par_iter().map(|line| primary.weight(line)).collect();
        primary.table = Table::new(weights);
        primary
    }

    /// Roughly how much an edge counts: its length on the film, times the contrast there. Across a crease the
    /// radiance changes as much as the normal turns; across a silhouette, and at a seam of texture coordinates within a
    /// plane, by all of it.
    fn weight(&self, line: &Line) -> f64 {
        let scene = self.paths.scene;
        let edge = &self.list.edges[line.edge as usize];
        let origin = self.frame.origin.value();
        let contrast = match self.list.limits(scene, edge) {
            Some([u, v]) => {
                let [a, b] = edge.span(scene);
                let facing = [u, v].map(|u| u.cross(b - a).dot(origin - a));
                let crease = if edge.jump { 1.0 } else { SMOOTH };
                let is_silhouette = facing[0] * facing[1] <= 0.0;
                let is_seam = edge.jump && self.list.is_flat(scene, edge);
                if is_silhouette || is_seam { 1.0 } else { crease * (u - v).length().clamp(LEAST, 1.0) }
            }
            None => 1.0,
        };
        let [a, b] = edge.span(scene);
        if self.film.has_lens() {
            // What hides it from one point of the lens may not from another, and a near end is seen at any size.
            let [start, end] = line.along;
            let depth = 0.5 * (line.depth[0] + line.depth[1]);
            return a.distance(b) * (end - start) / depth * contrast;
        }
        let (u, s) = line.at(0.5);
        let t = a.lerp(b, s).distance(origin);
        let direction = self.film.direction(&self.frame, [u.x, u.y]).value();
        let hidden = self.paths.scene.hidden_from_camera(origin, direction, t * (1.0 - NEARLY));
        line.ends[0].distance(line.ends[1]) * contrast * if hidden { HIDDEN } else { 1.0 }
    }

    /// The part of an edge before the camera that is within the cells of the film, or that a lens may see there.
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
        // How far beside other points of the lens see as well: they are shifted, and their image planes back.
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
    /// The film point at a fraction of the projected length, and how far along the edge it is.
    ///
    /// 1/z is linear on the film.
    fn at(&self, fraction: f64) -> (DVec2, f64) {
        let [z, y] = self.depth;
        let w = fraction * z / ((1.0 - fraction) * y + fraction * z);
        (self.ends[0].lerp(self.ends[1], fraction), self.along[0] + w * (self.along[1] - self.along[0]))
    }
}

impl Boundary for Primary<'_> {
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
        let scene = self.paths.scene;
        let mut numbers = address.numbers(PRIMARY_EDGE);
        let chosen = self.table.at(address.fraction(&mut numbers));
        let line = &self.lines[chosen.index];
        let edge = &self.list.edges[line.edge as usize];
        let film = self.film.through(&mut numbers);
        let origin = film.still.origin.value();
        let [a, b] = edge.span(scene);
        let (u, s, line) = if film.has_lens() {
            // Lines through each point of the lens are others: the point is drawn in space, uniformly.
            let [start, end] = line.along;
            let s = start + (end - start) * chosen.rest;
            let way = a.lerp(b, s) - origin;
            if way.dot(film.forward()) <= 0.0 {
                return;
            }
            let (direction, step) = (way.normalize(), (end - start) * (b - a) / way.length());
            let u = DVec2::from(film.project(&film.still, Vec3::constant(origin + way)));
            if film.cell(u).is_none() {
                return;
            }
            (u, s, film.jacobian(direction).apply(step - direction * direction.dot(step)))
        } else {
            let (u, s) = line.at(chosen.rest);
            (u, s, line.ends[1] - line.ends[0])
        };
        let length = line.length();
        let normal = line.perp() / length;
        if !normal.is_finite() {
            // Seen end-on.
            return;
        }
        let t = a.lerp(b, s).distance(origin);
        let directions = [-ASIDE_PIXELS, ASIDE_PIXELS].map(|e| film.ray(u + e * normal));
        let Some(sides) = look_past(self.paths.scene, self.list, edge, (origin, None), directions, t) else {
            return;
        };
        // Aside as well: at the edge itself a face does not hide the light that is below its horizon.
        let [before, behind] = [0, 1].map(|k| {
            let mut numbers = numbers.clone();
            self.paths.still_radiance(origin, directions[k], sides.hits[k], 1, &mut numbers)
        });
        if before == behind {
            return;
        }
        let point = edge.span.point(scene, s, |i| calculus.position(i));
        let [x, y] = film.project(&film.frame_through(calculus, frame), point);
        let sample = BoundarySample {
            at: u,
            light: (before - behind) * (sides.share * length / chosen.probability),
            speed: x * normal.x + y * normal.y,
        };
        found(calculus, sample);
    }
}
