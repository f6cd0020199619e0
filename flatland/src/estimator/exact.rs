//! The exact derivative, from the arrangement of all edges.

use glam::{DVec2, DVec3};

use super::{EstimatorError, GradientImage, Method, VertexGradient, check_adjoint};
use crate::plane::exact::Arrangement;
use crate::plane::{Film, Image, Motion, Scene};

/// dI/dθ = interior + boundary term, both integrated exactly.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Exact;

impl Method for Exact {
    fn name(&self) -> &'static str {
        "exact"
    }

    fn forward(&self, scene: &Scene, motion: &Motion, film: &Film) -> Result<GradientImage, EstimatorError> {
        let velocities = motion.velocities(scene)?;
        let arrangement = Arrangement::new(scene, film)?;
        let boundary = arrangement.boundary(film, &velocities)?;
        let interior = arrangement.interior(film, &velocities)?;
        Ok(GradientImage {
            mean: boundary.zip(&interior, |b, i| b + i),
            standard_error: Image::from_pixels(film, vec![DVec3::ZERO; film.width() * film.height()]),
            rays: 0,
            non_finite: 0,
        })
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        check_adjoint(film, adjoint)?;
        let mean = Arrangement::new(scene, film)?.gradient(film, adjoint)?;
        let standard_error = vec![DVec2::ZERO; mean.len()];
        Ok(VertexGradient { mean, standard_error, rays: 0, non_finite: 0 })
    }
}
