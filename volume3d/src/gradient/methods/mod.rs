//! Methods other than warped-area sampling, the pilot that chooses one, and the type of all.

pub(super) mod by_name;
pub(super) mod edge_sampling;
pub(super) mod estimator;
pub(super) mod finite_difference;
pub(super) mod pilot;
pub(super) mod rotation;
mod steps;
