//! A warp field from the outlines near a direction.
//!
//! What is seen along the directions u from a point jumps on arcs: the edges of the triangle that is seen, and the
//! silhouettes of what is nearer. A mean of the velocities of their points,
//!
//! > V(u) = ∫ ḃ K(u, b) db / (∫ K(u, b) db + 2π/R),  K(u, b) = (1/(1 − u·b) − 1/(1 − cos R))₊,
//!
//! over all these arcs b within an angle R of u is continuous and, as ∫ K grows without bound towards an arc, equal
//! to its velocity there; beyond R there is none, and V = 0. Both integrals and their gradients are elementary, so V
//! and ∇·V are exact: no auxiliary ray is traced, and nothing is left to be debiased.
//!
//! The arcs may be others for every triangle that is seen, as all its edges are among them and V is the same from
//! both sides. So what lies behind its plane is left out: no visible jump borders the triangle there. Silhouettes that
//! something else hides remain. They bend V where nothing jumps, which costs some variance and no bias.
//!
//! These are inverse distance weights (Shepard 1968), integrated along curves, so that splitting an edge changes
//! nothing. Where Bangaru, Li and Durand (2020) estimate a mean over the surfaces around u whose weights grow towards
//! their boundaries, this is a mean over the boundaries themselves.
//!
//! What costs variance: where silhouettes of different velocities v cross, ∇·V ~ Δv/r at a distance r, as for every
//! continuous field, so that its square has a logarithmically infinite mean; and between edges a gap g apart that part,
//! ∇·V ~ Δv/g. What is not followed: jumps that are no edge of a triangle. Those within faces with interpolated normals
//! are boundary terms beside it ([`flips`](crate::gradient::WarpedArea::flips)); the curves along which surfaces pass
//! through one another are missed. And where a silhouette lies exactly on an edge of what it hides that is no jump and
//! moves otherwise, V is the mean of both.

mod arc;
mod faces;
mod field;
mod node;
mod tree;

pub(crate) use arc::{Reach, WIDEST};
pub(crate) use field::{Outline, Pole, Silhouettes, Subject, View};
pub(crate) use tree::{Cone, Edge, HalfSpace, Tree};
