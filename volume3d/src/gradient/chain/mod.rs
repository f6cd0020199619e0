//! The field of chains: light through ideal mirrors, glass and openings, and of lights without extent.
//!
//! Every sample of the film, or of the directions at a bounce, determines a chain of points x₁ … x_m: ideal
//! reflections and refractions up to the first point that scatters, and for a light without extent the
//! occluder z between it and x_m. Light is discontinuous where any of them changes surface. With ξ_k the
//! material coordinates of the k-th point as a function of the sample u, a point that stays on its surface
//! moves over u with V_k = −(∂ξ_k/∂u)⁻¹ ∂ξ_k/∂θ, and the field is the mean of all V_k of all auxiliary rays,
//! each with its own weight (Theory 12):
//!
//! > V(u) = Σᵢ Σₖ w_ik V_k(u_i) / Σᵢ Σₖ w_ik,   w_ik = (D(u, u_i) + B_k(u_i))^−γ / p_i,
//!
//! where B_k vanishes where x_k reaches the end of its own surface as seen through the chain. No edge is
//! listed, and none could be: where an edge is seen in a curved mirror is known to its rays alone.
//!
//! ∂/∂u comes from numbers with two derivatives, ∂/∂θ from the numbers of the calculus, forward or reverse:
//! both by one program, [`Course`].

mod along;
mod field;
mod markers;
mod walk;

use flatland::calculus::{Number, Vec3};
use flatland::warp::{Bundle, Plane};
use glam::{DVec2, DVec3};

use self::along::{AlongRays, Pair};
pub(crate) use self::field::Kernel;
use self::field::{Combined, combine};
use self::walk::Course;
pub(crate) use self::walk::Through;
use crate::Sphere;
use crate::gradient::film::{FilmPlane, FilmPoint};
use crate::path::{Calculus, Frame, Warped};
use crate::scene::{Scene, Surface};

/// The warp at a film point u: its rates of the two coordinates, and of the Jacobian, as numbers of value 0.
/// Returned are also the number of rays.
pub(crate) fn on_film<C: Calculus>(
    calculus: &C,
    scene: &Scene,
    (film, frame): (&FilmPlane, &Frame<C::Number>),
    u: DVec2,
    bundle: &Bundle<Plane>,
    kernel: Kernel<'_>,
    through: Through<'_>,
) -> (Option<Combined<C::Number, 2>>, u64) {
    let still = AlongRays { scene };
    let fixed = film.moving_frame(&still);
    let rays = bundle.points().map(|u: DVec2| {
        let [x, y] = [Pair::new(u.x, [1.0, 0.0]), Pair::new(u.y, [0.0, 1.0])];
        let along = (fixed.origin, film.direction(&fixed, [x, y]));
        let at = [u.x, u.y].map(C::Number::constant);
        let moving = (frame.origin, film.direction(frame, at));
        (along, moving, [DVec2::X, DVec2::Y])
    });
    let course = Course { scene, from: None, through };
    combine(calculus, &course, rays, (bundle, u), kernel)
}

/// The warp at a direction ω seen from `origin` on a surface, as [`on_film`].
pub(crate) fn on_sphere<C: Calculus>(
    calculus: &C,
    scene: &Scene,
    (origin, from): (Vec3<C::Number>, Surface),
    direction: DVec3,
    bundle: &Bundle<Sphere>,
    kernel: Kernel<'_>,
    through: Through<'_>,
) -> (Option<Combined<C::Number, 3>>, u64) {
    let fixed = Vec3::constant(origin.value());
    let rays = bundle.points().map(|direction: DVec3| {
        let (s, t) = direction.any_orthonormal_pair();
        let tangents = [s, t].map(|v| v.to_array());
        let [x, y, z] = direction.to_array();
        let number = |k: usize, value: f64| Pair::new(value, [tangents[0][k], tangents[1][k]]);
        let along = (fixed, Vec3::new(number(0, x), number(1, y), number(2, z)));
        let moving = (origin, Vec3::constant(direction));
        (along, moving, [s, t])
    });
    let course = Course { scene, from: Some(from), through };
    combine(calculus, &course, rays, (bundle, direction), kernel)
}

/// The film point u moved by a warp.
pub(super) fn film_point<T: Number>(u: DVec2, warp: &Combined<T, 2>) -> FilmPoint<T> {
    let [x, y] = warp.value;
    FilmPoint {
        at: [T::constant(u.x) + x, T::constant(u.y) + y],
        jacobian: T::constant(1.0) + warp.divergence,
    }
}

/// A direction moved by a warp.
pub(super) fn warped<T: Number>(direction: DVec3, warp: &Combined<T, 3>) -> Warped<T> {
    let [x, y, z] = warp.value;
    Warped {
        direction: Vec3::constant(direction) + Vec3::new(x, y, z),
        jacobian: T::constant(1.0) + warp.divergence,
    }
}
