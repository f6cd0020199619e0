//! An independent reference for the pixels of a flat world and their derivatives.
//!
//! A pixel is ∫ h(u) L(u) du, and the light L that a surface reflects is an integral over directions. Each is
//! split wherever the visible line changes, and every piece is mapped to the fixed interval 0 ≤ ξ ≤ 1:
//! u = u₀ + ξ(u₁ − u₀), where u₀ and u₁ are dual numbers [`num_dual::Dual64`] that move with the vertices.
//! The derivative of the integral is then the integral of the derivative, without any boundary term. Within a
//! piece the integrand is continuous; it has kinks where the visible surface sees two vertices in one
//! direction, and there the quadrature splits ξ.
//!
//! The last integral over directions, of light of constant radiance, is taken in closed form; all others by
//! adaptive Gauss–Kronrod quadrature. Visibility is decided by brute force: from every point, in the middle
//! between the directions of neighbouring vertices, against every line. Only a world's data come from
//! flatland.

mod adaptive;
mod events;
mod film;
mod lobe;
mod place;
mod reflection;
mod scene;
mod term;

use flatland::transport::{Camera, Tangent, World};

use adaptive::Precision;
use events::Events;
use reflection::Reflection;
use scene::Scene;

/// A pixel and its derivative.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct PixelOracle {
    /// I = ∫ h L du.
    pub value: f64,
    /// dI/dθ.
    pub derivative: f64,
    /// The sum of the absolute values of the terms that `derivative` sums: the scale that rounding
    /// is measured against.
    pub absolute: f64,
    /// The estimated error of quadrature of the derivative, far below rounding for up to one scattering
    /// event.
    pub error: f64,
}

/// Tolerated difference between the two rules of a piece for up to one scattering event, and the maximum
/// number of halvings of a piece: a kink that is not a known event costs that many pieces.
const SINGLE: Precision = Precision { relative: 1e-10, halvings: 50, pieces: 10_000 };
/// The precision over the film for more scattering events, where the integrand is itself an integral.
const MULTIPLE: Precision = Precision { relative: 3e-7, halvings: 20, pieces: 2000 };
/// The precision over directions from the second event on: its errors must not disturb those over the film.
const INNER: Precision = Precision { relative: 1e-8, halvings: 30, pieces: 500 };

/// All pixels of a world whose parameters change with `change`, of light scattered at most `bounces` times.
///
/// The time is proportional to N² visibility tests per node, for N lines. The number of nodes grows a few
/// hundred times with each scattering event after the first: three events are too many.
pub fn image(world: &World, camera: &Camera, change: &Tangent, bounces: usize) -> Vec<PixelOracle> {
    change.check(world).expect("the change fits its world");
    let scene = Scene::new(world, camera, change);
    let events = if bounces == 0 { Events::none(&scene) } else { Events::new(&scene) };
    let reflection = Reflection { scene, events, inner: INNER };
    let precision = if bounces < 2 { SINGLE } else { MULTIPLE };
    let pixels = film::image(&reflection, &camera.film, bounces, precision);
    pixels
        .into_iter()
        .map(|term| PixelOracle {
            value: term.value.re,
            derivative: term.value.eps,
            absolute: term.absolute,
            error: term.error,
        })
        .collect()
}

#[cfg(test)]
mod tests;
