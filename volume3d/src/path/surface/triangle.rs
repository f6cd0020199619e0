//! Intersection of a ray with a triangle, over numbers.

use flatland::calculus::{Number, Vec3};
use glam::DVec2;

use crate::path::calculus::Calculus;
use crate::scene::{NONE, Scene, Triangle};

/// Texture coordinates of a triangle, interpolated barycentrically.
pub(super) fn uv<T: Number>(scene: &Scene, triangle: u32, weights: [T; 3]) -> [T; 2] {
    let corners: [DVec2; 3] = scene.triangles[triangle as usize].uvs.map(|i| scene.uvs[i as usize]);
    let mix = |f: fn(DVec2) -> f64| {
        weights[0] * f(corners[0]) + weights[1] * f(corners[1]) + weights[2] * f(corners[2])
    };
    [mix(|p| p.x), mix(|p| p.y)]
}

/// A triangle over numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct MovingTriangle<T> {
    pub(super) index: u32,
    corners: [Vec3<T>; 3],
    /// (p₁ − p₀) × (p₂ − p₀).
    cross: Vec3<T>,
}

impl<T: Number> MovingTriangle<T> {
    #[inline]
    pub(super) fn new<C: Calculus<Number = T>>(scene: &Scene, calculus: &C, index: u32) -> Self {
        let [a, b, c] = scene.triangles[index as usize].positions;
        let corners = [calculus.position(a), calculus.position(b), calculus.position(c)];
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        Self { index, corners, cross }
    }

    /// Distance along the ray o + tω to the plane: t = n·(p₀ − o)/(n·ω).
    #[inline]
    pub(super) fn distance(&self, origin: Vec3<T>, direction: Vec3<T>) -> T {
        self.cross.dot(self.corners[0] - origin) / self.cross.dot(direction)
    }

    /// Barycentric coordinates of a point of the plane.
    #[inline]
    pub(super) fn coordinates(&self, point: Vec3<T>) -> [T; 3] {
        let [a, b, c] = self.corners;
        let x = point - a;
        let area = self.cross.dot(self.cross);
        let second = x.cross(c - a).dot(self.cross) / area;
        let third = (b - a).cross(x).dot(self.cross) / area;
        [T::constant(1.0) - second - third, second, third]
    }

    /// Unit shading normal at barycentric coordinates: interpolated, or the geometric one.
    #[inline]
    pub(super) fn shading_normal<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
        weights: impl FnOnce() -> [T; 3],
    ) -> Vec3<T> {
        let normals = self.indices(scene).normals;
        if normals[0] != NONE {
            let [a, b, c] = normals.map(|i| calculus.normal(i));
            let weights = weights();
            let sum = a * weights[0] + b * weights[1] + c * weights[2];
            if sum.dot(sum).value() > 0.0 {
                return sum.normalized();
            }
        }
        self.cross.normalized()
    }

    /// ∂u p and ∂v p; `None` without texture coordinates, or if these are degenerate.
    pub(super) fn sides(&self, scene: &Scene) -> Option<[Vec3<T>; 2]> {
        if self.indices(scene).uvs[0] == NONE {
            return None;
        }
        let [a, b, c]: [DVec2; 3] = self.indices(scene).uvs.map(|i| scene.uvs[i as usize]);
        let (first, second) = (b - a, c - a);
        let span = first.perp_dot(second);
        let [p, q] = [self.corners[1] - self.corners[0], self.corners[2] - self.corners[0]];
        let mix = |x: f64, y: f64| p * T::constant(x / span) + q * T::constant(y / span);
        (span != 0.0).then(|| [mix(second.y, -first.y), mix(-second.x, first.x)])
    }

    /// Whether its normals are not interpolated.
    pub(super) fn is_flat(&self, scene: &Scene) -> bool {
        self.indices(scene).normals[0] == NONE
    }

    /// Unit geometric normal.
    pub(super) fn face_normal(&self) -> Vec3<T> {
        self.cross.normalized()
    }

    fn indices<'s>(&self, scene: &'s Scene) -> &'s Triangle {
        &scene.triangles[self.index as usize]
    }
}
