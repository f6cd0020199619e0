//! Pixels and derivatives in closed form, for discs and polygons that do not touch.
//!
//! L(ω) is smooth between the *critical* directions: tangents to discs and rays through vertices. With v =
//! dα/dθ of the directions where L changes from L⁻ to L⁺ (α increasing),
//!
//! ```text
//! I = ∫ h L dα,   dI/dθ = ∫ h ∂L/∂θ dα + Σ h (L⁻ − L⁺) v.
//! ```
//!
//! Rays are intersected in closed form without φ, so that the results are an independent reference. The
//! integrals between critical directions are Gauss–Legendre sums after α = a + (b − a)(1 − cos πs)/2, which
//! removes the square roots at tangents, with intervals halved until they agree to 10⁻¹¹.

mod bodies;
mod harmonic;
mod quadrature;

pub use harmonic::HarmonicField;

use std::f64::consts::TAU;

use glam::DVec2;

use self::bodies::{Body, Critical, Element};
use self::quadrature::Quadrature;
use super::{AngularFilm, Scene, Sdf};

/// Reason why a scene has no closed form.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ExactError {
    /// Only discs, polygons, boxes without rounding and their unions have closed forms.
    #[error("a {shape} has no closed form")]
    NoClosedForm {
        /// Kind of shape.
        shape: &'static str,
    },
    /// Shapes of a union are so close that blending changes their surfaces, or overlap.
    #[error("shapes {first} and {second} are {gap} apart, less than the blending width {width}")]
    Blended {
        /// Index of the first, in the order of the parameters.
        first: usize,
        /// The second.
        second: usize,
        /// Distance between them.
        gap: f64,
        /// The sum of all blending widths.
        width: f64,
    },
    /// A direction has the wrong number of parameters.
    #[error("a direction of {found} parameters for a shape that has {expected}")]
    Direction {
        /// Number of the shape's parameters.
        expected: usize,
        /// Number given.
        found: usize,
    },
}

/// A direction in which the radiance is discontinuous.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Silhouette {
    /// α, in radians.
    pub angle: f64,
    /// v = dα/dθ.
    pub rate: f64,
    /// L just below α.
    pub before: f64,
    /// L just above.
    pub after: f64,
    /// Distance from the eye to the point of contact.
    pub distance: f64,
}

/// A scene in closed form.
#[derive(Debug)]
pub struct Exact<'a> {
    scene: &'a Scene,
    bodies: Vec<Body<'a>>,
    elements: Vec<Element>,
    quadrature: Quadrature,
}

impl<'a> Exact<'a> {
    /// The closed form of a scene.
    ///
    /// # Errors
    /// If a shape has none.
    pub fn new(scene: &'a Scene) -> Result<Self, ExactError> {
        let bodies = bodies::bodies(scene.shape())?;
        let elements = bodies::elements(&bodies);
        Ok(Self { scene, bodies, elements, quadrature: Quadrature::new() })
    }

    /// L in the direction of an angle.
    #[must_use]
    pub fn radiance(&self, angle: f64) -> f64 {
        let direction = DVec2::from_angle(angle);
        self.first(direction, &[]).map_or(self.scene.background(), |(element, t)| {
            let x = self.scene.eye() + t * direction;
            self.scene.shading().radiance(x, self.normal(element, x))
        })
    }

    /// I of a pixel.
    #[must_use]
    pub fn pixel(&self, film: &AngularFilm, pixel: usize) -> f64 {
        let centre = film.centre(pixel);
        self.integrate(film, centre, |angle| self.radiance(angle))
    }

    /// I of every pixel.
    #[must_use]
    pub fn image(&self, film: &AngularFilm) -> Vec<f64> {
        (0..film.count()).map(|pixel| self.pixel(film, pixel)).collect()
    }

    /// dI/dθ of every pixel, its interior and its boundary part.
    ///
    /// # Errors
    /// If the direction does not fit the shape.
    pub fn derivative(&self, film: &AngularFilm, direction: &[f64]) -> Result<Vec<[f64; 2]>, ExactError> {
        let silhouettes = self.silhouettes(direction)?;
        let of_pixel = |pixel: usize| {
            let centre = film.centre(pixel);
            let interior = self.integrate(film, centre, |angle| self.radiance_rate(angle, direction));
            let jump = |s: &Silhouette| {
                let offset = nearest_turn(s.angle - centre);
                film.value(offset) * (s.before - s.after) * s.rate
            };
            [interior, silhouettes.iter().map(jump).sum()]
        };
        Ok((0..film.count()).map(of_pixel).collect())
    }

    /// Every direction in which L is discontinuous, with its velocity, unordered.
    ///
    /// # Errors
    /// If the direction in parameter space does not fit the shape.
    pub fn silhouettes(&self, direction: &[f64]) -> Result<Vec<Silhouette>, ExactError> {
        let (expected, found) = (self.scene.shape().parameter_count(), direction.len());
        if expected != found {
            return Err(ExactError::Direction { expected, found });
        }
        let critical = self.bodies.iter().flat_map(|body| body.critical(self.scene.eye(), direction));
        let seen = critical.filter_map(|c| self.judge(&c));
        Ok(seen.filter(|s| s.before != s.after).collect())
    }

    /// The discontinuity of L at a critical direction, if it is not occluded.
    fn judge(&self, critical: &Critical) -> Option<Silhouette> {
        let direction = DVec2::from_angle(critical.angle);
        let behind = self.first(direction, &critical.skip);
        if behind.is_some_and(|(_, t)| t < critical.distance) {
            return None;
        }
        let behind = behind.map_or(self.scene.background(), |(element, t)| {
            let x = self.scene.eye() + t * direction;
            self.scene.shading().radiance(x, self.normal(element, x))
        });
        let x = self.scene.eye() + critical.distance * direction;
        let [before, after] =
            critical.normals.map(|normal| normal.map_or(behind, |n| self.scene.shading().radiance(x, n)));
        let Critical { angle, rate, distance, .. } = *critical;
        Some(Silhouette { angle, rate, before, after, distance })
    }

    /// The first element along a ray that is not skipped, and its distance.
    fn first(&self, direction: DVec2, skip: &[Element]) -> Option<(Element, f64)> {
        let eye = self.scene.eye();
        let hits = self.elements.iter().filter(|e| !skip.contains(e));
        let hits = hits.filter_map(|&e| Some((e, self.bodies[e.body].intersect(e.part, eye, direction)?)));
        hits.min_by(|a, b| a.1.total_cmp(&b.1))
    }

    fn normal(&self, element: Element, x: DVec2) -> DVec2 {
        self.bodies[element.body].normal(element.part, x)
    }

    /// ∂L/∂θ at a fixed direction.
    fn radiance_rate(&self, angle: f64, direction: &[f64]) -> f64 {
        let omega = DVec2::from_angle(angle);
        let Some((element, t)) = self.first(omega, &[]) else { return 0.0 };
        let x = self.scene.eye() + t * omega;
        let (point, normal) = self.bodies[element.body].rates(element.part, x, omega, direction);
        let shading = self.scene.shading();
        shading.position.dot(point) + shading.normal.dot(normal)
    }

    /// ∫ h f dα over the support of a pixel, piece by piece.
    fn integrate(&self, film: &AngularFilm, centre: f64, f: impl Fn(f64) -> f64) -> f64 {
        let (low, high) = (centre - film.radius(), centre + film.radius());
        let still = vec![0.0; self.scene.shape().parameter_count()];
        let critical = self.bodies.iter().flat_map(|b| b.critical(self.scene.eye(), &still));
        let mut cuts: Vec<f64> =
            critical.flat_map(|c| turns(c.angle, low)).filter(|&a| a > low && a < high).collect();
        cuts.extend(film.cuts(centre));
        cuts.sort_by(f64::total_cmp);
        let piece = |w: &[f64]| self.quadrature.integrate(w[0], w[1], |a| film.value(a - centre) * f(a));
        cuts.windows(2).map(piece).sum()
    }
}

/// The direction as angles in the first two periods from `low` on.
fn turns(angle: f64, low: f64) -> [f64; 2] {
    let first = low + (angle - low).rem_euclid(TAU);
    [first, first + TAU]
}

/// The angle modulo 2π in [−π, π].
fn nearest_turn(angle: f64) -> f64 {
    angle - TAU * (angle / TAU).round()
}

#[cfg(test)]
mod tests;
