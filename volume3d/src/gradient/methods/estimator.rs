//! One type for all methods: a method with its sample budget and seed.

use std::fmt;

use crate::Image;
use crate::gradient::{
    ActiveParameters, Choice, EdgeSampling, Field, FiniteDifference, Gradient, GradientError, GradientImage,
    Method, Pilot, Progress, Rotation, Tangent, WarpedArea,
};
use crate::scene::Scene;

/// A method with its sample budget and seed.
///
/// ```no_run
/// # use volume3d::{gradient::{Estimator, Progress, Tangent}, scene::Scene};
/// # fn f(scene: &Scene, change: &Tangent) -> Result<(), Box<dyn std::error::Error>> {
/// let result = Estimator::auto(64, 1).forward(scene, change, &Progress::none())?;
/// # Ok(())
/// # }
/// ```
///
/// | constructor | field V | unbiased |
/// |---|---|---|
/// | [`auto`](Self::auto) | chosen by a pilot of few samples | yes |
/// | [`warped_area`](Self::warped_area) | mean over edges, exact | yes |
/// | [`softened`](Self::softened) | mean over edges, softened; the rest is sampled on edges | yes |
/// | [`edge_sampling`](Self::edge_sampling) | 0; everything is sampled on edges | yes |
/// | [`auxiliary_rays`](Self::auxiliary_rays) | mean over auxiliary rays, debiased | yes |
/// | [`rotation`](Self::rotation) | a rotation of each kernel | no |
/// | [`interior`](Self::interior) | 0, without edges | no, unless nothing geometric changes |
/// | [`finite_difference`](Self::finite_difference) | none | no: O(step²) |
///
/// [The guide](crate::guide::methods) says when to choose which. All options of a method are fields of its
/// own type, which the variants hold.
#[derive(Clone, Debug)]
pub enum Estimator {
    /// A pilot chooses between unbiased methods, and splits their samples.
    Auto(Pilot),
    /// Warped-area sampling.
    WarpedArea(WarpedArea),
    /// Edge sampling.
    EdgeSampling(EdgeSampling),
    /// The rotation method of Loubet et al. (2019).
    Rotation(Rotation),
    /// Central finite differences.
    FiniteDifference(FiniteDifference),
}

impl Default for Estimator {
    /// [`auto`](Self::auto) with 64 samples per pixel.
    fn default() -> Self {
        Self::auto(64, 0)
    }
}

impl From<Method> for Estimator {
    fn from(method: Method) -> Self {
        match method {
            Method::WarpedArea(method) => Self::WarpedArea(method),
            Method::EdgeSampling(method) => Self::EdgeSampling(method),
        }
    }
}

impl Estimator {
    /// The method that a pilot expects to err least in the time of `samples` samples per pixel of warped-area
    /// sampling.
    #[must_use]
    pub fn auto(samples: usize, seed: u64) -> Self {
        Self::Auto(Pilot { samples, seed })
    }

    /// Warped-area sampling with the exact mean over edges.
    #[must_use]
    pub fn warped_area(samples: usize, seed: u64) -> Self {
        Self::WarpedArea(WarpedArea { samples, seed, ..WarpedArea::default() })
    }

    /// Warped-area sampling with the softened mean over edges.
    #[must_use]
    pub fn softened(samples: usize, seed: u64) -> Self {
        let field = Field::softened(samples);
        Self::WarpedArea(WarpedArea { samples, seed, field, ..WarpedArea::default() })
    }

    /// Warped-area sampling with auxiliary rays, as published (Bangaru, Li and Durand 2020), debiased.
    #[must_use]
    pub fn auxiliary_rays(samples: usize, seed: u64) -> Self {
        let field = Field::AuxiliaryRays;
        Self::WarpedArea(WarpedArea { samples, seed, field, ..WarpedArea::default() })
    }

    /// Edge sampling (Li et al. 2018), with `samples` samples of the area and of every kind of curve.
    #[must_use]
    pub fn edge_sampling(samples: usize, seed: u64) -> Self {
        let (primary, secondary, bounces) = (samples, samples, samples);
        Self::EdgeSampling(EdgeSampling {
            samples,
            primary,
            secondary,
            bounces,
            seed,
            ..EdgeSampling::default()
        })
    }

    /// The rotation method (Loubet et al. 2019).
    #[must_use]
    pub fn rotation(samples: usize, seed: u64) -> Self {
        Self::Rotation(Rotation { samples, seed, ..Rotation::default() })
    }

    /// The interior term alone: complete where only materials and lights change.
    #[must_use]
    pub fn interior(samples: usize, seed: u64) -> Self {
        Self::WarpedArea(WarpedArea { samples, seed, warps: false, ..WarpedArea::default() })
    }

    /// Central differences over ± `step`, in units of the tangent's parameter.
    #[must_use]
    pub fn finite_difference(samples: usize, step: f64, seed: u64) -> Self {
        Self::FiniteDifference(FiniteDifference { samples, step, seed })
    }

    /// The same estimator with another seed.
    #[must_use]
    pub fn with_seed(&self, seed: u64) -> Self {
        match self.clone() {
            Self::Auto(method) => Self::Auto(Pilot { seed, ..method }),
            Self::WarpedArea(method) => Self::WarpedArea(WarpedArea { seed, ..method }),
            Self::EdgeSampling(method) => Self::EdgeSampling(EdgeSampling { seed, ..method }),
            Self::Rotation(method) => Self::Rotation(Rotation { seed, ..method }),
            Self::FiniteDifference(method) => Self::FiniteDifference(FiniteDifference { seed, ..method }),
        }
    }

    /// The method that the pilot chooses for a scene and its active parameters; the estimator itself if it
    /// has no pilot.
    ///
    /// For a fit: choose once, and take every step [with a seed](Self::with_seed) of its own.
    ///
    /// # Errors
    /// As for [`reverse`](Self::reverse).
    pub fn resolve(
        self,
        scene: &Scene,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Self, GradientError> {
        Ok(self.chosen(|pilot| pilot.for_active(scene, None, active, progress))?.0)
    }

    /// The estimator itself, or the choice of its pilot, with its reasons.
    ///
    /// # Errors
    /// The errors of `choose`.
    pub fn chosen(
        self,
        choose: impl FnOnce(&Pilot) -> Result<Choice, GradientError>,
    ) -> Result<(Self, Option<Choice>), GradientError> {
        let Self::Auto(pilot) = self else { return Ok((self, None)) };
        let choice = choose(&pilot)?;
        Ok((choice.method.clone().into(), Some(choice)))
    }

    /// dI/dθ of every pixel along a tangent.
    ///
    /// # Errors
    /// Those of the method, as for [`WarpedArea::forward`].
    pub fn forward(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        match self {
            Self::Auto(pilot) => {
                pilot.for_change(scene, change, progress)?.method.forward(scene, change, progress)
            }
            Self::WarpedArea(method) => method.forward(scene, change, progress),
            Self::EdgeSampling(method) => method.forward(scene, change, progress),
            Self::Rotation(method) => method.forward(scene, change, progress),
            Self::FiniteDifference(method) => method.forward(scene, change, progress),
        }
    }

    /// As [`forward`](Self::forward), with interior, primary and secondary terms apart; finite differences
    /// have none.
    ///
    /// # Errors
    /// As for [`forward`](Self::forward).
    pub fn forward_terms(
        &self,
        scene: &Scene,
        change: &Tangent,
        progress: &Progress,
    ) -> Result<GradientImage, GradientError> {
        match self {
            Self::Auto(pilot) => {
                pilot.for_change(scene, change, progress)?.method.forward_terms(scene, change, progress)
            }
            Self::WarpedArea(method) => method.forward_terms(scene, change, progress),
            Self::EdgeSampling(method) => method.forward_terms(scene, change, progress),
            Self::Rotation(method) => method.forward_terms(scene, change, progress),
            Self::FiniteDifference(method) => method.forward(scene, change, progress),
        }
    }

    /// ∂L/∂θ of every active parameter, for the loss L whose ∂L/∂I is `adjoint`.
    ///
    /// # Errors
    /// Those of the method, as for [`WarpedArea::reverse`]; [`GradientError::NoReverse`] for finite
    /// differences.
    pub fn reverse(
        &self,
        scene: &Scene,
        adjoint: &Image,
        active: &ActiveParameters,
        progress: &Progress,
    ) -> Result<Gradient, GradientError> {
        match self {
            Self::Auto(pilot) => {
                let choice = pilot.for_active(scene, Some(adjoint), active, progress)?;
                choice.method.reverse(scene, adjoint, active, progress)
            }
            Self::WarpedArea(method) => method.reverse(scene, adjoint, active, progress),
            Self::EdgeSampling(method) => method.reverse(scene, adjoint, active, progress),
            Self::Rotation(method) => method.reverse(scene, adjoint, active, progress),
            Self::FiniteDifference(_) => Err(GradientError::NoReverse),
        }
    }
}

/// The choice in words: the method, its expected error relative to the others', and why those were not
/// chosen.
impl fmt::Display for Choice {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { method, candidates, in_haste, is_lost } = self;
        if *in_haste {
            return write!(
                f,
                "{method}: a pilot tried nothing, as listing all edges would take more than a quarter of the time"
            );
        }
        let [best, others @ ..] = &candidates[..] else { return Ok(()) };
        write!(f, "a pilot chose {}", best.method)?;
        for other in others.iter().filter(|other| other.expected_squared_error > 0.0) {
            let times = best.expected_squared_error / other.expected_squared_error;
            write!(f, "; its squared error should be {times:.2} times that of {}", other.method)?;
            if let Some(reason) = other.reason {
                write!(f, ", {reason}")?;
            }
        }
        if !candidates.iter().any(|c| matches!(c.method, Method::EdgeSampling(_))) {
            f.write_str(
                "; edge sampling was no candidate: it is one where all materials are diffuse, few shapes emit and no \
                 surface is implicit",
            )?;
        }
        if *is_lost {
            f.write_str("; no trial found more than noise, so that this is a guess")?;
        }
        Ok(())
    }
}
