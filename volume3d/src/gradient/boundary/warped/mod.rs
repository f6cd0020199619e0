//! Boundary terms relative to a warp: curves with v − V in place of v.
//!
//! Curves on which a surface turns its other side are the discontinuities within faces that no field follows;
//! the residual of silhouettes and shadows of a [softened](super::residual) field is added to them. If
//! shadows are not sampled, the horizon of a face with shading normals consists of the face's own edges,
//! which are silhouettes seen from within its plane and are followed by the field.

#[cfg(test)]
pub(super) mod tests;

use flatland::calculus::Number;

use super::along_warp::AlongWarp;
use super::curve::{Curve, Eye};
use super::driver::{Address, Boundary, BoundarySample};
use super::emitters::{Emitters, Of};
use super::horizon::{Beyond, Horizon};
use super::inner_sign_changes::InnerSignChanges;
use super::list::EdgeList;
use super::primary::{Lines, Primary};
use super::residual::{Bounces, Outlines, Shadows, Silhouettes};
use super::secondary::{Light, Secondary};
use super::sign_changes::FilmSignChanges;
use super::{Moving, SIGN_CHANGE_AUXILIARY, Take, Term};
use crate::gradient::Stopped;
use crate::gradient::auxiliary::{Auxiliary, Construction};
use crate::gradient::differential::Differential;
use crate::gradient::motion::MovingBounds;
use crate::path::Frame;

/// One kind of curve, relative to the warp.
#[derive(Debug)]
struct Warped<'p, C> {
    warp: &'p AlongWarp<'p>,
    curve: C,
}

impl AlongWarp<'_> {
    /// Passes on the residual of silhouettes on the film, if the field is softened, and of shadows, if they
    /// are sampled.
    pub(in crate::gradient) fn residual(
        &self,
        moving: &Moving,
        taker: &mut impl Take,
    ) -> Result<(), Stopped> {
        let Construction::JumpMean { softness, lobe_softness, sampled_shadows, .. } = self.construction
        else {
            return Ok(());
        };
        if !(softness > 0.0 || lobe_softness > 0.0 || sampled_shadows) || !moving.anything() {
            return Ok(());
        }
        let list = &*self.paths.scene.derived(EdgeList::new);
        if let Some(edges) = self.edges
            && softness > 0.0
        {
            let edges = Primary::new(self.paths, list, moving, Lines::Left { edges, softness });
            taker.take(Term::Primary, &Silhouettes { warp: self, edges })?;
        }
        if lobe_softness > 0.0 {
            let edges = Secondary::new(self.paths, list, moving, Light::Bounces);
            taker.take(Term::Bounce, &Bounces { warp: self, edges })?;
        }
        if sampled_shadows {
            let edges = Secondary::new(self.paths, list, moving, Light::Shadows);
            taker.take(Term::Secondary, &Shadows { warp: self, edges })?;
            let edges = Emitters::new(self.paths, list, moving, Of::Curved, usize::MAX);
            taker.take(Term::Secondary, &Outlines { warp: self, edges })?;
            // The horizon of a face does not change as a point slides over the face.
            taker.take(Term::Secondary, &Horizon::new(self.paths, moving, Beyond::Lights))?;
        }
        Ok(())
    }

    /// Passes on all curves on which a surface turns its other side.
    ///
    /// Samples do not depend on what moves: forward and reverse mode are a linear map and its transpose.
    pub(in crate::gradient) fn sign_changes(&self, taker: &mut impl Take) -> Result<(), Stopped> {
        // There are none without shading normals.
        if self.paths.scene.normals.is_empty() {
            return Ok(());
        }
        let moving = Moving::everything(self.paths.scene);
        taker
            .take(Term::Primary, &Warped { warp: self, curve: FilmSignChanges::new(self.paths, &moving) })?;
        taker.take(Term::Secondary, &Warped { warp: self, curve: InnerSignChanges::new(self.paths, &moving) })
    }
}

impl<C: Curve> Boundary for Warped<'_, C> {
    fn is_empty(&self) -> bool {
        Curve::is_empty(&self.curve)
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds) -> Option<Auxiliary<'a>> {
        Some(self.warp.auxiliary(bounds))
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
                found(calculus, BoundarySample { at: u, light: self.curve.light(place), level: 0.0, speed });
            }
        }
    }
}
