//! Chamfer and Hausdorff distances of surfaces.

use flatland::random::{open01, stream};
use glam::DVec3;
use rayon::prelude::*;
use volume3d::geometry::{Mesh, Proximity};

/// The symmetric Chamfer distance ½ (mean over points a of A of d(a, B) + mean over points b of B of d(b,
/// A)), with `count` points uniform on each surface and distances to the other's nearest triangle: 0 for
/// equal surfaces, whatever their triangles.
pub(crate) fn chamfer(a: &Mesh, b: &Mesh, count: usize, seed: u64) -> f64 {
    let mean = |distances: Vec<f64>| distances.iter().sum::<f64>() / count as f64;
    0.5 * (mean(one_sided(a, b, count, seed)) + mean(one_sided(b, a, count, seed + 1)))
}

/// The distance within which 95 % of the points of each surface are to the other: a Hausdorff distance
/// without the worst 5 %.
pub(crate) fn hausdorff(a: &Mesh, b: &Mesh, count: usize, seed: u64) -> f64 {
    let most = |mut distances: Vec<f64>| {
        distances.sort_by(f64::total_cmp);
        distances[(0.95 * (count - 1) as f64) as usize]
    };
    most(one_sided(a, b, count, seed)).max(most(one_sided(b, a, count, seed + 1)))
}

/// The distances of points of one surface to the other.
fn one_sided(from: &Mesh, to: &Mesh, count: usize, seed: u64) -> Vec<f64> {
    // A mesh without area has no distance.
    let Some(to) = Proximity::new(to) else { return vec![f64::NAN; count] };
    points(from, count, seed).into_par_iter().map(|p| to.distance(p)).collect()
}

/// Uniform points on a surface.
fn points(mesh: &Mesh, count: usize, seed: u64) -> Vec<DVec3> {
    let corners = mesh.triangles().iter().map(|t| t.map(|i| mesh.positions()[i as usize]));
    let triangles: Vec<[DVec3; 3]> = corners.collect();
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

#[cfg(test)]
mod tests {
    use glam::DAffine3;

    use super::*;

    #[test]
    fn cubes_are_as_far_as_they_are() {
        let by = |size: f64| Mesh::cube().transformed(&DAffine3::from_scale(DVec3::splat(size)));
        assert!(chamfer(&by(1.0), &by(1.0), 1000, 1) < 1e-15);
        // From inside the distance to the faces is 0.1; from outside it is that, and more near edges: of the
        // side 2.2, a strip of 0.1 along each.
        let mean =
            |a: &Mesh, b: &Mesh, count: usize| one_sided(a, b, count, 1).iter().sum::<f64>() / count as f64;
        let inward = mean(&by(1.0), &by(1.1), 1000);
        assert!((inward - 0.1).abs() < 1e-12, "{inward}");
        let outward = mean(&by(1.1), &by(1.0), 20_000);
        assert!(outward > 0.1 && outward < 0.105, "{outward}");
        // A twentieth of the larger is beyond the smaller's faces by more than e = √0.95 · 1.1 − 1.
        let beyond = 0.95_f64.sqrt() * 1.1 - 1.0;
        let most = hausdorff(&by(1.0), &by(1.1), 20_000, 1);
        assert!((most - 0.1_f64.hypot(beyond)).abs() < 0.003, "{most}");
    }
}
