//! Monte Carlo edge sampling (Li, Aittala, Durand and Lehtinen 2018): the residual theorem with V = 0, the
//! interior term by path tracing and the whole motion of all curves.

use glam::DVec3;

use crate::Image;
use crate::gradient::curve::{Budget, Curves, Group, Zero};
use crate::gradient::modes::accumulator::Sums;
use crate::gradient::unsupported::{left_out_of_active, left_out_of_tangent, supports_meshes_only};
use crate::gradient::warp::motion::Motion;
use crate::gradient::{
    ActiveParameters, Gradient, GradientError, GradientImage, Missing, Progress, Tangent, Terms, WarpedArea,
};
use crate::path::{Kernels, Paths};
use crate::scene::Scene;

/// Derivatives by edge sampling.
///
/// Besides edges it samples the discontinuities of smooth shading: curves on which a surface turns away from
/// the camera or from an earlier path vertex, and the horizon of a moving face.
///
/// Discontinuities seen from shading points are drawn from their source: a point of an edge, and a line
/// through it. For direct light, at least half of these points are ones whose shadows may be visible on the
/// film. For other light, few lines pass through the visible region if that is a small part of a large scene,
/// and the secondary term is noisy; a receiver of 1/1000 the size of its scene is hardly ever found.
///
/// Edges that lie on an emitter are sampled if at most 64 shapes emit, or if edges × emitting shapes is at
/// most 10⁷. In larger scenes their shadows are omitted, which is **biased**.
#[derive(Clone, Debug)]
pub struct EdgeSampling {
    /// Paths per pixel for the interior term.
    pub samples: usize,
    /// Mean samples per pixel of each kind of discontinuity on the film: edges, and sign changes of shading
    /// normals.
    pub primary: usize,
    /// Mean samples per pixel of each kind of discontinuity seen from shading points: edges before lights,
    /// borders of emitters seen from first hits, horizons, and sign changes of shading normals.
    pub secondary: usize,
    /// Mean samples per pixel of edges seen from shading points in front of reflecting surfaces and a
    /// constant environment, and of borders of emitters seen after a bounce.
    pub bounces: usize,
    /// Random seed.
    pub seed: u64,
    /// Kinds of discontinuities whose motion may be omitted where no estimator covers it. Empty by default:
    /// scenes that have them are refused if geometry moves.
    ///
    /// Edge sampling is a sum of the interior term and one boundary term for each discontinuity. As V = 0, a
    /// missing discontinuity does not affect the others: the omitted terms are those of paths through a
    /// mirror or glass before the discontinuity, of normals turned away by a bump map, and of shadows without
    /// penumbra. (A warp, where nonzero, would also displace static discontinuities of these kinds.)
    /// Omissions are listed in [`GradientImage::left_out`] and [`Gradient::left_out`].
    pub allow_missing: Vec<Missing>,
}

impl Default for EdgeSampling {
    fn default() -> Self {
        Self { samples: 16, primary: 16, secondary: 16, bounces: 16, seed: 0, allow_missing: vec![] }
    }
}

impl EdgeSampling {
    /// Derivative of every pixel along a tangent.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` if geometry moves in front of ideal mirrors or under lights without
    /// extent, or such a light moves that casts shadows, `Tangent` if the tangent belongs to another scene,
    /// `Samples` if there are none, and `Stopped`.
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        let mut image = self.forward_terms(scene, change, progress)?;
        image.terms = None;
        Ok(image)
    }

    /// Like [`forward`](Self::forward), with interior, primary and secondary terms separate.
    ///
    /// # Errors
    /// As for [`forward`](Self::forward).
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        let left_out = left_out_of_tangent(scene, change, false, &self.allow_missing)?;
        self.check(change.is_geometric())?;
        if change.is_geometric() {
            supports_meshes_only(scene, "edge sampling")?;
        }
        let mut image = self.interior().forward(scene, change, progress)?;
        let (width, height) = image.gradient.size();
        let zero = Image::constant(width, height, DVec3::ZERO);
        let terms = Terms { interior: image.gradient.clone(), primary: zero.clone(), secondary: zero };
        image.terms = Some(terms);
        image.left_out = left_out;
        let paths = Paths::new(scene, Kernels::default());
        self.curves(&paths).forward(&Motion::new(scene, change), progress, &mut image)?;
        Ok(image)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every active parameter θ: the transpose of
    /// [`forward`](Self::forward), with the same random numbers if the active shapes are those that move.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` if geometry is active in front of ideal mirrors or under lights
    /// without extent, or such a light moves that casts shadows, `Adjoint` or
    /// `NonFiniteAdjoint` if the adjoint image differs from the film in size or is not finite, `Samples` if
    /// there are none, and `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        let left_out = left_out_of_active(scene, active, false, &self.allow_missing)?;
        self.check(active.is_geometric())?;
        if active.is_geometric() {
            supports_meshes_only(scene, "edge sampling")?;
        }
        let mut gradient = self.interior().reverse(scene, adjoint, active, progress)?;
        let (paths, mut sums) = (Paths::new(scene, Kernels::default()), Sums::new(scene));
        self.curves(&paths).reverse(&adjoint.pixels, active, progress, &mut sums)?;
        gradient.absorb(sums.finish(scene, active));
        gradient.left_out = left_out;
        Ok(gradient)
    }

    fn interior(&self) -> WarpedArea {
        WarpedArea {
            samples: self.samples,
            control_variate: 0,
            warps: false,
            seed: self.seed,
            ..WarpedArea::default()
        }
    }

    /// All curves, across V = 0.
    fn curves<'p>(&self, paths: &'p Paths<'p>) -> Curves<'p, Zero> {
        Curves { paths, field: Zero, budget: self.budget() }
    }

    /// Mean samples per pixel of every kind of curve.
    pub(in crate::gradient) fn budget(&self) -> Budget<'static> {
        let Self { primary, secondary, bounces, seed, .. } = *self;
        Budget::new(seed, &[], |kind| match kind.group() {
            Group::Film => primary,
            Group::Shading => secondary,
            Group::Bounces => bounces,
        })
    }

    fn check(&self, geometric: bool) -> Result<(), GradientError> {
        let all = [self.samples, self.primary, self.secondary, self.bounces];
        match all.into_iter().find(|&s| s < 1 && geometric) {
            Some(samples) => Err(GradientError::Samples { samples, least: 1 }),
            None => Ok(()),
        }
    }
}
