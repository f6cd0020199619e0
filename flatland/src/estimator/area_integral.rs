//! The area integral of any warp field, in both of its forms.

use glam::{DVec2, DVec3};

use super::error::EstimatorError;
use super::plane::{GradientImage, gradient_image};
use crate::calculus::{Dual, Number};
use crate::plane::{Attachment, Film, Filter, Hit, PixelSample, Scene};
use crate::random::{Stream, open01};
use crate::warp::{Field, Plane, WarpField};

/// The two forms of the area integral, which are equal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Form {
    /// ∂f/∂θ + ∇f·V + f ∇·V, term by term.
    #[default]
    Area,
    /// d/dθ of f(T(u'); θ) |det DT| with T = u' + (θ − θ₀) V(u'), by dual numbers.
    Reparameterised,
}

/// ∫ h ∂f/∂θ + ∇·(V h f) du of every pixel by sampling, for any construction of V: the derivative of the
/// image if V is continuous and boundary consistent, and otherwise not.
///
/// For the box filter, which is discontinuous on the static pixel edge, the flux ∮ f (V·n) dl through that
/// edge is subtracted, at one point of it per sample.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct AreaIntegral {
    /// Samples per pixel.
    pub samples: usize,
    /// Area or reparameterised form.
    pub form: Form,
    /// Whether the mean of f over the pixel is subtracted from f as a control variate. If V is continuous it
    /// changes nothing, because ∫ ∇·(V h) du = 0, and it removes the variance of pixels of constant shade.
    pub control_variate: bool,
    /// Random seed.
    pub seed: u64,
}

impl AreaIntegral {
    /// The integral of every pixel.
    ///
    /// # Errors
    /// [`EstimatorError::NoSamples`].
    pub fn forward(
        &self,
        scene: &Scene,
        velocities: &[DVec2],
        film: &Film,
        field: &impl WarpField<Plane>,
    ) -> Result<GradientImage, EstimatorError> {
        gradient_image(film, self.samples, self.seed, |x, y| {
            let centre = film.centre(x, y);
            let control = if self.control_variate { pixel_mean(scene, film, centre) } else { DVec3::ZERO };
            let place = Place { scene, film, centre, velocities, control };
            move |rng| {
                let s = film.sample(centre, rng);
                let hit = scene.hit(s.u);
                let (v, mut rays) = field.at(s.u, rng);
                let mut value = match self.form {
                    Form::Area => place.area(&s, hit.as_ref(), v),
                    Form::Reparameterised => place.reparameterised(&s, hit.as_ref(), v),
                };
                rays += 1;
                if film.filter() == Filter::Box {
                    let side = PixelSide::draw(film, centre, rng);
                    let f = scene.value(scene.hit(side.u).as_ref(), side.u) - control;
                    let (v, more) = field.at(side.u, rng);
                    value -= side.weight * v.value.dot(side.outward) * f;
                    rays += 1 + more;
                }
                (value, rays)
            }
        })
    }
}

/// The filter-weighted mean of f over a pixel, from 16 fixed points. Any constant would be a valid control
/// variate; this one is close to optimal.
pub(super) fn pixel_mean(scene: &Scene, film: &Film, centre: DVec2) -> DVec3 {
    let (low, high) = film.support(centre);
    let (mut sum, mut mass) = (DVec3::ZERO, 0.0);
    for i in 0..16 {
        let place = DVec2::new(f64::from(i % 4), f64::from(i / 4));
        let u = low + (high - low) * (place + 0.5) / 4.0;
        let h = film.filter_value(centre, u);
        sum += h * scene.value(scene.hit(u).as_ref(), u);
        mass += h;
    }
    sum / mass
}

/// A pixel of a moving scene.
struct Place<'a> {
    scene: &'a Scene,
    film: &'a Film,
    centre: DVec2,
    velocities: &'a [DVec2],
    /// Control variate, subtracted from f.
    control: DVec3,
}

impl Place<'_> {
    /// (h ∂f/∂θ + (f ∇h + h ∇f)·V + h f ∇·V)/p
    fn area(&self, sample: &PixelSample, hit: Option<&Hit>, field: Field<DVec2>) -> DVec3 {
        let (scene, u, v) = (self.scene, sample.u, field.value);
        let slope = DVec3::from(scene.gradient(hit, u).map(|g| g.dot(v)));
        sample.value * (scene.theta_derivative(hit, u, self.velocities) + slope)
            + (sample.gradient.dot(v) + sample.value * field.divergence)
                * (scene.value(hit, u) - self.control)
    }

    /// d/dθ of h(T) f(T; θ) |det DT| / p at θ₀, along T = u + (θ − θ₀) V.
    fn reparameterised(&self, sample: &PixelSample, hit: Option<&Hit>, field: Field<DVec2>) -> DVec3 {
        let (scene, u, v) = (self.scene, sample.u, field.value);
        let point = Dual::path(u, v);
        let filter = self.film.filter_value_dual(self.centre, point) * (1.0 / sample.density);
        let jacobian = Dual::new(1.0, [field.divergence]);
        // A shade attached to the material sees T move relative to it.
        let carried = hit.filter(|h| scene.shapes()[h.shape()].shade().attachment() == Attachment::Material);
        let shade_point = carried.map_or(point, |h| Dual::path(u, v - h.velocity(self.velocities)));
        let shade = scene.value_dual(hit, u, shade_point);
        let value = |c: usize| (shade[c] - Dual::constant(self.control[c])) * filter * jacobian;
        DVec3::from([0, 1, 2].map(|c| value(c).slope()))
    }
}

/// A point of a pixel's edge.
pub(super) struct PixelSide {
    pub(super) u: DVec2,
    pub(super) outward: DVec2,
    /// h divided by the density.
    pub(super) weight: f64,
}

impl PixelSide {
    pub(super) fn draw(film: &Film, centre: DVec2, rng: &mut Stream) -> Self {
        let along = 4.0 * open01(rng);
        let outward = [DVec2::X, DVec2::Y, DVec2::NEG_X, DVec2::NEG_Y][along as usize];
        let u = centre + film.pixel() * (0.5 * outward + (along.fract() - 0.5) * outward.perp());
        // Randomly on both sides of an edge that lies on it.
        let u = u + film.border() * (2.0 * open01(rng) - 1.0) * outward;
        Self { u, outward, weight: 4.0 / film.pixel() }
    }
}
