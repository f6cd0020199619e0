//! What a ray hits: a surface, and where on it.

use glam::DVec3;

use crate::geometry;

/// A surface that a ray can hit.
///
/// Whoever asks what depends on its kind does so by a pattern without a rest, so that the compiler finds them all when a
/// kind is added. Code that is about meshes by its nature takes the triangle out in one place.
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

/// Where a ray meets the scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Hit {
    pub(crate) surface: Surface,
    /// From the ray's origin.
    pub(crate) distance: f64,
    /// Where on the surface, in its own coordinates: of a triangle the weights of its corners.
    pub(crate) coordinates: [f64; 3],
}

impl From<geometry::Hit> for Hit {
    #[inline]
    fn from(hit: geometry::Hit) -> Self {
        let geometry::Hit { triangle, distance, barycentric } = hit;
        Self { surface: Surface::Triangle(triangle), distance, coordinates: barycentric }
    }
}

/// A point of a triangle's matter: Σ wₖ p_{iₖ}, with the indices i of its corners and their weights w.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MaterialPoint(pub(super) [(u32, f64); 3]);

impl MaterialPoint {
    /// Its velocity, from those of all positions.
    #[inline]
    pub(crate) fn velocity(&self, velocities: &[DVec3]) -> DVec3 {
        self.0.iter().map(|&(i, weight)| weight * velocities[i as usize]).sum()
    }

    /// The transpose: what a covector of its velocity gives to that of each position.
    #[inline]
    pub(crate) fn scatter(&self, covector: DVec3, mut add: impl FnMut(u32, DVec3)) {
        self.0.iter().for_each(|&(i, weight)| add(i, weight * covector));
    }
}
