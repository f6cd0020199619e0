//! Warped-area sampling: dI/dθ = ∫ ∂f/∂θ + ∇·(V f), on the film and at every bounce.

mod field;
mod job;
mod transpose;

use flatland::warp::{Debias, Warp};
use glam::DVec3;
use rayon::prelude::*;

use self::job::Job;
pub use field::Field;

use super::BASELINE;
use super::auxiliary::{Construction, MovingBounds};
use super::change::{Change, Wanted, supported};
use super::driver::{CellSink, over_film, waves};
use super::error::GradientError;
use super::film::FilmPlane;
use super::forward::Forward;
use super::motion::Motion;
use super::outline::Tree;
use super::primal::primal;
use super::progress::{Progress, Stopped};
use super::result::{Gradient, GradientImage, Image, finish};
use super::reverse::Inputs;
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Warped-area sampling (Bangaru, Li and Durand 2020) along paths.
#[derive(Clone, Debug)]
pub struct WarpedArea {
    /// Samples a pixel.
    pub samples: usize,
    /// Samples a pixel of the image that is subtracted as a control variate: ∫ ∇·(h V) du = 0, so radiance may
    /// be counted from any level that does not depend on the samples. 0 subtracts nothing.
    pub baseline: usize,
    /// What velocities its field is made of.
    pub field: Field,
    /// Auxiliary rays and their weights, on the film and on directions alike, for [`Field::AuxiliaryRays`].
    pub warp: Warp,
    /// The concentrations of auxiliary rays, and with them the reach of outlines on directions.
    pub kernels: Kernels,
    /// How many paths, at least one, tell the radiance that the film's warp carries from one pixel to another, where
    /// it does. Only the first of them carries derivatives.
    pub splitting: usize,
    /// Whether velocities of auxiliary rays on directions fade away from jumps, V_i (1 − B_i).
    pub fades: bool,
    /// Whether every film sample has a partner reflected through its cell's centre, with the same path numbers: the
    /// primary antithetic samples of Bangaru et al. (2020, section 5.2), which cost as much again. As cells share
    /// their numbers, partners are reflected through the centres of all pixels at once, and a gradient of the filter
    /// that is odd cancels the noise they share.
    pub antithetic: bool,
    /// False leaves out the warp, and with it primary and secondary term: the interior term alone.
    pub warps: bool,
    /// The seed of everything random.
    pub seed: u64,
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self {
            samples: 16,
            baseline: 4,
            field: Field::default(),
            warp: Warp { debias: DEBIAS, ..Warp::default() },
            kernels: Kernels::default(),
            splitting: 4,
            fades: true,
            antithetic: false,
            warps: true,
            seed: 0,
        }
    }
}

/// Along paths the error of one sample is large beside that of its warp, and a level that is drawn rarely counts
/// for much when it is: blocks are larger, and levels rarer, than the plane's default.
const DEBIAS: Debias = Debias::Multilevel { rays: 16, first: 0.1, ratio: 0.35 };

impl WarpedArea {
    /// The derivative of every pixel along a change.
    ///
    /// # Errors
    /// [`GradientError`], for what cannot be differentiated and bad parameters.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<1, 6>(scene, change, self.construction(), progress)
    }

    /// The same, with interior, primary and secondary term apart.
    ///
    /// # Errors
    /// [`GradientError`], for what cannot be differentiated and bad parameters.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<3, 15>(scene, change, self.construction(), progress)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every wanted parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers.
    ///
    /// # Errors
    /// [`GradientError`], for what cannot be differentiated and bad parameters.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &[DVec3],
        wanted: &Wanted,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        self.pull(scene, adjoint, wanted, self.construction(), progress)
    }

    fn construction(&self) -> Construction {
        match self.field {
            Field::Outlines { film, lobe } => Construction::Outlined { film, lobe },
            Field::AuxiliaryRays => Construction::Weighted { fades: self.fades },
        }
    }

    pub(super) fn pull(
        &self,
        scene: &Scene,
        adjoint: &[DVec3],
        wanted: &Wanted,
        construction: Construction,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        let (width, height) = scene.size();
        if adjoint.len() != width * height {
            return Err(GradientError::Adjoint { found: adjoint.len(), width, height });
        }
        self.check(scene, wanted.is_geometric(), 1)?;
        let job = self.job(scene, construction, progress)?;
        let inputs = Inputs::new(scene, wanted);
        let bounds = MovingBounds::new(scene, &wanted.shapes);
        let rows = job.rows();
        progress.start(rows);
        let (mut change, mut non_finite) = (Change::still(scene), vec![]);
        for wave in waves(rows) {
            let parts: Vec<Gradient> = wave
                .into_par_iter()
                .map(|j| {
                    let part = job.reverse_row(j, adjoint, &inputs, &bounds, progress);
                    progress.advance();
                    part
                })
                .collect();
            if progress.stopped() {
                return Err(Stopped.into());
            }
            for part in parts {
                change.add(&part.change);
                non_finite.extend(part.non_finite);
            }
        }
        change.pull_normals(scene, wanted);
        Ok(Gradient { change, non_finite })
    }

    fn check(&self, scene: &Scene, geometric: bool, least: usize) -> Result<(), GradientError> {
        if geometric && self.warps {
            supported(scene)?;
        }
        for kappa in [self.kernels.film, self.kernels.surface, self.kernels.relative] {
            self.warp.check(kappa)?;
        }
        for samples in [self.samples, self.splitting] {
            if samples < least {
                return Err(GradientError::Samples { samples, least });
            }
        }
        self.field.check()?;
        Ok(())
    }

    fn job<'s>(
        &'s self,
        scene: &'s Scene,
        construction: Construction,
        progress: &Progress,
    ) -> Result<Job<'s>, GradientError> {
        let paths = Paths::new(scene, self.kernels);
        let (width, height) = scene.size();
        let baseline = match self.baseline {
            0 => Image { width, height, pixels: vec![], standard_error: vec![], non_finite: vec![] },
            samples => primal(&paths, samples, self.seed ^ BASELINE, progress)?,
        };
        let film = FilmPlane::new(scene);
        let outlined = matches!(construction, Construction::Outlined { .. });
        let edges = outlined.then(|| Tree::new(scene));
        Ok(Job { method: self, paths, film, baseline, construction, edges })
    }

    pub(super) fn image<const N: usize, const K: usize>(
        &self,
        scene: &Scene,
        change: &Change,
        construction: Construction,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Change);
        }
        self.check(scene, change.is_geometric(), 1)?;
        let job = self.job(scene, construction, progress)?;
        let motion = Motion::new(scene, change);
        let begin = || {
            let auxiliary = job.auxiliary(&motion.bounds);
            Forward::<N> { scene, motion: &motion, auxiliary }
        };
        let cell = |forward: &mut Forward<'_, N>, place, sink: CellSink<'_, K>| {
            job.forward_cell(forward, place, sink);
        };
        let rays = |forward: &Forward<'_, N>| forward.auxiliary.as_ref().map_or(0, |a| a.rays);
        let sums = over_film(&job.film, self.samples, progress, begin, cell, rays)?;
        Ok(finish::<N, K>(&job.film, sums))
    }
}
