//! Mean over discontinuities: the warp field of [`flatland::warp::JumpMean`], derived and proved there in the
//! plane, for great arcs on the sphere and scenes with occlusion.
//!
//! Radiance along the directions u from a point is discontinuous on arcs: where the visible surface ends,
//! turns away, or becomes occluded. The weighted mean of the velocities of their points,
//!
//! > V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + 2π/R),  K(u, b) = (1/(1 − u·b) − 1/(1 − cos R))₊,
//!
//! over a set S(u) of such arcs b within an angle R of u, equals their velocity on them, as ∫ K diverges
//! there; where none is within R, V = 0. Both integrals and their gradients are elementary, so V and ∇·V are
//! exact: no auxiliary rays, and no debiasing.
//!
//! These are inverse distance weights (Shepard 1968), integrated along curves, so that splitting an edge
//! changes nothing. Where Bangaru, Li and Durand (2020) estimate a mean over the surfaces around u with
//! weights that grow towards their boundaries, this is a mean over the boundaries themselves.
//!
//! # The set S(u)
//!
//! A *face* is a set of coplanar triangles that continue one another without a discontinuity. If T is the
//! face seen at u, S(u) consists of
//!
//! 1. every silhouette, border and crossing of the scene, clipped to the half space in front of the plane of
//!    T, and
//! 2. the edges of T: creases, where its radiance ends, and *seams*, where a face of another plane continues
//!    it smoothly.
//!
//! Seams are not discontinuities. They are included because the best warp over a curved surface is the
//! velocity of the surface itself: with any other, points seen at a grazing angle slide fast. Their kernels
//! therefore have a factor 1/(1 + ∫ K/K₀), with the integral over all discontinuities of S(u) and K₀ a
//! constant: where a seam and a discontinuity coincide, the seam yields.
//!
//! # Lemma: V·ν is the same from both sides
//!
//! *Let T(u) be constant on open sets of directions that border on one another in arcs C with normals ν. If
//! no two discontinuities of different normal velocities coincide along an arc, V is continuous in every set,
//! and V·ν = v·ν on both sides of every arc, where v is the velocity of C.*
//!
//! *Within a set*, S is fixed, and V is a quotient of integrals that are continuous away from S: K vanishes
//! at the rim of the cap, and the denominator is at least 2π/R. At an arc A of S that is not a border of the
//! set, occluded or not, ∫_A K grows as 1/s at a distance s, and ∫_A (ḃ − v_A) K stays bounded, as ḃ − v_A is
//! linear along A up to second-order terms; all other terms are bounded, so V = v_A + O(s) on both its sides.
//! If A is a seam that coincides with a discontinuity of S, the discontinuity's ∫ K grows as 1/s, the product
//! of the seam's kernel and factor stays bounded, and V = v + O(s) with v the discontinuity's velocity.
//!
//! *Between two sets* with faces T and T′ there are three cases, by the reason why the face changes at C:
//!
//! - *One of them, say T, ends in front of the other.* Then C is a border of T, a silhouette, or the edge of
//!   a surface behind which T continues as another, occluded face; that is a silhouette too. It is in front
//!   of the plane of T, in which it lies, and of that of T′, which it occludes. So it is in S on both sides.
//!   A coincident seam of T′ yields.
//! - *They continue one another.* C is an edge of both, by (2): a crease or a seam in S on both sides. If it
//!   is a seam, no coincident discontinuity may be in S on one side only: one that lies in front of both
//!   planes is in S on both sides, both seams yield to it, and V is its velocity; one between the planes does
//!   not meet C.
//! - *They pass through one another.* C is a crossing, in both planes, and in S on both sides.
//!
//! In each case V = v + O(s) from both sides, except for the component along C: an arc clipped by the plane
//! of T has the velocity of an edge whose new end keeps its position on the edge, and relabelling the points
//! of a curve changes velocities along it but not across it. That suffices: by the divergence theorem in each
//! set, ∫ ∇·(V f) reduces to Σ ∮ Δf V·ν, and ∫ ∇·(V h) = 0 for every continuous h that vanishes at the
//! border. ∎
//!
//! The test `scan` of this module measures V·ν on both sides of every kind of curve, and of every pair of
//! coincident curves for which the derivative is defined. Where discontinuities of *different* normal
//! velocities coincide along an arc, the image has only two one-sided derivatives: V is then that of one
//! discontinuity on one side and the mean of both on the other.
//!
//! # Variance
//!
//! Occluded silhouettes remain in S. They bend V where nothing is discontinuous, which costs some variance
//! but no bias. Where silhouettes of different velocities cross, ∇·V ~ Δv/r at a distance r, as for every
//! continuous field, so that the mean of its square diverges logarithmically; between discontinuities a gap g
//! apart, ∇·V ~ Δv/g.
//!
//! Discontinuities within faces with interpolated normals are not arcs of S: they are separate boundary terms
//! ([`sign_changes`](crate::gradient::WarpedArea::sign_changes)).
//!
//! A softened field ([`Field::Softened`](crate::gradient::Field::Softened)) has no such tails: kernels of
//! discontinuities in front of T stop growing at an angle ε, while those of the border of T (its *owner*) and
//! of seams stay exact. Then V = v on the side of a silhouette whose surface ends there, and on both sides of
//! creases and seams. V ≠ v on the other side of silhouettes and at crossings, which leaves a
//! [residual](crate::gradient::boundary) there and nowhere else.
//!
//! With v the largest angular velocity of the N discontinuities within reach, |V| ≤ v and |∇·V| ≤ (4 + N)
//! v/ε, whatever the gaps and crossings, plus 2v/w within a face of apparent width w, whose borders move
//! relative to one another where it opens. A face is therefore *narrow* if w is less than ε/100, and kernels
//! of its own borders, seams included, stop growing at ε/40, which adds to the residual there:
//! |∇·V| ≤ (204 + N) v/ε. That is for faces of uniform width, area over length: at a spike whose sides move
//! relative to one another, the term is 2v over the spike's width. An area sample adds at most (|∇h| + h
//! |∇·V|/v) v |L − L₀| to a pixel, and a sample of a residual curve 2 v h |L − L₀| divided by its density.
//! (The test `bound` covers both; the divergence of the exact mean is more than 10⁵ times as large there.)

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
