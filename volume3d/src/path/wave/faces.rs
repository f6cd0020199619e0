//! What a path needs to know of every triangle, at hand.

use flatland::calculus::Vec3;
use glam::DVec3;

use crate::path::plain::Plain;
use crate::path::surface::SurfacePoint;
use crate::scene::{Bsdf, Hit, Reflectance, Scene};

/// A triangle, as all that meet it ask for it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Face {
    pub(super) corner: [f64; 3],
    /// (p₁ − p₀) × (p₂ − p₀), and the same of unit length.
    pub(super) cross: [f64; 3],
    pub(super) normal: [f64; 3],
    pub(super) shape: u32,
    /// Whether normals of its corners shade it.
    pub(super) is_smooth: bool,
}

/// How a shape reflects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Finish {
    /// Nothing.
    Black,
    /// Diffusely, the same everywhere, and perhaps on one side only.
    Matt { reflectance: [f64; 3], two_sided: bool },
    /// In any other way.
    Other,
}

/// All triangles of a scene, and how shapes reflect.
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

/// The normal that shades a triangle with normals of its corners, where a ray meets it.
#[inline(never)]
pub(super) fn smooth_normal(scene: &Scene, origin: DVec3, direction: DVec3, hit: &Hit) -> DVec3 {
    let plain = Plain { scene };
    let (origin, direction) = (Vec3::constant(origin), Vec3::constant(direction));
    let point = SurfacePoint::new(scene, &plain, origin, direction, hit.surface, hit.distance);
    point.interpolated_normal(scene, &plain).value()
}
