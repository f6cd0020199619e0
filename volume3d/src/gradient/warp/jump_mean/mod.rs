//! Mean over discontinuities: the warp field of [`flatland::warp::JumpMean`] (Theory 5), for great arcs on
//! the sphere and scenes with occlusion.
//!
//! Radiance along the directions u from a point is discontinuous on arcs: where the visible surface ends,
//! turns away, or becomes occluded. The field is a weighted mean of the velocities of their points,
//!
//! > V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + 2π/R),  K(u, b) = (1/(1 − u·b) − 1/(1 − cos R))₊,
//!
//! over a set S(u) of such arcs b within an angle R of u. Integrals and gradients are elementary, so V and
//! ∇·V are exact: no auxiliary rays, and no debiasing.
//!
//! # The set S(u)
//!
//! A [*face*](crate::gradient::edges) is a set of coplanar triangles that continue one another without a
//! discontinuity. If T is the face seen at u, S(u) consists of
//!
//! 1. every silhouette, border and crossing of the scene, clipped to the half space in front of the plane of
//!    T, and
//! 2. the edges of T: creases, where its radiance ends, and *seams*, where a face of another plane continues
//!    it smoothly.
//!
//! Seams are not discontinuities. They are included because the best warp over a curved surface is the
//! velocity of the surface itself. Their kernels have a factor 1/(1 + ∫ K/K₀), with the integral over all
//! discontinuities of S(u) and K₀ a constant: where a seam and a discontinuity coincide, the seam yields.
//!
//! # Lemma: V·ν is the same from both sides
//!
//! *Let T(u) be constant on open sets of directions that border on one another in arcs C with normals ν. If
//! no two discontinuities of different normal velocities coincide along an arc, V is continuous in every set,
//! and V·ν = v·ν on both sides of every arc, where v is the velocity of C* (Theory 5).
//!
//! The test `scan` of this module measures V·ν on both sides of every kind of curve, and of every pair of
//! coincident curves for which the derivative is defined. Where discontinuities of *different* normal
//! velocities coincide along an arc, the image has only two one-sided derivatives: V is then that of one
//! discontinuity on one side and the mean of both on the other.
//!
//! Occluded silhouettes remain in S. They bend V where nothing is discontinuous, which costs some variance
//! but no bias.
//!
//! Discontinuities within faces with interpolated normals are not arcs of S: they are separate boundary terms
//! ([`sign_changes`](crate::gradient::WarpedArea::sign_changes)).
//!
//! # Softened fields
//!
//! In a softened field ([`Field::Softened`](crate::gradient::Field::Softened), Theory 6) kernels of
//! discontinuities in front of T stop growing at an angle ε, while those of the border of T (its *owner*) and
//! of seams stay exact. It leaves a [residual](crate::gradient::curve) on the far side of silhouettes, at
//! crossings, and nowhere else. With v the largest angular velocity of the N discontinuities within reach,
//! |V| ≤ v, and |∇·V| is of the order of (1 + N) v/ε, whatever the gaps and crossings, plus 2v/w within a
//! face of apparent width w, whose borders move relative to one another where it opens. A face is therefore
//! *narrow* if w is less than ε/100, and kernels of its own borders, seams included, stop growing at ε/40,
//! which adds to the residual there. An area sample adds at most (|∇h| + h |∇·V|/v) v |L − L₀| to a pixel,
//! and a sample of a residual curve 2 v h |L − L₀| divided by its density. (The test `bound` covers both.)

mod arc;
#[cfg(test)]
mod bound;
mod crowding;
#[cfg(test)]
mod differences;
mod edge;
mod extent;
mod faces;
mod field;
mod leaf;
mod level_set;
mod listed;
mod node;
mod parts;
#[cfg(test)]
mod scan;
mod scene_edges;
mod tree;

pub(crate) use arc::{AngularSupport, WIDEST};
pub(crate) use edge::{Cone, HalfSpace};
pub(crate) use field::{JumpMean, Silhouettes, View};
pub(crate) use level_set::{Known, LevelSetTap, Sight};
pub(crate) use listed::Listed;
pub(crate) use scene_edges::SceneEdges;
