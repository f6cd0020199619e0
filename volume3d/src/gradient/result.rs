//! What an estimate of a gradient image says.

use glam::DVec3;

use super::Tangent;
use super::contribution::Contribution;
use super::non_finite::NonFinite;
use super::regions::Regions;
use super::unsupported::Unsupported;
use crate::Image;
use crate::scene::{SceneError, TraceCounts};

/// Interior, primary and secondary term of a derivative, pixel by pixel.
#[derive(Clone, Debug, PartialEq)]
pub struct Terms {
    /// ∂f/∂θ: what changes while all jumps stand still.
    pub interior: Image,
    /// The motion of jumps on the film.
    pub primary: Image,
    /// The motion of jumps seen from shading points: shadows, reflections, occluded light.
    pub secondary: Image,
}

/// Where the noise of a gradient image comes from: the squared standard errors of the parts it is the sum of, which are
/// independent. Each falls as one over the samples of its kind, see [`Pilot`](super::Pilot).
#[derive(Clone, Debug, PartialEq)]
pub struct Noise {
    /// Of samples of the area.
    pub area: Image,
    /// Of samples of curves on the film.
    pub film_curves: Image,
    /// Of samples of curves that shading points see.
    pub shading_curves: Image,
    /// Of those before surfaces that reflect and a constant environment, which the others are not.
    pub bounce_curves: Image,
    /// What samples of the area took, by cell, in rays.
    pub(super) work: Vec<f64>,
    /// How many kinds of curves there were, and what they took.
    pub(super) kinds: Kinds,
}

/// The kinds of curves that were sampled of one term.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Kind {
    pub(super) count: usize,
    /// What one sample of each took, in rays.
    pub(super) work: f64,
}

/// Those of all terms.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Kinds {
    pub(super) on_film: Kind,
    pub(super) before_lights: Kind,
    pub(super) before_all_else: Kind,
}

impl Noise {
    /// All of it from the area, until curves are added.
    pub(super) fn of_area(standard_error: &Image) -> Self {
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

/// Why a difference has one side only.
#[derive(Clone, Debug, PartialEq)]
pub struct OneSided {
    /// Whether that is θ + h, and not θ − h.
    pub ahead: bool,
    /// What is wrong with the scene on the other side.
    pub outside: SceneError,
}

/// A gradient image: the derivative of every pixel along one change.
#[derive(Clone, Debug, PartialEq)]
pub struct GradientImage {
    /// The image itself, from the same samples as the gradient, whose random numbers squares of 16 cells
    /// share: of few samples it has a pattern that those of [`render`](super::render) have not. It is
    /// unbiased by itself, but no product of the two is: do not compute the adjoint of a reverse pass from it
    /// at the same seed, see [the module](crate::gradient).
    pub image: Image,
    /// Its standard error.
    pub image_error: Image,
    /// dI/dθ of every pixel, linear RGB.
    pub gradient: Image,
    /// The standard error of each. Pixels have noise in common: that of a sum does not follow from these.
    pub standard_error: Image,
    /// What its square is the sum of.
    pub noise: Noise,
    /// Sums of the gradient over the whole and over blocks, with their standard errors.
    pub regions: Regions,
    /// The terms it is the sum of, if they were asked for and the method tells them apart.
    pub terms: Option<Terms>,
    /// Auxiliary rays that were traced.
    pub auxiliary_rays: u64,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
    /// Rays at implicit surfaces that could not be followed.
    pub traces: TraceCounts,
    /// Where they were: how many of each pixel's samples' rays ran out of steps or met too steep a surface, in all channels. Nothing if none did.
    pub lost_rays: Option<Image>,
    /// The jumps whose motion is left out, as [`EdgeSampling::allow_missing`](super::EdgeSampling) allows.
    pub left_out: Vec<Unsupported>,
    /// Why finite differences were taken on one side only, if they were: their error is ~ h then, not ~ h².
    pub one_sided: Option<OneSided>,
    /// The sample that contributes most to the gradient; nothing if there are none.
    pub largest: Option<Contribution>,
}

impl GradientImage {
    /// What the largest contribution of one sample is of Σ |gradient| over pixels and channels; 0 if nothing changes.
    #[must_use]
    pub fn largest_share(&self) -> f64 {
        let whole: f64 = self.gradient.pixels.iter().map(|g| g.abs().element_sum()).sum();
        self.largest.filter(|l| l.amount > 0.0).map_or(0.0, |l| l.amount / whole)
    }

    /// The largest contribution, if it is 2 % of Σ |gradient| or more, and 256 times what one of as many equal samples
    /// would have. Then tails are heavy: another seed may give another result, and standard errors, which are estimated
    /// from the same samples, are too small more often than not. It happens in the penumbrae of small lights, and with
    /// debiased auxiliary rays. More samples help slowly; another method may do better there, see
    /// [`WarpedArea`](super::WarpedArea).
    ///
    /// Without an outlier tails may still be heavy: what is rare may not have happened yet.
    #[must_use]
    pub fn outlier(&self) -> Option<Contribution> {
        self.largest.and_then(|largest| largest.if_outlier(self.largest_share()))
    }

    /// Whether the derivative of every pixel is exactly 0: no sample saw the image change. Either it does
    /// not, or what changes is too small or too rare for this many samples. The standard error, 0 as well,
    /// cannot tell.
    #[must_use]
    pub fn is_zero(&self) -> bool {
        self.gradient.pixels.iter().all(|g| *g == DVec3::ZERO)
    }
}

/// The derivative of one number by every parameter: what reverse mode returns.
#[derive(Clone, Debug, PartialEq)]
pub struct Gradient {
    /// By every parameter that was active; 0 by the others.
    pub by_parameter: Tangent,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
    /// Rays at implicit surfaces that could not be followed.
    pub traces: TraceCounts,
    /// The jumps whose motion is left out, as [`EdgeSampling::allow_missing`](super::EdgeSampling) allows.
    pub left_out: Vec<Unsupported>,
    /// The sample that contributes most to the derivatives by positions; nothing if none does. What a sample adds through
    /// normals that are computed from positions does not count.
    pub largest: Option<Contribution>,
}

impl Gradient {
    /// What the largest contribution of one sample is of Σ |gradient| over the coordinates of all positions; 0 if there is
    /// none.
    #[must_use]
    pub fn largest_share(&self) -> f64 {
        let whole: f64 = self.by_parameter.positions.iter().map(|g| g.abs().element_sum()).sum();
        self.largest.filter(|l| l.amount > 0.0).map_or(0.0, |l| l.amount / whole)
    }

    /// The largest contribution, if it is 2 % of Σ |gradient| or more, and 256 times what one of as many equal samples
    /// would have: tails are heavy, see [`GradientImage::outlier`].
    #[must_use]
    pub fn outlier(&self) -> Option<Contribution> {
        self.largest.and_then(|largest| largest.if_outlier(self.largest_share()))
    }

    /// Adds another part.
    pub(super) fn absorb(&mut self, part: Self) {
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

/// An image that was rendered.
#[derive(Clone, Debug, PartialEq)]
pub struct Rendering {
    /// The image.
    pub image: Image,
    /// The standard error of each pixel. Pixels have noise in common: that of a sum does not follow from these.
    pub standard_error: Image,
    /// Sums over the whole and over blocks, with their standard errors.
    pub regions: Regions,
    /// Samples that were not finite.
    pub non_finite: Vec<NonFinite>,
    /// Rays at implicit surfaces that could not be followed.
    pub traces: TraceCounts,
    /// Where they were: how many of each pixel's samples' rays ran out of steps or met too steep a surface, in all channels. Nothing if none did.
    pub lost_rays: Option<Image>,
}
