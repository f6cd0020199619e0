//! Edges that project onto the borders of box-filtered pixels.

use glam::DVec2;

use crate::geometry::Edges;
use crate::gradient::film::FilmPlane;
use crate::scene::Scene;

/// Edges of a shape that the camera sees along borders of pixels under the box filter, or along a border of
/// the film that cuts other filters.
///
/// Exactly on a border, a pixel has no derivative by motion across it, only two one-sided ones; all methods
/// return their mean. Near a border, the derivative is valid for displacements shorter than the distance
/// between edge and border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct OnPixelBorders {
    /// Index of the shape.
    pub shape: usize,
    /// Number of edges.
    pub edges: usize,
    /// Largest distance of such an edge from a border, in pixels; 0 up to rounding.
    pub distance: f64,
}

/// Distance below which an edge is reported, in pixels: fields of view are often written with six digits.
const NEAR: f64 = 1e-4;

/// Triangles whose unit normals differ by no more than this count as coplanar.
const FLAT: f64 = 1e-9;

impl OnPixelBorders {
    /// By shape, those of a scene. There are none behind a lens, which spreads edges.
    #[must_use]
    pub fn of(scene: &Scene) -> Vec<Self> {
        let film = FilmPlane::new(scene);
        if !film.ends_at_border() || film.has_lens() {
            return vec![];
        }
        let mut found: Vec<Self> = vec![];
        for sides in Edges::of(scene.triangles.iter().map(|t| t.positions)).iter() {
            let triangle = sides[0].triangle;
            if let [a, b] = sides
                && a.ascending != b.ascending
                && !scene.adjacency.jumps(a.triangle, a.corner as usize)
                && scene.face_normal(a.triangle).distance(scene.face_normal(b.triangle)) <= FLAT
            {
                continue;
            }
            let ends = sides[0].ends.map(|i| scene.positions[i as usize]);
            let Some(distance) = film.distance_to_border(ends) else { continue };
            let shape = scene.triangles[triangle as usize].shape as usize;
            match found.iter_mut().find(|other| other.shape == shape) {
                Some(other) => {
                    other.edges += 1;
                    other.distance = other.distance.max(distance);
                }
                None => found.push(Self { shape, edges: 1, distance }),
            }
        }
        found
    }
}

impl FilmPlane {
    /// Largest distance of a projected edge from the pixel border along which it runs; 0 if it lies on it,
    /// `None` if it is not near one.
    fn distance_to_border(&self, ends: [glam::DVec3; 2]) -> Option<f64> {
        let origin = self.still.origin.value();
        if ends.iter().any(|end| (*end - origin).dot(self.forward()) <= 0.0) {
            return None;
        }
        let [p, q] =
            ends.map(|end| DVec2::from(self.project(&self.still, flatland::calculus::Vec3::constant(end))));
        let (low, high) = self.image();
        (0..2).find_map(|axis| {
            let line = p[axis].round();
            let distance = (p[axis] - line).abs().max((q[axis] - line).abs());
            let across = 1 - axis;
            let is_border = match self.is_box() {
                true => line >= low[axis] && line <= high[axis],
                false => line == low[axis] || line == high[axis],
            };
            let seen = is_border
                && p[across].min(q[across]) < high[across]
                && p[across].max(q[across]) > low[across]
                && p.distance(q) > NEAR;
            (seen && distance <= NEAR).then(|| if self.is_on_border(distance) { 0.0 } else { distance })
        })
    }
}
