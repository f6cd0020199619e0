//! Results: gradient images, gradients and renderings.

use glam::DVec3;

use super::contribution::Contribution;
use super::regions::Regions;
use crate::Image;
use crate::gradient::Tangent;
use crate::gradient::run::non_finite::NonFinite;
use crate::gradient::unsupported::Unsupported;
use crate::scene::{SceneError, TraceCounts};

/// Interior, primary and secondary term of a derivative, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms {
    /// ∂f/∂θ with all discontinuities static.
    pub interior: Image,
    /// Motion of discontinuities on the film.
    pub primary: Image,
    /// Motion of discontinuities seen from shading points: shadows, reflections, occluded light.
    pub secondary: Image,
}

/// Noise of a gradient image by source: squared standard errors of its independent parts. Each is inversely
/// proportional to the number of samples of its kind, see [`Pilot`](crate::gradient::Pilot).
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// From area samples.
    pub area: Image,
    /// From samples of curves on the film.
    pub film_curves: Image,
    /// From samples of curves seen from shading points.
    pub shading_curves: Image,
    /// From samples of curves before reflecting surfaces and a constant environment, excluded from
    /// `shading_curves`.
    pub bounce_curves: Image,
    /// Cost of area samples by cell, in rays.
    pub(in crate::gradient) work: Vec<f64>,
    /// Number and cost of the kinds of curves.
    pub(in crate::gradient) kinds: Kinds,
}

/// Kinds of curves sampled for one term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::gradient) struct Kind {
    pub(in crate::gradient) count: usize,
    /// Total cost of one sample of each kind, in rays.
    pub(in crate::gradient) work: f64,
}

/// Kinds of curves of all terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(in crate::gradient) struct Kinds {
    pub(in crate::gradient) on_film: Kind,
    pub(in crate::gradient) before_lights: Kind,
    pub(in crate::gradient) before_all_else: Kind,
}

impl Noise {
    /// All noise from area samples, before curves are added.
    pub(in crate::gradient) fn of_area(standard_error: &Image) -> Self {
        let area = Image {
            pixels: standard_error.pixels.iter().map(|e| *e * *e).collect(),
            width: standard_error.width,
            height: standard_error.height,
        };
        let none = Image::constant(area.width, area.height, DVec3::ZERO);
        Self {
            area,
            film_curves: none.clone(),
            shading_curves: none.clone(),
            bounce_curves: none,
            work: vec![],
            kinds: Kinds::default(),
        }
    }
}

/// Reason for a one-sided finite difference.
#[derive(Clone, Debug, PartialEq)]
pub struct OneSided {
    /// Whether the side taken is θ + h; otherwise it is θ − h.
    pub ahead: bool,
    /// The error of the scene on the other side.
    pub outside: SceneError,
}

/// Gradient image: the derivative of every pixel along one tangent.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientImage {
    /// The primal image, from the samples of the gradient. Squares of 16 × 16 cells share their random
    /// numbers, which with few samples leaves a pattern that images of [`render`](crate::gradient::render) do
    /// not have. The image itself is unbiased, but its product with the gradient is not: do not compute the
    /// adjoint of a reverse pass from it at the same seed, see [the module](crate::gradient).
    pub image: Image,
    /// Standard error of the image.
    pub image_error: Image,
    /// dI/dθ of every pixel, linear RGB.
    pub gradient: Image,
    /// Standard error of each pixel's derivative. Pixels share noise: the error of a sum does not follow from
    /// these.
    pub standard_error: Image,
    /// Parts whose sum is the squared standard error.
    pub noise: Noise,
    /// Sums of the gradient over the whole image and over blocks, with standard errors.
    pub regions: Regions,
    /// The terms of the gradient, if requested and separable by the method.
    pub terms: Option<Terms>,
    /// Number of auxiliary rays.
    pub auxiliary_rays: u64,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
    /// Counts of implicit-surface rays that were lost.
    pub traces: TraceCounts,
    /// Number of lost rays (out of steps, or too steep a surface) among each pixel's samples, in all
    /// channels; `None` if there are none.
    pub lost_rays: Option<Image>,
    /// Omitted discontinuities, as permitted by
    /// [`EdgeSampling::allow_missing`](crate::gradient::EdgeSampling).
    pub left_out: Vec<Unsupported>,
    /// Reason for one-sided finite differences, whose bias is O(h) instead of O(h²), if they were needed.
    pub one_sided: Option<OneSided>,
    /// The sample with the largest contribution; `None` if no sample contributes.
    pub largest: Option<Contribution>,
}

impl GradientImage {
    /// The largest contribution of one sample as a fraction of Σ |gradient| over pixels and channels; 0 if
    /// the gradient is zero.
    #[must_use]
    pub fn largest_share(&self) -> f64 {
        let whole: f64 = self.gradient.pixels.iter().map(|g| g.abs().element_sum()).sum();
        self.largest.filter(|l| l.amount > 0.0).map_or(0.0, |l| l.amount / whole)
    }

    /// The largest contribution, if it is at least 2 % of Σ |gradient| and 256 times the average of as many
    /// equal samples. Tails are then heavy: another seed may give another result, and standard errors,
    /// estimated from the same samples, are too small more often than not. It occurs in the penumbrae of
    /// small lights and with debiased auxiliary rays. More samples help slowly; another method may be better
    /// there, see [`WarpedArea`](crate::gradient::WarpedArea).
    ///
    /// The absence of an outlier is no proof of light tails: a rare event may not have occurred yet.
    #[must_use]
    pub fn outlier(&self) -> Option<Contribution> {
        self.largest.and_then(|largest| largest.if_outlier(self.largest_share()))
    }

    /// Whether the derivative of every pixel is exactly 0: no sample saw the image change. Either it does not
    /// change, or what changes is too small or too rare for this many samples. The standard error, also 0,
    /// cannot distinguish the two.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.gradient.pixels.iter().all(|g| *g == DVec3::ZERO)
    }
}

/// Derivative of one number by every parameter: the result of reverse mode.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// Derivatives by the active parameters; 0 for all others.
    pub by_parameter: Tangent,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
    /// Counts of implicit-surface rays that were lost.
    pub traces: TraceCounts,
    /// Omitted discontinuities, as permitted by
    /// [`EdgeSampling::allow_missing`](crate::gradient::EdgeSampling).
    pub left_out: Vec<Unsupported>,
    /// The sample with the largest contribution to derivatives by positions; `None` if no sample contributes.
    /// Contributions through normals computed from positions are not counted.
    pub largest: Option<Contribution>,
}

impl Gradient {
    /// The largest contribution of one sample as a fraction of Σ |gradient| over the coordinates of all
    /// positions; 0 if there is none.
    #[must_use]
    pub fn largest_share(&self) -> f64 {
        let whole: f64 = self.by_parameter.positions.iter().map(|g| g.abs().element_sum()).sum();
        self.largest.filter(|l| l.amount > 0.0).map_or(0.0, |l| l.amount / whole)
    }

    /// The largest contribution, if it is at least 2 % of Σ |gradient| and 256 times the average of as many
    /// equal samples: a sign of heavy tails, see [`GradientImage::outlier`].
    #[must_use]
    pub fn outlier(&self) -> Option<Contribution> {
        self.largest.and_then(|largest| largest.if_outlier(self.largest_share()))
    }

    /// Adds another part.
    pub(in crate::gradient) fn absorb(&mut self, part: Self) {
        self.by_parameter.add(&part.by_parameter);
        self.non_finite.extend(part.non_finite);
        self.traces += part.traces;
        Contribution::merge(&mut self.largest, part.largest);
    }
}

impl From<Tangent> for Gradient {
    fn from(by_parameter: Tangent) -> Self {
        Self {
            by_parameter,
            non_finite: vec![],
            traces: TraceCounts::default(),
            left_out: vec![],
            largest: None,
        }
    }
}

/// A rendered image.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// The image.
    pub image: Image,
    /// Standard error of each pixel. Pixels share noise: the error of a sum does not follow from these.
    pub standard_error: Image,
    /// Sums over the whole image and over blocks, with standard errors.
    pub regions: Regions,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
    /// Counts of implicit-surface rays that were lost.
    pub traces: TraceCounts,
    /// Number of lost rays (out of steps, or too steep a surface) among each pixel's samples, in all
    /// channels; `None` if there are none.
    pub lost_rays: Option<Image>,
}
