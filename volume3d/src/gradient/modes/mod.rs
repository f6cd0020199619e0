//! Forward and reverse mode: one sample over numbers that carry derivatives.

pub(super) mod accumulator;
pub(super) mod border;
pub(super) mod differential;
pub(super) mod forward;
pub(super) mod reverse;
