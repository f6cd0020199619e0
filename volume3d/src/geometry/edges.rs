//! Where what is seen of a mesh jumps: the distance of a hit from the nearest such edge.

use std::collections::HashMap;

use glam::DVec3;

use crate::scene::{NONE, Reflectance, Scene, Triangle};

/// What lies beyond an edge of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Beyond {
    /// Nothing that continues the surface: from wherever the edge is seen, what is seen jumps there. A border, or an
    /// edge of three triangles or more.
    Border,
    /// Another triangle that continues the surface, but not its shading: a crease of flat shading, a seam of
    /// normals or of a texture. The radiance jumps there; what the surface covers does not.
    Crease(u32),
    /// Another triangle that continues surface and shading.
    Smooth(u32),
}

/// What must not jump within a field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Jumps {
    /// The radiance that is seen: borders, silhouettes, creases and crossings.
    Radiance,
    /// What covers what: borders and silhouettes; and crossings with a light, if it is one that is covered.
    Visibility {
        /// Its shape.
        light: Option<u32>,
    },
}

/// The nearest jump to a hit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Nearest {
    /// A lower estimate of the angle to it.
    pub(crate) angle: f64,
    /// If it is a crossing, which, and how far along it.
    pub(crate) crossing: Option<(u32, f64)>,
}

/// The edges of all triangles of a scene.
#[derive(Clone, Debug, Default)]
pub(crate) struct Edges {
    /// For edge k of a triangle, from corner k to corner k + 1.
    beyond: Vec<[Beyond; 3]>,
    /// The smallest radius of curvature around each triangle, from the angles to the faces that continue its
    /// surface; infinite where it is flat or alone.
    radius: Vec<f64>,
}

impl Edges {
    pub(crate) fn build(scene: &Scene) -> Self {
        let mut sides: HashMap<[u32; 2], Vec<(u32, u8)>> = HashMap::with_capacity(scene.triangles.len() * 2);
        for (t, triangle) in scene.triangles.iter().enumerate() {
            for k in 0..3 {
                let [a, b] = edge(triangle, k);
                sides.entry([a.min(b), a.max(b)]).or_default().push((t as u32, k as u8));
            }
        }
        let mut beyond = vec![[Beyond::Border; 3]; scene.triangles.len()];
        let mut radius = vec![f64::INFINITY; scene.triangles.len()];
        for pair in sides.values() {
            let &[(s, i), (t, j)] = pair.as_slice() else { continue };
            let (i, j) = (i as usize, j as usize);
            if !surface_continues(scene, (s, i), (t, j)) {
                continue;
            }
            let kind = if shading_continues(scene, (s, i), (t, j)) { Beyond::Smooth } else { Beyond::Crease };
            beyond[s as usize][i] = kind(t);
            beyond[t as usize][j] = kind(s);
            let r = radius_across(scene, s, t);
            for face in [s, t] {
                radius[face as usize] = radius[face as usize].min(r);
            }
        }
        Self { beyond, radius }
    }

    /// A lower estimate of the angle, seen from `origin`, between a hit and the nearest jump of what is seen.
    /// It vanishes on every jump that bounds the hit surface.
    ///
    /// For edges of the hit triangle it is the angle to their great circles. The silhouette of a smooth
    /// surface farther away than one triangle is estimated from the cosine c = |n·ω| as that of a sphere with
    /// the surface's smallest radius of curvature r: r c²/(2 t). Crossings are looked at one by one.
    pub(crate) fn nearest_jump(
        &self,
        scene: &Scene,
        triangle: u32,
        origin: DVec3,
        direction: DVec3,
        distance: f64,
        jumps: Jumps,
    ) -> Nearest {
        let corners = scene.triangles[triangle as usize].positions;
        let p = corners.map(|i| scene.positions[i as usize] - origin);
        let normal = (p[1] - p[0]).cross(p[2] - p[0]);
        let facing = normal.dot(p[0]);
        let radius = self.radius[triangle as usize];
        let mut nearest = f64::INFINITY;
        if radius.is_finite() {
            let cosine_squared = normal.dot(direction).powi(2) / normal.length_squared();
            nearest = 0.5 * radius * cosine_squared / distance;
        }
        for (k, beyond) in self.beyond[triangle as usize].into_iter().enumerate() {
            let jumps_here = match beyond {
                Beyond::Border => true,
                Beyond::Crease(_) if jumps == Jumps::Radiance => true,
                Beyond::Crease(other) | Beyond::Smooth(other) => {
                    facing * facing_of(scene, other, origin) <= 0.0
                }
            };
            if jumps_here {
                let plane = p[k].cross(p[(k + 1) % 3]);
                nearest = nearest.min((plane.dot(direction) / plane.length()).abs());
            }
        }
        let mut found = Nearest { angle: nearest, crossing: None };
        for &index in scene.crossings().of(triangle) {
            let crossing = scene.crossings().get(index);
            let counts = match jumps {
                Jumps::Radiance => true,
                Jumps::Visibility { light } => light.is_some_and(|l| crossing.shapes(scene).contains(&l)),
            };
            if counts {
                let (angle, along) = angle_to(crossing.places.map(|p| p - origin), direction, found.angle);
                if angle < found.angle {
                    found = Nearest { angle, crossing: Some((index, along)) };
                }
            }
        }
        found
    }

    /// The triangle that continues the surface beyond edge k.
    pub(crate) fn continued(&self, triangle: u32, k: usize) -> Option<u32> {
        match self.beyond[triangle as usize][k] {
            Beyond::Border => None,
            Beyond::Crease(other) | Beyond::Smooth(other) => Some(other),
        }
    }

    /// The triangle that continues surface and shading beyond edge k.
    pub(crate) fn smooth(&self, triangle: u32, k: usize) -> Option<u32> {
        match self.beyond[triangle as usize][k] {
            Beyond::Smooth(other) => Some(other),
            Beyond::Border | Beyond::Crease(_) => None,
        }
    }

    /// Whether what is seen jumps at edge k of a triangle from wherever it is seen, and not at silhouettes only.
    pub(crate) fn jumps(&self, triangle: u32, k: usize) -> bool {
        !matches!(self.beyond[triangle as usize][k], Beyond::Smooth(_))
    }
}

/// The angle, in terms of its sine or chord, between a direction and a segment as seen from the origin, and the place on
/// the segment that is nearest; or no less than `limit`.
fn angle_to([p, q]: [DVec3; 2], direction: DVec3, limit: f64) -> (f64, f64) {
    let pole = p.cross(q).normalize_or_zero();
    let height = pole.dot(direction);
    if height.abs() >= limit {
        return (f64::INFINITY, 0.0);
    }
    let [after, before] = [pole.dot(p.cross(direction)), pole.dot(direction.cross(q))];
    if after > 0.0 && before > 0.0 {
        return (height.abs(), after / (after + before));
    }
    let [a, b] = [p, q].map(|end| end.normalize_or_zero().distance(direction));
    if a < b { (a, 0.0) } else { (b, 1.0) }
}

/// Positive where a point is behind a triangle, negative where it is before it.
fn facing_of(scene: &Scene, triangle: u32, origin: DVec3) -> f64 {
    let [a, b, c] = scene.triangles[triangle as usize].positions.map(|i| scene.positions[i as usize]);
    (b - a).cross(c - a).dot(a - origin)
}

fn edge(triangle: &Triangle, k: usize) -> [u32; 2] {
    [triangle.positions[k], triangle.positions[(k + 1) % 3]]
}

/// Whether the surface goes on across an edge: the two must run along it in opposite senses, or front and back
/// meet in it.
fn surface_continues(scene: &Scene, (s, i): (u32, usize), (t, j): (u32, usize)) -> bool {
    let (s, t) = (&scene.triangles[s as usize], &scene.triangles[t as usize]);
    edge(s, i) != edge(t, j) && s.shape == t.shape
}

/// Whether normals and texture go on across an edge.
fn shading_continues(scene: &Scene, (s, i): (u32, usize), (t, j): (u32, usize)) -> bool {
    let (s, t) = (&scene.triangles[s as usize], &scene.triangles[t as usize]);
    let ends = |triangle: &Triangle, table: [u32; 3], k: usize| {
        let flipped = edge(triangle, k)[0] > edge(triangle, k)[1];
        let [a, b] = [table[k], table[(k + 1) % 3]];
        if flipped { [b, a] } else { [a, b] }
    };
    let shape = &scene.description.shapes[s.shape as usize];
    let textured =
        matches!(scene.description.materials[shape.material].bsdf.reflectance(), Reflectance::Texture(_));
    let same_uv = !textured || {
        let at = |triangle: &Triangle, k| ends(triangle, triangle.uvs, k).map(|n| scene.uvs[n as usize]);
        at(s, i) == at(t, j)
    };
    let same_normals = if s.normals[0] == NONE {
        coplanar(scene, s, t)
    } else {
        let at = |triangle: &Triangle, k| ends(triangle, triangle.normals, k);
        let value = |n: [u32; 2]| n.map(|n| scene.normals[n as usize]);
        at(s, i) == at(t, j) || value(at(s, i)) == value(at(t, j))
    };
    same_uv && same_normals
}

/// Unit normals that differ by no more than this are those of one plane. It is what rounding to single precision, in
/// which most meshes are stored, does to triangles a hundredth as large as their coordinates. A jump of the radiance that
/// is left out where flat-shaded triangles meet is as small, relatively.
pub(crate) const FLAT: f64 = 1e-5;

/// Whether two flat-shaded triangles shade alike, to rounding. Vertices that move may bend the edge between
/// them; but as long as nothing jumps there, nothing that moves there counts.
fn coplanar(scene: &Scene, s: &Triangle, t: &Triangle) -> bool {
    let normal = |triangle: &Triangle| {
        let [a, b, c] = triangle.positions.map(|i| scene.positions[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    };
    (normal(s) - normal(t)).length() <= FLAT
}

/// The distance of the centroids of two triangles over the angle between their normals.
fn radius_across(scene: &Scene, s: u32, t: u32) -> f64 {
    let corners = |i: u32| scene.triangles[i as usize].positions.map(|p| scene.positions[p as usize]);
    let normal = |[a, b, c]: [DVec3; 3]| (b - a).cross(c - a).normalize_or_zero();
    let centre = |p: [DVec3; 3]| (p[0] + p[1] + p[2]) / 3.0;
    let (s, t) = (corners(s), corners(t));
    let (m, n) = (normal(s), normal(t));
    let angle = m.cross(n).length().atan2(m.dot(n));
    (centre(s) - centre(t)).length() / angle
}
