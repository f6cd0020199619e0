//! Tests of the hierarchy against all triangles tested one by one.

use flatland::random::{Stream, open01, stream};
use glam::DVec3;
use rayon::prelude::*;

use super::meshes::{Mesh, cube, direction, icosphere, in_cube, rock, soup};
use crate::geometry::{Accelerator, Hit, Ray};
use crate::lanes::Instructions;

/// Möller and Trumbore's test: distance, and the least barycentric weight as a measure of how far inside the
/// hit is.
fn moller_trumbore(ray: &Ray, [a, b, c]: [DVec3; 3]) -> Option<(f64, f64, f64)> {
    let (e1, e2) = (b - a, c - a);
    let p = ray.direction.cross(e2);
    let determinant = e1.dot(p);
    let conditioning = determinant.abs() / (e1.length() * e2.length());
    if determinant == 0.0 {
        return None;
    }
    let s = ray.origin - a;
    let q = s.cross(e1);
    let (v, w) = (s.dot(p) / determinant, ray.direction.dot(q) / determinant);
    Some((e2.dot(q) / determinant, v.min(w).min(1.0 - v - w), conditioning))
}

/// The exact test on all triangles, which the hierarchy must reproduce bit for bit.
pub(super) fn one_by_one(mesh: &Mesh, ray: &Ray) -> Option<Hit> {
    let shear = super::super::watertight::Shear::new(ray.origin, ray.direction)?;
    let mut best: Option<Hit> = None;
    for triangle in 0..mesh.triangles.len() {
        let corners = mesh.corners(triangle);
        if ray.from == Some(triangle as u32) || !super::super::is_solid(&corners) {
            continue;
        }
        let Some(crossing) = shear.intersect(corners.map(|p| p.to_array()).each_ref()) else { continue };
        let distance = crossing.distance;
        let closer = best.is_none_or(|best| distance < best.distance);
        if distance > ray.near && distance < ray.far && closer {
            best = Some(Hit { triangle: triangle as u32, distance, barycentric: crossing.barycentric() });
        }
    }
    best
}

/// Rays of every kind: free, axis-aligned, in coordinate planes, at vertices and edges, with intervals.
pub(super) fn random_ray(mesh: &Mesh, i: usize, rng: &mut Stream) -> Ray {
    let size = mesh.positions.iter().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
    let [a, b, c] = mesh.corners((open01(rng) * mesh.triangles.len() as f64) as usize);
    let origin = match i % 5 {
        0 => 3.0 * size * in_cube(rng),
        1 => 1e7 * size * direction(rng),
        2 => a.lerp(b, open01(rng)).lerp(c, open01(rng)),
        _ => size * in_cube(rng),
    };
    let target = match i % 4 {
        0 => a,
        1 => a.lerp(c, open01(rng)),
        2 => a.lerp(b, open01(rng)).lerp(c, open01(rng)),
        _ => origin + direction(rng),
    };
    let mut direction = (target - origin).normalize_or(DVec3::X);
    match i % 7 {
        0 => direction[i % 3] = 0.0,
        1 => direction = DVec3::AXES[i % 3] * if i.is_multiple_of(2) { 1.0 } else { -1.0 },
        _ => {}
    }
    let direction = direction.normalize_or(DVec3::Z);
    let (near, far) = match i % 6 {
        0 => (0.1 * size, size),
        1 => (1e-12 * size, f64::INFINITY),
        2 => (0.0, (target - origin).length()),
        3 => (-size, size),
        _ => (0.0, f64::INFINITY),
    };
    let from = (i.is_multiple_of(3)).then(|| (open01(rng) * mesh.triangles.len() as f64) as u32);
    Ray { origin, direction, near, far, from }
}

pub(super) fn meshes() -> Vec<Mesh> {
    let mut rng = stream(20, &[]);
    let mut meshes = vec![
        cube(),
        icosphere(0),
        icosphere(3),
        rock(3, &mut rng),
        soup(1, &mut rng),
        soup(9, &mut rng),
        soup(1000, &mut rng),
    ];
    for scale in [1e-6, 1e6] {
        meshes.push(soup(500, &mut rng).map(|p| scale * *p));
    }
    meshes.push(soup(500, &mut rng).map(|p| *p + DVec3::new(1e6, -1e6, 1e6)));
    // A plane, a far outlier with small triangles, all triangles at one position.
    meshes.push(icosphere(2).map(|p| DVec3::new(p.x, 0.25, p.z)));
    let mut outlier = soup(500, &mut rng);
    outlier.positions[100] = DVec3::splat(1e5);
    meshes.push(outlier);
    let mut pile = cube();
    pile.triangles = (0..300).map(|i| pile.triangles[i % 12]).collect();
    meshes.push(pile);
    meshes
}

fn instruction_sets() -> Vec<Instructions> {
    let mut sets = vec![Instructions::detect(), Instructions::Portable];
    #[cfg(target_arch = "x86_64")]
    sets.extend(pulp::x86::V1::try_new().map(Instructions::Sse2));
    sets
}

/// Runs a query `times` times on every mesh with every instruction set; the label names the case.
fn on_every_mesh(times: usize, ask: impl Fn(&Mesh, &Accelerator, usize, &str) + Sync) {
    for (index, mesh) in meshes().iter().enumerate() {
        let mut accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
        if index % 2 == 1 {
            // Simulates a tree so deep that its stack of pending nodes needs heap memory.
            accelerator.tree.pending = 1000;
        }
        for instructions in instruction_sets() {
            accelerator.instructions = instructions;
            let label = format!("{index} {instructions:?}");
            (0..times).into_par_iter().for_each(|i| ask(mesh, &accelerator, i, &label));
        }
    }
}

#[test]
fn every_instruction_set_answers_like_all_triangles_one_by_one() {
    on_every_mesh(8_000, |mesh, accelerator, i, label| {
        let ray = random_ray(mesh, i, &mut stream(21, &[i as u64]));
        let expected = one_by_one(mesh, &ray);
        assert_eq!(accelerator.closest(&ray), expected, "{label} {i} {ray:?}");
        assert_eq!(accelerator.occluded(&ray), expected.is_some(), "{label} {i} {ray:?}");
    });
}

#[test]
fn occlusion_agrees_with_the_closest_hit_at_scales_where_products_overflow_and_underflow() {
    let mesh = soup(300, &mut stream(27, &[]));
    for scale in [1e-160, 1e-120, 1e-80, 1e-70, 1e70, 1e80, 1e120, 1e160] {
        let mesh = mesh.map(|p| scale * *p);
        let accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
        for i in 0..20_000 {
            let ray = random_ray(&mesh, i, &mut stream(28, &[i as u64]));
            let hit = accelerator.closest(&ray);
            assert_eq!(accelerator.occluded(&ray), hit.is_some(), "{scale} {i} {ray:?} {hit:?}");
        }
    }
}

#[test]
fn bundles_answer_like_single_rays() {
    on_every_mesh(6_000, |mesh, accelerator, i, label| {
        let mut rng = stream(24, &[i as u64]);
        let ray = random_ray(mesh, i, &mut rng);
        let spread = 10.0_f64.powf(-9.0 * open01(&mut rng));
        let count = (40.0 * open01(&mut rng).powi(2)) as usize;
        let mut direction = |k: usize| match k % 8 {
            7 => ray.direction,
            _ => (ray.direction + spread * in_cube(&mut rng)).normalize(),
        };
        let directions: Vec<DVec3> = (0..count).map(&mut direction).collect();
        let Ray { origin, near, far, from, .. } = ray;
        let mut hits = vec![None; 3];
        accelerator.closest_bundle(origin, &directions, near, far, from, &mut hits);
        assert_eq!(hits.len(), count);
        for (&direction, hit) in directions.iter().zip(hits) {
            let ray = Ray { direction, ..ray };
            assert_eq!(hit, accelerator.closest(&ray), "{label} {i} {spread} {ray:?}");
        }
    });
}

#[test]
fn bundles_at_edges_and_vertices_lose_nothing() {
    let mesh = rock(4, &mut stream(25, &[]));
    let accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
    let mut hits = Vec::new();
    for i in 0..20_000 {
        let mut rng = stream(26, &[i]);
        let origin = if i.is_multiple_of(2) { 0.2 * in_cube(&mut rng) } else { 3.0 * direction(&mut rng) };
        let [a, b, c] = mesh.corners((open01(&mut rng) * mesh.triangles.len() as f64) as usize);
        let targets = (0..16).map(|k| [a, b, c, a.lerp(b, open01(&mut rng))][k % 4]);
        let directions: Vec<DVec3> = targets.map(|target| (target - origin).normalize()).collect();
        accelerator.closest_bundle(origin, &directions, 0.0, f64::INFINITY, None, &mut hits);
        for (&direction, &hit) in directions.iter().zip(&hits) {
            let ray = Ray { origin, direction, near: 0.0, far: f64::INFINITY, from: None };
            assert_eq!(hit, accelerator.closest(&ray), "{ray:?}");
            assert!(hit.is_some() || i % 2 == 1, "{ray:?}");
        }
    }
}

#[test]
fn moller_and_trumbore_agree_where_they_are_accurate() {
    for mesh in meshes() {
        let accelerator = Accelerator::build(&mesh.positions, &mesh.triangles);
        let size = mesh.positions.iter().fold(0.0, |m: f64, p| m.max(p.abs().max_element()));
        for i in 0..6_000 {
            let ray = random_ray(&mesh, i, &mut stream(22, &[i as u64]));
            let hit = accelerator.closest(&ray);
            let reach = size + ray.origin.length();
            for triangle in 0..mesh.triangles.len() {
                let corners = mesh.corners(triangle);
                let Some((distance, inside, conditioning)) = moller_trumbore(&ray, corners) else { continue };
                // Errors of that test: some 100 roundings of 2⁻⁵³ of the distance to the vertices, divided by
                // the triangle's size and the sine of the angle of incidence.
                let [a, b, c] = corners;
                let (e1, e2) = (b - a, c - a);
                let thin = e1.cross(e2).length() / e1.length().max(e2.length()).max((c - b).length());
                let error = 1e-14 * reach / (conditioning * thin.min(1.0) / size.max(1.0)).max(1e-300);
                let slack = error * reach;
                if ray.from == Some(triangle as u32) || error > 1e-3 {
                    continue;
                }
                if inside > error && distance > ray.near + slack && distance < ray.far - slack {
                    let hit = hit.unwrap_or_else(|| panic!("{ray:?} meets {triangle}"));
                    assert!(hit.distance <= distance + slack, "{ray:?} {triangle} {hit:?} {distance}");
                }
                if hit.is_some_and(|hit| hit.triangle == triangle as u32) {
                    let hit = hit.expect("some");
                    assert!(inside > -error && (hit.distance - distance).abs() <= slack, "{ray:?} {hit:?}");
                }
            }
        }
    }
}

#[test]
fn the_tree_does_not_depend_on_threads() {
    let mesh = rock(6, &mut stream(23, &[]));
    let build = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| Accelerator::build(&mesh.positions, &mesh.triangles))
    };
    let (one, five) = (build(1), build(5));
    assert_eq!(one.tree.triangles, five.tree.triangles);
    assert_eq!(one.tree.nodes.len(), five.tree.nodes.len());
}

#[test]
fn bad_input_hits_nothing() {
    let ray = Ray { origin: DVec3::ZERO, direction: DVec3::Z, near: 0.0, far: f64::INFINITY, from: None };
    let none = Accelerator::build(&[], &[]);
    assert_eq!(none.closest(&ray), None);
    assert!(!none.occluded(&ray));
    let mut mesh = cube();
    let whole = Accelerator::build(&mesh.positions, &mesh.triangles);
    for direction in [DVec3::ZERO, DVec3::NAN, DVec3::INFINITY] {
        assert_eq!(whole.closest(&Ray { direction, ..ray }), None);
    }
    for origin in [DVec3::NAN, DVec3::INFINITY] {
        assert_eq!(whole.closest(&Ray { origin, ..ray }), None);
    }
    for (near, far) in [(f64::NAN, 1.0), (0.0, f64::NAN), (2.0, 0.5), (1.0, 1.0)] {
        assert_eq!(whole.closest(&Ray { near, far, ..ray }), None);
    }
    assert!(whole.closest(&ray).is_some());
    assert!(whole.closest(&Ray { near: f64::NEG_INFINITY, ..ray }).is_some_and(|hit| hit.distance == -1.0));
    mesh.positions[0] = DVec3::NAN;
    mesh.positions[1] = DVec3::INFINITY;
    let holed = Accelerator::build(&mesh.positions, &mesh.triangles);
    assert!(holed.bounds().0.is_finite() && holed.bounds().1.is_finite());
    for huge in [1e-300, 1e300, f64::MAX] {
        let mesh = cube().map(|p| huge * *p);
        let huge = Accelerator::build(&mesh.positions, &mesh.triangles);
        let _ = huge.closest(&ray);
    }
}
