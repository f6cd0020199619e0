//! One rigid motion per kernel (Loubet, Holzschuch and Jakob 2019), on the film and at every bounce.

use super::auxiliary::Construction;
use super::error::GradientError;
use super::progress::Progress;
use super::result::{Gradient, GradientImage};
use super::tangent::{ActiveParameters, Tangent};
use super::warped_area::WarpedArea;
use crate::Image;
use crate::path::Kernels;
use crate::scene::Scene;

/// The rotation reparameterisation: every kernel of directions turns with one of the points seen in it, on the film
/// it is shifted.
///
/// The point is the nearest of a few drawn from the kernel, as the edge of what hides the rest is the one that is
/// seen. **Biased** wherever no single rigid motion carries every edge in the kernel: V·ν then differs from the
/// boundary's velocity by its variation across the kernel, whatever the number of samples; and jumps of interpolated
/// normals within faces stand still. It is here for the comparison.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rotation {
    /// Samples a pixel.
    pub samples: usize,
    /// Samples a pixel of the image that is subtracted as a control variate, as for [`WarpedArea`].
    pub control_variate: usize,
    /// Points from which the one to follow is chosen.
    pub candidates: usize,
    /// Concentrations. The wider the kernel, the larger the bias; the narrower, the larger the variance.
    pub kernels: Kernels,
    /// The seed of everything random.
    pub seed: u64,
}

impl Default for Rotation {
    fn default() -> Self {
        Self { samples: 16, control_variate: 4, candidates: 4, kernels: Kernels::default(), seed: 0 }
    }
}

impl Rotation {
    /// The derivative of every pixel along a change.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Tangent` if the change is of another scene,
    /// `Samples` and `Warp` for parameters out of their range, and `Stopped`.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.area().image::<1, 6>(scene, change, self.construction(), progress)
    }

    /// The same, with interior, primary and secondary term apart.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Tangent` if the change is of another scene,
    /// `Samples` and `Warp` for parameters out of their range, and `Stopped`.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.area().image::<3, 15>(scene, change, self.construction(), progress)
    }

    /// The transpose of [`forward`](Self::forward).
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry is active before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Adjoint` if the adjoint has not the film's size,
    /// `Samples` and `Warp` for parameters out of their range, and `Stopped`.
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
