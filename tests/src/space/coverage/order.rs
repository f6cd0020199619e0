//! The painter's order of convex pieces that do not cross (Newell, Newell and Sancha 1972).
//!
//! Two pieces whose images overlap are compared over the overlap: 1/Z of a plane is an affine
//! function of the film's point, so its extremes over a convex overlap are at the corners.

use anyhow::{Context as _, Result, bail, ensure};
use flatland::plane::orient;
use glam::{DVec2, DVec3};

use super::camera::{Camera, Projection};
use super::plane::Plane;

/// Differences of 1/Z below this, relative to the larger 1/Z, are rounding.
const SAME_DEPTH: f64 = 1e-11;
/// An overlap of less than this, relative to the smaller image, is rounding.
const NO_AREA: f64 = 1e-12;
/// An overlap thinner than this, relative to the coordinates, is rounding of its corners.
const NO_WIDTH: f64 = 64.0 * f64::EPSILON;

/// A piece's image.
pub(super) struct Seen {
    pub(super) triangle: usize,
    /// Counterclockwise in the sense of [`orient`].
    pub(super) corners: Vec<DVec2>,
    pub(super) velocities: Vec<DVec2>,
    /// Vector whose product with the direction of the film's point is 1/Z of the plane.
    nearness: DVec3,
    camera: Camera,
    twice_area: f64,
    /// At the corners.
    largest_nearness: f64,
}

impl Seen {
    /// # Errors
    /// If a corner is behind the camera, where rounding may put a new one.
    pub(super) fn new(
        triangle: usize,
        mut corners: Vec<Projection>,
        plane: &Plane,
        camera: &Camera,
    ) -> Result<Self> {
        ensure!(corners.iter().all(|c| c.depth > 0.0), "a piece of triangle {triangle} is behind the camera");
        let at = |c: &[Projection]| c.iter().map(|c| c.at).collect::<Vec<_>>();
        if twice_area(&at(&corners)) < 0.0 {
            corners.reverse();
        }
        // n·(o + Z d) = n·p.
        let normal = plane.normal.value();
        let nearness = normal / normal.dot(plane.point.value() - camera.origin);
        let largest_nearness = corners.iter().map(|c| 1.0 / c.depth).fold(0.0, f64::max);
        let velocities = corners.iter().map(|c| c.velocity).collect();
        let corners = at(&corners);
        let twice_area = twice_area(&corners);
        Ok(Self { triangle, corners, velocities, nearness, camera: *camera, twice_area, largest_nearness })
    }

    fn nearness(&self, u: DVec2) -> f64 {
        self.nearness.dot(self.camera.direction(u))
    }

    /// The convex polygon of the film that both cover (Sutherland and Hodgman 1974).
    fn overlap(&self, other: &Self) -> Vec<DVec2> {
        let n = other.corners.len();
        (0..n).fold(self.corners.clone(), |polygon, k| {
            let (p, q) = (other.corners[k], other.corners[(k + 1) % n]);
            let mut kept = vec![];
            for (i, &a) in polygon.iter().enumerate() {
                let b = polygon[(i + 1) % polygon.len()];
                let (da, db) = (orient(p, q, a), orient(p, q, b));
                if da >= 0.0 {
                    kept.push(a);
                }
                if (da > 0.0 && db < 0.0) || (da < 0.0 && db > 0.0) {
                    kept.push(a.lerp(b, da / (da - db)));
                }
            }
            kept
        })
    }

    /// `Some(true)` if it occludes the other, `Some(false)` if the other occludes it, `None` if neither.
    fn hides(&self, other: &Self) -> Result<Option<bool>> {
        if self.triangle == other.triangle {
            return Ok(None);
        }
        let overlap = self.overlap(other);
        let longest = (0..overlap.len())
            .map(|k| overlap[k].distance(overlap[(k + 1) % overlap.len()]))
            .fold(0.0, f64::max);
        let coordinates = overlap.iter().map(|u| u.abs().max_element()).fold(0.0, f64::max);
        let rounding = NO_WIDTH * coordinates * longest;
        let smaller = self.twice_area.min(other.twice_area);
        if twice_area(&overlap) <= rounding.max(NO_AREA * smaller) {
            return Ok(None);
        }
        let (mut low, mut high) = (0.0_f64, 0.0_f64);
        for &u in &overlap {
            let difference = self.nearness(u) - other.nearness(u);
            (low, high) = (low.min(difference), high.max(difference));
        }
        let rounding = SAME_DEPTH * self.largest_nearness.max(other.largest_nearness);
        match (low < -rounding, high > rounding) {
            (false, true) => Ok(Some(true)),
            (true, false) => Ok(Some(false)),
            _ => bail!("triangles {} and {} have no order of depth", self.triangle, other.triangle),
        }
    }
}

fn twice_area(polygon: &[DVec2]) -> f64 {
    (2..polygon.len()).map(|k| orient(polygon[0], polygon[k - 1], polygon[k])).sum()
}

/// The pieces from the farthest to the nearest: none occludes a later one. Ties are broken by number.
pub(super) fn painters(seen: &[Seen]) -> Result<Vec<usize>> {
    let mut nearer: Vec<Vec<usize>> = vec![vec![]; seen.len()];
    let mut farther = vec![0; seen.len()];
    for j in 0..seen.len() {
        for i in 0..j {
            let Some(hides) = seen[i].hides(&seen[j])? else { continue };
            let (far, near) = if hides { (j, i) } else { (i, j) };
            nearer[far].push(near);
            farther[near] += 1;
        }
    }
    let mut order = Vec::with_capacity(seen.len());
    let mut done = vec![false; seen.len()];
    while order.len() < seen.len() {
        let next = (0..seen.len()).find(|&k| !done[k] && farther[k] == 0);
        let next = next.context("triangles hide each other in a ring")?;
        done[next] = true;
        order.push(next);
        nearer[next].iter().for_each(|&k| farther[k] -= 1);
    }
    Ok(order)
}
