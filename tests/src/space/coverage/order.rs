//! The painter's order of triangles, from what hides what (Newell, Newell and Sancha 1972).
//!
//! Two triangles whose images overlap are compared over the overlap: 1/Z of a plane is an affine
//! function of the film's point, so its extremes over a convex overlap are at the corners.

use flatland::plane::orient;
use glam::DVec2;

use super::CoverageError;
use super::camera::Projection;

/// Differences of 1/Z below this, relative to the larger 1/Z, are rounding.
const SAME_DEPTH: f64 = 1e-11;
/// An overlap of less than this, relative to the smaller image, is rounding.
const NO_AREA: f64 = 1e-12;

/// A triangle's image.
struct Image {
    vertices: [usize; 3],
    /// Counterclockwise in the sense of [`orient`].
    corners: [DVec2; 3],
    /// 1/Z at the corners.
    nearness: [f64; 3],
    twice_area: f64,
}

impl Image {
    fn new(mut vertices: [usize; 3], projections: &[Projection]) -> Self {
        let at = |v: usize| projections[v].at;
        if orient(at(vertices[0]), at(vertices[1]), at(vertices[2])) < 0.0 {
            vertices.swap(1, 2);
        }
        let corners = vertices.map(at);
        let nearness = vertices.map(|v| 1.0 / projections[v].depth);
        Self { vertices, corners, nearness, twice_area: orient(corners[0], corners[1], corners[2]) }
    }

    /// 1/Z of the triangle's plane where u is seen.
    fn nearness(&self, u: DVec2) -> f64 {
        let [a, b, c] = self.corners;
        let weights = [orient(b, c, u), orient(c, a, u), orient(a, b, u)];
        (0..3).map(|k| weights[k] * self.nearness[k]).sum::<f64>() / weights.iter().sum::<f64>()
    }

    /// Whether the two share an edge and lie on different sides of it.
    fn is_beside(&self, other: &Self) -> bool {
        let apex = |a: &Self, b: &Self| (0..3).find(|&k| !b.vertices.contains(&a.vertices[k]));
        let shared = self.vertices.iter().filter(|v| other.vertices.contains(v)).count();
        let (Some(i), Some(j)) = (apex(self, other), apex(other, self)) else { return false };
        let [p, q] = [self.corners[(i + 1) % 3], self.corners[(i + 2) % 3]];
        shared == 2 && orient(p, q, other.corners[j]) <= 0.0
    }

    /// The convex polygon in which both are seen (Sutherland and Hodgman 1974).
    fn overlap(&self, other: &Self) -> Vec<DVec2> {
        (0..3).fold(self.corners.to_vec(), |polygon, k| {
            let (p, q) = (other.corners[k], other.corners[(k + 1) % 3]);
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
}

/// The triangles from the farthest to the nearest: none hides a later one. Where the order is free
/// it is that of their numbers.
///
/// # Errors
/// [`CoverageError::Intersect`] or [`CoverageError::Cycle`] where there is no such order.
pub(super) fn painters(
    triangles: &[[usize; 3]],
    projections: &[Projection],
) -> Result<Vec<usize>, CoverageError> {
    let images: Vec<_> = triangles.iter().map(|&t| Image::new(t, projections)).collect();
    let mut nearer: Vec<Vec<usize>> = vec![vec![]; images.len()];
    let mut farther = vec![0; images.len()];
    for j in 0..images.len() {
        for i in 0..j {
            let Some(first_is_nearer) = compare(&images[i], &images[j]) else { continue };
            let (far, near) = match first_is_nearer {
                Nearer::First => (j, i),
                Nearer::Second => (i, j),
                Nearer::Neither => return Err(CoverageError::Intersect { first: i, second: j }),
            };
            nearer[far].push(near);
            farther[near] += 1;
        }
    }
    let mut order = Vec::with_capacity(images.len());
    let mut done = vec![false; images.len()];
    while order.len() < images.len() {
        let next = (0..images.len()).find(|&t| !done[t] && farther[t] == 0);
        let next = next.ok_or_else(|| {
            let triangle = done.iter().position(|done| !done).unwrap_or_default();
            CoverageError::Cycle { triangle }
        })?;
        done[next] = true;
        order.push(next);
        nearer[next].iter().for_each(|&t| farther[t] -= 1);
    }
    Ok(order)
}

enum Nearer {
    First,
    Second,
    Neither,
}

/// `None` where neither hides the other.
fn compare(first: &Image, second: &Image) -> Option<Nearer> {
    if first.is_beside(second) {
        return None;
    }
    let overlap = first.overlap(second);
    let twice_area: f64 = (2..overlap.len()).map(|k| orient(overlap[0], overlap[k - 1], overlap[k])).sum();
    if twice_area <= NO_AREA * first.twice_area.min(second.twice_area) {
        return None;
    }
    let scale = first.nearness.iter().chain(&second.nearness).fold(0.0_f64, |m, n| m.max(*n));
    let (mut low, mut high) = (0.0_f64, 0.0_f64);
    for &u in &overlap {
        let difference = first.nearness(u) - second.nearness(u);
        (low, high) = (low.min(difference), high.max(difference));
    }
    let rounding = SAME_DEPTH * scale;
    Some(match (low < -rounding, high > rounding) {
        (false, true) => Nearer::First,
        (true, false) => Nearer::Second,
        _ => Nearer::Neither,
    })
}
