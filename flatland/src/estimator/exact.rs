//! The exact derivative, from the arrangement of all edges.

use glam::{DVec2, DVec3};

use super::Method;
use super::error::EstimatorError;
use super::estimate::Estimate;
use super::plane::{GradientImage, VertexGradient, check_size};
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
        let no_error = Image::from_pixels(film, vec![DVec3::ZERO; film.width() * film.height()]);
        Ok(Estimate::exact(boundary.zip(&interior, |b, i| b + i), no_error))
    }

    fn reverse(&self, scene: &Scene, film: &Film, adjoint: &Image) -> Result<VertexGradient, EstimatorError> {
        check_size(film, adjoint)?;
        let mean = Arrangement::new(scene, film)?.gradient(film, adjoint)?;
        let no_error = vec![DVec2::ZERO; mean.len()];
        Ok(Estimate::exact(mean, no_error))
    }
}
