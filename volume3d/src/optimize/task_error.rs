//! Errors of tasks.

use super::objective::ObjectiveError;

/// Why a [`Task`](super::Task) cannot be run.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TaskError {
    /// The objective has no such view.
    #[error("the task is of view {index}, but there are {count} views here, counted from 0")]
    View {
        /// The view of the task.
        index: usize,
        /// The number of views.
        count: usize,
    },
    /// The view differs from that of the fit.
    #[error(
        "the task is of another fit: its view `{view}` differs from the one here in its picture, weights, mask, camera, loss or samples"
    )]
    Objective {
        /// The name of the view here.
        view: String,
    },
    /// The scene differs from that with which the fit began.
    #[error("the task is of another fit: its scene differs from the one here")]
    Scene,
    /// The parameters differ from those of the fit.
    #[error("the task is of another fit: its parameters, or the objects at rest that they move, differ")]
    Parameters,
    /// The method, its samples or its seed differ from those of the fit.
    #[error(
        "the task is of another fit: its method differs from the one here, or the method's samples or seed"
    )]
    Method,
    /// The parameters are more or fewer than those of the fit.
    #[error("the task is of {found} numbers, but the parameters here are {expected}")]
    Numbers {
        /// The number of parameters here.
        expected: usize,
        /// The number in the task.
        found: usize,
    },
    /// The adjoint image does not have one value for each pixel.
    #[error("view `{view}`: the adjoint has {found} pixels, but the film {expected}")]
    Adjoint {
        /// The name of the view.
        view: String,
        /// The pixels of the film.
        expected: usize,
        /// The pixels of the adjoint.
        found: usize,
    },
    /// The fit has replaced an implicit surface, which scenes elsewhere do not follow.
    #[error(
        "the fit has refined the surface of `{parameter}`, or replaced it by the network itself; tasks cannot be run elsewhere after that, so take these steps in the fit's own process"
    )]
    Replaced {
        /// The parameter.
        parameter: String,
    },
    /// The objective has no value or no derivative.
    #[error(transparent)]
    Evaluation(#[from] ObjectiveError),
}
