//! What a softened field leaves to the boundary, by samples of curves (Theory 6 and 7).
//!
//! On the film V follows the border of the surface that is seen, and silhouettes before it in part. Where V⁻ and V⁺ are its limits on
//! the two sides of a silhouette that moves with v, and L₀ is the level of the control variate,
//!
//! > ∮ h [(L⁻ − L₀) (v − V⁻) − (L⁺ − L₀) (v − V⁺)]·ν dl
//!
//! is left. On the side of the surface that ends V⁻ = v: one side alone counts, but at crossings, which are no one's border. Every
//! difference is at most twice the largest velocity near by, whatever the gap to the next silhouette.
//!
//! Towards lights V = 0 beside meshes, and all of the motion of shadows is left: that of an edge before a
//! light as the shading point sees it, which slides along its surface with the warp of the film and of the
//! directions before it. So are the outlines of emitters themselves; those of flat ones are added where
//! next-event estimation meets them. Beside implicit surfaces V is what they give to it, which the edges of
//! meshes know nothing of: it is continuous there, as rays end at the light's plane whatever is before it,
//! and what is left is v − V.
//!
//! At bounces V is softened as on the film, within lobes, and what it leaves of silhouettes that shading points see is sampled
//! likewise: the light of one side times the speed beyond the field of that side.
//!
//! Points of curves are drawn by length, contrast and visibility, which know nothing of velocities but what moves at all: forward and
//! reverse mode are one linear map and its transpose if what is active is what moves.

use flatland::calculus::{Number, Vec3};
use glam::DVec3;

use super::along_warp::AlongWarp;
use super::curve::Eye;
use super::driver::{Address, Boundary, BoundarySample};
use super::emitters::Emitters;
use super::primary::Primary;
use super::secondary::Secondary;
use super::sensor::CameraSubpath;
use super::warped_ray::{kernel, light_kernel, warped_ray};
use crate::gradient::auxiliary::Auxiliary;
use crate::gradient::differential::Differential;
use crate::gradient::motion::MovingBounds;
use crate::path::{Frame, Kernel, LightId, Paths, VisibilityDomain};
use crate::scene::Surface;

/// Silhouettes on the film.
#[derive(Debug)]
pub(super) struct Silhouettes<'p> {
    pub(super) warp: &'p AlongWarp<'p>,
    pub(super) edges: Primary<'p>,
}

/// Shadows.
#[derive(Debug)]
pub(super) struct Shadows<'p> {
    pub(super) warp: &'p AlongWarp<'p>,
    pub(super) edges: Secondary<'p>,
}

/// What bounces see jump.
#[derive(Debug)]
pub(super) struct Bounces<'p> {
    pub(super) warp: &'p AlongWarp<'p>,
    pub(super) edges: Secondary<'p>,
}

/// Outlines of emitters that are not flat.
#[derive(Debug)]
pub(super) struct Outlines<'p> {
    pub(super) warp: &'p AlongWarp<'p>,
    pub(super) edges: Emitters<'p>,
}

/// A point of an edge before a light, as the last point of a path sees it.
struct Lit<T> {
    point: Vec3<T>,
    /// Where it is.
    place: DVec3,
    /// ω × e.
    normal: DVec3,
    light: LightId,
}

/// A number whose derivative is (ω × e)·(ẋ_B − ẋ − t V): the speed of an edge's point as the last point of a
/// path sees it, which the warp moves, beyond that of the field towards the light.
fn speed<C: Differential>(
    paths: &Paths<'_>,
    calculus: &mut C,
    frame: &Frame<C::Number>,
    subpath: &CameraSubpath<'_>,
    Lit { point, place, normal, light }: Lit<C::Number>,
) -> Option<C::Number> {
    let seen_from = seen_from(paths, calculus, frame, subpath)?;
    let across = Vec3::constant(normal);
    let mut speed = across.dot(point - seen_from);
    if calculus.warps_light() {
        let [last, before @ ..] = subpath.vertices else { return None };
        let viewer = before.first().map_or(subpath.film.still.origin.value(), |vertex| vertex.position);
        let (direction, distance) = (place - last.position).normalize_and_length();
        let kernel = light_kernel(paths, viewer, last, light)?;
        let along = calculus.warp(seen_from, last.surface, direction, kernel).direction;
        speed = speed - across.dot(along) * distance;
    }
    (!speed.is_still()).then_some(speed)
}

/// The last point of a path, as warps move it.
fn seen_from<C: Differential>(
    paths: &Paths<'_>,
    calculus: &mut C,
    frame: &Frame<C::Number>,
    subpath: &CameraSubpath<'_>,
) -> Option<Vec3<C::Number>> {
    let first = subpath.vertices.last()?;
    let at = calculus.film_warp(subpath.film, subpath.at, Some(first.surface)).at;
    let frame = &subpath.film.frame_through(calculus, frame);
    let eye = Eye { film: subpath.film, frame, at, warps: true };
    Some(warped_ray(paths, calculus, &eye, subpath.vertices, None).0)
}

/// The kernel of a path's last direction, in which a surface is seen.
fn last_kernel(paths: &Paths<'_>, subpath: &CameraSubpath<'_>, surface: Option<Surface>) -> Option<Kernel> {
    let [last, before @ ..] = subpath.vertices else { return None };
    let viewer = before.first().map_or(subpath.film.still.origin.value(), |vertex| vertex.position);
    let limit = paths.scene.description.integrator.max_depth.unwrap_or(usize::MAX);
    let goes_on = subpath.vertices.len() + 1 < limit;
    let sees = if goes_on { VisibilityDomain::Radiance } else { VisibilityDomain::Distant };
    kernel(paths, viewer, last, sees, surface)
}

impl Boundary for Silhouettes<'_> {
    fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        Some(self.warp.auxiliary(bounds))
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let Some(point) = self.edges.draw(address) else { return };
        for (side, sign) in [(0, 1.0), (1, -1.0)] {
            let Some(scale) = self.edges.scale_on(&point, side) else { continue };
            let seen = point.sides.hits[side].map(|hit| hit.surface);
            let [x, y] = calculus.film_warp(&point.film, point.at, seen).at;
            let field = x * point.normal.x + y * point.normal.y;
            let speed = self.edges.speed(calculus, frame, &point) - field;
            if speed.is_still() {
                continue;
            }
            let level = sign * scale;
            let light = self.edges.radiance(&point, side) * level;
            found(calculus, BoundarySample { at: point.at, light, level, speed });
        }
    }
}

impl Boundary for Shadows<'_> {
    fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        Some(self.warp.auxiliary(bounds))
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let paths = self.warp.paths;
        self.edges.each(address, |shadow| {
            let Some(light) = shadow.of else { return };
            let point = shadow.point(paths.scene, calculus);
            let moving = Lit { point, place: shadow.place(paths.scene), normal: shadow.normal, light };
            if let Some(speed) = speed(paths, calculus, frame, &shadow.subpath, moving) {
                let (at, light) = (shadow.subpath.at, shadow.light());
                found(calculus, BoundarySample { at, light, level: 0.0, speed });
            }
        });
    }
}

impl Boundary for Bounces<'_> {
    fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        Some(self.warp.auxiliary(bounds))
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let paths = self.warp.paths;
        self.edges.each(address, |shadow| {
            let subpath = &shadow.subpath;
            let Some(seen_from) = seen_from(paths, calculus, frame, subpath) else { return };
            let normal = Vec3::constant(shadow.normal);
            let moved = normal.dot(shadow.point(paths.scene, calculus) - seen_from);
            for (side, sign) in [(0, 1.0), (1, -1.0)] {
                let light = shadow.lights[side] * sign;
                if light == DVec3::ZERO {
                    continue;
                }
                let surface = shadow.hits[side].map(|hit| hit.surface);
                let Some(kernel) = last_kernel(paths, subpath, surface) else { continue };
                let last = subpath.vertices[0].surface;
                let along = calculus.warp(seen_from, last, shadow.direction, kernel).direction;
                let speed = moved - normal.dot(along) * shadow.distance;
                if !speed.is_still() {
                    found(calculus, BoundarySample { at: subpath.at, light, level: 0.0, speed });
                }
            }
        });
    }
}

impl Boundary for Outlines<'_> {
    fn is_empty(&self) -> bool {
        self.edges.is_empty()
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        Some(self.warp.auxiliary(bounds))
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let paths = self.warp.paths;
        self.edges.each(address, |subpath, seen| {
            let point = self.edges.point(calculus, seen);
            let moving = Lit { point, place: point.value(), normal: seen.normal, light: seen.of };
            if let Some(speed) = speed(paths, calculus, frame, subpath, moving) {
                found(calculus, BoundarySample { at: subpath.at, light: seen.light, level: 0.0, speed });
            }
        });
    }
}
