//! Warped-area sampling: dI/dθ = ∫ ∂f/∂θ + ∇·(V f), on the film and at every bounce (Theory 8).
//!
//! V moves with every edge at which the integrand is discontinuous, except borders of flat emitters, which
//! are sampled with the velocity relative to V. On discontinuities within a face due to shading normals,
//! curves on which a surface turns its other side to the viewer, V is an arbitrary continuous field, and ∮ Δf
//! (v − V)·ν over these curves is added by edge sampling.

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

use super::auxiliary::Construction;
use super::curve::{Budget, Kind};
use super::film::FilmPlane;
use super::primal::primal;
use super::unsupported::{
    has_chains, left_out_of_active, left_out_of_tangent, may_move_chains, moves_chains,
    supports_field_of_view, supports_meshes_only, supports_no_media,
};
use crate::Image;
use crate::gradient::film::allocation::Allocation;
use crate::gradient::modes::accumulator::Sums;
use crate::gradient::parameters::tangent::{ActiveParameters, Tangent};
use crate::gradient::results::error::{GradientError, check_adjoint};
use crate::gradient::results::result::{Gradient, GradientImage};
use crate::gradient::run::progress::Progress;
use crate::gradient::run::streams::CONTROL_VARIATE;
use crate::gradient::warp::implicit_field::ImplicitField;
use crate::gradient::warp::jump_mean::SceneEdges;
use crate::gradient::warp::motion::Motion;
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Warped-area sampling (Bangaru, Li and Durand 2020) along paths.
///
/// Set two fields: [`samples`](Self::samples), 4 to 16 for an optimisation step and 64 or more for a gradient
/// image to look at, and [`seed`](Self::seed), a different one for every step. The defaults of all others are
/// unbiased; the [guide](crate::guide::methods) explains when another [`field`](Self::field) or another
/// method is better.
///
/// ```
/// # use volume3d::gradient::WarpedArea;
/// let step = 7;
/// let method = WarpedArea { samples: 16, seed: step, ..WarpedArea::default() };
/// ```
///
/// # Heavy tails
/// In the penumbra of a small light, the silhouettes of the light and of its occluder, which move
/// differently, intersect in every direction, and ∇·V is large there. [`EdgeSampling`](super::EdgeSampling)
/// does not have this problem: in the penumbra of a ball of radius 0.2 at distance 6 its variance × time was
/// 8 times lower.
///
/// Debiased [auxiliary rays](Field::AuxiliaryRays) have heavy tails for any kernel: a rare level has a large
/// weight when it is drawn, and near a corner of a room, where shading points slide along a wall next to
/// another, hits are as near as the corner and have correspondingly large angular velocities. If
/// [`GradientImage::outlier`] reports one sample with much of the result, use the mean over discontinuities,
/// or edge sampling.
#[derive(Clone, Debug)]
pub struct WarpedArea {
    /// Samples per pixel.
    pub samples: usize,
    /// Allocation over the film, if not uniform; `samples` is then its mean and for information only.
    pub allocation: Option<Arc<Allocation>>,
    /// Samples per pixel of the image that is subtracted as a control variate: as ∫ ∇·(h V) du = 0, any
    /// radiance that does not depend on the samples may be subtracted. 0 subtracts nothing. (Directions at a
    /// bounce in front of a constant environment have its radiance as control variate. The last bounce has
    /// none: it would increase cost and variance there.)
    pub control_variate: usize,
    /// Source of the field's velocities.
    pub field: Field,
    /// Field of implicit surfaces in means over discontinuities.
    pub implicit: ImplicitField,
    /// Auxiliary rays and their weights, on the film and on directions, for [`Field::AuxiliaryRays`]. With
    /// [`Debias::RussianRoulette`], the published debiasing, whose variance is infinite, unbiasedness is
    /// proved and tested in the plane and in flat worlds, but not tested in space.
    pub warp: Warp,
    /// Concentrations of auxiliary rays; they also determine the reach of the mean over discontinuities on
    /// directions.
    pub kernels: Kernels,
    /// Mean samples per pixel of curves within faces on which a surface with shading normals turns its other
    /// side: on the film, and as many seen from shading points. No field follows these discontinuities; their
    /// residual is sampled as a boundary term. 0 omits it, which is **biased** wherever there are such
    /// curves. Scenes without shading normals incur no cost.
    pub sign_changes: usize,
    /// Whether to warp. If false, only the interior term is computed, without primary and secondary terms.
    pub warps: bool,
    /// Random seed.
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

/// Debiasing along paths, where the error of one sample is large compared with that of its warp, and a rarely
/// drawn level has a large weight: blocks are larger, and levels rarer, than the plane's default.
const DEBIAS: Debias = Debias::Multilevel { rays: 16, first: 0.1, ratio: 0.35 };

/// Radial exponent a of auxiliary points. The strip along a silhouette that m rays cannot resolve narrows by
/// 2^−1/(2a) from level to level, and the weight of a level grows by 1/ratio. The estimate therefore exceeds
/// x with probability ~ x^−t, t = 1 + ln 2/(2a ln(1/ratio)): 2.1 for the plane's a = 0.3, whose variance is
/// finite in theory only, and 2.7 for this value.
const RADIAL_EXPONENT: f64 = 0.2;

impl WarpedArea {
    /// Derivative of every pixel along a tangent.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` if geometry moves in front of bump or normal maps or under lights
    /// whose beams end abruptly, or such a light moves, `Tangent` if the tangent belongs to another scene,
    /// `Samples`, `Reach`, `Softness`, `ImplicitField`, `Allocation` and `Warp` for parameters out of range,
    /// and `Stopped`.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<1, 6>(scene, change, self.construction(scene), progress)
    }

    /// Like [`forward`](Self::forward), with interior, primary and secondary terms separate. For a
    /// [softened](Field::Softened) field the whole motion of shadows, including that due to the film's warp,
    /// counts as secondary: the sum is unchanged, and the primary term is lower by that amount.
    ///
    /// # Errors
    /// As for [`forward`](Self::forward).
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.image::<3, 15>(scene, change, self.construction(scene), progress)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every active parameter θ: the transpose of
    /// [`forward`](Self::forward), with the same random numbers. One exception: for a
    /// [softened](Field::Softened) field the active shapes must be those that move, as these determine the
    /// sampled curves.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` if geometry is active in front of bump or normal maps or under lights
    /// whose beams end abruptly, or such a light moves, `Adjoint` or
    /// `NonFiniteAdjoint` if the adjoint image differs from the film in size or is not finite, `Samples`,
    /// `Reach`, `Softness`, `ImplicitField`, `Allocation` and `Warp` for parameters out of range, and
    /// `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        self.pull(scene, adjoint, active, self.construction(scene), progress)
    }

    /// Mean samples per pixel of every kind of curve that a field leaves.
    fn budget<'l>(&self, construction: Construction, control_variate: &'l [DVec3]) -> Budget<'l> {
        let (on_film, before_lights, beyond) = match (self.field, construction) {
            (
                Field::Softened { silhouettes, shadows, bounces, .. },
                Construction::JumpMean { softness, lobe_softness, sampled_shadows, .. },
            ) => {
                let silhouettes = if softness > 0.0 { silhouettes } else { 0 };
                let shadows = if sampled_shadows { shadows } else { 0 };
                (silhouettes, shadows, if lobe_softness > 0.0 { bounces } else { 0 })
            }
            _ => (0, 0, 0),
        };
        Budget::new(self.seed, control_variate, |kind| match kind {
            Kind::FilmEdges => on_film,
            Kind::FilmSignChanges | Kind::InnerSignChanges => self.sign_changes,
            Kind::ShadowEdges | Kind::Outlines | Kind::Horizons => before_lights,
            Kind::IndirectEdges => beyond,
            Kind::ReflectedOutlines => 0,
        })
    }

    /// Construction of the field in a scene. Towards lights, means over discontinuities are exact if shadows
    /// are not curves that can be sampled.
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
                // A field that leaves curves is not split by chains.
                let is_split = has_chains(scene);
                let sampled_shadows = shadows > 0 && !is_split && shadows::are_curves(scene);
                let softness = if is_split { 0.0 } else { softness };
                Construction::JumpMean {
                    film,
                    lobe,
                    softness,
                    lobe_softness: if bounces > 0 && !is_split { softness / film * lobe } else { 0.0 },
                    sampled_shadows,
                    implicit,
                }
            }
            Field::AuxiliaryRays => Construction::Weighted,
        }
    }

    /// The area integral with its boundary terms, for any construction of the warp.
    pub(super) fn image<const N: usize, const K: usize>(
        &self,
        scene: &Scene,
        change: &Tangent,
        construction: Construction,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        self.check_forward(scene, change, construction)?;
        let before = scene.trace_counts();
        let follows_chains = self.warps && splits(construction) && moves_chains(scene, change);
        let moves = (change.is_geometric(), follows_chains);
        let job = self.job(scene, construction, moves, progress)?;
        let motion = &Motion::new(scene, change);
        let mut image = job.forward::<N, K>(motion, progress)?;
        if self.warps && change.is_geometric() {
            job.curves().forward(motion, progress, &mut image)?;
        }
        image.traces = scene.trace_counts() - before;
        Ok(image)
    }

    /// Transpose of [`image`](Self::image).
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
        let follows_chains = self.warps && splits(construction) && may_move_chains(scene, active);
        let moves = (active.is_geometric(), follows_chains);
        let job = self.job(scene, construction, moves, progress)?;
        let mut sums = Sums::new(scene);
        job.reverse(&adjoint.pixels, active, progress, &mut sums)?;
        if self.warps && active.is_geometric() {
            job.curves().reverse(&adjoint.pixels, active, progress, &mut sums)?;
        }
        let mut gradient = sums.finish(scene, active);
        gradient.traces = scene.trace_counts() - before;
        Ok(gradient)
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
            left_out_of_tangent(scene, change, splits(construction), &[])?;
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
        check_adjoint(scene, adjoint)?;
        if self.warps {
            left_out_of_active(scene, active, splits(construction), &[])?;
        }
        self.check_construction(scene, construction, active.is_geometric())?;
        self.check()
    }

    /// Refuses media, and fields that support meshes only if there are implicit surfaces and anything moves.
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
        (geometric, follows_chains): (bool, bool),
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
        let is_softened = matches!(construction, Construction::JumpMean { softness, .. } if softness != 0.0);
        if let Some(edges) = edges.as_ref().filter(|_| is_softened) {
            edges.measure(scene);
        }
        Ok(Job { method: self, paths, film, control_variate, construction, edges, follows_chains })
    }
}

/// Whether light through chains has a warp of its own, for any construction of the first part's.
fn splits(construction: Construction) -> bool {
    !matches!(construction, Construction::Followed { .. })
}
