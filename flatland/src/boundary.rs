//! The residual theorem: the boundary term that a warp field leaves (Theory 7).
//!
//! Let f(u; θ) be smooth except for discontinuities on curves Γ that move with velocity v. Let V be **any**
//! continuous field that is smooth except on curves and points, with |∇V| integrable, and that vanishes where
//! the domain or f ends. (For n = 2 it need not be continuous at single points, if it is bounded there; for
//! n = 1 it must, as a discontinuity is itself a point.) Then
//!
//! ```text
//! d/dθ ∫ f du = ∫ ∂f/∂θ + ∇·(V f) du + ∮_Γ Δf (v − V)·ν dl,
//! ```
//!
//! where ν is the normal of Γ and Δf = f⁻ − f⁺, with f⁻ on the side that ν leaves and f⁺ on the side it
//! enters.
//!
//! | V | residual | method |
//! |---|---|---|
//! | 0 | Δf v·ν, all of it | edge sampling (Li, Aittala, Durand and Lehtinen 2018) |
//! | V·ν = v·ν on Γ: boundary consistent | 0 | warped-area sampling (Bangaru, Li and Durand 2020) |
//! | any other | Δf (v − V)·ν | both combined, also unbiased |
//!
//! In the plane [`BoundaryIntegral`](crate::estimator::BoundaryIntegral) samples the residual of any field;
//! along paths in flat worlds [`WarpedArea`](crate::estimator::transport::WarpedArea) samples the residual of
//! softened means over discontinuities.

use crate::warp::Vector;

/// (v − V)·ν: the normal speed of a discontinuity relative to the field.
///
/// `velocity` is v of the discontinuity, of which only the component along the unit normal `normal` ν
/// matters; `field` is V at the same point.
#[must_use]
pub fn residual_speed<V: Vector>(velocity: V, field: V, normal: V) -> f64 {
    (velocity - field).dot(normal)
}
