//! An edge as the last vertex of a camera path sees it.

use flatland::calculus::Vec3;
use glam::DVec3;

use super::drawing::CameraSubpath;
use super::eye::{end_of, kernel_of_light};
use super::field::WarpField;
use crate::gradient::modes::differential::Differential;
use crate::path::{Frame, Kernel, LightId, Paths};
use crate::scene::Span;

/// A point of an edge as the last vertex x of a camera path sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenEdge {
    pub(super) span: Span,
    /// Position along the edge.
    pub(super) along: f64,
    /// ω, and the distance t from x.
    pub(super) direction: DVec3,
    pub(super) distance: f64,
    /// ω × e, with e the edge's unit direction.
    pub(super) normal: DVec3,
}

impl SeenEdge {
    /// A number whose derivative is (ω × e)·(ẋ_B − ẋ − t V), with ẋ_B the velocity of the edge point, and ẋ
    /// that of x at fixed directions of the path before it, or at directions that V moves. V = 0 without a
    /// kernel.
    pub(super) fn speed<V: WarpField, C: Differential>(
        &self,
        paths: &Paths<'_>,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
        kernel: Option<Kernel>,
    ) -> C::Number {
        let (x, _) = end_of::<V, C>(paths, calculus, frame, path, None);
        let point = self.span.point(paths.scene, self.along, |i| calculus.position(i));
        let normal = Vec3::constant(self.normal);
        let moved = normal.dot(point - x);
        match (kernel, path.vertices) {
            (Some(kernel), [last, ..]) => {
                let along = calculus.warp(x, last.surface, self.direction, kernel).direction;
                moved - normal.dot(along) * self.distance
            }
            _ => moved,
        }
    }
}

/// A point of an edge at which light of one emitter ends.
#[derive(Clone, Copy, Debug)]
pub(super) struct LitEdge {
    pub(super) edge: SeenEdge,
    pub(super) emitter: LightId,
    /// Difference of its light divided by the density.
    pub(super) light: DVec3,
}

impl LitEdge {
    /// The speed relative to V towards the light, in which it is continuous at edges of meshes.
    pub(super) fn speed<V: WarpField, C: Differential>(
        &self,
        paths: &Paths<'_>,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        path: &CameraSubpath<'_>,
    ) -> C::Number {
        let kernel = if calculus.warps_light() { kernel_of_light(paths, path, self.emitter) } else { None };
        self.edge.speed::<V, C>(paths, calculus, frame, path, kernel)
    }
}
