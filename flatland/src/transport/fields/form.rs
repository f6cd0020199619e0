//! V and ∇·V on a one-dimensional domain as a linear form, and its transpose.

use glam::DVec2;

use crate::plane::MaterialPoint;
use crate::transport::CameraTangent;
use crate::warp::{Field, LinearField};

/// V and ∇·V at one point as a linear form in velocities ẏ of material points, relative to the velocity ẋ of
/// the point from which they are seen.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FieldForm {
    /// The material points with their coefficients.
    pub terms: Vec<FieldTerm>,
    /// Coefficients of the camera's rates in V and in ∇·V; only on the film.
    pub camera: [CameraTangent; 2],
    /// Number of rays.
    pub rays: u64,
}

/// A material point y with its coefficients: V = Σ value·(ẏ − ẋ), ∇·V = Σ divergence·(ẏ − ẋ).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FieldTerm {
    /// y.
    pub point: MaterialPoint,
    /// Its covector in V.
    pub value: DVec2,
    /// Its covector in ∇·V.
    pub divergence: DVec2,
}

impl FieldForm {
    /// V and ∇·V, given the velocity of every vertex, of the origin, and of the camera.
    #[must_use]
    pub fn at(&self, vertices: &[DVec2], origin: DVec2, camera: &CameraTangent) -> [f64; 2] {
        let points = self.field(|point| point.velocity(vertices) - origin);
        let [value, divergence] = self.camera.map(|c| c.dot(camera));
        [points.value + value, points.divergence + divergence]
    }

    /// Adds `weight` times the rate `covector`·(ẏ − ẋ) to V and `divergence` times it to ∇·V.
    pub(super) fn push(&mut self, point: MaterialPoint, covector: DVec2, weight: f64, divergence: f64) {
        let (value, divergence) = (weight * covector, divergence * covector);
        self.terms.push(FieldTerm { point, value, divergence });
    }

    pub(super) fn push_camera(&mut self, rate: &CameraTangent, weight: f64, divergence: f64) {
        self.camera[0].add(weight, rate);
        self.camera[1].add(divergence, rate);
    }
}

/// Covers the material points alone: the rates of the camera's angle and field of view are not velocities of
/// points, and contribute through [`camera`](FieldForm::camera).
impl LinearField for FieldForm {
    type Vector = f64;
    type Source = MaterialPoint;
    /// ẏ − ẋ.
    type Rate = DVec2;

    fn field(&self, mut relative: impl FnMut(&MaterialPoint) -> DVec2) -> Field<f64> {
        let mut sum = Field::<f64>::ZERO;
        for term in &self.terms {
            let relative = relative(&term.point);
            sum.value += term.value.dot(relative);
            sum.divergence += term.divergence.dot(relative);
        }
        sum
    }

    fn scatter(&self, a: f64, b: f64, mut add: impl FnMut(&MaterialPoint, DVec2)) {
        for term in &self.terms {
            add(&term.point, a * term.value + b * term.divergence);
        }
    }
}
