//! For whoever begins: from a mesh to a fitted pose, what to choose, and what to expect.
//!
//! | page | what it says |
//! |---|---|
//! | [`start`] | a scene around a mesh, a picture, a gradient that is checked, a pose from a picture |
//! | [`methods`] | which method and which settings, and how to find out |
//! | [`size`] | how large a problem is practical, and what it takes in time, threads and memory |
//!
//! What is biased when is said [on the crate's page](crate#what-is-biased-when).

#[doc = include_str!("../guide/start.md")]
pub mod start {}

#[doc = include_str!("../guide/methods.md")]
pub mod methods {}

#[doc = include_str!("../guide/size.md")]
pub mod size {}
