//! Sphere tracing of implicit surfaces (Hart 1996), with longer steps where second derivatives are bounded
//! (Kalra and Barr 1989).

use flatland::sdf::fields::MeanPoint;
use flatland::sdf::{End, Jet, Tracer};
use glam::DVec3;

use super::build::Scene;
use super::hit::{Hit, Surface};
use super::implicit::{Implicit, ImplicitShape, Placement};
use super::trace_counts::TraceCounts;

/// Start of a ray that leaves an implicit surface, relative to the surface's size, where φ exceeds rounding.
/// Parts of the surface nearer than that, in its own folds, are not seen.
const LEAVING: f64 = 1e-4;

/// Relative amount by which φ may fall below its lower bound in a step before the slope counts as above its
/// bound.
const STEEP: f64 = 1e-6;

/// Least |∇φ| on surfaces, as fields use it for the speed of level sets there.
const FLAT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// Largest number of evaluations of φ to prove that a ray is clear of a surface.
const LOOKS: usize = 64;

/// Tolerance, an angle and relative to the size, within which roots are searched if the tolerance of fields
/// is smaller: rays inside an outline then need fewer steps.
const ROOTS: f64 = 1e-6;

/// Value of |φ| that counts as zero, relative to the largest of distance, surface size and local coordinates
/// of the ray.
const EXACT: f64 = 1e-12;

/// See [`ROOTS`].
fn root_tolerance(tolerance: f64) -> f64 {
    tolerance.max(ROOTS)
}

/// The part of a ray on which a surface may lie.
#[derive(Clone, Copy)]
struct Part {
    near: f64,
    far: f64,
}

impl Scene {
    /// Counts of lost rays since the scene was made, or was last given meshes of another topology.
    #[must_use]
    pub fn trace_counts(&self) -> TraceCounts {
        self.trace_counters.get()
    }

    /// Counts a ray of a warp field that ran out of steps.
    pub(crate) fn count_out_of_steps(&self) {
        self.trace_counters.count_out_of_steps();
    }

    /// Nearest hit with an implicit surface along a ray between two distances, except one that the ray is
    /// known not to hit.
    pub(crate) fn closest_implicit(
        &self,
        origin: DVec3,
        direction: DVec3,
        from: Option<Surface>,
        (near, far): (f64, f64),
        clear: Option<u32>,
    ) -> Option<Hit> {
        let mut nearest: Option<Hit> = None;
        for (index, shape) in self.implicits().iter().enumerate() {
            if clear == Some(index as u32) {
                continue;
            }
            let surface = Surface::Implicit(index as u32);
            let far = nearest.map_or(far, |hit| hit.distance);
            let start = if from == Some(surface) { self.leaving(index as u32) } else { near };
            let Some(part) = self.part(index, origin, direction, Part { near: start, far }) else { continue };
            let ray = LocalRay::new(shape, origin, direction, self.implicit_size(index as u32));
            if let Some(distance) = self.march(&ray, part) {
                nearest = Some(Hit { surface, distance, coordinates: [0.0; 3] });
            }
        }
        nearest
    }

    /// Distance of a ray's hit with an implicit surface, from the end of the ray found by its field, and
    /// whether |∇φ| is too small there; `None` if the end does not determine it.
    pub(crate) fn hit_at_end(
        &self,
        implicit: u32,
        (origin, direction): (DVec3, DVec3),
        point: &MeanPoint<DVec3>,
    ) -> Option<Option<(Hit, bool)>> {
        if point.too_steep {
            return None;
        }
        match point.end {
            End::Miss => Some(None),
            End::OutOfSteps => None,
            End::Hit => {
                let shape = &self.implicits()[implicit as usize];
                let ray = LocalRay::new(shape, origin, direction, self.implicit_size(implicit));
                let tolerance = self.description.tracer.tolerance;
                // For a small, distant object the end may be nearer to another root.
                if tolerance * point.last > root_tolerance(tolerance) * ray.size {
                    return None;
                }
                let (root, there) = ray.polished(point.last, 0.0);
                let distance = root * ray.scale;
                let is_root = there.value.abs() <= EXACT * ray.largest().max(root)
                    && distance < self.far_of(implicit, origin);
                let hit = Hit { surface: Surface::Implicit(implicit), distance, coordinates: [0.0; 3] };
                is_root.then_some(Some((hit, there.gradient.length() < FLAT)))
            }
        }
    }

    /// Counts a hit with too small |∇φ|.
    pub(crate) fn count_too_flat(&self) {
        self.trace_counters.count_too_flat();
    }

    /// Start distance of a ray that leaves an implicit surface.
    pub(crate) fn leaving(&self, implicit: u32) -> f64 {
        LEAVING * self.implicit_size(implicit)
    }

    /// Distance beyond which no part of a surface is visible from a point.
    pub(crate) fn far_of(&self, implicit: u32, origin: DVec3) -> f64 {
        match self.implicit_bounds[implicit as usize] {
            Some((low, high)) => (0.5 * (low + high) - origin).length() + 0.5 * (high - low).length(),
            None => self.description.tracer.far,
        }
    }

    /// Half the diagonal of the surface's box, or of the scene's if it has none.
    pub(crate) fn implicit_size(&self, implicit: u32) -> f64 {
        match self.implicit_bounds[implicit as usize] {
            Some((low, high)) => 0.5 * (high - low).length(),
            None => self.extent,
        }
    }

    /// Whether a surface is at least `angle` radians from a part of a ray, as seen from its origin: φ > c t
    /// all along, which a few evaluations of φ prove for most rays that leave the surface. False if they do
    /// not.
    pub(crate) fn keeps_away(
        &self,
        implicit: u32,
        (origin, direction): (DVec3, DVec3),
        (near, far): (f64, f64),
        angle: f64,
    ) -> bool {
        let index = implicit as usize;
        let shape = &self.implicits()[index];
        let ray = LocalRay::new(shape, origin, direction, self.implicit_size(implicit));
        // φ − c t decreases faster by that.
        let ray = LocalRay { slope: ray.slope + angle, ..ray };
        // Second derivatives are bounded only within the box.
        let part = self.part(index, origin, direction, Part { near, far });
        let leaves = part.map_or(near, |part| part.far) / ray.scale;
        let (mut t, far) = (near / ray.scale, far / ray.scale);
        let mut least = f64::NEG_INFINITY;
        for _ in 0..LOOKS {
            let (value, slope) = ray.look(t);
            let (value, slope) = (value - angle * t, slope - angle);
            // A slope above its bound proves nothing: the ray must be traced.
            let is_above = value > 0.0 && value >= least;
            if !is_above {
                return false;
            }
            let step = self.description.tracer.step_scale
                * (value / ray.slope).max(ray.step(value, slope).min(leaves - t));
            least = ray.least(value, slope, step) - STEEP * value;
            t += step;
            if t >= far {
                return true;
            }
        }
        false
    }

    /// Intersection of a part of a ray with the surface's box.
    fn part(&self, index: usize, origin: DVec3, direction: DVec3, part: Part) -> Option<Part> {
        let Some((low, high)) = self.implicit_bounds[index] else {
            return Some(Part { far: part.far.min(self.description.tracer.far), ..part });
        };
        let inverse = direction.recip();
        let (a, b) = ((low - origin) * inverse, (high - origin) * inverse);
        // A ray within a face plane of the box gives NaN, which max and min drop.
        let (enter, leave) = (a.min(b), a.max(b));
        let near = enter.x.max(enter.y).max(enter.z).max(part.near);
        let far = leave.x.min(leave.y).min(leave.z).min(part.far);
        (near <= far).then_some(Part { near, far })
    }

    /// Distance to the surface.
    ///
    /// A ray that passes it within the tracer's tolerance is not a hit: at its nearest point ∇φ·ω is 0, and
    /// hit points would move with infinite speed.
    fn march(&self, ray: &LocalRay<'_>, part: Part) -> Option<f64> {
        let Tracer { tolerance, max_steps, step_scale, .. } = self.description.tracer;
        let (near, far) = (part.near / ray.scale, part.far / ray.scale);
        let mut t = near;
        let mut steep = false;
        let mut least = f64::NEG_INFINITY;
        let (mut end, mut flat) = (None, false);
        let mut out_of_steps = true;
        for _ in 0..max_steps {
            let (value, slope) = ray.look(t);
            steep |= value < least;
            // For a small, distant object the tolerance may exceed the spacing of its parts: a root is
            // searched only where a single one is near.
            if value <= root_tolerance(tolerance) * t.min(ray.size) {
                let (root, there) = ray.polished(t, near);
                if value <= 0.0 || there.value.abs() <= EXACT * ray.largest().max(root) {
                    // It may be beyond the end: a light, or the target point.
                    end = (root < far).then_some(root * ray.scale);
                    flat = end.is_some() && there.gradient.length() < FLAT;
                    out_of_steps = false;
                    break;
                }
            }
            let step = step_scale * ray.step(value, slope);
            least = ray.least(value, slope, step) - STEEP * value;
            t += step;
            if t >= far {
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

/// A ray in the coordinates of a surface, with distances divided by the placement's scale.
struct LocalRay<'a> {
    surface: &'a dyn Implicit,
    origin: DVec3,
    direction: DVec3,
    scale: f64,
    size: f64,
    /// L, the bound on |∇φ|: φ(t) ≥ φ(0) − L t.
    slope: f64,
    /// M, the bound on second derivatives, or ∞: φ(t) ≥ φ(0) + φ′(0) t − M t²/2.
    bend: f64,
}

impl<'a> LocalRay<'a> {
    /// From a world ray, and the size of the shape in the world.
    fn new(shape: &'a ImplicitShape, origin: DVec3, direction: DVec3, size: f64) -> Self {
        let Placement { scale, rotation, translation } = shape.placement;
        let turn = rotation.transpose();
        let surface = &*shape.surface;
        let (slope, bend) = (surface.slope_bound(), surface.second_derivative_bound());
        let origin = turn * (origin - translation) / scale;
        Self { surface, origin, direction: turn * direction, scale, size: size / scale, slope, bend }
    }

    /// Magnitude to which rounding of φ is relative: the size of the surface, or the coordinates of the ray's
    /// origin.
    fn largest(&self) -> f64 {
        self.size.max(self.origin.abs().max_element())
    }

    fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// φ, and φ′ if it is needed.
    fn look(&self, t: f64) -> (f64, f64) {
        if self.bend == f64::INFINITY {
            return (self.surface.value(self.at(t)), -self.slope);
        }
        let jet = self.surface.jet(self.at(t));
        (jet.value, jet.gradient.dot(self.direction))
    }

    /// Lower bound on the distance to a root: the larger one from the two bounds.
    fn step(&self, value: f64, slope: f64) -> f64 {
        let straight = value / self.slope;
        // If φ + φ′ t − M t²/2 is negative at that distance, its root is nearer.
        if value + (slope - 0.5 * self.bend * straight) * straight <= 0.0 {
            return straight;
        }
        // The root, without cancellation.
        let root = (slope * slope + 2.0 * self.bend * value).sqrt();
        let bent = if slope > 0.0 { (slope + root) / self.bend } else { 2.0 * value / (root - slope) };
        straight.max(bent)
    }

    /// Lower bound on φ after a step.
    fn least(&self, value: f64, slope: f64, step: f64) -> f64 {
        (value - self.slope * step).max(value + (slope - 0.5 * self.bend * step) * step)
    }

    /// The root next to t, to the precision of Newton's method, with φ and ∇φ there. Stops when |φ| does not
    /// halve in a step: at a kink, or without a root. Never nearer than `near`, the start of the ray.
    fn polished(&self, mut t: f64, near: f64) -> (f64, Jet<DVec3>) {
        let mut jet = self.surface.jet(self.at(t));
        while jet.value != 0.0 {
            let next = t - jet.value / jet.gradient.dot(self.direction);
            if !(next.is_finite() && next >= near) {
                break;
            }
            let there = self.surface.jet(self.at(next));
            let halves = there.value.abs() <= 0.5 * jet.value.abs();
            if !halves {
                break;
            }
            (t, jet) = (next, there);
        }
        (t, jet)
    }
}
