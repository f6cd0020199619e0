//! Flat worlds: light transport in the plane, over the directions of a circle (n = 1).
//!
//! A [`World`] consists of disjoint polylines and polygons, each of one [`Material`], in an environment of
//! constant radiance; a [`Camera`] is a pinhole with a line of pixels. The radiance that leaves x towards ω_o
//! is
//!
//! ```text
//! L(x, ω_o) = L_e + ∫ f(ω_i, ω_o) |n·ω_i| L(y, −ω_i) dω_i
//! ```
//!
//! over the half circle of directions on ω_o's side, with y the first point hit in direction ω_i. It is
//! computed over numbers of [`calculus`](crate::calculus): plain ones for the image, recorded ones for
//! derivatives.
//!
//! A [`Tangent`] is the rate of vertices, materials, environment and camera by θ; gradients have the same
//! type.

mod calculus;
mod camera;
mod emitters;
pub mod exact;
pub mod fields;
mod material;
mod path;
mod scattering;
mod sides;
mod tangent;
mod world;

pub(crate) use calculus::{Bounce, Calculus, Warped};
pub use camera::{Camera, CameraError, CameraTangent, Film, FilmSample};
pub(crate) use emitters::subtended;
pub use material::{Gloss, Material};
pub(crate) use path::{ActiveParameters, path_stream};
pub use path::{ImageError, LEAST_SURVIVAL, Paths};
pub(crate) use scattering::Scattering;
pub(crate) use sides::both_sides;
pub(crate) use tangent::{Covector, Parameters};
pub use tangent::{MaterialTangent, Tangent, TangentError, Terms};
pub use world::{Hit, Origin, Segment, Shape, World, WorldError};
