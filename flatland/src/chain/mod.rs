//! Chains: light through mirrors, glass and openings, and from lights without extent, in the plane (n = 1).
//!
//! A [`World`] consists of segments and arcs of circles: diffuse surfaces, ideal mirrors, smooth interfaces
//! of glass, and openings, which let a part of the light pass. From a film coordinate u a ray is reflected
//! and refracted to the first diffuse surface; its points x_1 … x_m are the *chain* of u. The light that it
//! carries is what the last surface emits, and what it reflects of lights in a point or from one direction.
//!
//! A ray has two continuations at glass and at openings; a sequence of decisions chooses among them. For a
//! fixed sequence the radiance is a function of u. It is discontinuous where a point of the chain, or a
//! point between x_m and a light, changes its surface. The warp field (Theory 12)
//!
//! ```text
//! V(u) = Σ_i Σ_k w_ik V_k(u_i)/Σ_i Σ_k w_ik,    w_ik = (D(u, u_i) + B_k(u_i))^−γ/p_i,
//! V_k = −(∂s_k/∂u)⁻¹ ∂s_k/∂θ,
//! ```
//!
//! has a weight for every point of the chain of every auxiliary ray, where s_k is the material coordinate of
//! x_k and B_k its distance to the end of its own curve, as the chain before it shows that. No list of
//! edges is needed, and none would say where an edge is seen in a curved mirror.
//!
//! - [`Exact`] integrates every pixel between its discontinuities, and has the derivative by terms;
//! - the estimators are in [`estimator::chain`](crate::estimator::chain).

mod curve;
mod error;
pub mod exact;
mod follow;
#[cfg(test)]
mod tests;
mod world;

pub use curve::Curve;
pub use error::ChainError;
pub use exact::{ChainTerms, Exact};
pub(crate) use follow::{Chain, End, Vertex};
pub(crate) use world::{Constants, Source};
pub use world::{Light, Optics, Surface, World};
