//! The curves on which a surface turns its other side, for warped-area sampling: the same samples, with the curve's
//! velocity beyond the warp's instead of all of it.
//!
//! Of the jumps within faces those are all that no field follows. The horizon of a face with shading normals is seen as
//! the edges of the face itself, which are silhouettes from within its plane, and fields follow these.

#[cfg(test)]
pub(super) mod tests;

use flatland::warp::Warp;
use glam::DVec3;

use super::curve::{Curve, Eye};
use super::driver::{Address, BoundarySample, Driver, Estimate, Splats};
use super::inner_sign_changes::InnerFlips;
use super::sign_changes::Flips;
use super::{FLIP_AUXILIARY, Moving, add};
use crate::calculus::{Number, Tape};
use crate::gradient::accumulator::Accumulator;
use crate::gradient::auxiliary::{Auxiliary, Construction, MovingBounds};
use crate::gradient::forward::Forward;
use crate::gradient::motion::Motion;
use crate::gradient::reverse::{Inputs, Reverse};
use crate::gradient::silhouette_mean::SceneEdges;
use crate::gradient::{ActiveParameters, Gradient, GradientImage, Progress, Stopped};
use crate::path::Paths;

/// The boundary terms of sign changes along a warp.
///
/// Samples do not depend on what moves: forward and reverse mode are one linear map and its transpose.
#[derive(Debug)]
pub(in crate::gradient) struct SignChanges<'j> {
    pub(in crate::gradient) paths: &'j Paths<'j>,
    pub(in crate::gradient) warp: &'j Warp,
    pub(in crate::gradient) construction: Construction,
    pub(in crate::gradient) edges: Option<&'j SceneEdges>,
    /// Samples of each kind of curve, a pixel on average.
    pub(in crate::gradient) samples: usize,
    pub(in crate::gradient) seed: u64,
}

/// One kind of curve, and the driver of its samples.
struct Part<'p, C> {
    sign_changes: &'p SignChanges<'p>,
    driver: Driver<'p>,
    curve: &'p C,
}

impl SignChanges<'_> {
    /// Adds the terms to a gradient image.
    pub(in crate::gradient) fn forward(
        &self,
        motion: &Motion<'_>,
        progress: &Progress,
        image: &mut GradientImage,
    ) -> Result<(), Stopped> {
        if self.is_empty() {
            return Ok(());
        }
        let moving = Moving::everything(self.paths.scene);
        let mut terms = image.terms.take();
        let sign_changes = Flips::new(self.paths, &moving);
        if !Curve::is_empty(&sign_changes) {
            let estimate = self.part(&sign_changes).forward(motion, progress)?;
            add(image, terms.as_mut().map(|t| &mut t.primary), estimate);
        }
        let sign_changes = InnerFlips::new(self.paths, &moving);
        if !Curve::is_empty(&sign_changes) {
            let estimate = self.part(&sign_changes).forward(motion, progress)?;
            add(image, terms.as_mut().map(|t| &mut t.secondary), estimate);
        }
        image.terms = terms;
        Ok(())
    }

    /// Adds their transpose to a gradient, whose computed normals are yet to be pulled back.
    pub(in crate::gradient) fn reverse(
        &self,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
        gradient: &mut Gradient,
    ) -> Result<(), Stopped> {
        if self.is_empty() {
            return Ok(());
        }
        let moving = Moving::everything(self.paths.scene);
        let sign_changes = Flips::new(self.paths, &moving);
        if !Curve::is_empty(&sign_changes) {
            self.part(&sign_changes).reverse(adjoint, active, progress, gradient)?;
        }
        let sign_changes = InnerFlips::new(self.paths, &moving);
        if !Curve::is_empty(&sign_changes) {
            self.part(&sign_changes).reverse(adjoint, active, progress, gradient)?;
        }
        Ok(())
    }

    /// Whether nothing has shading normals.
    fn is_empty(&self) -> bool {
        self.paths.scene.normals.is_empty()
    }

    fn part<'p, C: Curve>(&'p self, curve: &'p C) -> Part<'p, C> {
        let scene = self.paths.scene;
        let (width, height) = scene.size();
        Part {
            sign_changes: self,
            driver: Driver::new(scene, self.seed, self.samples * width * height),
            curve,
        }
    }

    fn auxiliary<'a>(&'a self, bounds: &'a MovingBounds, address: Address) -> Auxiliary<'a> {
        let rng = address.stream(FLIP_AUXILIARY);
        Auxiliary::new(self.paths, self.warp, bounds, self.construction, self.edges, rng)
    }

    /// κ on the film.
    fn kappa(&self) -> f64 {
        self.paths.kernels.film
    }
}

impl<C: Curve> Part<'_, C> {
    fn forward(&self, motion: &Motion<'_>, progress: &Progress) -> Result<Estimate, Stopped> {
        self.driver.estimate(progress, |group, chunk| self.forward_chunk(motion, group, chunk, progress))
    }

    fn forward_chunk(&self, motion: &Motion<'_>, group: usize, chunk: usize, progress: &Progress) -> Splats {
        let Self { sign_changes, driver, curve } = self;
        let scene = driver.scene;
        let (mut splats, mut places) = (Splats::default(), vec![]);
        let mut forward = Forward::<1> { scene, motion, auxiliary: None };
        let frame = &forward.frame(&driver.film);
        for address in driver.addresses(group, chunk) {
            if progress.stopped() {
                break;
            }
            places.clear();
            curve.draw(address, &mut places);
            for place in &places {
                forward.auxiliary = Some(sign_changes.auxiliary(&motion.bounds, address));
                let (u, seen) = curve.film(place);
                let (at, _) = forward.film_warp(&driver.film, u, sign_changes.kappa(), Some(seen));
                let speed = curve.speed(&mut forward, &Eye { frame, at, warps: true }, place);
                splats.rays += forward.auxiliary.as_ref().map_or(0, |a| a.rays);
                if !speed.is_still() {
                    let amount = curve.light(place) * speed.tangent[0];
                    driver.splat_into(&mut splats, u, address, amount);
                }
            }
        }
        splats
    }

    fn reverse(
        &self,
        adjoint: &[DVec3],
        active: &ActiveParameters,
        progress: &Progress,
        gradient: &mut Gradient,
    ) -> Result<(), Stopped> {
        let scene = self.driver.scene;
        let inputs = Inputs::new(scene, active);
        let bounds = MovingBounds::new(scene, &active.shapes);
        self.driver.collect(progress, gradient, |group, chunk| {
            self.reverse_chunk(adjoint, (&inputs, &bounds), group, chunk, progress)
        })
    }

    fn reverse_chunk(
        &self,
        adjoint: &[DVec3],
        (inputs, bounds): (&Inputs, &MovingBounds),
        group: usize,
        chunk: usize,
        progress: &Progress,
    ) -> Gradient {
        let Self { sign_changes, driver, curve } = self;
        let scene = driver.scene;
        let mut part = Accumulator::new(scene);
        let (mut tape, mut adjoints, mut places) = (Tape::new(), vec![], vec![]);
        for address in driver.addresses(group, chunk) {
            if progress.stopped() {
                break;
            }
            places.clear();
            curve.draw(address, &mut places);
            for place in &places {
                tape.clear();
                let auxiliary = sign_changes.auxiliary(bounds, address);
                let mut reverse = Reverse::new(scene, inputs, &tape, Some(auxiliary), driver.film);
                let frame = &reverse.frame();
                let (u, seen) = curve.film(place);
                let (at, _) = reverse.film_warp(u, sign_changes.kappa(), Some(seen));
                let speed = curve.speed(&mut reverse, &Eye { frame, at, warps: true }, place);
                if !speed.is_still() {
                    let crossing = BoundarySample { at: u, light: curve.light(place), speed };
                    let weights = (adjoint, driver.scale());
                    driver.pull(&mut reverse, &crossing, weights, address, &mut adjoints, &mut part);
                }
            }
        }
        part.gradient
    }
}
