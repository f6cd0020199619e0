//! What a ray hits, in numbers that carry derivatives.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::{DVec2, DVec3};

use super::bsdf::Shading;
use super::calculus::Calculus;
use crate::scene::{NONE, Reflectance, Scene, Texture, Triangle, Wrap};

/// A point of a surface that a ray from the viewer hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SurfacePoint<T> {
    pub(crate) triangle: u32,
    pub(crate) position: Vec3<T>,
    /// Towards the viewer, unit length.
    pub(crate) viewer: Vec3<T>,
    corners: [Vec3<T>; 3],
    /// (p₁ − p₀) × (p₂ − p₀).
    cross: Vec3<T>,
}

impl<T: Number> SurfacePoint<T> {
    /// Where the ray o + tω meets the plane of a triangle: t = n·(p₀ − o)/(n·ω). All of it moves: the origin,
    /// the direction and the triangle.
    pub(crate) fn new<C: Calculus<Number = T>>(
        scene: &Scene,
        calculus: &C,
        origin: Vec3<T>,
        direction: Vec3<T>,
        triangle: u32,
    ) -> Self {
        let corners = scene.triangles[triangle as usize].positions.map(|i| calculus.position(i));
        let cross = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let distance = cross.dot(corners[0] - origin) / cross.dot(direction);
        Self { triangle, position: origin + direction * distance, viewer: -direction, corners, cross }
    }

    /// What reflection depends on; `None` where the surface reflects nothing, whatever its parameters.
    pub(crate) fn shading<'s, C: Calculus<Number = T>>(
        &self,
        scene: &'s Scene,
        calculus: &C,
    ) -> Option<Shading<'s, T>> {
        let triangle = &scene.triangles[self.triangle as usize];
        let index = scene.description.shapes[triangle.shape as usize].material;
        let material = &scene.description.materials[index];
        let weights = self.barycentric();
        let normal = self.shading_normal(triangle, weights, calculus);
        let cosine = normal.dot(self.viewer).value();
        if cosine == 0.0 || (cosine < 0.0 && !material.two_sided) {
            return None;
        }
        let normal = if cosine < 0.0 { -normal } else { normal };
        let reflectance = match material.bsdf.reflectance() {
            Reflectance::Constant(c) => {
                if *c == DVec3::ZERO && !calculus.wants_black(index) {
                    return None;
                }
                calculus.reflectance(index, *c)
            }
            Reflectance::Texture(texture) => {
                let [s, t] = self.uv(scene, triangle, weights);
                let image = &scene.description.textures[*texture];
                lookup(image, *texture, [image.wrap; 2], s, t, calculus)
            }
        };
        let roughness = match material.bsdf {
            crate::scene::Bsdf::RoughConductor { alpha, .. } => calculus.roughness(index, alpha),
            _ => T::constant(0.0),
        };
        Some(Shading { bsdf: &material.bsdf, normal, viewer: self.viewer, reflectance, roughness })
    }

    /// The shading normal as it is interpolated, on whichever side.
    pub(crate) fn interpolated_normal<C: Calculus<Number = T>>(
        &self,
        scene: &Scene,
        calculus: &C,
    ) -> Vec3<T> {
        self.shading_normal(&scene.triangles[self.triangle as usize], self.barycentric(), calculus)
    }

    fn barycentric(&self) -> [T; 3] {
        let [a, b, c] = self.corners;
        let x = self.position - a;
        let area = self.cross.dot(self.cross);
        let second = x.cross(c - a).dot(self.cross) / area;
        let third = (b - a).cross(x).dot(self.cross) / area;
        [T::constant(1.0) - second - third, second, third]
    }

    fn shading_normal<C: Calculus<Number = T>>(
        &self,
        triangle: &Triangle,
        weights: [T; 3],
        calculus: &C,
    ) -> Vec3<T> {
        if triangle.normals[0] != NONE {
            let [a, b, c] = triangle.normals.map(|i| calculus.normal(i));
            let sum = a * weights[0] + b * weights[1] + c * weights[2];
            if sum.dot(sum).value() > 0.0 {
                return sum.normalized();
            }
        }
        self.cross.normalized()
    }

    fn uv(&self, scene: &Scene, triangle: &Triangle, weights: [T; 3]) -> [T; 2] {
        let corners: [DVec2; 3] = triangle.uvs.map(|i| scene.uvs[i as usize]);
        let mix = |f: fn(DVec2) -> f64| {
            weights[0] * f(corners[0]) + weights[1] * f(corners[1]) + weights[2] * f(corners[2])
        };
        [mix(|p| p.x), mix(|p| p.y)]
    }
}

/// The bilinear lookup of a texture at (s, t), t upwards, wrapped as told along each axis.
pub(crate) fn lookup<C: Calculus>(
    texture: &Texture,
    index: usize,
    wraps: [Wrap; 2],
    s: C::Number,
    t: C::Number,
    calculus: &C,
) -> Rgb<C::Number> {
    let half = C::Number::constant(0.5);
    let m = texture.to_uv;
    let offset = |x: f64| C::Number::constant(x);
    let u = s * m.matrix2.x_axis.x + t * m.matrix2.y_axis.x + offset(m.translation.x);
    let v = s * m.matrix2.x_axis.y + t * m.matrix2.y_axis.y + offset(m.translation.y);
    let (width, height) = (texture.width, texture.height);
    let x = u * width as f64 - half;
    let y = (C::Number::constant(1.0) - v) * height as f64 - half;
    let (i, j) = (x.value().floor(), y.value().floor());
    let (fx, fy) = (x - offset(i), y - offset(j));
    let texel = |di: f64, dj: f64| {
        let column = wrap(wraps[0], i + di, width);
        let row = wrap(wraps[1], j + dj, height);
        calculus.texel(index, row * width + column)
    };
    let (gx, gy) = (offset(1.0) - fx, offset(1.0) - fy);
    texel(0.0, 0.0) * (gx * gy)
        + texel(1.0, 0.0) * (fx * gy)
        + texel(0.0, 1.0) * (gx * fy)
        + texel(1.0, 1.0) * (fx * fy)
}

fn wrap(wrap: Wrap, index: f64, size: usize) -> usize {
    let n = size as f64;
    let index = match wrap {
        Wrap::Repeat => index.rem_euclid(n),
        Wrap::Mirror => {
            let around = index.rem_euclid(2.0 * n);
            if around < n { around } else { 2.0 * n - 1.0 - around }
        }
        Wrap::Clamp => index.clamp(0.0, n - 1.0),
    };
    // rem_euclid of a tiny negative number rounds to n itself.
    (index as usize).min(size - 1)
}
