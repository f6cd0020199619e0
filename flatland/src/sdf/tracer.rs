//! Sphere tracing (Hart 1996), with the derivatives of every point with respect to the direction.

use std::iter::Sum;
use std::ops::AddAssign;

use super::distance::{Jet, Sdf};
use super::scalar::Scalar;
use super::space::Space;

/// Parameters of ray tracing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tracer {
    /// ℓ = `step_scale` · φ divided by the bound on |∇φ|, in (0, 1]. Values below 1 give more points, and
    /// safety if |∇φ| slightly exceeds its bound.
    pub step_scale: f64,
    /// Tolerance: a point is on the surface if |φ| ≤ `tolerance` · t, an angle in radians, and the ray hits;
    /// at grazing incidence a root of φ must be found. In [10⁻¹⁴, 1).
    pub tolerance: f64,
    /// Largest number of points of a ray. A ray that passes the surface at the angle δ needs about δ^−½ of
    /// them.
    pub max_steps: usize,
    /// Distance at which a ray has left the scene.
    pub far: f64,
}

/// The cosine −∇φ·ω/|∇φ| above which a ray within the tolerance certainly hits: φ + φ′s + φ″s²/2 has a root
/// if φ′² ≥ 2 φ φ″, and |∇φ|/φ″ is the radius of curvature.
const STEEP: f64 = 0.1;
/// Value of |φ|/t that counts as rounding.
const EXACT: f64 = 1e-14;

impl Default for Tracer {
    /// Full steps, 10⁻¹⁰ radians, n = 20,000 points, 10³ units: rays within about 2π²r/(tn²) ≈ 5·10⁻⁸ r/t
    /// radians of a smooth silhouette of radius of curvature r at the distance t run out of steps.
    fn default() -> Self {
        Self { step_scale: 1.0, tolerance: 1e-10, max_steps: 20_000, far: 1e3 }
    }
}

/// Invalid parameters of the tracer.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TracerError {
    /// The step scale must be in (0, 1].
    #[error("the step scale {scale} is not in (0, 1]")]
    StepScale {
        /// The scale.
        scale: f64,
    },
    /// The tolerance must be in [10⁻¹⁴, 1): below, rounding stops the ray before the surface.
    #[error("the tolerance {tolerance} is not in [1e-14, 1)")]
    Tolerance {
        /// The tolerance.
        tolerance: f64,
    },
    /// The number of steps is 0.
    #[error("at least one step is needed")]
    NoSteps,
    /// The far limit must be positive and finite.
    #[error("the far limit {far} is not positive and finite")]
    Far {
        /// The limit.
        far: f64,
    },
}

/// End of a ray.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// Its last point is on the surface.
    Hit,
    /// It reached the far limit.
    Miss,
    /// Neither, within the allowed steps, or φ was NaN. Such a ray counts as a miss, and all estimators
    /// report their number.
    OutOfSteps,
}

impl End {
    /// The count of a single ray with this end.
    pub(super) fn count(self) -> RayCount {
        RayCount { traced: 1, out_of_steps: u64::from(self == Self::OutOfSteps) }
    }
}

/// x_i = o + t_i ω, with ∇_ω of everything that depends on it. Gradients are tangent at ω.
#[derive(Clone, Copy, Debug)]
pub struct TracePoint<V> {
    /// x_i.
    pub position: V,
    /// t_i.
    pub t: f64,
    /// ∇_ω t_i.
    pub t_gradient: V,
    /// φ and ∇φ at x_i.
    pub jet: Jet<V>,
    /// ∇_ω φ(x_i).
    pub phi_gradient: V,
    /// ℓ_i, the length of the step from here, truncated at the far limit.
    pub step: f64,
    /// ∇_ω ℓ_i.
    pub step_gradient: V,
}

/// A traced ray: all its points, the first of which is the eye, and its end.
#[derive(Clone, Debug)]
pub struct Trace<V> {
    /// ω.
    pub direction: V,
    /// All points at which φ was evaluated.
    pub points: Vec<TracePoint<V>>,
    /// End of the ray.
    pub end: End,
}

/// Number of rays traced, and of those that ran out of steps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RayCount {
    /// All rays.
    pub traced: u64,
    /// Rays that ended with [`End::OutOfSteps`].
    pub out_of_steps: u64,
}

impl From<u64> for RayCount {
    /// Rays that need no steps.
    fn from(traced: u64) -> Self {
        Self { traced, out_of_steps: 0 }
    }
}

impl AddAssign for RayCount {
    fn add_assign(&mut self, other: Self) {
        self.traced += other.traced;
        self.out_of_steps += other.out_of_steps;
    }
}

impl Sum for RayCount {
    fn sum<I: Iterator<Item = Self>>(counts: I) -> Self {
        counts.fold(Self::default(), |mut sum, count| {
            sum += count;
            sum
        })
    }
}

impl<V> Trace<V> {
    /// The count of this ray.
    #[must_use]
    pub fn count(&self) -> RayCount {
        self.end.count()
    }

    /// The point on the surface, if one was found.
    #[must_use]
    pub fn hit(&self) -> Option<&TracePoint<V>> {
        if self.end == End::Hit { self.points.last() } else { None }
    }
}

/// An implicit shape seen from a point.
#[derive(Clone, Copy)]
pub struct View<'a, V: Space> {
    /// φ.
    pub sdf: &'a dyn Sdf<V>,
    /// o, outside the shape or on its surface.
    pub eye: V,
    /// t₀, where rays start: 0 in free space. On a surface φ = 0 and no step would be taken; rays that leave
    /// one start beyond it.
    pub start: f64,
    /// Parameters of ray tracing.
    pub tracer: Tracer,
}

impl Tracer {
    /// Checks the parameters once, so that tracing need not.
    ///
    /// # Errors
    /// A [`TracerError`] that names the parameter.
    pub fn check(&self) -> Result<(), TracerError> {
        if !(self.step_scale > 0.0 && self.step_scale <= 1.0) {
            return Err(TracerError::StepScale { scale: self.step_scale });
        }
        if !(self.tolerance >= 1e-14 && self.tolerance < 1.0) {
            return Err(TracerError::Tolerance { tolerance: self.tolerance });
        }
        if self.max_steps == 0 {
            return Err(TracerError::NoSteps);
        }
        if self.far > 0.0 && self.far.is_finite() { Ok(()) } else { Err(TracerError::Far { far: self.far }) }
    }
}

impl<V: Space> View<'_, V> {
    /// Traces the ray in the unit direction ω:
    ///
    /// ```text
    /// t_{i+1} = t_i + ℓ_i,   ∇_ω t_{i+1} = ∇_ω t_i + ∇_ω ℓ_i,   ℓ = s φ,
    /// ∇_ω φ(x_i) = t_i P_ω ∇φ + (∇φ·ω) ∇_ω t_i.
    /// ```
    ///
    /// The last step of a miss ends at the far limit, so that points which enter there as ω rotates do so
    /// with ℓ = 0.
    #[must_use]
    pub fn trace(&self, direction: V) -> Trace<V> {
        let mut trace = Trace { direction, points: vec![], end: End::OutOfSteps };
        self.trace_until(direction, Scalar::constant(self.tracer.far), &mut trace);
        trace
    }

    /// [`trace`](Self::trace) up to a far limit that may depend on the direction, such as the distance of
    /// another hit of the ray. The trace's previous content is discarded, its memory reused.
    pub fn trace_until(&self, direction: V, far: Scalar<V>, trace: &mut Trace<V>) {
        trace.direction = direction;
        trace.points.clear();
        let points = &mut trace.points;
        let look = |x| (self.sdf.jet(x), ());
        trace.end = self.walk(direction, far, look, |point, ()| points.push(*point));
    }

    /// Visits the points in order, with additional results of each evaluation of φ.
    #[inline]
    pub(super) fn walk<T>(
        &self,
        direction: V,
        far: Scalar<V>,
        look: impl Fn(V) -> (Jet<V>, T),
        mut visit: impl FnMut(&TracePoint<V>, T),
    ) -> End {
        let tracer = &self.tracer;
        let scale = tracer.step_scale / self.sdf.slope_bound();
        let (mut t, mut t_gradient) = (self.start, V::ZERO);
        for index in 0..tracer.max_steps {
            let position = self.eye + direction * t;
            let (jet, more) = look(position);
            let along = jet.gradient.dot(direction);
            let phi_gradient = (jet.gradient - direction * along) * t + t_gradient * along;
            let (mut step, mut step_gradient) = (scale * jet.value, phi_gradient * scale);
            let leaves = t + step >= far.value;
            if leaves {
                (step, step_gradient) = (far.value - t, far.gradient - t_gradient);
            }
            visit(&TracePoint { position, t, t_gradient, jet, phi_gradient, step, step_gradient }, more);
            if index > 0 && jet.value.abs() <= tracer.tolerance * t && self.hits(direction, t, jet, along) {
                return End::Hit;
            }
            if leaves {
                return End::Miss;
            }
            t += step;
            t_gradient = t_gradient + step_gradient;
        }
        End::OutOfSteps
    }

    /// Whether a ray within the tolerance of the surface at t hits it. A grazing ray does if Newton's method
    /// finds a root; without a root, φ does not halve at each step.
    fn hits(&self, direction: V, mut t: f64, mut jet: Jet<V>, mut along: f64) -> bool {
        if along * along >= STEEP * STEEP * jet.gradient.dot(jet.gradient) {
            return true;
        }
        while jet.value > EXACT * t {
            let next = t - jet.value / along;
            let there = self.sdf.jet(self.eye + direction * next);
            let halves = there.value <= 0.5 * jet.value;
            if !halves {
                return false;
            }
            (t, jet, along) = (next, there, there.gradient.dot(direction));
        }
        true
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::sdf::shapes::{Circle, Shape, SmoothUnion};

    fn two_discs() -> Shape {
        let circle = |x, y, r| Shape::Circle(Circle::new(DVec2::new(x, y), r).expect("a circle"));
        let union = SmoothUnion::new(circle(3.0, 0.5, 0.6), circle(4.0, -1.3, 0.7), 0.3);
        Shape::Union(Box::new(union.expect("a union")))
    }

    fn view(sdf: &Shape) -> View<'_, DVec2> {
        View { sdf, eye: DVec2::ZERO, start: 0.0, tracer: Tracer { far: 20.0, ..Tracer::default() } }
    }

    #[test]
    fn every_gradient_is_that_of_the_discrete_trace() {
        // Rays that start beyond the eye and end at a wall.
        let wall = |angle: f64| {
            let gradient = DVec2::from_angle(angle).perp() * (2.0 * (4.0 * angle).cos());
            Scalar { value: 3.9 + 0.5 * (4.0 * angle).sin(), gradient }
        };
        let shape = two_discs();
        let free = view(&shape);
        let walled = View { start: 0.7, ..free };
        let at = |is_walled: bool, angle: f64| {
            let mut trace = free.trace(DVec2::from_angle(0.3));
            let (view, far) = if is_walled { (walled, wall(angle)) } else { (free, Scalar::constant(20.0)) };
            view.trace_until(DVec2::from_angle(angle), far, &mut trace);
            trace
        };
        let h = 1e-7;
        let angles = [-0.4, -0.17, 0.02, 0.1, 0.3, 0.42, 1.0].map(|angle| [(false, angle), (true, angle)]);
        for (is_walled, angle) in angles.into_iter().flatten() {
            let direction = DVec2::from_angle(angle);
            let [middle, plus, minus] = [0.0, h, -h].map(|h| at(is_walled, angle + h));
            let end = middle.points.last().map_or(0.0, |p| p.t + p.step);
            assert!(!is_walled || middle.end == End::Hit || (end - wall(angle).value).abs() < 1e-12);
            let rows = middle.points.iter().zip(&plus.points).zip(&minus.points);
            for (index, ((point, plus), minus)) in rows.enumerate() {
                let pairs = [
                    ("t", point.t_gradient, plus.t - minus.t),
                    ("φ", point.phi_gradient, plus.jet.value - minus.jet.value),
                    ("ℓ", point.step_gradient, plus.step - minus.step),
                ];
                for (what, gradient, difference) in pairs {
                    let (found, expected) = (gradient.dot(direction.perp()), difference / (2.0 * h));
                    let tolerance = 1e-5 * (1.0 + expected.abs());
                    assert!(
                        (found - expected).abs() < tolerance,
                        "{angle} {index} {what} {found} {expected}"
                    );
                    assert!(gradient.dot(direction).abs() < 1e-9 * (1.0 + expected.abs()));
                }
            }
        }
    }

    #[test]
    fn rays_end_as_they_must() {
        let shape = two_discs();
        let view = view(&shape);
        assert_eq!(view.trace(DVec2::NEG_X).end, End::Miss);
        let hit = view.trace(DVec2::from_angle(0.1));
        let point = hit.hit().expect("a hit");
        assert!(point.jet.value.abs() < 1e-9 && point.t < 4.0);
        let short = View { tracer: Tracer { max_steps: 3, ..view.tracer }, ..view };
        assert_eq!(short.trace(DVec2::from_angle(0.1)).end, End::OutOfSteps);
        assert_eq!(short.trace(DVec2::from_angle(0.1)).points.len(), 3);
        // The steps of a miss sum to the far limit.
        let miss = view.trace(DVec2::from_angle(1.0));
        let sum: f64 = miss.points.iter().map(|p| p.step).sum();
        assert!((sum - 20.0).abs() < 1e-12, "{sum}");
    }

    /// Within the tolerance of a silhouette, on both sides.
    #[test]
    fn rays_that_graze_hit_only_what_they_meet() {
        let shape = Shape::Circle(Circle::new(DVec2::new(3.0, 0.0), 1.0).expect("a circle"));
        let tracer = Tracer { tolerance: 1e-4, far: 20.0, ..Tracer::default() };
        let view = View { sdf: &shape, eye: DVec2::ZERO, start: 0.0, tracer };
        let silhouette = (1.0_f64 / 3.0).asin();
        for away in [1e-5, 1e-6, 1e-7] {
            let end = |away: f64| view.trace(DVec2::from_angle(silhouette + away)).end;
            assert_eq!([end(-away), end(away)], [End::Hit, End::Miss], "{away}");
        }
    }

    #[test]
    fn bad_parameters_are_refused() {
        let good = Tracer::default();
        assert_eq!(good.check(), Ok(()));
        let scale = Tracer { step_scale: 1.5, ..good }.check();
        assert!(matches!(scale, Err(TracerError::StepScale { .. })));
        let tolerance = Tracer { tolerance: f64::NAN, ..good }.check();
        assert!(matches!(tolerance, Err(TracerError::Tolerance { .. })));
        assert_eq!(Tracer { max_steps: 0, ..good }.check(), Err(TracerError::NoSteps));
        assert!(matches!(Tracer { far: f64::INFINITY, ..good }.check(), Err(TracerError::Far { .. })));
    }
}
