//! Edges of a scene, listed once.
//!
//! Two things need them: the [curves](super::curve), which sample points of edges, and the [mean over
//! discontinuities](crate::gradient::warp::jump_mean), which keeps a hierarchy of them. The list is cached
//! with the scene.

mod faces;
mod list;
mod morton;

pub(super) use list::{Edge, EdgeList, are_folded};
