//! What a run returns: images, gradients and errors.

pub(super) mod contribution;
pub(super) mod error;
pub(super) mod regions;
pub(super) mod result;
