//! Jumps within faces: curves {G = 0} of an expression G of the path's first segments (Theory 7).
//!
//! Let z be the film point and the directions of a path, and let the integrand jump by Δf where G(z; θ) = 0.
//! Along a change of variables z → z + θ V(z),
//!
//! > |∇G| (v − V·ν) = −Ġ,
//!
//! Ġ being the derivative of G along the warped path: all that is seen, the film point and the directions moves. With
//! V = 0 this is edge sampling's boundary term; with V a warp field's it is what warped-area sampling misses where the
//! field does not follow the curve. One function computes G for both.

use flatland::calculus::Number;
use glam::{DVec2, DVec3};

use super::driver::{Address, Boundary, BoundarySample};
use crate::gradient::differential::Differential;
use crate::gradient::film::FilmPlane;
use crate::path::{Calculus, Frame};
use crate::scene::Surface;

/// Where a path begins, in numbers.
#[derive(Clone, Copy, Debug)]
pub(super) struct Eye<'f, T> {
    /// The film, through the point of the lens that is looked through.
    pub(super) film: &'f FilmPlane,
    pub(super) frame: &'f Frame<T>,
    /// The film point.
    pub(super) at: [T; 2],
    /// Whether directions are warped; if not they stand still.
    pub(super) warps: bool,
}

impl<'f, T: Number> Eye<'f, T> {
    /// At a film point that stands still, as all directions do.
    pub(super) fn still(film: &'f FilmPlane, frame: &'f Frame<T>, at: DVec2) -> Self {
        Self { film, frame, at: [T::constant(at.x), T::constant(at.y)], warps: false }
    }
}

/// An integral over such curves.
pub(super) trait Curve: Sync {
    /// A point of a curve with a path that sees it.
    type Place;

    /// Whether there is nothing to sample.
    fn is_empty(&self) -> bool;

    /// Adds the places one sample finds.
    fn draw(&self, address: Address, places: &mut Vec<Self::Place>);

    /// The film, through the point of the lens that is looked through, the film point, and the surface seen there.
    fn film(&self, place: &Self::Place) -> (FilmPlane, DVec2, Surface);

    /// Δf/|∇G| over the density, such that the mean of light times speed over samples is the integral.
    fn light(&self, place: &Self::Place) -> DVec3;

    /// −G.
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
