//! The field V, as curves need it: zero, or a warp.

use std::fmt::Debug;

use flatland::random::stream;
use flatland::warp::Warp;

use super::address::WARPS;
use crate::gradient::auxiliary::{Auxiliary, Construction};
use crate::gradient::film::FilmPlane;
use crate::gradient::warp::jump_mean::SceneEdges;
use crate::gradient::warp::motion::MovingBounds;
use crate::path::Paths;

/// The field V relative to which curves move.
pub(in crate::gradient) trait WarpField: Copy + Debug + Sync {
    /// Whether V = 0 everywhere: then both sides of a curve have one speed, nothing is computed for V, and
    /// curves that rest are not sampled.
    const IS_ZERO: bool;

    /// Its warps, at film points in any order; `None` for V = 0.
    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>>;

    /// Softness, in radians, with which V follows the border of a triangle's face on the film; 0 unless the
    /// field is softened and the face narrow.
    fn border_softness(&self, film: &FilmPlane, triangle: u32) -> f64;

    /// Whether chains of ideal boundaries, and lights without extent, have fields of their own, so that
    /// curves of this one are only of the light that their first point scatters.
    fn splits(&self) -> bool {
        false
    }
}

/// V = 0: edge sampling.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Zero;

impl WarpField for Zero {
    const IS_ZERO: bool = true;

    fn auxiliary<'a>(&'a self, _: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        None
    }

    fn border_softness(&self, _: &FilmPlane, _: u32) -> f64 {
        0.0
    }
}

/// The field of warped-area sampling.
#[derive(Clone, Copy, Debug)]
pub(in crate::gradient) struct Warping<'j> {
    pub(in crate::gradient) paths: &'j Paths<'j>,
    pub(in crate::gradient) warp: &'j Warp,
    pub(in crate::gradient) construction: Construction,
    pub(in crate::gradient) edges: Option<&'j SceneEdges>,
    pub(in crate::gradient) seed: u64,
    pub(in crate::gradient) splits: bool,
}

impl WarpField for Warping<'_> {
    const IS_ZERO: bool = false;

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        let Self { paths, warp, construction, edges, seed, .. } = *self;
        let rng = stream(seed, &[WARPS]);
        let mut auxiliary = Auxiliary::new(paths, warp, bounds, construction, edges, rng);
        auxiliary.scattered = true;
        Some(auxiliary)
    }

    fn border_softness(&self, film: &FilmPlane, triangle: u32) -> f64 {
        let (Construction::JumpMean { softness, .. }, Some(edges)) = (self.construction, self.edges) else {
            return 0.0;
        };
        edges.border_softness(triangle, film.still.origin.value(), softness * film.pixel_angle())
    }

    fn splits(&self) -> bool {
        self.splits
    }
}
