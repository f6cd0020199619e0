//! Common data of boundary terms relative to a warp.

use flatland::random::stream;
use flatland::warp::Warp;

use super::SIGN_CHANGE_AUXILIARY;
use crate::gradient::auxiliary::{Auxiliary, Construction};
use crate::gradient::jump_mean::SceneEdges;
use crate::gradient::motion::MovingBounds;
use crate::path::Paths;

/// The warp relative to which boundary terms are computed.
#[derive(Debug)]
pub(in crate::gradient) struct AlongWarp<'j> {
    pub(in crate::gradient) paths: &'j Paths<'j>,
    pub(in crate::gradient) warp: &'j Warp,
    pub(in crate::gradient) construction: Construction,
    pub(in crate::gradient) edges: Option<&'j SceneEdges>,
    pub(in crate::gradient) seed: u64,
}

impl AlongWarp<'_> {
    /// Its warps, at film points in any order.
    pub(super) fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Auxiliary<'a> {
        let Self { paths, warp, construction, edges, seed } = *self;
        let rng = stream(seed, &[SIGN_CHANGE_AUXILIARY]);
        let mut auxiliary = Auxiliary::new(paths, warp, bounds, construction, edges, rng);
        auxiliary.scattered = true;
        auxiliary
    }
}
