//! The method chosen by a pilot.

use std::fmt;

use crate::Image;
use crate::gradient::{
    ActiveParameters, EdgeSampling, Field, Gradient, GradientError, GradientImage, Progress, Tangent,
    WarpedArea,
};
use crate::scene::Scene;

/// An unbiased method with its sample counts.
#[derive(Clone, Debug)]
pub enum Method {
    /// Warped-area sampling.
    WarpedArea(WarpedArea),
    /// Edge sampling.
    EdgeSampling(EdgeSampling),
}

impl Method {
    /// The method with another seed.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        match self.clone() {
            Self::WarpedArea(method) => Self::WarpedArea(WarpedArea { seed, ..method }),
            Self::EdgeSampling(method) => Self::EdgeSampling(EdgeSampling { seed, ..method }),
        }
    }

    /// Derivative of every pixel along a tangent.
    ///
    /// # Errors
    /// As for [`WarpedArea::forward`].
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        match self {
            Self::WarpedArea(method) => method.forward(scene, change, progress),
            Self::EdgeSampling(method) => method.forward(scene, change, progress),
        }
    }

    /// Like [`forward`](Self::forward), with interior, primary and secondary terms separate.
    ///
    /// # Errors
    /// As for [`WarpedArea::forward`].
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        match self {
            Self::WarpedArea(method) => method.forward_terms(scene, change, progress),
            Self::EdgeSampling(method) => method.forward_terms(scene, change, progress),
        }
    }

    /// Derivative of Σ adjoint · image by every active parameter.
    ///
    /// # Errors
    /// As for [`WarpedArea::reverse`].
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        match self {
            Self::WarpedArea(method) => method.reverse(scene, adjoint, active, progress),
            Self::EdgeSampling(method) => method.reverse(scene, adjoint, active, progress),
        }
    }
}

/// Name of the method with samples per pixel.
impl fmt::Display for Method {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WarpedArea(WarpedArea {
                samples,
                field: Field::Softened { silhouettes, shadows, .. },
                ..
            }) => {
                let head = format!(
                    "warped area, softened: {samples} samples of the area, {silhouettes} of silhouettes"
                );
                match shadows {
                    0 => write!(f, "{head} a pixel, shadows by the exact field"),
                    _ => write!(f, "{head}, {shadows} of shadows a pixel"),
                }
            }
            Self::WarpedArea(method) => write!(f, "warped area: {} samples a pixel", method.samples),
            Self::EdgeSampling(EdgeSampling { samples, primary, secondary, bounces, .. }) => {
                write!(
                    f,
                    "edge sampling: {samples} paths, {primary} edges on the film, {secondary} before lights and {bounces} before all else seen from surfaces a pixel"
                )
            }
        }
    }
}
