//! Warped-area sampling in three dimensions, on `flatland`'s warp machinery.
//!
//! What a renderer in space needs beyond the plane is one more [`Domain`](flatland::warp::Domain): the sphere of
//! directions. Weights, stencils, debiasing, forward and reverse mode are those of
//! [`flatland::warp`], unchanged.
//!
//! ```
//! use flatland::random::stream;
//! use flatland::warp::Warp;
//! use glam::DVec3;
//! use volume3d::Sphere;
//!
//! // A cap of directions turns about the x axis; everything else stands still.
//! let cap = |u: DVec3| u.z > 0.5;
//! let distance = |u: DVec3| u.z.acos() - 0.5_f64.acos();
//! let stencil = Warp::default().stencil::<Sphere, _>(DVec3::Z, 10.0, &mut stream(0, &[]), |u| {
//!     (u, if cap(u) { -distance(u) } else { f64::INFINITY })
//! });
//! let field = stencil.field(|&u| if cap(u) { DVec3::X.cross(u) } else { DVec3::ZERO });
//! assert!(field.value.dot(DVec3::Z).abs() < 1e-12, "the field is tangent");
//! ```

mod calculus;
pub mod geometry;
pub mod gradient;
pub mod io;
mod path;
pub mod scene;
mod sphere;

pub use path::Kernels;
pub use sphere::Sphere;
