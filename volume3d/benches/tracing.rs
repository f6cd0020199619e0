//! Rays a second, one thread, on a sphere of 81,920 triangles, and the time to build its hierarchy.
//!
//! `cargo bench -p volume3d --bench tracing`; elements are rays (triangles, for the build).

use std::collections::HashMap;
use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use flatland::random::{Stream, open01, stream};
use flatland::warp::Domain;
use glam::DVec3;
use volume3d::Sphere;
use volume3d::geometry::{Accelerator, Ray};

/// Rays of a benchmark, enough to leave no trace of one round in the caches of the next.
const RAYS: usize = 1 << 16;
/// Auxiliary rays of a primary one.
const BUNDLE: usize = 16;
/// Splits of an icosahedron: 20 · 4⁶ = 81,920 triangles.
const LEVELS: usize = 6;

/// The unit sphere: an icosahedron, each face split in four [`LEVELS`] times.
fn icosphere() -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut positions: Vec<DVec3> = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)]
        .into_iter()
        .flat_map(|(a, b)| [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)])
        .map(DVec3::normalize)
        .collect();
    // Faces join corners at the edge length 1.05; the next distance is 1.7.
    let adjacent = |a: u32, b: u32| positions[a as usize].distance(positions[b as usize]) < 1.1;
    let mut triangles: Vec<[u32; 3]> = (0..12)
        .flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| [a, b, c])))
        .filter(|&[a, b, c]| adjacent(a, b) && adjacent(b, c) && adjacent(c, a))
        .collect();
    for _ in 0..LEVELS {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    (positions, triangles)
}

fn in_ball(rng: &mut Stream) -> DVec3 {
    loop {
        let p = DVec3::from_array([0; 3].map(|_| 2.0 * open01(rng) - 1.0));
        if p.length_squared() < 1.0 {
            return p;
        }
    }
}

/// From a sphere of radius 3 to points of the ball of radius 1.1: most rays hit.
fn outside(rng: &mut Stream) -> Ray {
    let origin = 3.0 * in_ball(rng).normalize();
    let direction = (1.1 * in_ball(rng) - origin).normalize();
    Ray { origin, direction, near: 0.0, far: f64::INFINITY, from: None }
}

/// From points of the ball of radius 0.9 in all directions: every ray hits.
fn inside(rng: &mut Stream) -> Ray {
    Ray { origin: 0.9 * in_ball(rng), direction: in_ball(rng).normalize(), ..outside(rng) }
}

/// From points of the surface in all directions: half of the rays leave the sphere, half cross it.
fn bounces(accelerator: &Accelerator, count: usize) -> Vec<Ray> {
    let mut rng = stream(3, &[]);
    (0..count)
        .map(|_| {
            let ray = inside(&mut rng);
            let hit = accelerator.closest(&ray).expect("from the inside every ray hits");
            let origin = ray.origin + hit.distance * ray.direction;
            Ray { origin, direction: in_ball(&mut rng).normalize(), from: Some(hit.triangle), ..ray }
        })
        .collect()
}

type Draw = fn(&mut Stream) -> Ray;
const SIDES: [(&str, Draw); 2] = [("outside", outside), ("inside", inside)];

fn build(c: &mut Criterion) {
    let (positions, triangles) = icosphere();
    let mut group = c.benchmark_group("build");
    group.sample_size(10).throughput(Throughput::Elements(triangles.len() as u64));
    group.bench_function("icosphere", |b| b.iter(|| Accelerator::build(&positions, &triangles)));
}

fn single(c: &mut Criterion) {
    let (positions, triangles) = icosphere();
    let accelerator = Accelerator::build(&positions, &triangles);
    for (side, draw) in SIDES {
        let mut rng = stream(1, &[]);
        let rays: Vec<Ray> = (0..RAYS).map(|_| draw(&mut rng)).collect();
        one_by_one(c, side, &accelerator, &rays);
    }
    one_by_one(c, "bounce", &accelerator, &bounces(&accelerator, RAYS));
}

fn one_by_one(c: &mut Criterion, side: &str, accelerator: &Accelerator, rays: &[Ray]) {
    let mut group = c.benchmark_group(format!("single/{side}"));
    group.sample_size(20).throughput(Throughput::Elements(rays.len() as u64));
    group.bench_function("closest", |b| {
        b.iter(|| rays.iter().filter(|ray| black_box(accelerator.closest(ray)).is_some()).count());
    });
    group.bench_function("occluded", |b| {
        b.iter(|| rays.iter().filter(|ray| accelerator.occluded(ray)).count());
    });
}

fn bundles(c: &mut Criterion) {
    let (positions, triangles) = icosphere();
    let accelerator = Accelerator::build(&positions, &triangles);
    for (side, draw) in SIDES {
        let mut group = c.benchmark_group(format!("bundle/{side}"));
        group.sample_size(20).throughput(Throughput::Elements(RAYS as u64));
        for kappa in [1e2, 1e4, 1e5, 1e7] {
            let mut rng = stream(2, &[]);
            let rays: Vec<(Ray, Vec<DVec3>)> = (0..RAYS / BUNDLE)
                .map(|_| {
                    let ray = draw(&mut rng);
                    let draw = |_| {
                        Sphere::draw(ray.direction, kappa, 1.0, [open01(&mut rng), open01(&mut rng)]).point
                    };
                    (ray, (0..BUNDLE).map(draw).collect())
                })
                .collect();
            let mut hits = Vec::new();
            group.bench_function(BenchmarkId::new("kappa", kappa), |b| {
                b.iter(|| {
                    for (ray, directions) in &rays {
                        let Ray { origin, near, far, from, .. } = *ray;
                        accelerator.closest_bundle(origin, directions, near, far, from, &mut hits);
                        black_box(&hits);
                    }
                });
            });
        }
    }
}

criterion_group!(benches, build, single, bundles);
criterion_main!(benches);
