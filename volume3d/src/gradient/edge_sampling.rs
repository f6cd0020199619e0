//! Monte Carlo edge sampling (Li, Aittala, Durand and Lehtinen 2018): the interior term by path tracing, the
//! boundary terms by sampling edges.

use glam::DVec3;

use super::accumulator::Sums;
use super::boundary::{Effort, Gradients, Images, Moving, each_boundary};
use super::motion::Motion;
use super::unsupported::{left_out_of_active, left_out_of_tangent, supports_meshes_only};
use super::{
    ActiveParameters, Gradient, GradientError, GradientImage, Missing, Progress, Tangent, Terms, WarpedArea,
};
use crate::Image;
use crate::scene::Scene;

/// Derivatives by sampling edges.
///
/// Besides edges it samples the curves that smooth shading brings: where a surface turns its other side to the camera
/// or to an earlier point of the path, and the horizon of a face that turns.
///
/// Jumps seen from shading points are drawn where they arise: a point of an edge, and a line through it. Before emitters at least half of
/// these points are ones whose shadows the film may show. Of other jumps few lines pass what is shown where that is a small part of a large
/// world, and the secondary term is noisy; a receiver of a thousandth of its world's size is hardly ever found.
///
/// Edges that lie on an emitter are followed where at most 64 shapes emit, or where edges times emitting
/// shapes are at most 10⁷. In larger scenes their shadows are left out, which is **biased**.
#[derive(Clone, Debug)]
pub struct EdgeSampling {
    /// Paths a pixel for the interior term.
    pub samples: usize,
    /// Samples of each kind of jump on the film, a pixel on average: edges, and sign changes of shading normals.
    pub primary: usize,
    /// Samples of each kind of jump seen from shading points, a pixel on average: edges before lights, borders of emitters as first points
    /// see them, horizons, and sign changes of shading normals.
    pub secondary: usize,
    /// Samples of edges before all else, before surfaces that reflect and a constant environment, as shading points see them, and of
    /// borders of emitters as points see them after a bounce, a pixel on average.
    pub bounces: usize,
    /// The seed of everything random.
    pub seed: u64,
    /// Kinds of jumps whose motion may be left out, where nothing follows it: by default none, and scenes that have them
    /// are refused where geometry moves.
    ///
    /// Edge sampling is a sum: what changes between jumps, and the motion of every jump it follows. With V = 0 a
    /// jump that is not followed takes nothing from the others and adds nothing to them: what is left out is a part of the
    /// boundary term of paths that pass a mirror or a glass before the jump, of normals that a relief turns away, and of
    /// shadows without a penumbra. (A warp would also slide still jumps of these kinds along, wherever it is not zero.) What
    /// was left out is listed in [`GradientImage::left_out`] and [`Gradient::left_out`].
    pub allow_missing: Vec<Missing>,
}

impl Default for EdgeSampling {
    fn default() -> Self {
        Self { samples: 16, primary: 16, secondary: 16, bounces: 16, seed: 0, allow_missing: vec![] }
    }
}

impl EdgeSampling {
    /// The derivative of every pixel along a change.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Tangent` if the change is of another scene,
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

    /// The same, with interior, primary and secondary term apart.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry moves before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Tangent` if the change is of another scene,
    /// `Samples` if there are none, and `Stopped`.
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        let left_out = left_out_of_tangent(scene, change, &self.allow_missing)?;
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
        let motion = &Motion::new(scene, change);
        let effort = self.effort();
        let mut images = Images { effort, scene, motion, progress, image: &mut image };
        each_boundary(scene, &Moving::of(scene, motion), &mut images)?;
        Ok(image)
    }

    /// Σ over pixels and channels of adjoint · dI/dθ, for every active parameter θ at once: the transpose of
    /// [`forward`](Self::forward), with the same random numbers if the active shapes are those that move.
    ///
    /// # Errors
    /// [`GradientError`]: `Unsupported` where geometry is active before ideal mirrors or under lights without
    /// extent, or such a light does that casts shadows, `Adjoint` if the adjoint has not the film's size,
    /// `Samples` if there are none, and `Stopped`.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        let left_out = left_out_of_active(scene, active, &self.allow_missing)?;
        self.check(active.is_geometric())?;
        if active.is_geometric() {
            supports_meshes_only(scene, "edge sampling")?;
        }
        let mut gradient = self.interior().reverse(scene, adjoint, active, progress)?;
        let moving = Moving::active(active);
        let (effort, mut sums) = (self.effort(), Sums::new(scene));
        let mut gradients =
            Gradients { effort, scene, adjoint: &adjoint.pixels, active, progress, sums: &mut sums };
        each_boundary(scene, &moving, &mut gradients)?;
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

    pub(super) fn effort(&self) -> Effort<'static> {
        let Self { primary, secondary, bounces, seed, .. } = *self;
        Effort { primary, secondary, bounces, seed, levels: &[] }
    }

    fn check(&self, geometric: bool) -> Result<(), GradientError> {
        let all = [self.samples, self.primary, self.secondary, self.bounces];
        match all.into_iter().find(|&s| s < 1 && geometric) {
            Some(samples) => Err(GradientError::Samples { samples, least: 1 }),
            None => Ok(()),
        }
    }
}
