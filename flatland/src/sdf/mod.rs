//! Implicit flat worlds: shapes φ(x; θ) = 0 seen from a point, in all directions of the circle.
//!
//! The image is I_p = ∫ h_p(ω) L(ω; θ) dω over the circle of directions (n = 1), where L is what the
//! ray from the eye hits first. A ray is found by sphere tracing, which brings points x_i with φ and
//! ∇φ for nothing; the two fields published for implicit shapes are made of these points alone and
//! trace no auxiliary ray. [`distance`](Sdf), [`tracer`](Tracer) and [`fields`] do not know the
//! dimension: with [`Space`] for the plane or space, the sphere of directions uses the same code.
//!
//! - [`Sdf`]: φ, its derivatives in space and in the parameters, and the transpose of the latter.
//! - [`LevelSetVelocity`]: how fast a level set moves, and the derivatives of that.
//! - [`shapes`]: discs, rectangles, polygons, grids, and their smooth union.
//! - [`Tracer`], [`View`], [`Trace`]: sphere tracing and the derivative of the whole trace.
//! - [`fields`]: every construction of V, as a linear form in ∂_θφ and ∇∂_θφ.
//! - [`Scene`], [`AngularFilm`]: an eye, a shading, pixels of equal angle.
//! - [`estimator::sdf`](crate::estimator::sdf): area integral, relaxed boundary, implicit differentiation.
//! - [`exact`]: the same pixels and derivatives in closed form, from tangent rays.
//!
//! What moves is the shape. The eye, the light and the film stand still.

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
