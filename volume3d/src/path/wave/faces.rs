//! Compact triangle data for waves.

use flatland::calculus::Vec3;
use glam::DVec3;

use crate::path::plain::Plain;
use crate::path::surface::SurfacePoint;
use crate::scene::{Bsdf, Hit, Reflectance, Scene};

/// A triangle, with the data needed at every hit.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub(super) corner: [f64; 3],
    /// (p₁ − p₀) × (p₂ − p₀), and the same as a unit vector.
    pub(super) cross: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) shape: u32,
    /// Whether it has vertex normals.
    pub(super) is_smooth: bool,
}

/// Reflection of a shape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Finish {
    /// None.
    Black,
    /// Constant diffuse reflectance, on one or both sides.
    Matt { reflectance: [f64; 3], two_sided: bool },
    /// Any other.
    Other,
}

/// All triangles of a scene, and the reflection of shapes.
#[derive(Clone, Debug)]
pub(super) struct Faces {
    pub(super) faces: Vec<Face>,
    pub(super) finishes: Vec<Finish>,
}

impl Faces {
    pub(super) fn new(scene: &Scene) -> Self {
        let face = |triangle: u32| {
            let [a, b, c] = scene.corners(triangle).map(Vec3::<f64>::constant);
            let cross = (b - a).cross(c - a);
            let normal = cross.normalized();
            let [corner, cross, normal] = [a, cross, normal].map(|v| v.value().to_array());
            let own = &scene.triangles[triangle as usize];
            Face { corner, cross, normal, shape: own.shape, is_smooth: !own.is_flat() }
        };
        let shapes = scene.description.shapes.iter();
        Self {
            faces: (0..scene.triangles.len() as u32).map(face).collect(),
            finishes: shapes.map(|shape| Finish::of(scene, shape.material)).collect(),
        }
    }
}

impl Finish {
    fn of(scene: &Scene, material: usize) -> Self {
        let material = &scene.description.materials[material];
        let is_plain = material.opacity.is_none()
            && material.relief.is_none()
            && material.roughness_textures == [None; 2]
            && material.blend.is_none()
            && material.back.is_none();
        match &material.bsdf {
            Bsdf::Diffuse { reflectance: Reflectance::Constant(c) } if is_plain && *c == DVec3::ZERO => {
                Self::Black
            }
            Bsdf::Diffuse { reflectance: Reflectance::Constant(c) } if is_plain => {
                Self::Matt { reflectance: c.to_array(), two_sided: material.two_sided }
            }
            _ => Self::Other,
        }
    }
}

/// The interpolated normal where a ray meets a triangle with vertex normals.
#[inline(never)]
pub(super) fn smooth_normal(scene: &Scene, origin: DVec3, direction: DVec3, hit: &Hit) -> DVec3 {
    let plain = Plain { scene };
    let (origin, direction) = (Vec3::constant(origin), Vec3::constant(direction));
    let point = SurfacePoint::new(scene, &plain, origin, direction, hit.surface, hit.distance);
    point.interpolated_normal(scene, &plain).value()
}
