//! What is asked of a surface that was hit, whatever its kind.

use glam::DVec3;

use super::build::Scene;
use super::hit::{Hit, MaterialPoint, Surface};

impl Scene {
    /// The shape that a surface is a part of.
    #[inline]
    pub(crate) fn shape_of(&self, surface: Surface) -> u32 {
        match surface {
            Surface::Triangle(triangle) => self.triangles[triangle as usize].shape,
        }
    }

    /// The index of its material.
    #[inline]
    pub(crate) fn material_of(&self, surface: Surface) -> usize {
        self.description.shapes[self.shape_of(surface) as usize].material
    }

    /// The unit normal of its front; 0 where there is none. It is the same all over a triangle.
    #[inline]
    pub(crate) fn normal_of(&self, surface: Surface) -> DVec3 {
        self.area_vector(surface).normalize_or_zero()
    }

    /// Whether it is shaded by other normals than its own.
    pub(crate) fn has_shading_normals(&self, surface: Surface) -> bool {
        match surface {
            Surface::Triangle(triangle) => !self.triangles[triangle as usize].is_flat(),
        }
    }

    /// The shape and its radiance, if a ray along a direction hits the front of one that emits.
    #[inline]
    pub(crate) fn emission(&self, hit: &Hit, direction: DVec3) -> Option<(u32, DVec3)> {
        let shape = self.shape_of(hit.surface);
        let radiance = self.description.shapes[shape as usize].radiance?;
        (self.area_vector(hit.surface).dot(direction) < 0.0).then_some((shape, radiance))
    }

    /// The point of matter that was hit.
    #[inline]
    pub(crate) fn material_point(&self, hit: &Hit) -> MaterialPoint {
        match hit.surface {
            Surface::Triangle(triangle) => {
                let corners = self.triangles[triangle as usize].positions;
                MaterialPoint::Mesh(std::array::from_fn(|k| (corners[k], hit.coordinates[k])))
            }
        }
    }

    /// Along the normal, of any length: (p₁ − p₀) × (p₂ − p₀).
    #[inline]
    fn area_vector(&self, surface: Surface) -> DVec3 {
        match surface {
            Surface::Triangle(triangle) => {
                let [a, b, c] = self.corners(triangle);
                (b - a).cross(c - a)
            }
        }
    }
}
