//! The kinds of warp field.

use crate::gradient::GradientError;

/// What the warp field is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Field {
    /// The velocities of the edges near a direction, by their exact mean over those edges: no auxiliary ray, and no bias (jumps of
    /// interpolated normals are no edges: see [`WarpedArea::sign_changes`](super::WarpedArea::sign_changes)).
    /// Edges of meshes are listed once. None of them is tested for visibility, and none is sampled but the
    /// borders of flat emitters. Implicit surfaces join the mean by the points of their sphere tracer, as
    /// [`WarpedArea::implicit`](super::WarpedArea::implicit) says: it is the one field that knows them.
    JumpMean {
        /// How far away edges count on the film, in pixels.
        film: f64,
        /// How far away they count on directions, in widths 1/√κ of the kernel, see
        /// [`Kernels`](crate::Kernels).
        lobe: f64,
    },
    /// The velocities of what auxiliary rays hit (Bangaru, Li and Durand 2020).
    AuxiliaryRays,
}

impl Default for Field {
    fn default() -> Self {
        Self::JumpMean { film: 1.2, lobe: 0.5 }
    }
}

impl Field {
    pub(super) fn check(&self) -> Result<(), GradientError> {
        let Self::JumpMean { film, lobe } = *self else { return Ok(()) };
        for (name, reach) in [("film", film), ("lobe", lobe)] {
            if !(reach > 0.0 && reach.is_finite()) {
                return Err(GradientError::Reach { name, reach });
            }
        }
        Ok(())
    }
}
