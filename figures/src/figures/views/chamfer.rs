//! How far two surfaces are from one another.

use flatland::random::{open01, stream};
use glam::DVec3;
use rayon::prelude::*;
use volume3d::geometry::Mesh;

/// The symmetric Chamfer distance ½ (mean over points a of A of d(a, B) + mean over points b of B of d(b, A)), with `count` points uniform on
/// each surface and distances to the other's nearest triangle: 0 for equal surfaces, whatever their triangles.
pub(super) fn chamfer(a: &Mesh, b: &Mesh, count: usize, seed: u64) -> f64 {
    0.5 * (one_sided(a, b, count, seed) + one_sided(b, a, count, seed + 1))
}

fn one_sided(from: &Mesh, to: &Mesh, count: usize, seed: u64) -> f64 {
    let triangles: Vec<Placed> = corners(to).map(Placed::new).collect();
    let points = points(from, count, seed);
    let distances: Vec<f64> = points.par_iter().map(|p| nearest(*p, &triangles)).collect();
    distances.iter().sum::<f64>() / count as f64
}

/// A triangle and a ball around it.
struct Placed {
    corners: [DVec3; 3],
    centre: DVec3,
    radius: f64,
}

impl Placed {
    fn new(corners: [DVec3; 3]) -> Self {
        let centre = corners.iter().sum::<DVec3>() / 3.0;
        let radius = corners.iter().map(|c| c.distance(centre)).fold(0.0, f64::max);
        Self { corners, centre, radius }
    }
}

fn corners(mesh: &Mesh) -> impl Iterator<Item = [DVec3; 3]> {
    mesh.triangles().iter().map(|t| t.map(|i| mesh.positions()[i as usize]))
}

/// Points that are uniform on a surface.
fn points(mesh: &Mesh, count: usize, seed: u64) -> Vec<DVec3> {
    let triangles: Vec<[DVec3; 3]> = corners(mesh).collect();
    let mut sum = 0.0;
    let areas: Vec<f64> = triangles
        .iter()
        .map(|[a, b, c]| {
            sum += (*b - *a).cross(*c - *a).length();
            sum
        })
        .collect();
    let mut rng = stream(seed, &[]);
    let point = |_| {
        let [pick, u, v] = std::array::from_fn(|_| open01(&mut rng));
        let at = areas.partition_point(|area| *area < pick * sum).min(triangles.len() - 1);
        let [a, b, c] = triangles[at];
        let root = u.sqrt();
        a * (1.0 - root) + root * (b * (1.0 - v) + c * v)
    };
    (0..count).map(point).collect()
}

fn nearest(p: DVec3, triangles: &[Placed]) -> f64 {
    let mut least = f64::INFINITY;
    for triangle in triangles {
        if p.distance(triangle.centre) - triangle.radius < least {
            least = least.min(p.distance(closest_point(p, triangle.corners)));
        }
    }
    least
}

/// The point of a triangle that is nearest to p (Ericson 2005, section 5.1.5).
fn closest_point(p: DVec3, [a, b, c]: [DVec3; 3]) -> DVec3 {
    let (ab, ac) = (b - a, c - a);
    let (d1, d2) = (ab.dot(p - a), ac.dot(p - a));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(p - b), ac.dot(p - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(p - c), ac.dot(p - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + (ab * vb + ac * vc) / (va + vb + vc)
}

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;

    #[test]
    fn cubes_are_as_far_as_they_are() {
        let by = |size: f64| Mesh::cube().transformed(&DAffine3::from_scale(DVec3::splat(size)));
        assert!(chamfer(&by(1.0), &by(1.0), 1000, 1) < 1e-15);
        // From within it is 0.1 to the faces; from without that, and more by edges: of the side 2.2, a strip of 0.1 along each.
        let inward = one_sided(&by(1.0), &by(1.1), 1000, 1);
        assert!((inward - 0.1).abs() < 1e-12, "{inward}");
        let outward = one_sided(&by(1.1), &by(1.0), 20_000, 1);
        assert!(outward > 0.1 && outward < 0.105, "{outward}");
    }

    #[test]
    fn the_closest_point_is_closer_than_all_others() {
        let mut rng = stream(3, &[]);
        let mut random = || DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(&mut rng) - 1.0));
        for _ in 0..200 {
            let (p, corners) = (random(), [random(), random(), random()]);
            let least = p.distance(closest_point(p, corners));
            let mesh = Mesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap();
            let others = points(&mesh, 500, 7).into_iter().map(|q| p.distance(q));
            let nearest = others.fold(f64::INFINITY, f64::min);
            assert!(least <= nearest + 1e-12 && nearest < least + 0.2, "{least} {nearest}");
        }
    }
}
