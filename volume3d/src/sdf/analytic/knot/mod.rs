//! Knotted tubes.

mod curve;

use flatland::sdf::{Jet, Sdf, SecondOrder, Space as _};
use glam::{DMat3, DVec3};

use self::curve::Curve;
use super::{Parametric, ShapeError};

/// The points within r of the torus knot T(p, q): the curve that winds p times around the y axis through c
/// and q times through the hole of a torus of radii R and a,
///
/// ```text
/// γ(t) = c + ((R + a cos qt) cos pt, a sin qt, (R + a cos qt) sin pt),   0 ≤ t < 2π,
/// φ = min_t |x − γ(t)| − r.
/// ```
///
/// (2, 3) is the trefoil, (1, 1) an undulating ring. Parameters: the components of c, then R, a and r; p and
/// q are fixed.
///
/// # Differentiability
///
/// The nearest t moves with x and θ. ∂φ/∂θ = −m·∂γ/∂θ, with m = ∇φ the direction from γ(t) to x, does not
/// depend on that motion; its gradient and ∇²φ do. φ is not differentiable where two points of the curve are
/// nearest (its medial axis, including the y axis and the gap between strands) and at centres of curvature,
/// where ∇²φ is unbounded. The returned derivatives are those for one of the nearest points; on the curve
/// itself they are 0. The tube is thinner than the curve's reach, so that except for the curve none of these
/// points is inside it or on it.
///
/// # The nearest point
///
/// The nearest point is global. Pieces of the curve are excluded if bounds on derivatives show that they are
/// too far away, and bisected if bounds on γ″ and γ‴ do not prove |x − γ|² convex. Each other piece has one
/// minimum, found by Newton's method safeguarded by bisection.
#[derive(Clone, Debug, PartialEq)]
pub struct Knot {
    centre: DVec3,
    tube: f64,
    curve: Curve,
}

/// Data of a point near the curve.
struct Local {
    /// ∇φ: away from the curve; 0 on it.
    m: DVec3,
    distance: f64,
    /// 1/distance; 0 on the curve.
    bend: f64,
    /// γ′ at the nearest point.
    tangent: DVec3,
    /// ∇t = γ′/(|γ′|² − (x − γ)·γ″).
    moves: DVec3,
    /// ∂γ/∂R and ∂γ/∂a.
    by_radii: [DVec3; 2],
    /// Their derivatives by t.
    along: [DVec3; 2],
}

impl Local {
    /// ∇²φ = (I − m mᵀ − γ′ ∇tᵀ)/|x − γ|.
    fn hessian(&self) -> DMat3 {
        (DMat3::IDENTITY - self.m.outer(self.m) - self.tangent.outer(self.moves)) * self.bend
    }

    /// ∂φ/∂R or ∂φ/∂a, and its gradient −∇²φ ∂γ/∂θ − (m·∂γ′/∂θ) ∇t.
    fn by_radius(&self, which: usize) -> Jet<DVec3> {
        let velocity = self.by_radii[which];
        let turn = self.moves * self.m.dot(self.along[which]);
        Jet { value: -self.m.dot(velocity), gradient: -(self.hessian() * velocity) - turn }
    }
}

impl Knot {
    /// The tube of radius r around T(p, q) on a torus of radii R and a.
    ///
    /// # Errors
    /// - A parameter is not finite, or a radius not positive.
    /// - a is not between R/1000 and R (for thinner ones use a ring, [`Torus`](super::Torus)).
    /// - p or q is 0, they have a common divisor, or p + q exceeds 32.
    /// - r is not smaller than the reach of the curve, where the tube would touch itself or have kinks. The
    ///   reach is the least |γ(s) − γ(t)|²/2 divided by the distance of γ(s) from the tangent at t (Federer
    ///   1959), computed to about 0.1 % by sampling t and s.
    pub fn new(
        centre: DVec3,
        (p, q): (u32, u32),
        (major, minor): (f64, f64),
        tube: f64,
    ) -> Result<Self, ShapeError> {
        let check =
            |parameter, value, wanted, holds| ShapeError::check("knot", parameter, value, wanted, holds);
        for (axis, name) in ["centre.x", "centre.y", "centre.z"].into_iter().enumerate() {
            check(name, centre[axis], "finite", true)?;
        }
        let windings = 1..=31;
        check("p", f64::from(p), "between 1 and 31", windings.contains(&p))?;
        check("q", f64::from(q), "between 1 and 31", windings.contains(&q))?;
        check("p + q", f64::from(p) + f64::from(q), "at most 32", u64::from(p) + u64::from(q) <= 32)?;
        check("q", f64::from(q), "without a common divisor with p", divisor(p, q) == 1)?;
        check("major radius", major, "larger than the minor radius and finite", major > minor)?;
        check("minor radius", minor, "at least a thousandth of the major radius", minor >= 1e-3 * major)?;
        check("minor radius", minor, "positive", minor > 0.0)?;
        check("tube radius", tube, "positive and finite", tube > 0.0)?;
        let curve = Curve::new([p, q].map(f64::from), major, minor);
        check("tube radius", tube, "smaller than the reach of the curve", tube < curve.reach())?;
        Ok(Self { centre, tube, curve })
    }

    /// Windings around the axis, and through the hole.
    #[must_use]
    pub fn windings(&self) -> (u32, u32) {
        let [p, q] = self.curve.windings();
        (p as u32, q as u32)
    }

    fn local(&self, x: DVec3) -> Local {
        let offset = x - self.centre;
        let [[by_major, along_major, bend_major], [by_minor, along_minor, bend_minor]] =
            self.curve.basis(self.curve.nearest(offset));
        let [major, minor] = self.curve.radii();
        let from_curve = offset - (by_major * major + by_minor * minor);
        let tangent = along_major * major + along_minor * minor;
        let turn = bend_major * major + bend_minor * minor;
        let distance = from_curve.length();
        let bend = if distance > 0.0 { distance.recip() } else { 0.0 };
        let convexity = tangent.dot(tangent) - from_curve.dot(turn);
        // Not positive only at centres of curvature, up to rounding.
        let moves = if convexity > 0.0 { tangent / convexity } else { DVec3::ZERO };
        Local {
            m: from_curve * bend,
            distance,
            bend,
            tangent,
            moves,
            by_radii: [by_major, by_minor],
            along: [along_major, along_minor],
        }
    }
}

/// Greatest common divisor.
fn divisor(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { divisor(b, a % b) }
}

impl Parametric<DVec3> for Knot {
    fn parameters(&self) -> Vec<f64> {
        let [major, minor] = self.curve.radii();
        vec![self.centre.x, self.centre.y, self.centre.z, major, minor, self.tube]
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        let &[x, y, z, major, minor, tube] = parameters else {
            return Err(ShapeError::Count { expected: 6, found: parameters.len() });
        };
        Self::new(DVec3::new(x, y, z), self.windings(), (major, minor), tube)
    }
}

impl Sdf<DVec3> for Knot {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        let local = self.local(x);
        Jet { value: local.distance - self.tube, gradient: local.m }
    }

    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        let local = self.local(x);
        let jet = Jet { value: local.distance - self.tube, gradient: local.m };
        SecondOrder { jet, hessian: local.hessian() }
    }

    /// Box around the torus on which the curve lies, enlarged by r and the level.
    fn level_bounds(&self, level: f64) -> Option<(DVec3, DVec3)> {
        let [major, minor] = self.curve.radii();
        let half = DVec3::new(major + minor, minor, major + minor) + (self.tube + level);
        Some((self.centre - half, self.centre + half))
    }

    fn parameter_count(&self) -> usize {
        6
    }

    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        let local = self.local(x);
        let centre = DVec3::from_slice(direction);
        let moved = Jet { value: -local.m.dot(centre) - direction[5], gradient: -(local.hessian() * centre) };
        moved + local.by_radius(0) * direction[3] + local.by_radius(1) * direction[4]
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let local = self.local(x);
        let centre = local.m * covector.value + local.hessian() * covector.gradient;
        for axis in 0..3 {
            gradient[axis] -= centre[axis];
        }
        gradient[3] += local.by_radius(0).dot(covector);
        gradient[4] += local.by_radius(1).dot(covector);
        gradient[5] -= covector.value;
    }
}
