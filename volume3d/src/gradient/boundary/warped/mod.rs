//! The curves on which a surface turns its other side, for warped-area sampling: the same samples, with the curve's
//! velocity beyond the warp's instead of all of it.
//!
//! Of the jumps within faces those are all that no field follows. The horizon of a face with shading normals is seen as
//! the edges of the face itself, which are silhouettes from within its plane, and fields follow these.

#[cfg(test)]
pub(super) mod tests;

use flatland::calculus::Number;
use flatland::random::stream;
use flatland::warp::Warp;

use super::curve::{Curve, Eye};
use super::driver::{Address, Boundary, BoundarySample};
use super::inner_sign_changes::InnerSignChanges;
use super::sign_changes::FilmSignChanges;
use super::{Moving, SIGN_CHANGE_AUXILIARY, Take, Term};
use crate::gradient::Stopped;
use crate::gradient::auxiliary::{Auxiliary, Construction};
use crate::gradient::differential::Differential;
use crate::gradient::jump_mean::SceneEdges;
use crate::gradient::motion::MovingBounds;
use crate::path::{Frame, Paths};

/// The boundary terms of sign changes along a warp.
///
/// Samples do not depend on what moves: forward and reverse mode are one linear map and its transpose.
#[derive(Debug)]
pub(in crate::gradient) struct SignChanges<'j> {
    pub(in crate::gradient) paths: &'j Paths<'j>,
    pub(in crate::gradient) warp: &'j Warp,
    pub(in crate::gradient) construction: Construction,
    pub(in crate::gradient) edges: Option<&'j SceneEdges>,
    pub(in crate::gradient) seed: u64,
}

/// One kind of curve, along the warp.
#[derive(Debug)]
struct Warped<'p, C> {
    sign_changes: &'p SignChanges<'p>,
    curve: C,
}

impl SignChanges<'_> {
    /// Hands over all there are.
    pub(in crate::gradient) fn each(&self, taker: &mut impl Take) -> Result<(), Stopped> {
        // Without shading normals there are none.
        if self.paths.scene.normals.is_empty() {
            return Ok(());
        }
        let moving = Moving::everything(self.paths.scene);
        taker.take(
            Term::Primary,
            &Warped { sign_changes: self, curve: FilmSignChanges::new(self.paths, &moving) },
        )?;
        taker.take(
            Term::Secondary,
            &Warped { sign_changes: self, curve: InnerSignChanges::new(self.paths, &moving) },
        )
    }
}

impl<C: Curve> Boundary for Warped<'_, C> {
    fn is_empty(&self) -> bool {
        Curve::is_empty(&self.curve)
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        let SignChanges { paths, warp, construction, edges, seed } = *self.sign_changes;
        Some(Auxiliary::new(paths, warp, bounds, construction, edges, stream(seed, &[SIGN_CHANGE_AUXILIARY])))
    }

    fn sample<D: Differential>(
        &self,
        calculus: &mut D,
        frame: &Frame<D::Number>,
        address: Address,
        found: &mut impl FnMut(&mut D, BoundarySample<D::Number>),
    ) {
        let mut places = vec![];
        self.curve.draw(address, &mut places);
        for place in &places {
            if let Some(rng) = calculus.rng() {
                *rng = address.stream(SIGN_CHANGE_AUXILIARY);
            }
            let (film, u, seen) = self.curve.film(place);
            let at = calculus.film_warp(&film, u, Some(seen)).at;
            let eye = Eye { film: &film, frame: &film.frame_through(calculus, frame), at, warps: true };
            let speed = self.curve.speed(calculus, &eye, place);
            if !speed.is_still() {
                found(calculus, BoundarySample { at: u, light: self.curve.light(place), speed });
            }
        }
    }
}
