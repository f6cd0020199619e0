//! Directions in the space of a scene's parameters, and the scene displaced along them.

pub(super) mod displaced;
pub(super) mod implicit;
pub(super) mod rigid;
pub(super) mod rows;
pub(super) mod tangent;
