//! A warp field from the jumps near a direction: [`flatland::warp::JumpMean`], which is derived and proved in the plane, for
//! great arcs on the sphere and for scenes in which surfaces hide one another.
//!
//! What is seen along the directions u from a point jumps on arcs: where the surface that is seen ends, turns away, or is
//! hidden. A mean of the velocities of their points,
//!
//! > V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + 2π/R),  K(u, b) = (1/(1 − u·b) − 1/(1 − cos R))₊,
//!
//! over a set S(u) of such arcs b within an angle R of u is equal to their velocity on them, as ∫ K grows without bound
//! there; beyond R there is none, and V = 0. Both integrals and their gradients are elementary, so V and ∇·V are exact: no
//! auxiliary ray is traced, and nothing is left to be debiased.
//!
//! These are inverse distance weights (Shepard 1968), integrated along curves, so that splitting an edge changes
//! nothing. Where Bangaru, Li and Durand (2020) estimate a mean over the surfaces around u whose weights grow towards
//! their boundaries, this is a mean over the boundaries themselves.
//!
//! # What counts
//!
//! A *face* is a set of coplanar triangles that continue one another without a jump. If T is the face seen at u, S(u) is
//!
//! 1. every silhouette, border and crossing of the scene, clipped to what is before the plane of T, and
//! 2. the edges of T: creases, where its radiance ends, and *seams*, where it is continued smoothly by a face of another
//!    plane.
//!
//! Seams are no jumps. They are there because a warp over a curved surface is best where it is the velocity of the
//! surface itself: where that is seen at a grazing angle its points slide fast under any other. So their kernels have a
//! factor 1/(1 + ∫ K/K₀), the integral over all jumps of S(u), and K₀ a constant: a seam yields to a jump where both are
//! at one place.
//!
//! # Lemma: V·ν is the same from both sides
//!
//! *Let T(u) be constant on open sets of directions, and these border on one another in arcs C with normals ν. If no two
//! jumps of different normal velocities coincide along an arc, V is continuous in every set, and V·ν = v·ν on both
//! sides of every arc, where v is the velocity of C.*
//!
//! *In a set* S is fixed, and V is a quotient of integrals that are continuous away from S: K vanishes at the rim of the
//! cap, and the denominator is at least 2π/R. At an arc A of S that is no border of the set, hidden or not, ∫_A K grows as
//! 1/s at a distance s, and ∫_A (ḃ − v_A) K stays bounded, as ḃ − v_A is linear along A but for terms of second order; all
//! other terms being bounded, V = v_A + O(s) on both its sides. Where it is a seam and a jump of S is at the same place,
//! the jump's ∫ K grows as 1/s, the seam's product with its factor stays bounded, and V = v + O(s) with v the jump's
//! velocity.
//!
//! *Between two sets* with faces T and T′ there are three cases, according to why the face changes at C:
//!
//! - *One of them, T say, ends there, before the other.* Then C is a border of T, a silhouette, or the edge of a surface
//!   behind which T goes on as another face that is hidden; that is a silhouette too. It is before the plane of T, in which
//!   it lies, and before that of T′, which it hides. So it is in S on both sides. A seam of T′ at the same place yields.
//! - *They continue one another.* C is an edge of both, by (2): a crease or a seam in S on both sides. If it is a seam, no
//!   jump may be in S on one side only, and at the same place: one that lies before both planes is in S on both
//!   sides, both seams yield to it, and V is its velocity; one between the planes does not meet C.
//! - *They pass through one another.* C is a crossing, in both planes, and in S on both sides.
//!
//! In each of them V = v + O(s) from both sides, but for the part along C: an arc that is clipped by the plane of T has the
//! velocity of an edge whose new end keeps its place on the edge, and relabelling the points of a curve changes velocities
//! along it and not across it. That is enough. By the divergence theorem in each set, what is left of ∫ ∇·(V f) is
//! Σ ∮ Δf V·ν, and ∫ ∇·(V h) = 0 for every continuous h that vanishes at the border. ∎
//!
//! The test `scan` of this module measures V·ν on both sides of every kind of curve, and of coincidences of each pair
//! that leaves the derivative defined. Where jumps of *different* normal velocities coincide along an arc the image has
//! two one-sided derivatives and no other: V is then that of one jump on one side and the mean of both on the other.
//!
//! # What it costs
//!
//! Silhouettes that something else hides remain in S. They bend V where nothing jumps, which costs some variance and no
//! bias. Where silhouettes of different velocities v cross, ∇·V ~ Δv/r at a distance r, as for every continuous field,
//! so that its square has a logarithmically infinite mean; and between jumps a gap g apart that part, ∇·V ~ Δv/g.
//!
//! Jumps within faces with interpolated normals are no arcs of S: they are boundary terms beside the field
//! ([`sign_changes`](crate::gradient::WarpedArea::sign_changes)).
//!
//! A softened field ([`Field::Softened`](crate::gradient::Field::Softened)) has no such tails: kernels of jumps before T stop growing at an angle
//! ε, and those of the border of T (its *owner*) and of seams stay exact. Then V = v on the side of a silhouette whose surface ends there, at
//! creases and at seams from both sides, and V ≠ v on the other side of silhouettes and at crossings, which leaves a
//! [residual](crate::gradient::boundary) there and nowhere else.
//! With v the largest angular velocity of the N jumps within reach, |V| ≤ v and |∇·V| ≤ (4 + N) v/ε, whatever gaps and crossings there are, and 2v/w
//! more within a face that is seen w wide, whose borders move against one another where it opens. So a face is *narrow* if w is less than a hundredth
//! of ε, and kernels of its own borders, seams included, stop growing at ε/40, which adds to the residual there: |∇·V| ≤ (204 + N) v/ε. That is for faces as wide everywhere as
//! their area over their length: where one has a spike whose sides move against one another, it is 2v over the width of that. A sample of the area adds at most
//! (|∇h| + h |∇·V|/v) v |L − L₀| to a pixel, and one of a curve that is left 2 v h |L − L₀| over its density. (The test `bound` has both sides; the
//! exact mean's divergence is 10⁵ times as large and more there.)

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
