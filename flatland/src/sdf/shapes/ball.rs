//! Discs and balls.

use glam::DVec2;

use super::point::PointDistance;
use super::{Parametric, ShapeError};
use crate::sdf::distance::{Jet, Sdf, SecondOrder};
use crate::sdf::space::Space;

/// φ = |x − c| − r, in the plane or in space. Parameters: the components of c, then r.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ball<V> {
    centre: V,
    radius: f64,
}

/// A disc in the plane.
pub type Circle = Ball<DVec2>;

impl<V: Space> Ball<V> {
    /// A disc or ball of positive radius.
    ///
    /// # Errors
    /// If a parameter is not finite or the radius not positive.
    pub fn new(centre: V, radius: f64) -> Result<Self, ShapeError> {
        let shape = if V::DIMENSION == 2 { "circle" } else { "ball" };
        for (axis, name) in ["centre.x", "centre.y", "centre.z"][..V::DIMENSION].iter().enumerate() {
            ShapeError::check(shape, name, centre.component(axis), "finite", true)?;
        }
        ShapeError::check(shape, "radius", radius, "positive and finite", radius > 0.0)?;
        Ok(Self { centre, radius })
    }

    /// c.
    #[must_use]
    pub fn centre(&self) -> V {
        self.centre
    }

    /// r.
    #[must_use]
    pub fn radius(&self) -> f64 {
        self.radius
    }

    fn point(&self, x: V) -> PointDistance<V> {
        PointDistance::new(x, self.centre)
    }
}

impl<V: Space> Parametric<V> for Ball<V> {
    fn parameters(&self) -> Vec<f64> {
        (0..V::DIMENSION).map(|axis| self.centre.component(axis)).chain([self.radius]).collect()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        ShapeError::count(V::DIMENSION + 1, parameters)?;
        Self::new(V::from_components(|axis| parameters[axis]), parameters[V::DIMENSION])
    }
}

impl<V: Space> Sdf<V> for Ball<V> {
    fn jet(&self, x: V) -> Jet<V> {
        let jet = self.point(x).jet();
        Jet { value: jet.value - self.radius, ..jet }
    }

    fn second_order(&self, x: V) -> SecondOrder<V> {
        SecondOrder { jet: self.jet(x), ..self.point(x).second_order() }
    }

    /// The distance from a point is convex.
    fn second_derivative_bound(&self) -> f64 {
        0.0
    }

    fn level_bounds(&self, level: f64) -> Option<(V, V)> {
        let half = V::from_components(|_| self.radius + level);
        Some((self.centre - half, self.centre + half))
    }

    fn parameter_count(&self) -> usize {
        V::DIMENSION + 1
    }

    fn rate(&self, x: V, direction: &[f64]) -> Jet<V> {
        let rate = self.point(x).rate(V::from_components(|axis| direction[axis]));
        Jet { value: rate.value - direction[V::DIMENSION], ..rate }
    }

    fn add_parameter_gradient(&self, x: V, covector: Jet<V>, gradient: &mut [f64]) {
        let centre = self.point(x).transpose(covector);
        for (axis, entry) in gradient[..V::DIMENSION].iter_mut().enumerate() {
            *entry += centre.component(axis);
        }
        gradient[V::DIMENSION] -= covector.value;
    }
}
