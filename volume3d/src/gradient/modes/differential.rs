//! Number types that carry derivatives, warps included.

use flatland::random::Stream;
use glam::{DVec2, DVec3};

use crate::gradient::chain::Through;
use crate::gradient::film::{FilmPlane, FilmPoint};
use crate::path::{Calculus, Frame, Kernel};
use crate::scene::{Hit, Scene, Surface};

/// Number type of derivatives, forward or reverse. A sample's computation is written once over this trait.
pub(in crate::gradient) trait Differential: Calculus {
    /// First hit of a camera ray.
    fn look(&mut self, scene: &Scene, origin: DVec3, direction: DVec3) -> Option<Hit>;

    /// The warp at a film point, given the surface seen there, if any.
    fn film_warp(&mut self, film: &FilmPlane, u: DVec2, seen: Option<Surface>) -> FilmPoint<Self::Number>;

    /// The film point warped for light through a chain, seen from a camera frame; `None` if it is the same
    /// for all light.
    fn chain_film_warp(
        &mut self,
        film: &FilmPlane,
        frame: &Frame<Self::Number>,
        u: DVec2,
        through: Through<'_>,
    ) -> Option<FilmPoint<Self::Number>>;

    /// Whether the warp may be nonzero at a direction seen from a static point x.
    fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool;

    /// Random numbers of warps; `None` without warps.
    fn rng(&mut self) -> Option<&mut Stream>;
}
