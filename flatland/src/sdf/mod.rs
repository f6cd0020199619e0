//! Implicit flat worlds: shapes φ(x; θ) = 0 seen from a point, in all directions of the circle.
//!
//! The image is I_p = ∫ h_p(ω) L(ω; θ) dω over the circle of directions (n = 1), where L is the radiance of
//! the first hit of the ray from the eye. Rays are sphere traced, which yields points x_i with φ and ∇φ at no
//! additional cost; the two fields published for implicit shapes use only these points and trace no auxiliary
//! rays. [`distance`](Sdf), [`tracer`](Tracer) and [`fields`] are independent of the dimension: over
//! [`Space`], the plane and space share the same code.
//!
//! - [`Sdf`]: φ, its derivatives in space and in the parameters, and the transpose of the latter.
//! - [`LevelSetVelocity`]: velocity of a level set, and its derivatives.
//! - [`shapes`]: discs, rectangles, polygons, grids, and their smooth union.
//! - [`Tracer`], [`View`], [`Trace`]: sphere tracing and the derivative of the whole trace.
//! - [`fields`]: all constructions of V, as linear forms in ∂_θφ and ∇∂_θφ.
//! - [`Scene`], [`AngularFilm`]: an eye, a shading, pixels of equal angle.
//! - [`estimator::sdf`](crate::estimator::sdf): area integral, relaxed boundary, implicit differentiation.
//! - [`exact`]: the same pixels and derivatives in closed form, from tangent rays.
//!
//! Only the shape moves; eye, light and film are static.

mod distance;
pub mod exact;
pub mod fields;
mod film;
mod near_miss;
mod scalar;
mod scene;
pub mod shapes;
mod space;
mod tracer;

pub use distance::{Jet, LevelSetVelocity, Sdf, SecondOrder};
pub use film::{AngularFilm, AngularFilmError};
pub use near_miss::near_misses;
pub use scalar::Scalar;
pub(crate) use scene::Seen;
pub use scene::{Scene, SceneError, Shading};
pub use space::{Directions, Space};
pub use tracer::{End, RayCount, Trace, TracePoint, Tracer, TracerError, View};
