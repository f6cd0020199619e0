//! Discs.

use glam::DVec2;

use super::point::PointDistance;
use super::{ShapeError, check};
use crate::sdf::distance::{Jet, Sdf};

/// φ = |x − c| − r. Parameters: c.x, c.y, r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Circle {
    centre: DVec2,
    radius: f64,
}

impl Circle {
    /// A disc of positive radius.
    ///
    /// # Errors
    /// If a parameter is not finite or the radius not positive.
    pub fn new(centre: DVec2, radius: f64) -> Result<Self, ShapeError> {
        check("circle", "centre.x", centre.x, "finite", true)?;
        check("circle", "centre.y", centre.y, "finite", true)?;
        check("circle", "radius", radius, "positive and finite", radius > 0.0)?;
        Ok(Self { centre, radius })
    }

    pub(super) fn from_parameters(parameters: &[f64]) -> Result<Self, ShapeError> {
        Self::new(DVec2::new(parameters[0], parameters[1]), parameters[2])
    }

    pub(super) fn parameters(&self) -> Vec<f64> {
        vec![self.centre.x, self.centre.y, self.radius]
    }

    /// c.
    #[must_use]
    pub fn centre(&self) -> DVec2 {
        self.centre
    }

    /// r.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    fn point(&self, x: DVec2) -> PointDistance {
        PointDistance::new(x, self.centre)
    }
}

impl Sdf<DVec2> for Circle {
    fn jet(&self, x: DVec2) -> Jet<DVec2> {
        let jet = self.point(x).jet();
        Jet { value: jet.value - self.radius, ..jet }
    }

    fn hessian_times(&self, x: DVec2, v: DVec2) -> DVec2 {
        self.point(x).hessian_times(v)
    }

    fn laplacian(&self, x: DVec2) -> f64 {
        self.point(x).laplacian()
    }

    fn parameter_count(&self) -> usize {
        3
    }

    fn rate(&self, x: DVec2, direction: &[f64]) -> Jet<DVec2> {
        let rate = self.point(x).rate(DVec2::new(direction[0], direction[1]));
        Jet { value: rate.value - direction[2], ..rate }
    }

    fn add_parameter_gradient(&self, x: DVec2, covector: Jet<DVec2>, gradient: &mut [f64]) {
        let centre = self.point(x).transpose(covector);
        gradient[0] += centre.x;
        gradient[1] += centre.y;
        gradient[2] -= covector.value;
    }
}
