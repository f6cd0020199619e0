//! Emission of shapes: a radiance, optionally times a texture.

use flatland::calculus::{Rgb, Vec3};
use glam::DVec3;

use super::calculus::Calculus;
use super::plain::Plain;
use super::surface::{texture_at, texture_towards};
use crate::scene::Scene;

/// Radiance that an emitting triangle sends against a ray, over numbers: the hit point, and with it the
/// texture value, follow the motion of ray and triangle.
#[inline]
pub(super) fn emitted<C: Calculus>(
    scene: &Scene,
    calculus: &C,
    (origin, direction): (Vec3<C::Number>, Vec3<C::Number>),
    triangle: u32,
) -> Rgb<C::Number> {
    let index = scene.triangles[triangle as usize].shape as usize;
    let shape = &scene.description.shapes[index];
    let radiance = calculus.radiance(index, shape.radiance.unwrap_or(DVec3::ZERO));
    match shape.radiance_texture {
        Some(texture) => radiance * texture_towards(scene, calculus, (origin, direction), triangle, texture),
        None => radiance,
    }
}

/// Radiance of the front of an emitting triangle at given barycentric coordinates.
pub(crate) fn radiance_at(scene: &Scene, triangle: u32, weights: [f64; 3]) -> DVec3 {
    let shape = &scene.description.shapes[scene.triangles[triangle as usize].shape as usize];
    let radiance = shape.radiance.unwrap_or(DVec3::ZERO);
    match shape.radiance_texture {
        Some(texture) => radiance * texture_at(scene, &Plain { scene }, triangle, weights, texture).value(),
        None => radiance,
    }
}
