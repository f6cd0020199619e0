//! Implicit surfaces in space: shapes φ(x; θ) = 0, φ > 0 outside.
//!
//! [`flatland::sdf`] does not know the dimension: its [`Sdf`](flatland::sdf::Sdf), [sphere tracing](flatland::sdf::View) and
//! [fields](flatland::sdf::fields) serve space with [`DVec3`](glam::DVec3) for points and [`Sphere`](crate::Sphere) for
//! directions, and so do its [balls and smooth unions](flatland::sdf::shapes). Here is what space adds.

pub mod analytic;
pub mod network;
