//! Discontinuities seen from shading points, in the path-space form (Zhang, Miller, Yan, Gkioulekas and Zhao
//! 2020; Theory 9).
//!
//! At a shading point x the boundary term is ∮ f cos θ ΔL (v·ν) dl over the curves on the sphere of
//! directions on which edges are seen. With e the edge's unit direction, x_B its point at arc length s, ω the
//! direction from x to it and t the distance,
//!
//! > dA dl (v·ν) = (ω × e)·(ẋ_B − ẋ)/|n·ω| dω ds,
//!
//! with ẋ the velocity of x at fixed directions of the path before it, dA a patch of the surface at x, and dω
//! its solid angle at x_B. Sample a point of an edge and a direction through it, and trace to x.

mod beside;
mod choice;
mod stretches;
#[cfg(test)]
mod tests;

use flatland::calculus::Vec3;
use glam::DVec3;

pub(in crate::gradient) use self::beside::contacts_are_followed;
use self::beside::{Bodies, Contact};
use self::choice::{Aim, Passing};
use self::stretches::{Shown, Stretch, stretches};
use super::driver::{Address, Boundary, BoundarySample};
use super::list::{Edge, EdgeList};
use super::sensor::{CameraSubpath, Sensor, Vertex};
use super::sides::{Sides, aside, look_past, near};
use super::table::Table;
use super::wedge::Targets;
use super::{BACKWARDS, LIT_EDGE, Moving, REST_EDGE};
use crate::gradient::differential::Differential;
use crate::path::{Frame, LightId, Paths, Sequence};
use crate::scene::{Environment, Hit, Scene};

/// Light that passes an edge.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Light {
    /// Emission, as sampled by next-event estimation: directions are those of lights.
    Emitted,
    /// Emission, at edges of all shapes except the emitter itself.
    Shadows,
    /// A constant environment and reflected light: directions are uniform over those in which radiance may be
    /// discontinuous.
    Rest,
    /// The residual of a softened field for that light: silhouettes and crossings.
    Bounces,
}

impl Light {
    /// Whether the light is emission, as sampled by next-event estimation.
    fn is_emission(self) -> bool {
        matches!(self, Self::Emitted | Self::Shadows)
    }

    /// Whether shading points slide with warps, static ones included.
    fn is_along_warps(self) -> bool {
        matches!(self, Self::Shadows | Self::Bounces)
    }
}

/// Edges as seen from shading points.
#[derive(Debug)]
pub(super) struct Secondary<'a> {
    sensor: Sensor<'a>,
    list: &'a EdgeList,
    moving: &'a Moving,
    light: Light,
    targets: Option<Targets>,
    /// Stretches to choose from.
    stretches: Vec<Stretch>,
    contacts: Vec<Contact>,
    table: Table,
    /// Largest number of path segments before the discontinuity.
    longest: usize,
}

/// A point of an edge with a direction to the light, and the point where the light arrives.
struct Segment<'e> {
    edge: &'e Edge,
    along: f64,
    start: Vertex,
    direction: DVec3,
    distance: f64,
    /// ω × e.
    normal: DVec3,
}

impl Segment<'_> {
    /// Directions on either side of the edge, along which surfaces there are evaluated: a point of a surface
    /// that ends at a lamp is lit by it, and the end itself is not.
    fn aside(&self, scene: &Scene) -> [DVec3; 2] {
        let angle = aside(self.edge.span(scene), self.start.position, self.distance);
        let across = angle * self.normal.normalize_or_zero();
        [-1.0, 1.0].map(|s| (self.direction + s * across).normalize())
    }
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
            stretches: vec![],
            contacts: vec![],
            table: Table::default(),
            longest: limit.saturating_sub(1),
        };
        let constant = matches!(paths.scene.description.environment, Some(Environment::Constant { .. }));
        let nothing = match light {
            Light::Emitted | Light::Shadows => limit < 2,
            Light::Rest | Light::Bounces => limit < 2 || (limit == 2 && !constant),
        };
        if !nothing {
            let shown = if light.is_emission() { Shown::new(&secondary.sensor) } else { None };
            secondary.cut(shown.as_ref());
        }
        secondary
    }

    /// Cuts all edges into stretches and computes their weights.
    fn cut(&mut self, shown: Option<&Shown>) {
        let bodies = match self.light.is_emission() {
            true => Bodies::new(self.sensor.paths, self.targets.as_ref()),
            false => Bodies::default(),
        };
        (self.stretches, self.contacts) = stretches(self.list, &self.sensor, shown, &bodies);
        self.table = self.weights();
    }

    /// Radiance on both sides of the edge along a path's last segment; zero on a side that a softened field
    /// follows.
    fn lights(
        &self,
        segment: &Segment<'_>,
        sides: &Sides,
        passing: Passing<'_>,
        depth: usize,
        numbers: &Sequence,
    ) -> [DVec3; 2] {
        let paths = self.sensor.paths;
        let shape = |hit: &Hit| paths.scene.shape_of(hit.surface);
        let emits = |hit: Hit| paths.scene.description.shapes[shape(&hit) as usize].radiance.is_some();
        let aside = segment.aside(paths.scene);
        [0, 1].map(|side| match (passing, sides.hits[side], aside[side]) {
            (_, hit, _) if self.light == Light::Bounces && self.list.owns(segment.edge, hit) => DVec3::ZERO,
            (Passing::Of(aim), hit, direction) => {
                let hit = hit.filter(|h| aim.surface.is_none_or(|s| s == h.surface));
                paths.lit(aim.id, hit, direction)
            }
            // If an emitter's own edge coincides with this one, the whole discontinuity is assigned to it.
            (Passing::From(_), ..) if sides.other.and_then(|side| sides.hits[side]).is_some_and(emits) => {
                DVec3::ZERO
            }
            (Passing::From(contact), hit, direction) => {
                let hit = hit.filter(|h| contact.shapes.contains(&shape(h)));
                hit.map_or(DVec3::ZERO, |hit| paths.lit_by_all(Some(hit), direction))
            }
            (Passing::Anything, hit, direction) => {
                let (x, mut numbers) = (segment.start.position, numbers.clone());
                paths.still_radiance(x, direction, hit, depth, &mut numbers)
                    - paths.lit_by_all(hit, direction)
            }
        })
    }

    fn sides(&self, segment: &Segment<'_>) -> Option<Sides> {
        let start = (segment.start.position, Some(segment.start.surface));
        let scene = self.sensor.paths.scene;
        look_past(scene, self.list, segment.edge, start, segment.aside(scene), segment.distance)
    }
}

/// An edge as seen from the last shading point of a path.
pub(super) struct Shadow<'s> {
    /// Path to that point.
    pub(super) subpath: CameraSubpath<'s>,
    /// Radiance before and behind the edge, divided by the density.
    pub(super) lights: [DVec3; 2],
    /// Surfaces seen there.
    pub(super) hits: [Option<Hit>; 2],
    /// Direction from that point to the edge, and distance.
    pub(super) direction: DVec3,
    pub(super) distance: f64,
    /// ω × e.
    pub(super) normal: DVec3,
    /// The light that the direction was sampled for.
    pub(super) of: Option<LightId>,
    edge: &'s Edge,
    along: f64,
}

impl Shadow<'_> {
    /// Difference of radiance.
    pub(super) fn light(&self) -> DVec3 {
        self.lights[0] - self.lights[1]
    }

    /// Position of the edge point.
    pub(super) fn place(&self, scene: &Scene) -> DVec3 {
        let [a, b] = self.edge.span(scene);
        a.lerp(b, self.along)
    }

    /// The edge point over numbers.
    pub(super) fn point<C: Differential>(&self, scene: &Scene, calculus: &C) -> Vec3<C::Number> {
        self.edge.span.point(scene, self.along, |i| calculus.position(i))
    }
}

impl Secondary<'_> {
    /// Whether there is nothing to sample.
    pub(super) fn is_empty(&self) -> bool {
        self.table.total() <= 0.0
    }

    /// Whether the discontinuities of a light are sampled at an edge.
    fn is_about(&self, edge: &Edge, passing: Passing<'_>) -> bool {
        match (self.light, passing) {
            (Light::Shadows, Passing::Of(Aim { id: LightId::Shape(shape), .. })) => {
                !edge.shapes.contains(&shape)
            }
            _ => true,
        }
    }

    /// Calls back with every camera path that sees light end at one point of an edge.
    pub(super) fn each(&self, address: Address, mut found: impl FnMut(&Shadow<'_>)) {
        let paths = self.sensor.paths;
        let scene = paths.scene;
        let mut numbers = address.numbers(if self.light.is_emission() { LIT_EDGE } else { REST_EDGE });
        let chosen = self.table.at(address.fraction(&mut numbers));
        let stretch = &self.stretches[chosen.index];
        let edge = &self.list.edges[stretch.edge as usize];
        let [a, b] = edge.span(scene);
        let along = stretch.place(chosen.rest);
        let point = a.lerp(b, along);
        let (length, near) = (a.distance(b), near(scene, self.list, edge));
        let Some(drawn) = self.draw(stretch, point, &mut numbers) else { return };
        if !self.is_about(edge, drawn.passing) {
            return;
        }
        let normal = drawn.direction.cross((b - a) / length);
        if self.light.is_emission() || self.longest == 1 {
            let occupied = self.list.occupied(scene, edge, normal);
            if occupied[0] == occupied[1] {
                return;
            }
        }
        if let Passing::Of(aim) = drawn.passing
            && scene.blocked(point, drawn.direction, near, aim.distance)
        {
            return;
        }
        let Some(hit) = scene.beyond(point, -drawn.direction, near) else { return };
        let shape = scene.shape_of(hit.surface) as usize;
        // With a warped film, static shading points slide as well.
        if self.longest == 1
            && !self.light.is_along_warps()
            && !(self.moving.camera || self.moving.shapes[shape] || self.moving.has_any(edge.shapes))
        {
            return;
        }
        let start = Vertex { position: point - drawn.direction * hit.distance, surface: hit.surface };
        let segment =
            Segment { edge, along, start, direction: drawn.direction, distance: hit.distance, normal };
        let scale = stretch.part() * length / (chosen.probability * drawn.density);
        // Camera subpaths and the paths beyond the edge must not share random numbers.
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
                let lights = self.lights(&segment, sides, drawn.passing, depth, &numbers);
                if lights[0] == lights[1] && (self.light != Light::Bounces || lights[0] == DVec3::ZERO) {
                    return;
                }
                let Segment { direction, distance, normal, along, .. } = segment;
                let factor = subpath.weight * scale * sides.share;
                let lights = lights.map(|light| light * factor);
                let hits = sides.hits;
                let mut hand_over = |lights, of| {
                    let subpath = subpath.clone();
                    found(&Shadow { subpath, lights, hits, direction, distance, normal, of, edge, along });
                };
                match drawn.passing {
                    Passing::Of(aim) => hand_over(lights, Some(aim.id)),
                    Passing::Anything => hand_over(lights, None),
                    // One light at a time: each has its own field.
                    Passing::From(contact) => {
                        for &shape in &contact.shapes {
                            let is_its =
                                |side: usize| hits[side].is_some_and(|h| scene.shape_of(h.surface) == shape);
                            let lights =
                                [0, 1].map(|side| if is_its(side) { lights[side] } else { DVec3::ZERO });
                            if lights[0] != lights[1] {
                                hand_over(lights, Some(LightId::Shape(shape)));
                            }
                        }
                    }
                }
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
