//! Boxes with rounded edges.

use flatland::sdf::{Jet, Sdf, SecondOrder, Space as _};
use glam::{BVec3, DMat3, DVec3};

use super::{Parametric, ShapeError};

/// The points within r of an axis-aligned box: with s the signs and q = |x − c| − h,
///
/// ```text
/// φ = |q₊| − r outside the core, max(q) − r inside.
/// ```
///
/// Parameters: the components of the centre c, the half extents h of the core, and the rounding r. The sharp
/// box, r = 0, has corners that no field of tracer points follows.
///
/// Second derivatives are discontinuous between faces and edges of the rounded box; ∇φ is continuous outside
/// the core.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundedBox {
    centre: DVec3,
    half: DVec3,
    rounding: f64,
}

/// Data of a point in the box's own frame.
struct Local {
    /// Signs of x − c.
    signs: DVec3,
    /// Active components of q: the positive ones, or the largest inside.
    counts: BVec3,
    /// ∂φ/∂q.
    m: DVec3,
    /// Distance from the core; negative inside.
    distance: f64,
    /// 1/|q₊|; 0 inside.
    inverse: f64,
}

impl RoundedBox {
    /// A box around a core of half extents h, enlarged by r ≥ 0.
    ///
    /// # Errors
    /// If a parameter is not finite, or an extent or r is negative.
    pub fn new(centre: DVec3, half: DVec3, rounding: f64) -> Result<Self, ShapeError> {
        for (axis, name) in ["centre.x", "centre.y", "centre.z"].into_iter().enumerate() {
            ShapeError::check("rounded box", name, centre[axis], "finite", true)?;
        }
        for (axis, name) in ["half.x", "half.y", "half.z"].into_iter().enumerate() {
            ShapeError::check("rounded box", name, half[axis], "finite and not negative", half[axis] >= 0.0)?;
        }
        ShapeError::check("rounded box", "rounding", rounding, "finite and not negative", rounding >= 0.0)?;
        Ok(Self { centre, half, rounding })
    }

    fn local(&self, x: DVec3) -> Local {
        let offset = x - self.centre;
        let signs = DVec3::from_array(offset.to_array().map(|o| if o < 0.0 { -1.0 } else { 1.0 }));
        let q = offset.abs() - self.half;
        let beyond = q.max(DVec3::ZERO);
        let distance = beyond.length();
        if distance > 0.0 {
            let m = beyond / distance;
            return Local { signs, counts: q.cmpgt(DVec3::ZERO), m, distance, inverse: distance.recip() };
        }
        let most = q.max_position();
        let counts = BVec3::new(most == 0, most == 1, most == 2);
        let m = DVec3::AXES[most];
        Local { signs, counts, m, distance: q[most], inverse: 0.0 }
    }
}

impl Local {
    fn gradient(&self) -> DVec3 {
        self.signs * self.m
    }

    /// ∂²φ/∂q², on the active components.
    fn curvature_times(&self, v: DVec3) -> DVec3 {
        let v = DVec3::select(self.counts, v, DVec3::ZERO);
        (v - self.m * self.m.dot(v)) * self.inverse
    }
}

impl Parametric<DVec3> for RoundedBox {
    fn parameters(&self) -> Vec<f64> {
        [self.centre.to_array(), self.half.to_array()].concat().into_iter().chain([self.rounding]).collect()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        let &[x, y, z, a, b, c, r] = parameters else {
            return Err(ShapeError::Count { expected: 7, found: parameters.len() });
        };
        Self::new(DVec3::new(x, y, z), DVec3::new(a, b, c), r)
    }
}

impl Sdf<DVec3> for RoundedBox {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        let local = self.local(x);
        Jet { value: local.distance - self.rounding, gradient: local.gradient() }
    }

    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        let local = self.local(x);
        let gradient = local.gradient();
        let counts = DVec3::select(local.counts, DVec3::ONE, DVec3::ZERO);
        let hessian = (DMat3::from_diagonal(counts) - gradient.outer(gradient)) * local.inverse;
        SecondOrder { jet: Jet { value: local.distance - self.rounding, gradient }, hessian }
    }

    /// The distance from a convex set is convex.
    fn second_derivative_bound(&self) -> f64 {
        0.0
    }

    fn level_bounds(&self, level: f64) -> Option<(DVec3, DVec3)> {
        let half = self.half + (self.rounding + level);
        Some((self.centre - half, self.centre + half))
    }

    fn parameter_count(&self) -> usize {
        7
    }

    /// q̇ = −s ċ − ḣ.
    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        let local = self.local(x);
        let q = -local.signs * DVec3::from_slice(direction) - DVec3::from_slice(&direction[3..]);
        Jet { value: local.m.dot(q) - direction[6], gradient: local.signs * local.curvature_times(q) }
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let local = self.local(x);
        let q = local.m * covector.value + local.curvature_times(local.signs * covector.gradient);
        for axis in 0..3 {
            gradient[axis] -= local.signs[axis] * q[axis];
            gradient[3 + axis] -= q[axis];
        }
        gradient[6] -= covector.value;
    }
}
