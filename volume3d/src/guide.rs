//! For whoever begins: from a mesh to a fitted pose, what to choose, and what to expect.
//!
//! | page | what it says |
//! |---|---|
//! | [`start`] | a scene around a mesh, a picture, a gradient that is checked, a pose from a picture |
//! | [`methods`] | which method and which settings, and how to find out |
//! | [`bias`] | what is unbiased, biased and refused, and where tails are heavy |
//! | [`surfaces`] | a surface of unknown shape from pictures: as a grid of distances, and as a network |
//! | [`deviations`] | where a scene of the Mitsuba format means something else here than there, and by how much |
//! | [`size`] | how large a problem is practical, and what it takes in time, threads and memory |

#[doc = include_str!("../guide/start.md")]
pub mod start {}

#[doc = include_str!("../guide/methods.md")]
pub mod methods {}

#[doc = include_str!("../guide/bias.md")]
pub mod bias {}

#[doc = include_str!("../guide/surfaces.md")]
pub mod surfaces {}

#[doc = include_str!("../guide/deviations.md")]
pub mod deviations {}

#[doc = include_str!("../guide/size.md")]
pub mod size {}
