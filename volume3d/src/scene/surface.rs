//! Properties of hit surfaces, independent of their kind.

use flatland::sdf::Sdf as _;
use glam::DVec3;

use super::build::Scene;
use super::hit::{Hit, MaterialPoint, Surface};
use super::value::Reflectance;

impl Scene {
    /// Shape of a surface. Implicit surfaces are numbered after all meshes.
    #[inline]
    pub(crate) fn shape_of(&self, surface: Surface) -> u32 {
        match surface {
            Surface::Triangle(triangle) => self.triangles[triangle as usize].shape,
            Surface::Implicit(index) => self.description.shapes.len() as u32 + index,
        }
    }

    /// Index of its material.
    #[inline]
    pub(crate) fn material_of(&self, surface: Surface) -> usize {
        match surface {
            Surface::Triangle(_) => self.description.shapes[self.shape_of(surface) as usize].material,
            Surface::Implicit(index) => self.description.implicits[index as usize].material,
        }
    }

    /// Unit normal of the front at a point; 0 if undefined. Constant over a triangle.
    #[inline]
    pub(crate) fn normal_of(&self, surface: Surface, at: DVec3) -> DVec3 {
        match surface {
            Surface::Triangle(triangle) => self.face_normal(triangle),
            Surface::Implicit(index) => self.implicits()[index as usize].jet(at).gradient.normalize_or_zero(),
        }
    }

    /// Unit normal of a triangle's front; 0 if it has no area.
    #[inline]
    pub(crate) fn face_normal(&self, triangle: u32) -> DVec3 {
        self.area_vector(triangle).normalize_or_zero()
    }

    /// Whether it has shading normals other than the geometric one.
    pub(crate) fn has_shading_normals(&self, surface: Surface) -> bool {
        match surface {
            Surface::Triangle(triangle) => !self.triangles[triangle as usize].is_flat(),
            Surface::Implicit(_) => false,
        }
    }

    /// Whether its shape emits.
    pub(crate) fn is_emitter(&self, surface: Surface) -> bool {
        let Surface::Triangle(_) = surface else { return false };
        self.description.shapes[self.shape_of(surface) as usize].radiance.is_some()
    }

    /// The triangle, if the ray hits the front of an emitting shape.
    #[inline]
    pub(crate) fn emitting(&self, hit: &Hit, direction: DVec3) -> Option<u32> {
        let Surface::Triangle(triangle) = hit.surface else { return None };
        (self.is_emitter(hit.surface) && self.area_vector(triangle).dot(direction) < 0.0).then_some(triangle)
    }

    /// Whether all light passes straight through: the surface is only a boundary of media, or invisible.
    pub(crate) fn is_clear(&self, surface: Surface) -> bool {
        let material = &self.description.materials[self.material_of(surface)];
        material.opacity == Some(Reflectance::Constant(DVec3::ZERO)) && material.back.is_none()
    }

    /// Medium on the side of a surface to which a direction leaves it; the surrounding medium if the surface
    /// bounds none.
    pub(crate) fn medium_towards(
        &self,
        surface: Surface,
        direction: DVec3,
        around: Option<usize>,
    ) -> Option<usize> {
        let Surface::Triangle(triangle) = surface else { return around };
        match self.description.shapes[self.shape_of(surface) as usize].boundary {
            None => around,
            Some(sides) if self.area_vector(triangle).dot(direction) > 0.0 => sides.exterior,
            Some(sides) => sides.interior,
        }
    }

    /// Material point of a hit triangle.
    #[inline]
    pub(crate) fn material_point(&self, triangle: u32, hit: &Hit) -> MaterialPoint {
        let corners = self.triangles[triangle as usize].positions;
        MaterialPoint(std::array::from_fn(|k| (corners[k], hit.coordinates[k])))
    }

    /// Unnormalised normal: (p₁ − p₀) × (p₂ − p₀).
    #[inline]
    fn area_vector(&self, triangle: u32) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        (b - a).cross(c - a)
    }
}
