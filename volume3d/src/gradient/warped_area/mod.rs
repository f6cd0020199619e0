//! Warped-area sampling: dI/dθ = ∫ ∂f/∂θ + ∇·(V f), on the film and at every bounce.
//!
//! V moves with every edge at which the integrand jumps. Where shading normals make it jump within a face, on curves on
//! which a surface turns its other side to the viewer, V is any continuous field, and ∮ Δf (v − V)·ν over these curves
//! is added, by samples of edge sampling.

mod field;
mod job;
mod transpose;

use flatland::warp::{Debias, Warp};
use glam::DVec3;

use self::job::Job;
pub use field::Field;

use super::BASELINE;
use super::auxiliary::Construction;
use super::change::{Change, Wanted, supports_change, supports_wanted};
use super::error::GradientError;
use super::film::FilmPlane;
use super::motion::Motion;
use super::outline::SceneEdges;
use super::primal::primal;
use super::progress::Progress;
use super::result::{Gradient, GradientImage};
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Warped-area sampling (Bangaru, Li and Durand 2020) along paths.
///
/// # Heavy tails
/// In the penumbra of a small light the outlines of the light and of what hides it, which move differently, meet in every
/// direction, and ∇·V is large there. [`EdgeSampling`](super::EdgeSampling) has no such trouble. On a strip of penumbra of
/// a ball of radius 0.2 at distance 6, where the exact total is −1.76, 16 runs of 1,024 samples a pixel gave, at equal
/// time (1.1 s and 1.0 s a run on a shared machine), −1.77 ± 0.25 by this method and −1.77 ± 0.09 by edge sampling: 8
/// times the variance × time.
///
/// Debiased [auxiliary rays](Field::AuxiliaryRays) have long tails besides, whatever the kernel: a rare level counts for much
/// when it is drawn, and near a corner of a room, where shading points slide along a wall beside another, what rays
/// hit is as near as the corner and its angular velocity as large. Where
/// [`GradientImage::outlier`] tells of one sample with much of the result, take the outlines, or edge sampling.
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
    /// Samples, a pixel on average, of the curves within faces on which a surface with shading normals turns its
    /// other side: on the film, and as many seen from shading points. No field follows these jumps; what they move
    /// beyond it is a boundary term, and sampled. 0 leaves it out, which is **biased** wherever there are such
    /// curves. Scenes without shading normals cost nothing.
    pub flips: usize,
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
            warp: Warp { debias: DEBIAS, focus: FOCUS, ..Warp::default() },
            kernels: Kernels::default(),
            splitting: 8,
            fades: true,
            antithetic: false,
            flips: 4,
            warps: true,
            seed: 0,
        }
    }
}

/// Along paths the error of one sample is large beside that of its warp, and a level that is drawn rarely counts
/// for much when it is: blocks are larger, and levels rarer, than the plane's default.
const DEBIAS: Debias = Debias::Multilevel { rays: 16, first: 0.1, ratio: 0.35 };

/// How auxiliary rays crowd around what they serve. The strip along a silhouette that m rays cannot resolve narrows by
/// 2^−1/(2a) from level to level, with a the focus, and what a level counts for grows by 1/ratio. So the estimate
/// exceeds x with probability ~ x^−t, t = 1 + ln 2/(2a ln(1/ratio)): 2.1 for the plane's a = 0.3, whose variance is
/// finite on paper alone, and 2.7 for this.
const FOCUS: f64 = 0.2;

impl WarpedArea {
    /// The derivative of every pixel along a change.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without extent,
    /// `Change` if the change is of another scene, `Samples` and `Warp` for parameters out of their range, and `Stopped`.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.whole::<1, 6>(scene, change, progress)
    }

    /// The same, with interior, primary and secondary term apart.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without extent,
    /// `Change` if the change is of another scene, `Samples` and `Warp` for parameters out of their range, and `Stopped`.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.whole::<3, 15>(scene, change, progress)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every wanted parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers. (Not if auxiliary rays
    /// [adapt](flatland::warp::Adaptive): then what moves decides how many there are, and both are unbiased by
    /// themselves.)
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry is wanted before ideal mirrors or under lights without extent,
    /// `Adjoint` if the adjoint has not the film's size, `Samples` and `Warp` for parameters out of their range, and
    /// `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &[DVec3],
        wanted: &Wanted,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        self.check_reverse(scene, adjoint, wanted)?;
        let job = self.job(scene, self.construction(), wanted.is_geometric(), progress)?;
        let mut gradient = job.reverse(adjoint, wanted, progress)?;
        if self.flips > 0 && self.warps && wanted.is_geometric() {
            job.flipped().reverse(adjoint, wanted, progress, &mut gradient)?;
        }
        gradient.change.pull_normals(scene, wanted);
        Ok(gradient)
    }

    /// The area integral with all boundary terms.
    fn whole<const N: usize, const K: usize>(
        &self,
        scene: &Scene,
        change: &Change,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.check_forward(scene, change)?;
        let job = self.job(scene, self.construction(), change.is_geometric(), progress)?;
        let motion = Motion::new(scene, change);
        let mut image = job.forward::<N, K>(&motion, progress)?;
        if self.flips > 0 && self.warps && change.is_geometric() {
            job.flipped().forward(&motion, progress, &mut image)?;
        }
        Ok(image)
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
        self.check_reverse(scene, adjoint, wanted)?;
        let job = self.job(scene, construction, wanted.is_geometric(), progress)?;
        let mut gradient = job.reverse(adjoint, wanted, progress)?;
        gradient.change.pull_normals(scene, wanted);
        Ok(gradient)
    }

    fn check_forward(&self, scene: &Scene, change: &Change) -> Result<(), GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Change);
        }
        if self.warps {
            supports_change(scene, change)?;
        }
        self.check()
    }

    fn check_reverse(&self, scene: &Scene, adjoint: &[DVec3], wanted: &Wanted) -> Result<(), GradientError> {
        let (width, height) = scene.size();
        if adjoint.len() != width * height {
            return Err(GradientError::Adjoint { found: adjoint.len(), width, height });
        }
        if self.warps {
            supports_wanted(scene, wanted)?;
        }
        self.check()
    }

    fn check(&self) -> Result<(), GradientError> {
        for kappa in [self.kernels.film, self.kernels.surface, self.kernels.relative] {
            self.warp.check(kappa)?;
        }
        for samples in [self.samples, self.splitting] {
            if samples < 1 {
                return Err(GradientError::Samples { samples, least: 1 });
            }
        }
        self.field.check()?;
        Ok(())
    }

    fn job<'s>(
        &'s self,
        scene: &'s Scene,
        construction: Construction,
        geometric: bool,
        progress: &Progress,
    ) -> Result<Job<'s>, GradientError> {
        let paths = Paths::new(scene, self.kernels);
        let baseline = match self.baseline {
            0 => vec![],
            samples => primal(&paths, samples, self.seed ^ BASELINE, progress)?.pixels,
        };
        let film = FilmPlane::new(scene);
        let outlined = matches!(construction, Construction::Outlined { .. });
        let edges = (outlined && geometric && self.warps).then(|| SceneEdges::new(scene));
        Ok(Job { method: self, paths, film, baseline, construction, edges })
    }

    pub(super) fn image<const N: usize, const K: usize>(
        &self,
        scene: &Scene,
        change: &Change,
        construction: Construction,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.check_forward(scene, change)?;
        let motion = Motion::new(scene, change);
        let job = self.job(scene, construction, change.is_geometric(), progress)?;
        Ok(job.forward::<N, K>(&motion, progress)?)
    }
}
