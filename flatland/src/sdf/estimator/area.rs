//! The area integral of any warp field, and its interior part alone.

use glam::DVec2;

use super::linear::{self, PixelSample, Sampled, Spent};
use super::{Estimate, EstimatorError, check_adjoint, check_direction, check_samples};
use crate::random::{Stream, open01};
use crate::sdf::fields::TracedField;
use crate::sdf::scene::Seen;
use crate::sdf::{AngularFilm, AngularFilter, Scene, Sdf};
use crate::warp::{Circle, Field, WarpField};

/// Which part of the derivative is estimated.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Terms {
    /// ∂L/∂θ + ∇·(V L): the derivative.
    #[default]
    All,
    /// h ∂L/∂θ at a fixed direction.
    Interior,
    /// ∇·(V h L) alone, which stands for the silhouettes.
    Boundary,
}

/// ∫ h ∂L/∂θ + ∇·(V h L) dω of every pixel: the derivative of the image if V is continuous and boundary
/// consistent, and something else if it is not.
///
/// For the box filter, which jumps on the fixed ends of the pixel, the flux of h L V through them is
/// subtracted, at one of them per sample.
///
/// Near a silhouette ∂L/∂θ and ∇_ωL·V each grow as 1/(n·ω) and cancel: [`Terms::All`] has a smaller
/// variance than either part. At grazing hits either part alone has a variance that diverges
/// logarithmically.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AreaIntegral {
    /// Samples a pixel.
    pub samples: usize,
    /// Which part.
    pub terms: Terms,
    /// Seed.
    pub seed: u64,
}

impl Default for AreaIntegral {
    fn default() -> Self {
        Self { samples: 64, terms: Terms::All, seed: 0 }
    }
}

/// A sample as a linear form in the field and the rates of φ at the hit: a·V + b ∇·V + c (L's own).
struct Linear {
    direction: DVec2,
    a: DVec2,
    b: f64,
    /// The factor of the hit's (c, r).
    c: f64,
    seen: Option<Seen>,
}

impl AreaIntegral {
    /// dI/dθ of every pixel along a direction in parameter space.
    ///
    /// # Errors
    /// If the direction does not fit the shape or no samples were asked for.
    pub fn forward(
        &self,
        scene: &Scene,
        direction: &[f64],
        film: &AngularFilm,
        field: &impl WarpField<Circle>,
    ) -> Result<Estimate, EstimatorError> {
        check_direction(scene, direction)?;
        check_samples(self.samples)?;
        Ok(linear::forward(film, self.samples, self.seed, |pixel, rng| {
            let (mut value, mut rays, mut out_of_steps) = (0.0, 0, false);
            for form in self.draw(scene, film, pixel, rng) {
                let seen = form.seen.as_ref();
                if let Some((x, covector)) = seen.and_then(|s| s.hit) {
                    value += form.c * covector.dot(scene.shape().rate(x, direction));
                }
                rays += 1;
                out_of_steps |= seen.is_some_and(|s| s.out_of_steps);
                if self.terms != Terms::Interior {
                    let (Field { value: v, divergence }, more) = field.at(form.direction, rng);
                    value += form.a.dot(v) + form.b * divergence;
                    rays += more;
                }
            }
            Sampled { value, rays, out_of_steps }
        }))
    }

    /// ∂L/∂θ of every parameter for the loss whose ∂L/∂I is `adjoint`.
    ///
    /// # Errors
    /// If the adjoint image does not fit the film, the field's parameters are out of range or no
    /// samples were asked for.
    pub fn reverse(
        &self,
        scene: &Scene,
        film: &AngularFilm,
        adjoint: &[f64],
        field: &impl TracedField<Circle>,
    ) -> Result<Estimate, EstimatorError> {
        check_adjoint(film, adjoint)?;
        check_samples(self.samples)?;
        field.check()?;
        let (shape, view) = (scene.shape(), scene.view());
        let sizes = (adjoint, shape.parameter_count());
        Ok(linear::reverse(self.samples, self.seed, sizes, |pixel, delta, rng, gradient| {
            let mut spent = Spent { rays: 0, out_of_steps: false };
            for form in self.draw(scene, film, pixel, rng) {
                let seen = form.seen.as_ref();
                if let Some((x, covector)) = seen.and_then(|s| s.hit) {
                    shape.add_parameter_gradient(x, covector * (delta * form.c), gradient);
                }
                spent.rays += 1;
                spent.out_of_steps |= seen.is_some_and(|s| s.out_of_steps);
                if self.terms != Terms::Interior {
                    let taps = field.form(&view, form.direction, rng);
                    taps.scatter(form.a * delta, form.b * delta, |x, covector| {
                        shape.add_parameter_gradient(x, covector, gradient);
                    });
                    spent.rays += taps.rays();
                }
            }
            spent
        }))
    }

    /// The directions of one sample: one within the pixel, and one of its ends if the filter jumps.
    fn draw<'a>(
        &self,
        scene: &'a Scene,
        film: &AngularFilm,
        pixel: usize,
        rng: &mut Stream,
    ) -> impl Iterator<Item = Linear> + use<'a> {
        let sample = PixelSample::draw(film, pixel, rng);
        let flux = film.filter() == AngularFilter::Box && self.terms != Terms::Interior;
        let end = flux.then(|| pixel_end(scene, film, pixel, rng));
        std::iter::once(self.area(scene, &sample)).chain(end)
    }

    /// h dL/dθ + (∇h·V + h ∇·V) L
    fn area(&self, scene: &Scene, sample: &PixelSample) -> Linear {
        let direction = sample.direction;
        let seen = scene.seen(&scene.view().trace(direction));
        let (interior, boundary) = match self.terms {
            Terms::All => (1.0, 1.0),
            Terms::Interior => (1.0, 0.0),
            Terms::Boundary => (0.0, 1.0),
        };
        Linear {
            direction,
            a: (seen.gradient * sample.value + direction.perp() * (sample.slope * seen.radiance)) * boundary,
            b: sample.value * seen.radiance * boundary,
            c: sample.value * interior,
            seen: Some(seen),
        }
    }
}

/// −h L V·ν at one of the two ends of a pixel, over its probability.
fn pixel_end(scene: &Scene, film: &AngularFilm, pixel: usize, rng: &mut Stream) -> Linear {
    let side = if open01(rng) < 0.5 { -1.0 } else { 1.0 };
    let direction = DVec2::from_angle(film.centre(pixel) + side * film.radius());
    let radiance = scene.radiance(&scene.view().trace(direction));
    let a = direction.perp() * (-2.0 * side * radiance / film.pixel());
    Linear { direction, a, b: 0.0, c: 0.0, seen: None }
}

/// Implicit differentiation of the hit (Yariv et al. 2020, "Multiview Neural Surface Reconstruction",
/// IDR): ẋ = −ω φ̇/(∇φ·ω), and nothing at silhouettes. It is the interior term alone; the original
/// adds a loss on a mask for what is missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ImplicitHit {
    /// Samples a pixel.
    pub samples: usize,
    /// Seed.
    pub seed: u64,
}

/// No motion of directions.
struct Still;

impl WarpField<Circle> for Still {
    fn at(&self, _: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        (Field::ZERO, 0)
    }
}

impl ImplicitHit {
    fn interior(&self) -> AreaIntegral {
        AreaIntegral { samples: self.samples, terms: Terms::Interior, seed: self.seed }
    }

    /// The interior part of dI/dθ.
    ///
    /// # Errors
    /// As [`AreaIntegral::forward`].
    pub fn forward(
        &self,
        scene: &Scene,
        direction: &[f64],
        film: &AngularFilm,
    ) -> Result<Estimate, EstimatorError> {
        self.interior().forward(scene, direction, film, &Still)
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
    ) -> Result<Estimate, EstimatorError> {
        // The interior part asks no field.
        self.interior().reverse(scene, film, adjoint, &crate::sdf::fields::DirectField)
    }
}
