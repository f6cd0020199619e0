//! Discontinuities within faces: curves {G = 0} of an expression G of the path's first segments (Theory 7).
//!
//! Let z be the film point and the directions of a path, and let the integrand jump by Δf where G(z; θ) = 0.
//! Along a change of variables z → z + θ V(z),
//!
//! > |∇G| (v − V·ν) = −Ġ,
//!
//! with Ġ the derivative of G along the warped path: scene, film point and directions all move. With V = 0
//! this is the boundary term of edge sampling; with V a warp field it is the residual of warped-area sampling
//! where the field does not follow the curve. One function computes G for both.

use flatland::calculus::Number;
use glam::{DVec2, DVec3};

use super::driver::{Address, Boundary, BoundarySample};
use crate::gradient::differential::Differential;
use crate::gradient::film::FilmPlane;
use crate::path::{Calculus, Frame};
use crate::scene::Surface;

/// Start of a path, over numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye<'f, T> {
    /// The film, through the sampled point of the lens.
    pub(super) film: &'f FilmPlane,
    pub(super) frame: &'f Frame<T>,
    /// Film point.
    pub(super) at: [T; 2],
    /// Whether directions are warped; otherwise they are static.
    pub(super) warps: bool,
}

impl<'f, T: Number> Eye<'f, T> {
    /// A static film point with static directions.
    pub(super) fn still(film: &'f FilmPlane, frame: &'f Frame<T>, at: DVec2) -> Self {
        Self { film, frame, at: [T::constant(at.x), T::constant(at.y)], warps: false }
    }
}

/// Integral over curves {G = 0}.
pub(super) trait Curve: Sync {
    /// A point of a curve, with a path that sees it.
    type Place;

    /// Whether there is nothing to sample.
    fn is_empty(&self) -> bool;

    /// Appends the points that one sample finds.
    fn draw(&self, address: Address, places: &mut Vec<Self::Place>);

    /// The film through the sampled point of the lens, the film point, and the surface seen there.
    fn film(&self, place: &Self::Place) -> (FilmPlane, DVec2, Surface);

    /// Δf/|∇G| divided by the density: the mean of `light` × `speed` over samples is the integral.
    fn light(&self, place: &Self::Place) -> DVec3;

    /// A number whose derivative is −Ġ.
    fn speed<C: Calculus>(
        &self,
        calculus: &mut C,
        eye: &Eye<'_, C::Number>,
        place: &Self::Place,
    ) -> C::Number;
}

impl<T: Curve> Boundary for T {
    fn is_empty(&self) -> bool {
        Curve::is_empty(self)
    }

    fn sample<C: Differential>(
        &self,
        calculus: &mut C,
        frame: &Frame<C::Number>,
        address: Address,
        found: &mut impl FnMut(&mut C, BoundarySample<C::Number>),
    ) {
        let mut places = vec![];
        self.draw(address, &mut places);
        for place in &places {
            let light = self.light(place);
            if light != DVec3::ZERO {
                let (film, at, _) = self.film(place);
                let frame = film.frame_through(calculus, frame);
                let speed = self.speed(calculus, &Eye::still(&film, &frame, at), place);
                found(calculus, BoundarySample { at, light, level: 0.0, speed });
            }
        }
    }
}
