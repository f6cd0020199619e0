//! Warped-area sampling along paths (Bangaru, Li and Durand 2020), with any construction of the field.

use super::Method;
use super::driver::{self, Gradient, GradientImage, LinearMethod};
use super::fault::Fault;
use super::film_jumps::FilmJumps;
use super::jumps::EdgeChoice;
use super::kernels::Kernels;
use super::record::{Job, Scratch};
use super::streams::{CONTROL, Streams};
use super::sweep::Sweep;
use crate::estimator::error::EstimatorError;
use crate::plane::Filter;
use crate::random::{open01, stream};
use crate::transport::fields::Construction;
use crate::transport::{ActiveParameters, Camera, Paths, Tangent, World};
use crate::warp::{JumpMean, WarpError, Weighting};

/// A warp at every bounce: on the film, and on the circle of directions at every surface, for directions
/// sampled from the scattering function and towards emitters.
///
/// The light of each emitting segment and the light scattered towards a surface are separate integrals with
/// separate kernels. Both strategies of multiple importance sampling use the same field for the same
/// integral: their weights are then not differentiated.
///
/// The residual of a [softened](Construction::Softened) field is added by one sample of the vertices under
/// the pixel's filter and one at every surface. A path gives the light on every side of a sampled vertex on
/// which the field does not follow it.
///
/// Unbiased with [`Construction::JumpMean`], [`Construction::Softened`] and [`Construction::Harmonic`], and
/// with [`Construction::Local`] and [`Construction::Auxiliary`] if their warp is debiased and boundary-aware
/// with pγ ≥ 1.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WarpedArea {
    /// Paths per pixel.
    pub samples: usize,
    /// Termination of paths.
    pub paths: Paths,
    /// Construction of the warp field.
    pub construction: Construction,
    /// The concentrations of the auxiliary kernels.
    pub kernels: Kernels,
    /// A deliberate mistake, for tests that must detect it.
    pub fault: Option<Fault>,
    /// Random seed.
    pub seed: u64,
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self {
            samples: 64,
            paths: Paths::default(),
            construction: Construction::default(),
            kernels: Kernels::default(),
            fault: None,
            seed: 0,
        }
    }
}

impl Method for WarpedArea {
    fn name(&self) -> &'static str {
        match self.construction {
            Construction::Auxiliary(w) | Construction::Local(w) if w.weighting == Weighting::Gaussian => {
                "Gaussian field"
            }
            Construction::Auxiliary(_) | Construction::Local(_) => "warped area",
            Construction::JumpMean { .. } => "mean over jumps",
            Construction::Softened { .. } => "softened mean over jumps",
            Construction::Harmonic => "harmonic field",
            Construction::Direct => "direct field",
            Construction::Followed { .. } => "rotation",
            Construction::Still => "interior only",
        }
    }

    fn forward(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<GradientImage, EstimatorError> {
        driver::forward(self, world, camera, change)
    }

    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, EstimatorError> {
        driver::reverse(self, world, camera, adjoint)
    }
}

/// A pixel, with its mean radiance as control variate: ∫ ∇·(V h) du = 0.
pub(super) struct Pixel {
    index: usize,
    control: f64,
    /// Discontinuities with a residual.
    jumps: FilmJumps,
}

/// Fixed film points of the control variate.
const CONTROLS: usize = 8;

impl LinearMethod for WarpedArea {
    type Pixel = Pixel;

    fn check(&self) -> Result<(), EstimatorError> {
        let Kernels { film, surface, relative } = self.kernels;
        if !(relative > 0.0 && relative <= 1e6) {
            return Err(EstimatorError::RelativeWidth { relative });
        }
        for kappa in [film, surface] {
            match &self.construction {
                Construction::Auxiliary(warp) | Construction::Local(warp) => warp.check(kappa)?,
                Construction::Followed { candidates: 0 } => return Err(EstimatorError::NoCandidates),
                _ if !(kappa > 0.0 && kappa.is_finite()) => return Err(WarpError::Kappa { kappa }.into()),
                Construction::Softened { softness, .. } if softness.is_nan() || *softness < 0.0 => {
                    return Err(EstimatorError::Softness { softness: *softness });
                }
                Construction::JumpMean { reach } | Construction::Softened { reach, .. } => {
                    JumpMean { reach: reach / kappa.sqrt() }.check()?;
                }
                _ => {}
            }
        }
        Ok(())
    }

    fn job<'a>(&self, world: &'a World, camera: &'a Camera, active: ActiveParameters) -> Job<'a> {
        let Self { samples, paths, construction, kernels, fault, seed } = *self;
        let leaves = matches!(construction, Construction::Softened { softness, .. } if softness > 0.0);
        let edges = (leaves && fault != Some(Fault::NoResidual)).then(EdgeChoice::default);
        Job { world, camera, active, samples, seed, paths, construction, kernels, edges, fault }
    }

    fn pixel(&self, job: &Job<'_>, pixel: usize) -> Pixel {
        let film = job.camera.film;
        let mut sum = 0.0;
        if job.active.geometry {
            for i in 0..CONTROLS {
                // Any constant independent of the samples is valid.
                let mut rng = stream(job.seed, &[pixel as u64, i as u64, CONTROL]);
                let offset = (i as f64 + 0.5) / CONTROLS as f64 - 0.5;
                let u = film.centre(pixel) + film.filter.radius() * offset;
                sum += job.paths.film_radiance(job.world, job.camera, u, &mut rng).0;
            }
        }
        Pixel { index: pixel, control: sum / CONTROLS as f64, jumps: FilmJumps::new(job, pixel) }
    }

    fn sample(&self, job: &Job<'_>, pixel: &Pixel, streams: &mut Streams, scratch: &mut Scratch) -> u64 {
        let mut sweep = Sweep::sample(job, pixel.index, pixel.control, streams, scratch);
        if job.active.geometry && job.camera.film.filter == Filter::Box {
            pixel_end(&mut sweep, pixel);
        }
        pixel.jumps.emit(&mut sweep, pixel.control);
        sweep.rays
    }
}

/// Subtracts the flux f V through one end of the pixel, chosen at random, as the box filter is discontinuous
/// at its static ends (Bangaru et al. 2022).
fn pixel_end(sweep: &mut Sweep<'_, '_>, pixel: &Pixel) {
    let Job { world, camera, paths, .. } = *sweep.job;
    let rng = &mut sweep.streams.pixel_end;
    let outward = if open01(rng) < 0.5 { -1.0 } else { 1.0 };
    // Randomly on both sides of a discontinuity there.
    let beside = camera.film.border() * (2.0 * open01(rng) - 1.0);
    let u = camera.film.centre(pixel.index) + 0.5 * outward + beside;
    let (value, rays) = paths.film_radiance(world, camera, u, rng);
    sweep.rays += rays;
    sweep.film_field(u, -2.0 * outward * (value - pixel.control), 0.0);
}
