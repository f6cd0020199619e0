//! The area integral of any warp field, and its interior part.

use std::f64::consts::PI;

use glam::DVec2;

use super::driver;
use super::sample::PixelSample;
use crate::estimator::error::{EstimatorError, check_direction};
use crate::estimator::estimate::Estimate;
use crate::plane::Filter;
use crate::random::{Stream, open01};
use crate::sdf::Seen;
use crate::sdf::fields::{MotionField, TracedField};
use crate::sdf::{AngularFilm, Jet, RayCount, Scene, Sdf};
use crate::warp::{Circle, Field, LinearField as _};

/// Part of the derivative to estimate.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Terms {
    /// h ∂L/∂θ + ∇·(V h L): the derivative.
    #[default]
    All,
    /// h ∂L/∂θ at a fixed direction.
    Interior,
    /// ∇·(V h L) alone, in which L varies with ω at fixed θ. For a valid V its integral is the silhouette
    /// term Σ h (L⁻ − L⁺) v.
    Boundary,
}

/// ∫ h ∂L/∂θ + ∇·(V h L) dω of every pixel: the derivative of the image if V is continuous and boundary
/// consistent, and otherwise not.
///
/// For the box filter, which is discontinuous on the static ends of the pixel, the flux of h L V through them
/// is subtracted, at one of them per sample.
///
/// Near a silhouette ∂L/∂θ and ∇_ωL·V each grow as 1/(n·ω) and cancel: [`Terms::All`] has a smaller variance
/// than either part. At grazing hits the variance of either part alone diverges logarithmically.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AreaIntegral {
    /// Samples per pixel.
    pub samples: usize,
    /// Part to estimate.
    pub terms: Terms,
    /// Random seed.
    pub seed: u64,
}

impl Default for AreaIntegral {
    fn default() -> Self {
        Self { samples: 64, terms: Terms::All, seed: 0 }
    }
}

/// A sample as a linear form in the field and the rates of φ at the hit: a·V + b ∇·V + c (form of L).
struct Linear {
    direction: DVec2,
    a: DVec2,
    b: f64,
    /// Factor of the hit's (c, r).
    c: f64,
    hit: Option<(DVec2, Jet<DVec2>)>,
    rays: RayCount,
}

impl AreaIntegral {
    /// dI/dθ of every pixel along the parameter direction for which the field was made, in this scene.
    ///
    /// # Errors
    /// If that direction does not fit the shape or no samples were requested.
    pub fn forward(
        &self,
        scene: &Scene,
        film: &AngularFilm,
        field: &impl MotionField<Circle>,
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        let direction = field.direction();
        check_direction(scene.shape().parameter_count(), direction)?;
        driver::forward(film, (self.samples, self.seed), |pixel, rng| {
            let (mut value, mut rays) = (0.0, RayCount::default());
            for form in self.draw(scene, film, pixel, rng) {
                if let Some((x, covector)) = form.hit {
                    value += form.c * covector.dot(scene.shape().rate(x, direction));
                }
                rays += form.rays;
                if self.terms != Terms::Interior {
                    let (Field { value: v, divergence }, more) = field.sample(form.direction, rng);
                    value += form.a.dot(v) + form.b * divergence;
                    rays += more;
                }
            }
            (value, rays)
        })
    }

    /// ∂L/∂θ of every parameter for the loss whose ∂L/∂I is `adjoint`.
    ///
    /// # Errors
    /// If the adjoint image does not fit the film, the field's parameters are out of range or no samples were
    /// requested.
    pub fn reverse(
        &self,
        scene: &Scene,
        film: &AngularFilm,
        adjoint: &[f64],
        field: &impl TracedField<Circle>,
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        field.check()?;
        let (shape, view) = (scene.shape(), scene.view());
        driver::reverse((scene, film), (self.samples, self.seed), adjoint, |pixel, delta, rng, gradient| {
            let mut rays = RayCount::default();
            for form in self.draw(scene, film, pixel, rng) {
                if let Some((x, covector)) = form.hit {
                    shape.add_parameter_gradient(x, covector * (delta * form.c), gradient);
                }
                rays += form.rays;
                if self.terms != Terms::Interior {
                    let taps = field.form(&view, form.direction, rng);
                    taps.scatter(form.a * delta, form.b * delta, |x, covector| {
                        shape.add_parameter_gradient(*x, covector, gradient);
                    });
                    rays += taps.rays();
                }
            }
            rays
        })
    }

    /// Directions of one sample: one within the pixel, and one of its ends if the filter is discontinuous.
    fn draw(
        &self,
        scene: &Scene,
        film: &AngularFilm,
        pixel: usize,
        rng: &mut Stream,
    ) -> impl Iterator<Item = Linear> + use<> {
        let sample = PixelSample::draw(film, pixel, rng);
        let flux = film.filter() == Filter::Box && self.terms != Terms::Interior;
        let end = flux.then(|| pixel_end(scene, film, pixel, rng));
        std::iter::once(self.area(scene, &sample)).chain(end)
    }

    /// h dL/dθ + (∇h·V + h ∇·V) L
    fn area(&self, scene: &Scene, sample: &PixelSample) -> Linear {
        let direction = sample.direction;
        let trace = scene.view().trace(direction);
        let Seen { radiance, gradient, hit } = scene.seen(&trace);
        let (interior, boundary) = match self.terms {
            Terms::All => (1.0, 1.0),
            Terms::Interior => (1.0, 0.0),
            Terms::Boundary => (0.0, 1.0),
        };
        Linear {
            direction,
            a: (gradient * sample.value + direction.perp() * (sample.slope * radiance)) * boundary,
            b: sample.value * radiance * boundary,
            c: sample.value * interior,
            hit,
            rays: trace.count(),
        }
    }
}

/// −h L V·ν at one of the two ends of a pixel, divided by its probability.
fn pixel_end(scene: &Scene, film: &AngularFilm, pixel: usize, rng: &mut Stream) -> Linear {
    let side = if open01(rng) < 0.5 { -1.0 } else { 1.0 };
    // Randomly on both sides of a silhouette there.
    let beside = 1024.0 * f64::EPSILON * PI * (2.0 * open01(rng) - 1.0);
    let direction = DVec2::from_angle(film.centre(pixel) + side * film.radius() + beside);
    let trace = scene.view().trace(direction);
    let a = direction.perp() * (-2.0 * side * scene.radiance(&trace) / film.pixel());
    Linear { direction, a, b: 0.0, c: 0.0, hit: None, rays: trace.count() }
}

/// Implicit differentiation of the hit (Yariv et al. 2020, "Multiview Neural Surface Reconstruction", IDR):
/// ẋ = −ω φ̇/(∇φ·ω), without a boundary term at silhouettes. It is the interior term alone; the original adds
/// a loss on a mask for the missing term.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImplicitHit {
    /// Samples per pixel.
    pub samples: usize,
    /// Random seed.
    pub seed: u64,
}

/// The zero field.
struct Still<'a>(&'a [f64]);

impl MotionField<Circle> for Still<'_> {
    fn direction(&self) -> &[f64] {
        self.0
    }

    fn sample(&self, _: DVec2, _: &mut Stream) -> (Field<DVec2>, RayCount) {
        (Field::ZERO, RayCount::default())
    }
}

impl ImplicitHit {
    fn interior(&self) -> AreaIntegral {
        AreaIntegral { samples: self.samples, terms: Terms::Interior, seed: self.seed }
    }

    /// The interior part of dI/dθ along a direction in parameter space.
    ///
    /// # Errors
    /// As [`AreaIntegral::forward`].
    pub fn forward(
        &self,
        scene: &Scene,
        direction: &[f64],
        film: &AngularFilm,
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        self.interior().forward(scene, film, &Still(direction))
    }

    /// The interior part of ∂L/∂θ.
    ///
    /// # Errors
    /// As [`AreaIntegral::reverse`].
    pub fn reverse(
        &self,
        scene: &Scene,
        film: &AngularFilm,
        adjoint: &[f64],
    ) -> Result<Estimate<Vec<f64>>, EstimatorError> {
        // The interior part does not evaluate a field.
        self.interior().reverse(scene, film, adjoint, &crate::sdf::fields::DirectField)
    }
}
