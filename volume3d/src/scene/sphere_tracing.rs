//! Rays that meet implicit surfaces: sphere tracing (Hart 1996).

use flatland::sdf::{Sdf as _, Tracer};
use glam::DVec3;

use super::build::Scene;
use super::hit::{Hit, Surface};
use super::implicit::ImplicitShape;
use super::trace_counts::TraceCounts;

/// A ray that leaves an implicit surface starts at this part of the surface's size, where φ has risen above rounding. What
/// is nearer than that, in its own folds, it does not see.
const LEAVING: f64 = 1e-4;

/// A step to where φ is negative by more than this part of what it was: the slope on the way was above its bound.
const STEEP: f64 = 1e-6;

/// On surfaces |∇φ| must not be less, as fields take it for the speed of level sets there.
const FLAT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// How often a root is made more exact: Newton's method doubles its digits.
const POLISHING: usize = 6;

/// The part of a ray on which a surface may be.
#[derive(Clone, Copy)]
struct Part {
    near: f64,
    far: f64,
}

impl Scene {
    /// What tracing implicit surfaces has met since the scene was made, or was last given meshes of another topology.
    #[must_use]
    pub fn trace_counts(&self) -> TraceCounts {
        self.trace_counters.get()
    }

    /// Counts a ray of a warp field that ran out of steps.
    pub(crate) fn count_out_of_steps(&self) {
        self.trace_counters.count_out_of_steps();
    }

    /// The nearest implicit surface along a ray between two distances.
    pub(super) fn closest_implicit(
        &self,
        origin: DVec3,
        direction: DVec3,
        from: Option<Surface>,
        (near, far): (f64, f64),
    ) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (index, shape) in self.description.implicits.iter().enumerate() {
            let surface = Surface::Implicit(index as u32);
            let far = nearest.map_or(far, |hit| hit.distance);
            let start = if from == Some(surface) { self.leaving(index as u32) } else { near };
            let Some(part) = self.part(index, origin, direction, Part { near: start, far }) else { continue };
            if let Some(distance) = self.march(shape, origin, direction, part) {
                nearest = Some(Hit { surface, distance, coordinates: [0.0; 3] });
            }
        }
        nearest
    }

    /// How far from its origin a ray starts that leaves an implicit surface.
    pub(crate) fn leaving(&self, implicit: u32) -> f64 {
        LEAVING * self.implicit_size(implicit)
    }

    /// The distance beyond which nothing of a surface is seen from a point.
    pub(crate) fn far_of(&self, implicit: u32, origin: DVec3) -> f64 {
        match self.implicit_bounds[implicit as usize] {
            Some((low, high)) => (0.5 * (low + high) - origin).length() + 0.5 * (high - low).length(),
            None => self.description.tracer.far,
        }
    }

    /// Half the diagonal of its box, or that of the scene's if it has none.
    pub(crate) fn implicit_size(&self, implicit: u32) -> f64 {
        match self.implicit_bounds[implicit as usize] {
            Some((low, high)) => 0.5 * (high - low).length(),
            None => self.extent,
        }
    }

    /// What of a part of a ray is within the surface's box.
    fn part(&self, index: usize, origin: DVec3, direction: DVec3, part: Part) -> Option<Part> {
        let Some((low, high)) = self.implicit_bounds[index] else {
            return Some(Part { far: part.far.min(self.description.tracer.far), ..part });
        };
        let inverse = direction.recip();
        let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
        // NaN arises where a ray runs within a face of the box: max and min then drop it.
        let (enter, leave) = (a.min(b), a.max(b));
        let near = enter.x.max(enter.y).max(enter.z).max(part.near);
        let far = leave.x.min(leave.y).min(leave.z).min(part.far);
        (near <= far).then_some(Part { near, far })
    }

    /// How far away the surface is.
    fn march(&self, shape: &ImplicitShape, origin: DVec3, direction: DVec3, part: Part) -> Option<f64> {
        let Tracer { step_scale, tolerance, max_steps, .. } = self.description.tracer;
        let bound = shape.slope_bound();
        let scale = step_scale / bound;
        let mut t = part.near;
        let mut steep = false;
        let mut before = f64::INFINITY;
        let (mut end, mut flat) = (None, false);
        let mut out_of_steps = true;
        for _ in 0..max_steps {
            let value = shape.value(origin + direction * t);
            // A whole step took φ from `before` to 0 at most.
            steep |= value < before * (1.0 - step_scale) - STEEP * before;
            before = value;
            if value <= tolerance * t {
                let (root, slope) = polished(shape, origin, direction, t);
                // What hits within the tolerance may do so beyond the end: a light, or the point that is looked for.
                end = (root < part.far).then_some(root);
                flat = end.is_some() && slope < FLAT;
                out_of_steps = false;
                break;
            }
            t += scale * value;
            if t >= part.far {
                out_of_steps = false;
                break;
            }
        }
        let counters = &self.trace_counters;
        if out_of_steps {
            counters.count_out_of_steps();
        }
        if steep {
            counters.count_too_steep();
        }
        if flat {
            counters.count_too_flat();
        }
        end
    }
}

/// The root of φ along a ray next to t, as exactly as Newton's method finds it: |φ| at least halves at each step.
/// And |∇φ| there.
fn polished(shape: &ImplicitShape, origin: DVec3, direction: DVec3, mut t: f64) -> (f64, f64) {
    let mut jet = shape.jet(origin + direction * t);
    for _ in 0..POLISHING {
        let next = t - jet.value / jet.gradient.dot(direction);
        if !(next.is_finite() && next > 0.0) {
            break;
        }
        let there = shape.jet(origin + direction * next);
        if there.value.abs() > 0.5 * jet.value.abs() {
            break;
        }
        (t, jet) = (next, there);
    }
    (t, jet.gradient.length())
}
