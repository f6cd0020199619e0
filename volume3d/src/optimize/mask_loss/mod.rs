//! Mask supervision: a loss of silhouettes of an implicit surface.

mod along_ray;
mod error;
mod network;
#[cfg(test)]
mod tests;

use flatland::sdf::Jet;
use flatland::sdf::shapes::Ball;
use glam::DVec3;
use rayon::prelude::*;

pub use self::error::MaskLossError;

use self::along_ray::{Chord, Least, NotFinite, Search};
use super::taps::by_parameters;
use crate::gradient::{FilmPlane, ImplicitTangent};
use crate::scene::{ImplicitShape, Scene};

/// Mask loss of IDR (Yariv et al. 2020, equation 8) for one implicit surface φ.
///
/// A mask states for every pixel whether the object is visible in it, O_p = 1, or not, O_p = 0. With m_p the
/// least φ along the ray through the centre of the pixel p and the middle of a lens, and P the evaluated
/// pixels,
///
/// ```text
/// L = w/(α |P|) Σ_{p ∈ P, not P_in} CE(O_p, S_α(p)),   S_α(p) = 1/(1 + e^{α m_p}),
/// CE(1, S) = −ln S,   CE(0, S) = −ln (1 − S),   P_in = {p: O_p = 1 and m_p ≤ 0}.
/// ```
///
/// Pixels of P_in show the surface as they should and are left to the colour loss. Where a pixel joins them,
/// L falls by w ln 2/(α |P|), a jump that is IDR's own. Elsewhere L is as smooth as φ, except where two
/// minima along a ray are equally low. Its derivative is
///
/// ```text
/// L̇ = w/|P| Σ g_p φ̇(x_p),   g = 1/(1 + e^{−α m}) if O = 1,   g = −1/(1 + e^{α m}) if O = 0,
/// ```
///
/// x_p being the minimiser of φ: the motion of x_p itself does not matter, as φ does not change along the ray
/// there (the envelope theorem). The loss is deterministic, and no silhouette has to be sampled. But L
/// ignores colours, and depends on each ray only through the one point that is nearest to the surface or
/// deepest in it.
///
/// # Which minimum
///
/// The minimum is searched within a ball, [`region`](Self::region), among points that divide the ray's chord
/// into [`samples`](Self::samples) parts of length h; points that cannot be less, by the surface's bound B on
/// |∇φ|, are skipped. The minimum is then refined between the points on both sides of the best, until ∇φ·ω =
/// 0 to about 10⁻¹¹ of the chord. IDR takes 100 points at random and does not refine.
///
/// The result is at most B h/2 above the true minimum, and at most M h²/8 where second derivatives are
/// bounded by M. If two minima along a ray differ by less, the wrong one may be chosen, and features thinner
/// than h may be missed altogether. The bound of a [`Network`](crate::sdf::network::Network) is stated by its
/// user: where slopes are steeper, lower points may be skipped.
///
/// A ray that misses the ball counts with its point nearest to the centre, as in IDR; a surface outside of
/// the ball is not seen. The mask is that of this surface alone: other objects in the scene do not occlude
/// it.
///
/// For a [network on a grid](crate::sdf::Baked) the network itself is searched, in single precision, and no
/// point is skipped: far from the surface the grid holds distances that do not depend on the weights.
///
/// # Units
///
/// L is w times a length, in scene units; α is 1 over a length, and 1/α is how far from the silhouette a
/// pixel begins to count. [`new`](Self::new) uses the settings of IDR, in units of the ball's radius.
///
/// ```
/// # use flatland::sdf::shapes::Ball;
/// # use glam::DVec3;
/// # use volume3d::{optimize::{MaskLoss, MaskLossError}, scene::Scene};
/// /// What a step of a fit adds to the derivatives of a surface that is somewhere in the unit ball.
/// fn by_mask(scene: &Scene, mask: &[bool], step: u64, steps: u64) -> Result<Vec<f64>, MaskLossError> {
///     let region = Ball::new(DVec3::ZERO, 1.0).expect("a ball");
///     let loss = MaskLoss::new(region).sharpened(step, steps);
///     Ok(loss.of(scene, 0, mask)?.gradient.parameters)
/// }
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaskLoss {
    /// w, at least 0. IDR uses 100 in the unit ball, together with a colour loss that is the sum over
    /// channels of |I − T| with colours in [−1, 1]: six times [`Loss::L1`](super::Loss::L1) of colours in [0,
    /// 1], so that beside the latter it is 17.
    pub weight: f64,
    /// α, positive. IDR begins with 50 in the unit ball and [doubles](Self::sharpened) it five times.
    pub alpha: f64,
    /// Number of parts of a chord, at least 1. 100, as in IDR, resolve features as thick as 2 % of the ball's
    /// radius.
    pub samples: usize,
    /// Search region: a ball that contains the object and does not depend on parameters. IDR's is the unit
    /// ball.
    pub region: Ball<DVec3>,
}

/// Mask loss and its derivative.
#[derive(Clone, Debug, PartialEq)]
pub struct MaskEvaluation {
    /// L.
    pub loss: f64,
    /// The derivative of L by the surface's parameters and by its placement.
    pub gradient: ImplicitTangent,
    /// |P_in|, the number of pixels that show the surface as they should.
    pub covered: usize,
    /// The number of pixels that should show the surface, and do not.
    pub missing: usize,
    /// The number of pixels that show the surface, and should not.
    pub excess: usize,
}

impl MaskLoss {
    /// The settings of IDR within a ball of radius R: w = 100/R, α = 50/R, 100 samples.
    #[must_use]
    pub fn new(region: Ball<DVec3>) -> Self {
        let radius = region.radius();
        Self { weight: 100.0 / radius, alpha: 50.0 / radius, samples: 100, region }
    }

    /// The loss in step `step`, from 0, of `steps`: α is doubled after each eighth of the steps, five times
    /// in all, as IDR does after each 250 of 2000 epochs.
    #[must_use]
    pub fn sharpened(self, step: u64, steps: u64) -> Self {
        let eighths = (8.0 * step as f64 / steps.max(1) as f64).floor().clamp(0.0, 5.0);
        Self { alpha: self.alpha * eighths.exp2(), ..self }
    }

    /// The loss of a surface, by its index among the implicit surfaces of a scene, over all pixels of the
    /// film, row by row from the top. The camera is that of the scene. Bits do not depend on the number of
    /// threads.
    ///
    /// # Errors
    /// A [`MaskLossError`] if there is no such surface, the mask is not of the film's size, a number is out
    /// of its range, or φ is not finite.
    pub fn of(&self, scene: &Scene, surface: usize, mask: &[bool]) -> Result<MaskEvaluation, MaskLossError> {
        let pixels: Vec<usize> = (0..mask.len()).collect();
        self.of_pixels(scene, surface, mask, &pixels)
    }

    /// The loss over some pixels, by their indices row by row; |P| is their number, and a repeated pixel
    /// counts repeatedly. With [`random_pixels`](super::mask::random_pixels) loss and derivative are
    /// unbiased.
    ///
    /// # Errors
    /// As for all pixels, and if there are no pixels, or one is not on the film.
    pub fn of_pixels(
        &self,
        scene: &Scene,
        surface: usize,
        mask: &[bool],
        pixels: &[usize],
    ) -> Result<MaskEvaluation, MaskLossError> {
        self.check()?;
        let implicits = &scene.description().implicits;
        let unknown = MaskLossError::Surface { index: surface, count: implicits.len() };
        let shape = implicits.get(surface).ok_or(unknown)?;
        let (width, height) = scene.size();
        let count = width * height;
        if mask.len() != count {
            return Err(MaskLossError::Size { width, height, found: mask.len() });
        }
        if let Some(&index) = pixels.iter().find(|&&pixel| pixel >= count) {
            return Err(MaskLossError::Pixel { index, count });
        }
        if pixels.is_empty() {
            return Err(MaskLossError::NoPixels);
        }
        let (film, origin) = (FilmPlane::new(scene), scene.description().camera.origin);
        let chord = |&pixel: &usize| {
            let (x, y) = (pixel % width, pixel / width);
            let direction = film.ray(film.point(x + film.reach, y + film.reach, [0.5; 2]));
            // Pixels of P_in do not contribute.
            let enough = if mask[pixel] { 0.0 } else { f64::NEG_INFINITY };
            (Chord::new(origin, direction, &self.region), enough)
        };
        let chords: Vec<(Chord, f64)> = pixels.iter().map(chord).collect();
        let leasts: Vec<Result<Option<Least>, NotFinite>> = match shape.surface.network() {
            Some(baked) => network::leasts(shape, baked, &chords, self.samples),
            None => {
                let search = Search::new(shape, self.samples);
                chords.par_iter().map(|(chord, enough)| search.least(chord, *enough)).collect()
            }
        };
        let mut counted: Vec<(bool, Least)> = vec![];
        for (&pixel, least) in pixels.iter().zip(leasts) {
            let (x, y) = (pixel % width, pixel / width);
            let bad = |NotFinite { point, value }| MaskLossError::NotFinite { x, y, point, value };
            counted.extend(least.map_err(bad)?.map(|least| (mask[pixel], least)));
        }
        Ok(self.gathered(shape, pixels.len(), &counted))
    }

    /// The sum of all terms, in the order of pixels.
    fn gathered(&self, shape: &ImplicitShape, pixels: usize, leasts: &[(bool, Least)]) -> MaskEvaluation {
        let scale = self.weight / pixels as f64;
        let covered = pixels - leasts.len();
        let (mut loss, mut missing, mut excess) = (0.0, 0, 0);
        let mut gradient = ImplicitTangent::default();
        let mut taps = vec![];
        for &(seen, Least { point, jet }) in leasts {
            missing += usize::from(seen);
            excess += usize::from(!seen && jet.value <= 0.0);
            let sign = if seen { 1.0 } else { -1.0 };
            let (share, slope) = softplus(sign * jet.value, self.alpha);
            loss += scale * share;
            let covector = scale * sign * slope;
            if covector != 0.0 {
                // For a rigid motion with velocity u, φ̇ = −∇φ·u.
                let push = jet.gradient * covector;
                gradient.translation -= push;
                gradient.rotation -= (point - shape.placement.translation).cross(push);
                taps.push((point, Jet { value: covector, gradient: DVec3::ZERO }));
            }
        }
        gradient.parameters = by_parameters(shape, &taps);
        MaskEvaluation { loss, gradient, covered, missing, excess }
    }

    /// Checks that the settings are in their ranges.
    ///
    /// # Errors
    /// [`MaskLossError::Range`].
    pub fn check(&self) -> Result<(), MaskLossError> {
        let range = |what, value, range| Err(MaskLossError::Range { what, value, range });
        if !(self.weight.is_finite() && self.weight >= 0.0) {
            return range("weight", self.weight, "finite and at least 0");
        }
        if !(self.alpha.is_finite() && self.alpha > 0.0) {
            return range("sharpness α", self.alpha, "positive and finite");
        }
        if self.samples == 0 {
            return range("number of samples", 0.0, "at least 1");
        }
        Ok(())
    }
}

/// ln(1 + e^{αm})/α and its derivative by m, without overflow.
fn softplus(m: f64, alpha: f64) -> (f64, f64) {
    let tail = (-alpha * m.abs()).exp();
    let slope = if m >= 0.0 { 1.0 } else { tail } / (1.0 + tail);
    (m.max(0.0) + tail.ln_1p() / alpha, slope)
}
