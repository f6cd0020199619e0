//! Numbers that move with the warp of the film.

use flatland::random::Stream;
use glam::{DVec2, DVec3};

use super::film::FilmPlane;
use crate::path::{Calculus, Kernel};
use crate::scene::{Hit, Scene, Surface};

/// A point of the film u + ε V(u), and the Jacobian 1 + ε ∇·V(u) of the change of variables it belongs to.
#[derive(Clone, Copy, Debug)]
pub(super) struct FilmPoint<T> {
    pub(super) at: [T; 2],
    pub(super) jacobian: T,
}

/// The calculus of a derivative, forward or in reverse. What a sample computes is written over it once, and the two modes
/// differ in what they do with the numbers.
pub(super) trait Differential: Calculus {
    /// What the camera sees along a ray.
    fn look(&mut self, scene: &Scene, origin: DVec3, direction: DVec3) -> Option<Hit>;

    /// The warp at a point of the film, at which a surface or nothing is seen.
    fn film_warp(&mut self, film: &FilmPlane, u: DVec2, seen: Option<Surface>) -> FilmPoint<Self::Number>;

    /// Whether there may be a warp at a direction as seen from x, if x stands still.
    fn may_warp(&self, x: DVec3, direction: DVec3, kernel: &Kernel) -> bool;

    /// The random numbers of warps, if there are warps.
    fn rng(&mut self) -> Option<&mut Stream>;
}
