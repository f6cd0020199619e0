//! Residual boundary terms of a softened field, by sampling curves (Theory 6 and 7).
//!
//! On the film V follows the border of the visible surface, and silhouettes in front of it in part. With V⁻
//! and V⁺ its limits on the two sides of a silhouette that moves with v, and L₀ the control variate, the
//! residual is
//!
//! > ∮ h [(L⁻ − L₀) (v − V⁻) − (L⁺ − L₀) (v − V⁺)]·ν dl.
//!
//! On the side of the surface that ends there, V⁻ = v: only one side counts, except at crossings, which are
//! no surface's border. Every difference is at most twice the largest nearby velocity, whatever the gap to
//! the next silhouette.
//!
//! Towards lights V = 0 for meshes, and the whole motion of shadows is residual: that of an edge in front of
//! a light as seen from the shading point, which slides along its surface with the warps of the film and of
//! earlier directions. So are the outlines of emitters; those of flat emitters are added during next-event
//! estimation. For implicit surfaces V is their contribution to the field, independent of mesh edges: there
//! it is continuous, as rays end at the light's plane whatever is in front of it, and the residual is v − V.
//!
//! At bounces V is softened as on the film, within lobes, and the residual of silhouettes seen from shading
//! points is sampled likewise: the light of one side times the speed relative to the field of that side.
//!
//! Points of curves are sampled by length, contrast and visibility, independently of velocities except for
//! which shapes move: forward and reverse mode are a linear map and its transpose if the active shapes are
//! those that move.

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

/// Discontinuities seen at bounces.
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

/// A point of an edge in front of a light, as seen from the last vertex of a path.
struct Lit<T> {
    point: Vec3<T>,
    /// Position of the point.
    place: DVec3,
    /// ω × e.
    normal: DVec3,
    light: LightId,
}

/// A number whose derivative is (ω × e)·(ẋ_B − ẋ − t V): the speed of an edge point as seen from the last
/// path vertex, which the warp moves, relative to the field towards the light.
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

/// The last vertex of a path, as moved by warps.
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
