//! User guide: from a mesh to a fitted pose.
//!
//! | page | contents |
//! |---|---|
//! | [`start`] | a scene around a mesh, a rendering, a verified gradient, a pose fitted to a picture |
//! | [`methods`] | choice of method and settings |
//! | [`bias`] | unbiased, biased and refused cases; heavy tails |
//! | [`surfaces`] | surface reconstruction from pictures, as a distance grid or a neural network |
//! | [`size`] | practical problem sizes, with time, threads and memory |

#[doc = include_str!("../guide/start.md")]
pub mod start {}

#[doc = include_str!("../guide/methods.md")]
pub mod methods {}

#[doc = include_str!("../guide/bias.md")]
pub mod bias {}

#[doc = include_str!("../guide/surfaces.md")]
pub mod surfaces {}

#[doc = include_str!("../guide/size.md")]
pub mod size {}
