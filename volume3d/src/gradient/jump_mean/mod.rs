//! A warp field from the jumps near a direction (Theory 5): [`flatland::warp::JumpMean`] for great arcs on
//! the sphere and for scenes in which surfaces hide one another.
//!
//! What is seen along the directions u from a point jumps on arcs: where the surface that is seen ends, turns away, or is
//! hidden. The field is a mean of the velocities of their points,
//!
//! > V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + 2π/R),  K(u, b) = (1/(1 − u·b) − 1/(1 − cos R))₊,
//!
//! over a set S(u) of such arcs b within an angle R of u. Integrals and gradients are elementary, so V and
//! ∇·V are exact: no auxiliary ray is traced, and nothing is left to be debiased.
//!
//! # What counts
//!
//! A *face* is a set of coplanar triangles that continue one another without a jump. If T is the face seen at u, S(u) is
//!
//! 1. every silhouette, border and crossing of the scene, clipped to what is before the plane of T, and
//! 2. the edges of T: creases, where its radiance ends, and *seams*, where it is continued smoothly by a face of another
//!    plane.
//!
//! Seams are no jumps. They are there because a warp over a curved surface is best where it is the velocity
//! of the surface itself. Their kernels have a factor 1/(1 + ∫ K/K₀), the integral over all jumps of S(u),
//! and K₀ a constant: a seam yields to a jump where both are at one place.
//!
//! # Lemma: V·ν is the same from both sides
//!
//! *Let T(u) be constant on open sets of directions, and these border on one another in arcs C with normals ν. If no two
//! jumps of different normal velocities coincide along an arc, V is continuous in every set, and V·ν = v·ν on both
//! sides of every arc, where v is the velocity of C* (Theory 5).
//!
//! The test `scan` of this module measures V·ν on both sides of every kind of curve, and of coincidences of each pair
//! that leaves the derivative defined. Where jumps of *different* normal velocities coincide along an arc the image has
//! two one-sided derivatives and no other: V is then that of one jump on one side and the mean of both on the other.
//!
//! Silhouettes that something else hides remain in S. They bend V where nothing jumps, which costs some variance and no
//! bias.
//!
//! Jumps within faces with interpolated normals are no arcs of S: they are boundary terms beside the field
//! ([`sign_changes`](crate::gradient::WarpedArea::sign_changes)).
//!
//! # Softened fields
//!
//! Of a softened field ([`Field::Softened`](crate::gradient::Field::Softened), Theory 6) kernels of jumps
//! before T stop growing at an angle ε, and those of the border of T (its *owner*) and of seams stay exact.
//! It leaves a [residual](crate::gradient::boundary) on the far side of silhouettes, at crossings, and
//! nowhere else. With v the largest angular velocity of the N jumps within reach, |V| ≤ v, and |∇·V| is of
//! the order of (1 + N) v/ε, whatever gaps and crossings there are, and 2v/w more within a face that is seen
//! w wide, whose borders move against one another where it opens. So a face is *narrow* if w is less than a
//! hundredth of ε, and kernels of its own borders, seams included, stop growing at ε/40, which adds to the
//! residual there. A sample of the area adds at most (|∇h| + h |∇·V|/v) v |L − L₀| to a pixel, and one of a
//! curve that is left 2 v h |L − L₀| over its density. (The test `bound` has both sides.)

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
pub(crate) use faces::Faces;
pub(crate) use field::{JumpMean, Silhouettes, Subject, View};
pub(crate) use level_set::{Known, LevelSetTap, Sight};
pub(crate) use listed::Listed;
pub(crate) use scene_edges::SceneEdges;
