//! Hits of rays: a surface, and a point on it.

use glam::DVec3;

use crate::geometry;

/// A surface that a ray can hit.
///
/// Code that depends on the kind uses an exhaustive pattern, so that the compiler finds it when a kind is
/// added. Code that is specific to meshes extracts the triangle in one place.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Surface {
    /// A triangle of a mesh, by its index in the scene.
    Triangle(u32),
    /// An implicit surface, by its index in the scene.
    Implicit(u32),
}

impl Surface {
    /// The triangle, if it is one.
    pub(crate) fn triangle(self) -> Option<u32> {
        match self {
            Self::Triangle(triangle) => Some(triangle),
            Self::Implicit(_) => None,
        }
    }
}

/// Intersection of a ray with the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub(crate) surface: Surface,
    /// Distance from the ray's origin.
    pub(crate) distance: f64,
    /// Position on the surface, in its own coordinates: for a triangle, barycentric coordinates.
    pub(crate) coordinates: [f64; 3],
}

impl From<geometry::Hit> for Hit {
    #[inline]
    fn from(hit: geometry::Hit) -> Self {
        let geometry::Hit { triangle, distance, barycentric } = hit;
        Self { surface: Surface::Triangle(triangle), distance, coordinates: barycentric }
    }
}

/// A material point of a triangle: Σ wₖ p_{iₖ}, with the indices i of its corners and their weights w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialPoint(pub(super) [(u32, f64); 3]);

impl MaterialPoint {
    /// Its velocity, from those of all positions.
    #[inline]
    pub(crate) fn velocity(&self, velocities: &[DVec3]) -> DVec3 {
        self.0.iter().map(|&(i, weight)| weight * velocities[i as usize]).sum()
    }

    /// Transpose of [`velocity`](Self::velocity): hands each position its part of a covector.
    #[inline]
    pub(crate) fn scatter(&self, covector: DVec3, mut add: impl FnMut(u32, DVec3)) {
        self.0.iter().for_each(|&(i, weight)| add(i, weight * covector));
    }
}
