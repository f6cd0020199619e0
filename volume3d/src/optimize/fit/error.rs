//! Why a fit does not go on.

use super::super::objective::ObjectiveError;
use crate::scene::SceneError;
use crate::sdf::{BakeError, RedistanceError};

/// Why a fit does not go on. Its state is that before the step.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FitError {
    /// The objective has no value or no derivative.
    #[error(transparent)]
    Objective(#[from] ObjectiveError),
    /// A step led to values that are none.
    #[error("{0}; try a smaller rate, or bounds")]
    Scene(#[from] SceneError),
    /// A derivative is not a number.
    #[error("the gradient by `{parameter}` is not finite")]
    NotFinite {
        /// The name of the parameter.
        parameter: String,
    },
    /// The loss or the penalty is not a number.
    #[error("the loss is {loss}, and the penalty of regularizers {penalty}: not finite")]
    Loss {
        /// Of the images.
        loss: f64,
        /// Of the regularizers.
        penalty: f64,
    },
    /// What is for the nodes of a grid is asked of something else.
    #[error(
        "`{parameter}` is not the nodes of a grid of distances, which alone have smooth steps of that kind, and can be made distances again; \
         finer become they, and networks on grids"
    )]
    NoGrid {
        /// The name of the parameter.
        parameter: String,
    },
    /// What is for a network is asked of the nodes of a grid.
    #[error("`{parameter}` is the nodes of a grid, not a network, which alone is traced itself in the end")]
    NoNetwork {
        /// The name of the parameter.
        parameter: String,
    },
    /// The nodes of a grid have no surface any more.
    #[error("`{parameter}`: {error}; try a smaller rate")]
    Grid {
        /// The name of the parameter.
        parameter: String,
        /// What is wrong.
        error: RedistanceError,
    },
    /// A network has no surface on a finer grid.
    #[error("`{parameter}`: {error}; try more cells at first, or a smaller rate")]
    Bake {
        /// The name of the parameter.
        parameter: String,
        /// What is wrong.
        error: BakeError,
    },
    /// The loss has become far larger than it was.
    #[error(
        "the fit diverges: the loss is {loss:.3e}, and was {first:.3e} at first; try smaller rates, or more samples"
    )]
    Diverges {
        /// Now.
        loss: f64,
        /// In the first step.
        first: f64,
    },
}
