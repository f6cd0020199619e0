//! Rings.

use flatland::sdf::{Jet, Sdf, SecondOrder, Space as _};
use glam::{DMat3, DVec3};

use super::{Parametric, ShapeError};

/// The points within r of a circle of radius R around the y axis through c: with p the component of x − c
/// orthogonal to y, and ρ = |p|,
///
/// ```text
/// φ = √((ρ − R)² + y²) − r.
/// ```
///
/// Parameters: the components of c, R, r. ∇φ is discontinuous on the axis; derivatives there and on the
/// circle itself are 0.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Torus {
    centre: DVec3,
    major: f64,
    minor: f64,
}

/// Data of a point near the circle.
struct Local {
    /// Away from the axis; 0 on it.
    outward: DVec3,
    /// 1/ρ; 0 on the axis.
    inverse: f64,
    /// ∇φ: away from the circle; 0 on it.
    m: DVec3,
    distance: f64,
}

impl Local {
    /// ∇²φ: (I − m mᵀ)/distance in the plane through the axis, and the circle's own curvature around the
    /// axis.
    fn hessian(&self) -> DMat3 {
        let bend = if self.distance > 0.0 { self.distance.recip() } else { 0.0 };
        let around = self.outward.cross(DVec3::Y);
        let in_plane = self.outward.outer(self.outward) + DVec3::Y.outer(DVec3::Y) - self.m.outer(self.m);
        in_plane * bend + around.outer(around) * (self.m.dot(self.outward) * self.inverse)
    }

    /// ∂φ/∂R.
    fn by_major(&self) -> f64 {
        -self.m.dot(self.outward)
    }

    /// ∇∂φ/∂R = −∇(m·e) with e outward: m and e rotate as x moves.
    fn gradient_by_major(&self) -> DVec3 {
        let bend = if self.distance > 0.0 { self.distance.recip() } else { 0.0 };
        let along = self.m.dot(self.outward);
        (self.m * along - self.outward) * bend
    }
}

impl Torus {
    /// A ring of radii R > r > 0: from the axis to the centre of the tube, and of the tube itself.
    ///
    /// # Errors
    /// If a parameter is not finite, r is not positive, or R is not larger than r.
    pub fn new(centre: DVec3, major: f64, minor: f64) -> Result<Self, ShapeError> {
        for (axis, name) in ["centre.x", "centre.y", "centre.z"].into_iter().enumerate() {
            ShapeError::check("torus", name, centre[axis], "finite", true)?;
        }
        ShapeError::check("torus", "minor radius", minor, "positive and finite", minor > 0.0)?;
        ShapeError::check(
            "torus",
            "major radius",
            major,
            "larger than the minor radius and finite",
            major > minor,
        )?;
        Ok(Self { centre, major, minor })
    }

    fn local(&self, x: DVec3) -> Local {
        let offset = x - self.centre;
        let p = DVec3::new(offset.x, 0.0, offset.z);
        let rho = p.length();
        let inverse = if rho > 0.0 { rho.recip() } else { 0.0 };
        let outward = p * inverse;
        let from_circle = outward * (rho - self.major) + offset.y * DVec3::Y;
        let distance = (rho - self.major).hypot(offset.y);
        let m = if distance > 0.0 { from_circle / distance } else { DVec3::ZERO };
        Local { outward, inverse, m, distance }
    }
}

impl Parametric<DVec3> for Torus {
    fn parameters(&self) -> Vec<f64> {
        vec![self.centre.x, self.centre.y, self.centre.z, self.major, self.minor]
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        let &[x, y, z, major, minor] = parameters else {
            return Err(ShapeError::Count { expected: 5, found: parameters.len() });
        };
        Self::new(DVec3::new(x, y, z), major, minor)
    }
}

impl Sdf<DVec3> for Torus {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        let local = self.local(x);
        Jet { value: local.distance - self.minor, gradient: local.m }
    }

    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        let local = self.local(x);
        let jet = Jet { value: local.distance - self.minor, gradient: local.m };
        SecondOrder { jet, hessian: local.hessian() }
    }

    fn level_bounds(&self, level: f64) -> Option<(DVec3, DVec3)> {
        let half = DVec3::new(self.major, 0.0, self.major) + (self.minor + level);
        Some((self.centre - half, self.centre + half))
    }

    fn parameter_count(&self) -> usize {
        5
    }

    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        let local = self.local(x);
        let centre = DVec3::from_slice(direction);
        Jet {
            value: -local.m.dot(centre) + local.by_major() * direction[3] - direction[4],
            gradient: local.gradient_by_major() * direction[3] - local.hessian() * centre,
        }
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let local = self.local(x);
        let centre = local.m * covector.value + local.hessian() * covector.gradient;
        for axis in 0..3 {
            gradient[axis] -= centre[axis];
        }
        gradient[3] += local.by_major() * covector.value + local.gradient_by_major().dot(covector.gradient);
        gradient[4] -= covector.value;
    }
}
