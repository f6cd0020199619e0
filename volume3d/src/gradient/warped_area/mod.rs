//! Warped-area sampling: dI/dθ = ∫ ∂f/∂θ + ∇·(V f), on the film and at every bounce.
//!
//! V moves with every edge at which the integrand jumps, but for the borders of flat emitters, which are sampled with
//! the speed that V leaves them. Where shading normals make it jump within a face, on curves on
//! which a surface turns its other side to the viewer, V is any continuous field, and ∮ Δf (v − V)·ν over these curves
//! is added, by samples of edge sampling.

mod camera_rays;
mod field;
mod forward;
mod job;
mod others;
mod reverse;
mod shadows;

use self::job::Job;
pub use field::Field;
use std::sync::Arc;

use flatland::warp::{Debias, Warp};
use glam::DVec3;

use super::CONTROL_VARIATE;
use super::accumulator::Sums;
use super::allocation::Allocation;
use super::auxiliary::Construction;
use super::boundary::{Effort, Gradients, Images, Moving};
use super::error::GradientError;
use super::film::FilmPlane;
use super::implicit_field::ImplicitField;
use super::jump_mean::SceneEdges;
use super::motion::Motion;
use super::primal::primal;
use super::progress::Progress;
use super::result::{Gradient, GradientImage};
use super::tangent::{ActiveParameters, Tangent};
use super::unsupported::{
    left_out_of_active, left_out_of_tangent, supports_field_of_view, supports_meshes_only, supports_no_media,
};
use crate::Image;
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Warped-area sampling (Bangaru, Li and Durand 2020) along paths.
///
/// Two fields are to be touched: [`samples`](Self::samples), 4 to 16 for a step of a fit and 64 or more for a gradient
/// image to look at, and [`seed`](Self::seed), another one for every step. The defaults of all others are unbiased; the
/// [guide](crate::guide::methods) says when another [`field`](Self::field), or another method, is better.
///
/// ```
/// # use volume3d::gradient::WarpedArea;
/// let step = 7;
/// let method = WarpedArea { samples: 16, seed: step, ..WarpedArea::default() };
/// ```
///
/// # Heavy tails
/// In the penumbra of a small light the silhouettes of the light and of what hides it, which move differently, meet in every
/// direction, and ∇·V is large there. [`EdgeSampling`](super::EdgeSampling) has no such trouble. On a strip of penumbra of
/// a ball of radius 0.2 at distance 6, where the exact total is −1.76, 16 runs of 1,024 samples a pixel gave, at equal
/// time (1.1 s and 1.0 s a run on a shared machine), −1.77 ± 0.25 by this method and −1.77 ± 0.09 by edge sampling: 8
/// times the variance × time.
///
/// Debiased [auxiliary rays](Field::AuxiliaryRays) have long tails besides, whatever the kernel: a rare level counts for much
/// when it is drawn, and near a corner of a room, where shading points slide along a wall beside another, what rays
/// hit is as near as the corner and its angular velocity as large. Where
/// [`GradientImage::outlier`] tells of one sample with much of the result, take the mean over jumps, or edge sampling.
#[derive(Clone, Debug)]
pub struct WarpedArea {
    /// Samples a pixel.
    pub samples: usize,
    /// How they are spread over the film, if not evenly; `samples` is then their mean, and no more than said.
    pub allocation: Option<Arc<Allocation>>,
    /// Samples a pixel of the image that is subtracted as a control variate: ∫ ∇·(h V) du = 0, so radiance may
    /// be counted from any level that does not depend on the samples. 0 subtracts nothing. (Directions that a bounce takes before a constant
    /// environment have its radiance for their level, but the last ones, which see what is dark as well: of two bounces more this takes .7 to
    /// .9 of the variance × seconds, as nothing that escapes needs a field.)
    pub control_variate: usize,
    /// What velocities its field is made of.
    pub field: Field,
    /// What follows the silhouettes of implicit surfaces in means over jumps.
    pub implicit: ImplicitField,
    /// Auxiliary rays and their weights, on the film and on directions alike, for [`Field::AuxiliaryRays`].
    /// With [`Debias::RussianRoulette`], the published debiasing, whose variance is infinite, it is unbiased
    /// by what is proved and tested in the plane and in flat worlds; no test of it is in space.
    pub warp: Warp,
    /// The concentrations of auxiliary rays, and with them the reach of the mean over jumps on directions.
    pub kernels: Kernels,
    /// Samples, a pixel on average, of the curves within faces on which a surface with shading normals turns its
    /// other side: on the film, and as many seen from shading points. No field follows these jumps; what they move
    /// beyond it is a boundary term, and sampled. 0 leaves it out, which is **biased** wherever there are such
    /// curves. Scenes without shading normals cost nothing.
    pub sign_changes: usize,
    /// False leaves out the warp, and with it primary and secondary term: the interior term alone.
    pub warps: bool,
    /// The seed of everything random.
    pub seed: u64,
}

impl Default for WarpedArea {
    fn default() -> Self {
        Self {
            samples: 16,
            allocation: None,
            control_variate: 4,
            field: Field::default(),
            implicit: ImplicitField::default(),
            warp: Warp { debias: DEBIAS, radial_exponent: RADIAL_EXPONENT, ..Warp::default() },
            kernels: Kernels::default(),
            sign_changes: 4,
            warps: true,
            seed: 0,
        }
    }
}

/// Along paths the error of one sample is large beside that of its warp, and a level that is drawn rarely counts
/// for much when it is: blocks are larger, and levels rarer, than the plane's default.
const DEBIAS: Debias = Debias::Multilevel { rays: 16, first: 0.1, ratio: 0.35 };

/// How auxiliary rays crowd around what they serve. The strip along a silhouette that m rays cannot resolve narrows by
/// 2^−1/(2a) from level to level, with a the radial exponent, and what a level counts for grows by 1/ratio. So the estimate
/// exceeds x with probability ~ x^−t, t = 1 + ln 2/(2a ln(1/ratio)): 2.1 for the plane's a = 0.3, whose variance is
/// finite on paper alone, and 2.7 for this.
const RADIAL_EXPONENT: f64 = 0.2;

impl WarpedArea {
    /// The derivative of every pixel along a change.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Tangent` if the change is of another scene,
    /// `Samples`, `Reach`, `Softness`, `ImplicitField`, `Allocation` and `Warp` for parameters out of their
    /// range, and `Stopped`.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<1, 6>(scene, change, self.construction(scene), progress)
    }

    /// The same, with interior, primary and secondary term apart. Of a [softened](Field::Softened) field all motion of shadows counts as
    /// secondary, that which the film's warp makes of it included: the sum is what it is, and the primary term lacks as much.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Tangent` if the change is of another scene,
    /// `Samples`, `Reach`, `Softness`, `ImplicitField`, `Allocation` and `Warp` for parameters out of their
    /// range, and `Stopped`.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<3, 15>(scene, change, self.construction(scene), progress)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every active parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers (of a [softened](Field::Softened) field if what is active is what
    /// moves, as curves are drawn by that). (Not if auxiliary rays
    /// [adapt](flatland::warp::Adaptive): then what moves decides how many there are, and both are unbiased by
    /// themselves.)
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry is active before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Adjoint` if the adjoint has not the film's size,
    /// `Samples`, `Reach`, `Softness`, `ImplicitField`, `Allocation` and `Warp` for parameters out of their
    /// range, and `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        self.pull(scene, adjoint, active, self.construction(scene), progress)
    }

    /// Of sign changes.
    fn effort(&self) -> Effort<'static> {
        let samples = self.sign_changes;
        Effort { primary: samples, secondary: samples, bounces: 0, seed: self.seed, levels: &[] }
    }

    /// Of what a softened field leaves.
    fn residual_effort<'l>(&self, levels: &'l [DVec3]) -> Effort<'l> {
        let Field::Softened { silhouettes, shadows, bounces, .. } = self.field else {
            return Effort { levels, ..self.effort() };
        };
        Effort { primary: silhouettes, secondary: shadows, bounces, seed: self.seed, levels }
    }

    /// What the field is made of in a scene. Towards lights means over jumps are exact where shadows are no
    /// curves that can be sampled.
    pub(super) fn construction(&self, scene: &Scene) -> Construction {
        let implicit = self.implicit;
        match self.field {
            Field::JumpMean { film, lobe } => Construction::JumpMean {
                film,
                lobe,
                softness: 0.0,
                lobe_softness: 0.0,
                sampled_shadows: false,
                implicit,
            },
            Field::Softened { film, lobe, softness, shadows, bounces, .. } => {
                let sampled_shadows = shadows > 0 && shadows::are_curves(scene);
                Construction::JumpMean {
                    film,
                    lobe,
                    softness,
                    lobe_softness: if bounces > 0 { softness / film * lobe } else { 0.0 },
                    sampled_shadows,
                    implicit,
                }
            }
            Field::AuxiliaryRays => Construction::Weighted,
        }
    }

    /// The area integral with the boundary terms that go with it, of any construction of the warp.
    pub(super) fn image<const N: usize, const K: usize>(
        &self,
        scene: &Scene,
        change: &Tangent,
        construction: Construction,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.check_forward(scene, change, construction)?;
        let before = scene.trace_counts();
        let job = self.job(scene, construction, change.is_geometric(), progress)?;
        let motion = &Motion::new(scene, change);
        let mut image = job.forward::<N, K>(motion, progress)?;
        if self.has_boundaries() && change.is_geometric() {
            let (effort, image) = (self.effort(), &mut image);
            job.along_warp().sign_changes(&mut Images { effort, scene, motion, progress, image })?;
        }
        if self.warps && change.is_geometric() {
            let (effort, image) = (self.residual_effort(&job.control_variate), &mut image);
            let moving = Moving::of(scene, motion);
            job.along_warp().residual(&moving, &mut Images { effort, scene, motion, progress, image })?;
        }
        image.traces = scene.trace_counts() - before;
        Ok(image)
    }

    /// Its transpose.
    pub(super) fn pull(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        construction: Construction,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        self.check_reverse(scene, adjoint, active, construction)?;
        let before = scene.trace_counts();
        let job = self.job(scene, construction, active.is_geometric(), progress)?;
        let mut sums = Sums::new(scene);
        job.reverse(&adjoint.pixels, active, progress, &mut sums)?;
        if self.has_boundaries() && active.is_geometric() {
            let (effort, sums) = (self.effort(), &mut sums);
            job.along_warp().sign_changes(&mut Gradients {
                effort,
                scene,
                adjoint: &adjoint.pixels,
                active,
                progress,
                sums,
            })?;
        }
        if self.warps && active.is_geometric() {
            let (effort, sums) = (self.residual_effort(&job.control_variate), &mut sums);
            let moving = Moving::active(active);
            job.along_warp().residual(
                &moving,
                &mut Gradients { effort, scene, adjoint: &adjoint.pixels, active, progress, sums },
            )?;
        }
        let mut gradient = sums.finish(scene, active);
        gradient.traces = scene.trace_counts() - before;
        Ok(gradient)
    }

    fn has_boundaries(&self) -> bool {
        self.sign_changes > 0 && self.warps
    }

    fn check_forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        construction: Construction,
    ) -> Result<(), GradientError> {
        if !change.fits(scene) {
            return Err(GradientError::Tangent);
        }
        supports_field_of_view(scene, change)?;
        if self.warps {
            left_out_of_tangent(scene, change, &[])?;
        }
        self.check_construction(scene, construction, change.is_geometric())?;
        self.check()
    }

    fn check_reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        construction: Construction,
    ) -> Result<(), GradientError> {
        if adjoint.size() != scene.size() || adjoint.pixels.len() != adjoint.width * adjoint.height {
            return Err(GradientError::Adjoint { found: adjoint.size(), film: scene.size() });
        }
        if self.warps {
            left_out_of_active(scene, active, &[])?;
        }
        self.check_construction(scene, construction, active.is_geometric())?;
        self.check()
    }

    /// Refuses media, and fields that know meshes only where there are implicit surfaces, and something moves.
    fn check_construction(
        &self,
        scene: &Scene,
        construction: Construction,
        geometric: bool,
    ) -> Result<(), GradientError> {
        supports_no_media(scene)?;
        if geometric && self.warps && matches!(construction, Construction::Followed { .. }) {
            supports_meshes_only(scene, "rotation")?;
        }
        Ok(())
    }

    fn check(&self) -> Result<(), GradientError> {
        for kappa in [self.kernels.film, self.kernels.surface, self.kernels.relative] {
            self.warp.check(kappa)?;
        }
        if self.samples < 1 {
            return Err(GradientError::Samples { samples: self.samples, least: 1 });
        }
        self.field.check()?;
        self.implicit.check()?;
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
        let control_variate = match self.control_variate {
            0 => vec![],
            samples => primal(&paths, samples, self.seed ^ CONTROL_VARIATE, progress)?.image.pixels,
        };
        let film = FilmPlane::new(scene);
        if self.allocation.as_ref().is_some_and(|allocation| !allocation.fits(&film)) {
            return Err(GradientError::Allocation);
        }
        let by_jumps = matches!(construction, Construction::JumpMean { .. });
        let edges = (by_jumps && geometric && self.warps).then(|| scene.derived(SceneEdges::new));
        Ok(Job { method: self, paths, film, control_variate, construction, edges })
    }
}
