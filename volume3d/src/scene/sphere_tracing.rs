//! Rays that meet implicit surfaces: sphere tracing (Hart 1996), with longer steps where second derivatives are bounded (Kalra and
//! Barr 1989).

use flatland::sdf::fields::MeanPoint;
use flatland::sdf::{End, Jet, Tracer};
use glam::DVec3;

use super::build::Scene;
use super::hit::{Hit, Surface};
use super::implicit::{Implicit, ImplicitShape, Placement};
use super::trace_counts::TraceCounts;

/// A ray that leaves an implicit surface starts at this part of the surface's size, where φ has risen above rounding. What
/// is nearer than that, in its own folds, it does not see.
const LEAVING: f64 = 1e-4;

/// A step to where φ is less by more than this part of what it was than it must be: the slope on the way was above its bound.
const STEEP: f64 = 1e-6;

/// On surfaces |∇φ| must not be less, as fields take it for the speed of level sets there.
const FLAT: f64 = std::f64::consts::FRAC_1_SQRT_2;

/// So often is φ looked at to tell that a ray is clear of a surface.
const LOOKS: usize = 64;

/// The tolerance, an angle and a part of the size, within which roots are looked for, however small that of
/// fields is: rays inside an outline need fewer steps so.
const ROOTS: f64 = 1e-6;

/// A point is on a surface where |φ| is at most this part of how far away it is, of the surface's size, or of
/// the ray's coordinates in those of the surface, whichever is most.
const EXACT: f64 = 1e-12;

/// See [`ROOTS`].
fn root_tolerance(tolerance: f64) -> f64 {
    tolerance.max(ROOTS)
}

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

    /// The nearest implicit surface along a ray between two distances, but for one that is known to be nowhere on it.
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

    /// Where a ray meets an implicit surface, of which its field has found the end, and whether |∇φ| is too small there; nothing if the end does not tell.
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
                // Of what is far away and small, the end may be nearer to another root.
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

    /// Counts a hit where |∇φ| is too small.
    pub(crate) fn count_too_flat(&self) {
        self.trace_counters.count_too_flat();
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

    /// Whether a surface is so many radians or more from a part of a ray, as seen from its origin: φ > c t all along, which few looks at φ
    /// tell of most rays that leave the surface. False where these do not tell.
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
        // φ − c t falls the faster.
        let ray = LocalRay { slope: ray.slope + angle, ..ray };
        // Only in the box are second derivatives bounded.
        let part = self.part(index, origin, direction, Part { near, far });
        let leaves = part.map_or(near, |part| part.far) / ray.scale;
        let (mut t, far) = (near / ray.scale, far / ray.scale);
        let mut least = f64::NEG_INFINITY;
        for _ in 0..LOOKS {
            let (value, slope) = ray.look(t);
            let (value, slope) = (value - angle * t, slope - angle);
            // A slope above its bound tells nothing: the ray is to be followed.
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
    ///
    /// A ray that passes it within the tracer's tolerance is no hit: where it is nearest, ∇φ·ω is 0, and what hits move by infinite.
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
            // Of what is far away and small, the tolerance may be more than its parts are apart: the next root is looked for where only one is near.
            if value <= root_tolerance(tolerance) * t.min(ray.size) {
                let (root, there) = ray.polished(t, near);
                if value <= 0.0 || there.value.abs() <= EXACT * ray.largest().max(root) {
                    // It may be beyond the end: a light, or the point that is looked for.
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

/// A ray in the coordinates of a surface, where distances are those of the world by its scale.
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
    /// Of a ray of the world, and the size of the shape there.
    fn new(shape: &'a ImplicitShape, origin: DVec3, direction: DVec3, size: f64) -> Self {
        let Placement { scale, rotation, translation } = shape.placement;
        let turn = rotation.transpose();
        let surface = &*shape.surface;
        let (slope, bend) = (surface.slope_bound(), surface.second_derivative_bound());
        let origin = turn * (origin - translation) / scale;
        Self { surface, origin, direction: turn * direction, scale, size: size / scale, slope, bend }
    }

    /// What rounding of φ is relative to: the size of the surface, and the coordinates of where the ray
    /// begins.
    fn largest(&self) -> f64 {
        self.size.max(self.origin.abs().max_element())
    }

    fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }

    /// φ, and φ′ if it is of use.
    fn look(&self, t: f64) -> (f64, f64) {
        if self.bend == f64::INFINITY {
            return (self.surface.value(self.at(t)), -self.slope);
        }
        let jet = self.surface.jet(self.at(t));
        (jet.value, jet.gradient.dot(self.direction))
    }

    /// How far it is at least to a root: the farther of what the two bounds say.
    fn step(&self, value: f64, slope: f64) -> f64 {
        let straight = value / self.slope;
        // Where φ + φ′ t − M t²/2 is negative already, its root is nearer.
        if value + (slope - 0.5 * self.bend * straight) * straight <= 0.0 {
            return straight;
        }
        // The root, without cancellation.
        let root = (slope * slope + 2.0 * self.bend * value).sqrt();
        let bent = if slope > 0.0 { (slope + root) / self.bend } else { 2.0 * value / (root - slope) };
        straight.max(bent)
    }

    /// What φ must at least be after a step.
    fn least(&self, value: f64, slope: f64, step: f64) -> f64 {
        (value - self.slope * step).max(value + (slope - 0.5 * self.bend * step) * step)
    }

    /// The root next to t, as exactly as Newton's method finds it, and φ and ∇φ there. Where there is none, or a kink, |φ|
    /// does not halve at each step. None nearer than `near`: there the ray begins.
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
