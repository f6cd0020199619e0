//! Warp fields: what they follow, the default one, and their transposes.

pub(super) mod followed;
pub(super) mod implicit_field;
pub(super) mod jump_mean;
pub(super) mod level_set;
pub(super) mod motion;
pub(super) mod nearest_discontinuity;
pub(super) mod rigid_motion;
pub(super) mod warps;
