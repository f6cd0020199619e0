//! Rotated, rounded rectangles.

use glam::DVec2;

use super::ShapeError;
use super::polygon::Polygon;
use crate::sdf::distance::{Jet, Sdf, SecondOrder};

/// A rectangle of half extents h, rotated by an angle and enlarged by a rounding r on every side:
/// φ = (distance to the rectangle) − r. Parameters: c.x, c.y, h.x, h.y, angle, r.
#[derive(Clone, Debug, PartialEq)]
pub struct RoundedBox {
    centre: DVec2,
    half: DVec2,
    angle: f64,
    rounding: f64,
    /// The rectangle without rounding, counter-clockwise.
    core: Polygon,
}

/// The corners in units of h.
const CORNERS: [DVec2; 4] =
    [DVec2::new(-1.0, -1.0), DVec2::new(1.0, -1.0), DVec2::new(1.0, 1.0), DVec2::new(-1.0, 1.0)];

impl RoundedBox {
    /// A rectangle; `angle` is in radians, `rounding` the radius of its corners.
    ///
    /// # Errors
    /// If a parameter is not finite, a half extent not positive or the rounding negative.
    pub fn new(centre: DVec2, half: DVec2, angle: f64, rounding: f64) -> Result<Self, ShapeError> {
        ShapeError::check("box", "centre.x", centre.x, "finite", true)?;
        ShapeError::check("box", "centre.y", centre.y, "finite", true)?;
        ShapeError::check("box", "half.x", half.x, "positive and finite", half.x > 0.0)?;
        ShapeError::check("box", "half.y", half.y, "positive and finite", half.y > 0.0)?;
        ShapeError::check("box", "angle", angle, "finite", true)?;
        ShapeError::check("box", "rounding", rounding, "finite and not negative", rounding >= 0.0)?;
        let turn = DVec2::from_angle(angle);
        let corners = CORNERS.map(|corner| centre + turn.rotate(corner * half));
        let core = Polygon::new(corners.to_vec())?;
        Ok(Self { centre, half, angle, rounding, core })
    }

    pub(super) fn from_parameters(p: &[f64]) -> Result<Self, ShapeError> {
        Self::new(DVec2::new(p[0], p[1]), DVec2::new(p[2], p[3]), p[4], p[5])
    }

    pub(super) fn parameters(&self) -> Vec<f64> {
        vec![self.centre.x, self.centre.y, self.half.x, self.half.y, self.angle, self.rounding]
    }

    /// r.
    #[must_use]
    pub fn rounding(&self) -> f64 {
        self.rounding
    }

    /// The rectangle without its rounding.
    #[must_use]
    pub fn core(&self) -> &Polygon {
        &self.core
    }

    /// The velocity of a corner of the core.
    pub(in crate::sdf) fn corner_velocity(&self, corner: usize, direction: &[f64]) -> DVec2 {
        let (centre, half) = (DVec2::new(direction[0], direction[1]), DVec2::new(direction[2], direction[3]));
        let arm = self.core.vertices()[corner] - self.centre;
        centre + DVec2::from_angle(self.angle).rotate(CORNERS[corner] * half) + direction[4] * arm.perp()
    }
}

impl Sdf<DVec2> for RoundedBox {
    fn jet(&self, x: DVec2) -> Jet<DVec2> {
        let jet = self.core.jet(x);
        Jet { value: jet.value - self.rounding, ..jet }
    }

    fn second_order(&self, x: DVec2) -> SecondOrder<DVec2> {
        SecondOrder { jet: self.jet(x), ..self.core.second_order(x) }
    }

    fn parameter_count(&self) -> usize {
        6
    }

    fn rate(&self, x: DVec2, direction: &[f64]) -> Jet<DVec2> {
        let rate = self.core.rate_of(x, |corner| self.corner_velocity(corner, direction));
        Jet { value: rate.value - direction[5], ..rate }
    }

    fn add_parameter_gradient(&self, x: DVec2, covector: Jet<DVec2>, gradient: &mut [f64]) {
        let turn = DVec2::from_angle(-self.angle);
        self.core.scatter(x, covector, |corner, c| {
            let half = CORNERS[corner] * turn.rotate(c);
            let arm = self.core.vertices()[corner] - self.centre;
            for (entry, add) in [c.x, c.y, half.x, half.y, arm.perp().dot(c)].into_iter().enumerate() {
                gradient[entry] += add;
            }
        });
        gradient[5] -= covector.value;
    }
}
