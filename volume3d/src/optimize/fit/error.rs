//! Errors of a fit.

use super::super::objective::ObjectiveError;
use super::super::parts::PartsError;
use crate::scene::SceneError;
use crate::sdf::{BakeError, RedistanceError};

/// Why a step of a fit failed. The state of the fit is that before the step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The objective has no value or no derivative.
    #[error(transparent)]
    Objective(#[from] ObjectiveError),
    /// Parts of a step are not those that were asked for.
    #[error(transparent)]
    Parts(#[from] PartsError),
    /// A step led to invalid parameter values.
    #[error("{0}; try a smaller rate, or bounds")]
    Scene(#[from] SceneError),
    /// A derivative is not finite.
    #[error("the gradient by `{parameter}` is not finite")]
    NotFinite {
        /// The name of the parameter.
        parameter: String,
    },
    /// The loss or the penalty is not finite.
    #[error("the loss is {loss}, and the penalty of regularizers {penalty}: not finite")]
    Loss {
        /// The loss of the images.
        loss: f64,
        /// The sum of the regularizers.
        penalty: f64,
    },
    /// A setting for SDF grids is applied to another parameter.
    #[error(
        "`{parameter}` is not the nodes of a grid of distances, which alone have smooth steps of that kind, and can be made distances again; \
         finer become they, and networks on grids"
    )]
    NoGrid {
        /// The name of the parameter.
        parameter: String,
    },
    /// A setting for networks is applied to an SDF grid.
    #[error("`{parameter}` is the nodes of a grid, not a network, which alone is traced itself in the end")]
    NoNetwork {
        /// The name of the parameter.
        parameter: String,
    },
    /// The grid no longer has a surface.
    #[error("`{parameter}`: {error}; try a smaller rate")]
    Grid {
        /// The name of the parameter.
        parameter: String,
        /// The cause.
        error: RedistanceError,
    },
    /// A network has no surface on the refined grid.
    #[error("`{parameter}`: {error}; try more cells at first, or a smaller rate")]
    Bake {
        /// The name of the parameter.
        parameter: String,
        /// The cause.
        error: BakeError,
    },
    /// The loss has become far larger than in the first step.
    #[error(
        "the fit diverges: the loss is {loss:.3e}, and was {first:.3e} at first; try smaller rates, or more samples"
    )]
    Diverges {
        /// The current loss.
        loss: f64,
        /// The loss in the first step.
        first: f64,
    },
}
