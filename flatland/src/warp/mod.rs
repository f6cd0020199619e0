//! The warp field V and its divergence, from auxiliary points in any dimension (Theory 3) or from the
//! discontinuities themselves (Theory 5).
//!
//! Around a point u, auxiliary points u_i are drawn from a kernel of concentration κ. Each has the velocity
//! V_i of the object seen there and a boundary value B_i that vanishes where that object ends. With D the
//! kernel's own distance and w = (D + B)^−γ,
//!
//! ```text
//! V = Σ ω_i V_i,   ∇·V = Σ ω_i (ℓ_i − ℓ̄)·V_i − c u·V,
//! ω_i = w̃_i / Σ w̃_j,   w̃ = w/p,   ℓ = ∇_u ln w,   ℓ̄ = Σ ω_i ℓ_i,
//! ```
//!
//! (Bangaru, Li and Durand 2020, section 4.3) with c = 0 on the line and in the plane, and c = n on the
//! circle and the sphere, where fields are projected to the tangent space at u. Both are linear in the V_i,
//! so a [`Stencil`] stores their coefficients: it is a [`LinearField`], which forward mode applies and
//! reverse mode transposes, and every [`Debias`] scheme is one more linear combination.
//!
//! If the discontinuities near u are known, [`JumpMean`] needs no auxiliary points:
//!
//! | field | needs | (V, ∇·V) | bias |
//! |---|---|---|---|
//! | [`Warp`] | hits around u, and distances to their ends | estimated | none if debiased, see below |
//! | [`JumpMean`] | a list of all discontinuities | exact, or softened with a residual | none |
//!
//! # Bias
//!
//! The quotient by Σ w̃ makes every fixed number of rays biased ([`Debias::Consistent`]), the more so the
//! closer u is to a boundary. [`Debias::Multilevel`] and [`Debias::RussianRoulette`] remove that bias exactly
//! (Theory 4). With B ~ sᵖ in the distance s, the field is boundary consistent
//! if pγ ≥ 1 (n = 1) and γ ≥ 1/p + 1/2 (n = 2), at equality only logarithmically; below the bound no number
//! of rays helps.
//!
//! # Numerics
//!
//! With x = κ|u−u'|²/2 (line, plane) or κ(1 − u·u') (circle, sphere), D = eˣ − 1, and q = B e⁻ˣ + (1 − e⁻ˣ),
//!
//! ```text
//! ln w = −γ (x + ln q),   ℓ = −(γ/q) ∇_u x,
//! ```
//!
//! which neither overflows nor cancels anywhere. Weights are stored as logarithms relative to the largest, so
//! no clamp is needed and none is made.

mod auxiliary;
mod boundary;
mod debias;
mod domain;
mod estimate;
mod field;
mod jumps;
mod parameters;
mod stencil;

pub use auxiliary::AuxiliaryPoints;
pub use boundary::BoundaryFunction;
pub use debias::Debias;
pub use domain::{Circle, Domain, Draw, Line, Plane, Vector};
pub use estimate::{Bundle, ChainHit};
#[cfg(test)]
pub(crate) use field::assert_transposed;
pub use field::{Field, LinearField, WarpField};
pub use jumps::{Jump, JumpMean};
pub use parameters::{Warp, WarpError, Weighting};
pub use stencil::{Stencil, Term};
