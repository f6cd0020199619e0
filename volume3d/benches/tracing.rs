//! Rays a second, one thread, on a sphere of 81,920 triangles, and the time to build its hierarchy.
//!
//! `cargo bench -p volume3d --bench tracing`; elements are rays (triangles, for the build).

mod icosphere;

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use flatland::random::{Stream, open01, stream};
use flatland::warp::Domain;
use glam::DVec3;
use icosphere::icosphere;
use volume3d::Sphere;
use volume3d::geometry::{Accelerator, Hit, Ray};

/// Rays of a benchmark, enough to leave no trace of one round in the caches of the next.
const RAYS: usize = 1 << 16;
/// Auxiliary rays of a primary one.
const BUNDLE: usize = 16;
/// Splits of an icosahedron: 20 · 4⁶ = 81,920 triangles.
const LEVELS: usize = 6;

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
    let (positions, triangles) = icosphere(LEVELS);
    let mut group = c.benchmark_group("build");
    group.sample_size(10).throughput(Throughput::Elements(triangles.len() as u64));
    group.bench_function("icosphere", |b| b.iter(|| Accelerator::build(&positions, &triangles)));
}

fn single(c: &mut Criterion) {
    let (positions, triangles) = icosphere(LEVELS);
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
    let (positions, triangles) = icosphere(LEVELS);
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
            let mut hits: Vec<Option<Hit>> = Vec::new();
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
