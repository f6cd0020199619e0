//! Rotation heuristic: one rigid motion per kernel (Loubet, Holzschuch and Jakob 2019), on the film and at
//! every bounce.

use crate::Image;
use crate::gradient::auxiliary::Construction;
use crate::gradient::parameters::tangent::{ActiveParameters, Tangent};
use crate::gradient::results::error::GradientError;
use crate::gradient::results::result::{Gradient, GradientImage};
use crate::gradient::run::progress::Progress;
use crate::gradient::warped_area::WarpedArea;
use crate::path::Kernels;
use crate::scene::Scene;

/// The rotation reparameterisation: every kernel of directions rotates with one of the points seen in it; on
/// the film it translates.
///
/// The followed point is the nearest of several drawn from the kernel. **Biased** wherever no single rigid
/// motion moves every edge in the kernel (Theory 11). Discontinuities of interpolated normals within faces
/// are treated as static. Provided for comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Samples per pixel.
    pub samples: usize,
    /// Samples per pixel of the control-variate image, as for [`WarpedArea`].
    pub control_variate: usize,
    /// Number of points from which the followed one is chosen.
    pub candidates: usize,
    /// Kernel concentrations: the wider the kernel, the larger the bias; the narrower, the larger the
    /// variance.
    pub kernels: Kernels,
    /// Random seed.
    pub seed: u64,
}

impl Default for Rotation {
    fn default() -> Self {
        Self { samples: 16, control_variate: 4, candidates: 4, kernels: Kernels::default(), seed: 0 }
    }
}

impl Rotation {
    /// Derivative of every pixel along a tangent.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` if geometry moves in front of ideal mirrors or under lights without
    /// extent, or such a light moves that casts shadows, `Tangent` if the tangent belongs to another scene,
    /// `Samples` and `Warp` for parameters out of range, and `Stopped`.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.area().image::<1, 6>(scene, change, self.construction(), progress)
    }

    /// Like [`forward`](Self::forward), with interior, primary and secondary terms separate.
    ///
    /// # Errors
    /// As for [`forward`](Self::forward).
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.area().image::<3, 15>(scene, change, self.construction(), progress)
    }

    /// Transpose of [`forward`](Self::forward).
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` if geometry is active in front of ideal mirrors or under lights
    /// without extent, or such a light moves that casts shadows, `Adjoint` or
    /// `NonFiniteAdjoint` if the adjoint image differs from the film in size or is not finite, `Samples` and
    /// `Warp` for parameters out of range, and `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        self.area().pull(scene, adjoint, active, self.construction(), progress)
    }

    fn construction(&self) -> Construction {
        Construction::Followed { candidates: self.candidates.max(1) }
    }

    fn area(&self) -> WarpedArea {
        let Self { samples, control_variate, kernels, seed, .. } = *self;
        WarpedArea { samples, control_variate, kernels, sign_changes: 0, seed, ..WarpedArea::default() }
    }
}
