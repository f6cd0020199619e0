//! What a softened field leaves to the boundary, by samples of curves (the residual theorem, [`flatland::boundary`]).
//!
//! On the film V follows the border of the surface that is seen, and silhouettes before it in part. Where V⁻ and V⁺ are its limits on
//! the two sides of a silhouette that moves with v, and L₀ is the level of the control variate,
//!
//! > ∮ h [(L⁻ − L₀) (v − V⁻) − (L⁺ − L₀) (v − V⁺)]·ν dl
//!
//! is left. On the side of the surface that ends V⁻ = v: one side alone counts, but at crossings, which are no one's border. Every
//! difference is at most twice the largest velocity near by, whatever the gap to the next silhouette.
//!
//! Towards lights V = 0, and all of the motion of shadows is left: that of an edge before a light as the shading point sees
//! it, which slides along its surface with the warp of the film and of the directions before it. So are the outlines of emitters
//! themselves; those of flat ones are added where next-event estimation meets them.
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
use super::warped_ray::warped_ray;
use crate::gradient::auxiliary::Auxiliary;
use crate::gradient::differential::Differential;
use crate::gradient::motion::MovingBounds;
use crate::path::{Frame, Paths};

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

/// Outlines of emitters that are not flat.
#[derive(Debug)]
pub(super) struct Outlines<'p> {
    pub(super) warp: &'p AlongWarp<'p>,
    pub(super) edges: Emitters<'p>,
}

/// A number whose derivative is (ω × e)·(ẋ_B − ẋ): the speed of an edge's point as the last point of a path sees it, which the warp
/// moves.
fn speed<C: Differential>(
    paths: &Paths<'_>,
    calculus: &mut C,
    frame: &Frame<C::Number>,
    subpath: &CameraSubpath<'_>,
    (point, normal): (Vec3<C::Number>, DVec3),
) -> Option<C::Number> {
    let first = subpath.vertices.last()?;
    let at = calculus.film_warp(subpath.film, subpath.at, Some(first.surface)).at;
    let frame = &subpath.film.frame_through(calculus, frame);
    let eye = Eye { film: subpath.film, frame, at, warps: true };
    let (seen_from, _) = warped_ray(paths, calculus, &eye, subpath.vertices, None);
    let speed = Vec3::constant(normal).dot(point - seen_from);
    (!speed.is_still()).then_some(speed)
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
            if self.edges.owns(&point, side) {
                continue;
            }
            let seen = point.sides.hits[side].map(|hit| hit.surface);
            let [x, y] = calculus.film_warp(&point.film, point.at, seen).at;
            let field = x * point.normal.x + y * point.normal.y;
            let speed = self.edges.speed(calculus, frame, &point) - field;
            if speed.is_still() {
                continue;
            }
            let level = sign * point.scale;
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
            let moving = (shadow.point(paths.scene, calculus), shadow.normal);
            if let Some(speed) = speed(paths, calculus, frame, &shadow.subpath, moving) {
                let (at, light) = (shadow.subpath.at, shadow.light);
                found(calculus, BoundarySample { at, light, level: 0.0, speed });
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
            let moving = (self.edges.point(calculus, seen), seen.normal);
            if let Some(speed) = speed(paths, calculus, frame, subpath, moving) {
                found(calculus, BoundarySample { at: subpath.at, light: seen.light, level: 0.0, speed });
            }
        });
    }
}
