//! Ray queries of a scene.

use glam::DVec3;

use super::build::Scene;
use super::hit::{Hit, Surface};
use super::trace_counts::count_traced;
use crate::geometry::{self, ROUNDING, Ray, Shadows, Sheaf};

/// Distance, relative to the scene's largest coordinate, that counts as rounding: a ray that leaves a surface
/// starts there. Hits are recomputed in double precision, whose own error is a hundred times less. It is one
/// number for all rays; an occluder closer than that is below the resolution of the scene's coordinates.
const NEAR: f64 = 1e-13;

/// Fraction by which a shadow ray ends before the light, which must not occlude itself. Distances are rounded
/// to 10⁻¹⁶, and coordinates to [`rounding`](Scene::rounding).
pub(crate) const SHORT: f64 = 1e-10;

impl Scene {
    /// Nearest hit of a ray that starts on a surface, which it does not hit there, or of a camera ray, to
    /// which emitters may be invisible.
    #[inline]
    pub(crate) fn closest(&self, origin: DVec3, direction: DVec3, from: Option<Surface>) -> Option<Hit> {
        self.closest_beside(origin, direction, from, None)
    }

    /// [`closest`](Self::closest), given an implicit surface that the ray is known not to hit.
    #[inline]
    pub(crate) fn closest_beside(
        &self,
        origin: DVec3,
        direction: DVec3,
        from: Option<Surface>,
        clear: Option<u32>,
    ) -> Option<Hit> {
        count_traced(1);
        let (near, triangle) = self.start(from);
        let ray = Ray { origin, direction, near, far: f64::INFINITY, from: triangle };
        let hit = self.accelerator.closest(&ray).map(Hit::from);
        let hit = self.or_implicit(hit, origin, direction, from, near, clear);
        if from.is_none() && self.description.hide_emitters {
            return self.past_emitters(origin, direction, hit);
        }
        hit
    }

    /// Whether a camera ray misses all meshes.
    pub(crate) fn passes_meshes(&self, origin: DVec3, direction: DVec3) -> bool {
        count_traced(1);
        let ray = Ray { origin, direction, near: 0.0, far: f64::INFINITY, from: None };
        !self.accelerator.occluded(&ray)
    }

    /// Hit of a camera ray past emitting shapes that are invisible to the camera.
    fn past_emitters(&self, origin: DVec3, direction: DVec3, mut hit: Option<Hit>) -> Option<Hit> {
        while let Some(Hit { surface, distance, .. }) = hit
            && self.is_emitter(surface)
        {
            let next = self.closest(origin + distance * direction, direction, Some(surface));
            hit = next.map(|next| Hit { distance: distance + next.distance, ..next });
        }
        hit
    }

    /// Nearest hit beyond a distance.
    pub(crate) fn beyond(&self, origin: DVec3, direction: DVec3, near: f64) -> Option<Hit> {
        count_traced(1);
        let ray = Ray { origin, direction, near, far: f64::INFINITY, from: None };
        self.or_implicit(self.accelerator.closest(&ray).map(Hit::from), origin, direction, None, near, None)
    }

    /// Whether anything occludes the ray between the distances `near` and `far`, the latter reduced by
    /// rounding.
    pub(crate) fn blocked(&self, origin: DVec3, direction: DVec3, near: f64, far: f64) -> bool {
        count_traced(1);
        let far = self.short_of(far);
        self.accelerator.occluded(&Ray { origin, direction, near, far, from: None })
            || self.closest_implicit(origin, direction, None, (near, far), None).is_some()
    }

    /// Whether the camera at `origin` does not see a point at a distance, reduced by rounding.
    pub(crate) fn hidden_from_camera(&self, origin: DVec3, direction: DVec3, far: f64) -> bool {
        if !self.description.hide_emitters {
            return self.blocked(origin, direction, 0.0, far);
        }
        self.closest(origin, direction, None).is_some_and(|hit| hit.distance < self.short_of(far))
    }

    /// Whether anything occludes a point at a distance from x on a surface.
    #[inline]
    pub(crate) fn shadowed(&self, x: DVec3, from: Surface, direction: DVec3, distance: f64) -> bool {
        self.shadowed_before(x, from, direction, distance, None)
    }

    /// [`shadowed`](Self::shadowed), where the point lies on a surface that does not occlude it.
    #[inline]
    pub(crate) fn shadowed_before(
        &self,
        x: DVec3,
        from: Surface,
        direction: DVec3,
        distance: f64,
        target: Option<Surface>,
    ) -> bool {
        count_traced(1);
        let (near, triangle) = self.start(Some(from));
        let far = self.short_of(distance);
        let target = match target {
            Some(Surface::Triangle(target)) => Some(target),
            Some(Surface::Implicit(_)) | None => None,
        };
        let ray = Ray { origin: x, direction, near, far, from: triangle };
        self.accelerator.occluded_before(&ray, target)
            || !self.description.implicits.is_empty()
                && self.closest_implicit(x, direction, Some(from), (near, far), None).is_some()
    }

    /// Bit masks of rays that hit a mesh, with the results of [`shadowed_before`](Self::shadowed_before).
    pub(crate) fn shadowed_sheaves(&self, shadows: &[Shadows<'_>; 2]) -> [u32; 2] {
        count_traced(shadows.iter().map(|shadows| shadows.sheaf.members.count_ones() as usize).sum());
        self.accelerator.occluded_sheaves(shadows)
    }

    /// Nearest mesh hits, if any, with the results of [`closest`](Self::closest).
    pub(crate) fn closest_sheaf(&self, sheaf: &Sheaf, hits: &mut [Option<geometry::Hit>; Sheaf::MOST]) {
        count_traced(sheaf.members.count_ones() as usize);
        self.accelerator.closest_sheaf(sheaf, hits);
    }

    /// Nearest hits of many rays from one origin, with the results of [`closest`](Self::closest).
    pub(crate) fn closest_bundle(
        &self,
        origin: DVec3,
        directions: &[DVec3],
        from: Option<Surface>,
        hits: &mut Vec<Option<Hit>>,
    ) {
        count_traced(directions.len());
        let (near, triangle) = self.start(from);
        self.accelerator.closest_bundle(origin, directions, near, f64::INFINITY, triangle, hits);
        if !self.description.implicits.is_empty() {
            for (hit, &direction) in hits.iter_mut().zip(directions) {
                *hit = self.or_implicit(*hit, origin, direction, from, near, None);
            }
        }
        if from.is_none() && self.description.hide_emitters {
            for (hit, &direction) in hits.iter_mut().zip(directions) {
                *hit = self.past_emitters(origin, direction, *hit);
            }
        }
    }

    /// A mesh hit, or a nearer hit of an implicit surface.
    #[inline]
    fn or_implicit(
        &self,
        hit: Option<Hit>,
        origin: DVec3,
        direction: DVec3,
        from: Option<Surface>,
        near: f64,
        clear: Option<u32>,
    ) -> Option<Hit> {
        if self.description.implicits.is_empty() {
            return hit;
        }
        let far = hit.map_or(f64::INFINITY, |hit| hit.distance);
        self.closest_implicit(origin, direction, from, (near, far), clear).or(hit)
    }

    /// Length below which computed differences are rounding.
    #[inline]
    pub(crate) fn rounding(&self) -> f64 {
        NEAR * self.extent
    }

    /// Uncertainty of input positions at a point: a few roundings of the given coordinates, as caused by
    /// transforms.
    #[inline]
    pub(crate) fn grain(&self, at: DVec3) -> f64 {
        ROUNDING * (at + self.offset()).abs().max_element()
    }

    /// Angle, in radians, by which that uncertainty may rotate a triangle: the grain divided by its least
    /// height.
    pub(crate) fn tilt(&self, triangle: u32) -> f64 {
        let [a, b, c] = self.corners(triangle);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let grain = self.grain(a).max(self.grain(b)).max(self.grain(c));
        grain * longest / (b - a).cross(c - a).length()
    }

    /// Distance from its origin at which a ray starts, and the triangle that it leaves.
    #[inline]
    fn start(&self, from: Option<Surface>) -> (f64, Option<u32>) {
        match from {
            Some(Surface::Triangle(triangle)) => (self.rounding(), Some(triangle)),
            // It may start inside a mesh by the tolerance to which the surface was hit.
            Some(Surface::Implicit(_)) => (self.rounding(), None),
            None => (0.0, None),
        }
    }

    /// End of a ray to a point: before the point by a fraction of the distance and by the rounding of
    /// coordinates.
    #[inline]
    pub(crate) fn short_of(&self, distance: f64) -> f64 {
        distance * (1.0 - SHORT) - self.rounding()
    }
}
