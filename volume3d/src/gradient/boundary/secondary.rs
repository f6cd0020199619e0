//! Jumps seen from shading points, in the form of path space (Zhang, Miller, Yan, Gkioulekas and Zhao 2020).
//!
//! At a shading point x the boundary term is ∮ f cos θ ΔL (v·ν) dl over the curves on the sphere of directions on
//! which edges are seen. With e the edge's unit direction, x_B its point at arc length s, t = |x_B − x|,
//! ω = (x_B − x)/t and φ the angle between e and ω:
//!
//!   dl = sin φ ds/t, ν = (ω × e)/sin φ, v·ν = (ω × e)·(ẋ_B − ẋ)/(t sin φ),
//!
//! ẋ being the velocity of x with the directions of the path before it held still. At fixed s, a patch dA of
//! the surface at x is a solid angle dω = |n·ω| dA/t² at x_B, so that
//!
//!   dA dl = (t sin φ/|n·ω|) dω ds,  dA (v·ν) dl = (ω × e)·(ẋ_B − ẋ)/|n·ω| dω ds:
//!
//! distances cancel. One draws a point of an edge and a direction through it, and finds x.

use flatland::calculus::Vec3;
use std::f64::consts::{PI, TAU};

use glam::DVec3;
use rayon::prelude::*;

use super::driver::{Address, Boundary, BoundarySample};
use super::list::{Edge, EdgeList};
use super::sensor::{CameraSubpath, Sensor, Vertex};
use super::sides::{ASIDE, Sides, look_past};
use super::table::Table;
use super::wedge::{Aimed, Targets, Wedge};
use super::{BACKWARDS, LIT_EDGE, Moving, REST_EDGE, STILL};
use crate::gradient::differential::Differential;
use crate::path::{Frame, LightId, Paths, Sequence};
use crate::scene::{Environment, Hit, Scene, Surface};

/// What passes an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Light {
    /// The emission that next-event estimation finds: directions are those of lights.
    Emitted,
    /// The same at edges of all shapes but the emitter's own.
    Shadows,
    /// A constant environment and what surfaces reflect: directions are uniform, where what is seen may jump.
    Rest,
    /// The same along a softened field, which leaves silhouettes and crossings.
    Bounces,
}

impl Light {
    /// Whether it is emission that next-event estimation finds.
    fn is_emission(self) -> bool {
        matches!(self, Self::Emitted | Self::Shadows)
    }

    /// Whether shading points slide along warps, those that stand still as well.
    fn is_along_warps(self) -> bool {
        matches!(self, Self::Shadows | Self::Bounces)
    }
}

/// Edges as they are seen from shading points.
#[derive(Debug)]
pub(super) struct Secondary<'a> {
    sensor: Sensor<'a>,
    list: &'a EdgeList,
    moving: &'a Moving,
    light: Light,
    targets: Option<Targets>,
    table: Table,
    /// The longest part of a path before the jump.
    longest: usize,
}

/// Directions to lights that tell how often an edge is a silhouette before one.
const PILOTS: usize = 16;

/// What a fold with smooth shading counts, of what a crease does.
const SMOOTH: f64 = 0.05;

/// An edge that was never one in so many trials may still be.
const LEAST: f64 = 0.05;

/// A direction through a point of an edge.
#[derive(Clone, Copy, Debug)]
struct Drawn {
    direction: DVec3,
    /// Per solid angle.
    density: f64,
    aim: Option<Aim>,
}

/// The light that a direction was drawn for, and the only surface of it that counts, if it is one of them.
#[derive(Clone, Copy, Debug)]
struct Aim {
    id: LightId,
    surface: Option<Surface>,
    distance: f64,
}

/// A point of an edge with a direction to the light, and where light arrives.
struct Segment<'e> {
    edge: &'e Edge,
    along: f64,
    start: Vertex,
    direction: DVec3,
    distance: f64,
    /// ω × e.
    normal: DVec3,
}

impl<'a> Secondary<'a> {
    pub(super) fn new(paths: &'a Paths<'a>, list: &'a EdgeList, moving: &'a Moving, light: Light) -> Self {
        let limit = paths.scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        let mut secondary = Self {
            sensor: Sensor::new(paths),
            list,
            moving,
            light,
            targets: Targets::new(paths),
            table: Table::default(),
            longest: limit.saturating_sub(1),
        };
        let constant = matches!(paths.scene.description.environment, Some(Environment::Constant { .. }));
        let nothing = match light {
            Light::Emitted | Light::Shadows => limit < 2,
            Light::Rest | Light::Bounces => limit < 2 || (limit == 2 && !constant),
        };
        if !nothing {
            secondary.table = secondary.weights();
        }
        secondary
    }

    fn weights(&self) -> Table {
        let scene = self.sensor.paths.scene;
        let weigh = |edge: &Edge| {
            let [a, b] = edge.span(scene);
            a.distance(b)
                * match self.light {
                    Light::Emitted | Light::Shadows => self.silhouette_rate(edge),
                    Light::Rest | Light::Bounces if self.list.may_jump(scene, edge) => self.solid_angle(edge),
                    Light::Rest | Light::Bounces => 0.0,
                }
        };
        let mut weights: Vec<f64> = self.list.edges.par_iter().map(weigh).collect();
        self.moving.limit_still(&mut weights, STILL, |e| self.moving.has_any(self.list.edges[e].shapes));
        Table::new(weights)
    }

    /// Roughly the solid angle of lights before which the edge is a silhouette, or how often it is one, if that cannot
    /// be told; 0 only where it never is.
    fn silhouette_rate(&self, edge: &Edge) -> f64 {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let emits = |s: u32| scene.description.shapes[s as usize].radiance.is_some();
        if self.light == Light::Emitted && edge.shapes.into_iter().any(emits) || edge.is_crossing() {
            // Those of emitters are sampled from the camera, and at other crossings no emission jumps.
            return 0.0;
        }
        if self.light == Light::Shadows && paths.lights.is_the_only(edge.shapes[0]) {
            return 0.0;
        }
        let [a, b] = edge.span(scene);
        if let Some(targets) = &self.targets {
            return match self.wedge(edge) {
                Some(wedge) => targets.solid_angle(scene, &wedge, [a, b]),
                None if self.list.is_flat(scene, edge) => 0.0,
                None => targets.reach(scene, [a, b]),
            };
        }
        let middle = a.midpoint(b);
        let mut count = 0;
        for i in 0..PILOTS {
            // Additive recurrences of the roots of x⁴ = x + 1.
            let numbers = [0.819_172_5, 0.671_043_6, 0.549_700_5].map(|g| (0.5 + g * i as f64).fract());
            let Some(towards) = paths.lights.sample(scene, middle, numbers) else { continue };
            let normal = towards.sampled.direction.cross(b - a);
            let sides = self.list.occupied(scene, edge, normal);
            count += usize::from(sides[0] != sides[1]);
        }
        let rate = count as f64 / PILOTS as f64;
        if rate > 0.0 || self.may_be_silhouette(edge) { rate.max(LEAST) } else { 0.0 }
    }

    /// Whether an edge of two triangles may be a silhouette before a light: whether some light is not on the
    /// same sides of both their planes throughout.
    fn may_be_silhouette(&self, edge: &Edge) -> bool {
        let scene = self.sensor.paths.scene;
        let Some(spheres) = self.sensor.paths.lights.spheres() else { return true };
        let Some([u, v]) = self.list.limits(scene, edge) else { return true };
        let [a, b] = edge.span(scene);
        let e = (b - a).normalize_or_zero();
        spheres.iter().any(|&(centre, radius)| {
            let [f, g] = [u, v].map(|u| u.cross(e).dot(centre - a));
            f.abs() <= radius || g.abs() <= radius || f * g < 0.0
        })
    }

    /// Roughly the solid angle in which what is seen jumps at an edge, times the contrast there.
    fn solid_angle(&self, edge: &Edge) -> f64 {
        if edge.is_crossing() && self.longest == 1 {
            // A constant environment does not jump.
            return 0.0;
        }
        let (anywhere, wedge) = (self.share_anywhere(edge), self.wedge(edge));
        let crease = if edge.jump { 1.0 } else { SMOOTH };
        match wedge {
            None => 4.0 * PI,
            Some(w) if anywhere == 0.0 => 4.0 * w.angle,
            Some(w) => 4.0 * w.angle + 4.0 * PI * crease * w.angle.clamp(LEAST, 1.0),
        }
    }

    /// The part of directions that are drawn from the whole sphere; the others are those of the wedge.
    ///
    /// Emission jumps at silhouettes only, and so does a constant environment; what surfaces reflect jumps at all
    /// folds, of which a softened field leaves the silhouettes.
    fn share_anywhere(&self, edge: &Edge) -> f64 {
        match self.wedge(edge) {
            None => 1.0,
            Some(_) if self.longest > 1 && self.light == Light::Rest => 0.5,
            Some(_) => 0.0,
        }
    }

    /// The directions in which an edge of two triangles is a silhouette; `None` where every direction counts.
    fn wedge(&self, edge: &Edge) -> Option<Wedge> {
        // A fold through which something passes is a crossing as well.
        if self.light == Light::Bounces && edge.crossed {
            return None;
        }
        Wedge::of(self.sensor.paths.scene, self.list, edge)
    }

    /// A direction from a point of an edge towards the light.
    fn draw(&self, edge: &Edge, point: DVec3, numbers: &mut Sequence) -> Option<Drawn> {
        let paths = self.sensor.paths;
        let (c, [a, b]) = (numbers.one(), numbers.pair());
        if self.light.is_emission() {
            if let (Some(targets), Some(wedge)) = (&self.targets, self.wedge(edge)) {
                let aimed = targets.draw(paths.scene, &wedge, edge.span(paths.scene), point, [c, a, b])?;
                let Aimed { direction, distance, density, surface, id } = aimed;
                return Some(Drawn {
                    direction,
                    density,
                    aim: Some(Aim { id, surface: Some(surface), distance }),
                });
            }
            let towards = paths.lights.sample(paths.scene, point, [c, a, b])?;
            let (direction, density) = (towards.sampled.direction, towards.sampled.density);
            let aim = Aim { id: towards.id, surface: None, distance: towards.distance };
            return Some(Drawn { direction, density, aim: Some(aim) });
        }
        let [p, q] = edge.span(paths.scene);
        let e = (q - p).normalize_or_zero();
        let z = 2.0 * a - 1.0;
        let radius = (1.0 - z * z).sqrt();
        let (wedge, anywhere) = (self.wedge(edge), self.share_anywhere(edge));
        let (s, t) = e.any_orthonormal_pair();
        let (u, v, turn) = match &wedge {
            // What is left of the choice takes one of the two opposite parts.
            Some(w) if c >= anywhere => {
                let opposite = (c - anywhere) / (1.0 - anywhere) < 0.5;
                (w.u, w.up, w.angle * b + if opposite { PI } else { 0.0 })
            }
            _ => (s, t, TAU * b),
        };
        let (sin, cos) = turn.sin_cos();
        let direction = z * e + radius * (cos * u + sin * v);
        let in_wedge =
            wedge.as_ref().filter(|w| w.holds(direction)).map_or(0.0, |w| (1.0 - anywhere) / (4.0 * w.angle));
        Some(Drawn { direction, density: in_wedge + anywhere / (4.0 * PI), aim: None })
            .filter(|drawn| drawn.density > 0.0)
    }

    /// Rays through an edge's point start that far from it: its own triangles do not count.
    fn near(&self) -> f64 {
        1e4 * self.sensor.paths.scene.rounding()
    }

    /// The light on both sides of the edge along a path's last segment; none on a side that a softened field follows.
    fn lights(
        &self,
        segment: &Segment<'_>,
        sides: &Sides,
        aim: Option<Aim>,
        depth: usize,
        numbers: &Sequence,
    ) -> [DVec3; 2] {
        let paths = self.sensor.paths;
        sides.hits.map(|hit: Option<Hit>| match aim {
            _ if self.light == Light::Bounces && self.list.owns(segment.edge, hit) => DVec3::ZERO,
            Some(Aim { id, surface, .. }) => {
                let hit = hit.filter(|h| surface.is_none_or(|s| s == h.surface));
                paths.lit(id, hit, segment.direction)
            }
            None => {
                let (x, mut numbers) = (segment.start.position, numbers.clone());
                paths.still_radiance(x, segment.direction, hit, depth, &mut numbers)
                    - paths.lit_by_all(hit, segment.direction)
            }
        })
    }

    fn sides(&self, segment: &Segment<'_>) -> Option<Sides> {
        let across = ASIDE * segment.normal.normalize_or_zero();
        let directions = [-1.0, 1.0].map(|s| (segment.direction + s * across).normalize());
        let start = (segment.start.position, Some(segment.start.surface));
        look_past(self.sensor.paths.scene, self.list, segment.edge, start, directions, segment.distance)
    }
}

/// An edge as the last shading point of a path sees it.
pub(super) struct Shadow<'s> {
    /// The path to that point.
    pub(super) subpath: CameraSubpath<'s>,
    /// The light before the edge and behind it, over the density.
    pub(super) lights: [DVec3; 2],
    /// What is seen there.
    pub(super) hits: [Option<Hit>; 2],
    /// The direction from that point to the edge, and how far it is.
    pub(super) direction: DVec3,
    pub(super) distance: f64,
    /// ω × e.
    pub(super) normal: DVec3,
    edge: &'s Edge,
    along: f64,
}

impl Shadow<'_> {
    /// The difference of light.
    pub(super) fn light(&self) -> DVec3 {
        self.lights[0] - self.lights[1]
    }

    /// The edge's point in numbers.
    pub(super) fn point<C: Differential>(&self, scene: &Scene, calculus: &C) -> Vec3<C::Number> {
        self.edge.span.point(scene, self.along, |i| calculus.position(i))
    }
}

impl Secondary<'_> {
    /// Whether there is nothing to sample.
    pub(super) fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Whether a light is one of those whose jumps are sampled at an edge.
    fn is_about(&self, edge: &Edge, aim: Option<Aim>) -> bool {
        match (self.light, aim.map(|aim| aim.id)) {
            (Light::Shadows, Some(LightId::Shape(shape))) => !edge.shapes.contains(&shape),
            _ => true,
        }
    }

    /// Hands over every path from the camera that sees light jump at one point of an edge.
    pub(super) fn each(&self, address: Address, mut found: impl FnMut(&Shadow<'_>)) {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let mut numbers = address.numbers(if self.light.is_emission() { LIT_EDGE } else { REST_EDGE });
        let chosen = self.table.at(address.fraction(&mut numbers));
        let edge = &self.list.edges[chosen.index];
        let [a, b] = edge.span(scene);
        let point = a.lerp(b, chosen.rest);
        let length = a.distance(b);
        let Some(drawn) = self.draw(edge, point, &mut numbers) else { return };
        if !self.is_about(edge, drawn.aim) {
            return;
        }
        let normal = drawn.direction.cross((b - a) / length);
        if self.light.is_emission() || self.longest == 1 {
            let occupied = self.list.occupied(scene, edge, normal);
            if occupied[0] == occupied[1] {
                return;
            }
        }
        if let Some(aim) = drawn.aim
            && scene.blocked(point, drawn.direction, self.near(), aim.distance)
        {
            return;
        }
        let Some(hit) = scene.beyond(point, -drawn.direction, self.near()) else { return };
        let shape = scene.shape_of(hit.surface) as usize;
        // Along a warp of the film shading points slide that stand still.
        if self.longest == 1
            && !self.light.is_along_warps()
            && !(self.moving.camera || self.moving.shapes[shape] || self.moving.has_any(edge.shapes))
        {
            return;
        }
        let start = Vertex { position: point - drawn.direction * hit.distance, surface: hit.surface };
        let segment = Segment {
            edge,
            along: chosen.rest,
            start,
            direction: drawn.direction,
            distance: hit.distance,
            normal,
        };
        let scale = length / (chosen.probability * drawn.density);
        // Camera subpaths and what is seen beyond the edge must not share random numbers.
        let mut backwards = address.numbers(BACKWARDS);
        let mut sides: Option<Option<Sides>> = None;
        self.sensor.each_subpath(
            start,
            drawn.direction,
            self.longest,
            &mut backwards,
            |subpath: CameraSubpath<'_>| {
                let Some(sides) = sides.get_or_insert_with(|| self.sides(&segment)) else { return };
                let depth = subpath.vertices.len() + 1;
                let lights = self.lights(&segment, sides, drawn.aim, depth, &numbers);
                if lights[0] == lights[1] && (self.light != Light::Bounces || lights[0] == DVec3::ZERO) {
                    return;
                }
                let Segment { direction, distance, normal, along, .. } = segment;
                let factor = subpath.weight * scale * sides.share;
                let lights = lights.map(|light| light * factor);
                let hits = sides.hits;
                found(&Shadow { subpath, lights, hits, direction, distance, normal, edge, along });
            },
        );
    }
}

impl Boundary for Secondary<'_> {
    fn is_empty(&self) -> bool {
        Secondary::is_empty(self)
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let scene = self.sensor.paths.scene;
        self.each(address, |shadow| {
            let seen_from = self.sensor.position(calculus, frame, &shadow.subpath);
            let relative = shadow.point(scene, calculus) - seen_from;
            let speed = Vec3::constant(shadow.normal).dot(relative);
            found(
                calculus,
                BoundarySample { at: shadow.subpath.at, light: shadow.light(), level: 0.0, speed },
            );
        });
    }
}
