//! Runs of many samples: random streams, parallel parts, progress.

pub(super) mod groups;
pub(super) mod non_finite;
pub(super) mod parts;
pub(super) mod progress;
pub(super) mod streams;
