//! Time of rays, paths and gradients in flat worlds, from 10 to 10,000 segments, and of the exact
//! pixels of a small one.
//!
//! `cargo bench -p flatland --bench transport`; elements are rays or paths.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use flatland::estimator::transport::{EdgeSampling, Method, WarpedArea};
use flatland::plane::Filter;
use flatland::random::{open01, stream};
use flatland::transport::exact::{Exact, Radiosity};
use flatland::transport::fields::Construction;
use flatland::transport::{Camera, Film, Material, Origin, Paths, Shape, Tangent, World};
use glam::DVec2;

fn p(x: f64, y: f64) -> DVec2 {
    DVec2::new(x, y)
}

/// A closed room with a light and a disc of `sides` segments in its middle.
fn room(sides: usize) -> (World, Camera, Tangent) {
    let corner = |i: usize| {
        let t = std::f64::consts::TAU * i as f64 / sides as f64;
        p(-0.5, 1.1) + 0.4 * DVec2::from_angle(t)
    };
    let walls = [p(-2.0, 0.0), p(2.0, 0.1), p(2.1, 3.0), p(-1.9, 3.1)];
    let shapes = vec![
        Shape::closed(walls, Material::diffuse(0.7)),
        Shape::open([p(-0.4, 2.7), p(0.5, 2.75)], Material::emitter(4.0)),
        Shape::closed((0..sides).map(corner), Material::diffuse(0.5)),
    ];
    let world = World::new(0.0, shapes).expect("a world");
    let film = Film { pixels: 16, filter: Filter::Tent };
    let camera = Camera { position: p(1.3, 1.5), angle: -2.4, field_of_view: 1.2, film };
    let change = Tangent::translate(&world, [2], p(1.0, 0.5));
    (world, camera, change)
}

fn rays(c: &mut Criterion) {
    let mut group = c.benchmark_group("transport/ray");
    group.throughput(Throughput::Elements(1));
    for sides in [10, 100, 1_000, 10_000] {
        let (world, camera, _) = room(sides);
        let mut rng = stream(1, &[]);
        group.bench_function(BenchmarkId::from_parameter(sides), |b| {
            b.iter(|| {
                let direction = DVec2::from_angle(std::f64::consts::TAU * open01(&mut rng));
                world.trace(Origin::free(camera.position), direction)
            });
        });
    }
}

fn paths(c: &mut Criterion) {
    const SAMPLES: usize = 20;
    let mut group = c.benchmark_group("transport/path");
    group.sample_size(10);
    for (sides, bounces) in [(10, 1), (10, 4), (1_000, 1)] {
        let (world, camera, change) = room(sides);
        let paths = Paths { bounces, ..Paths::default() };
        let name = format!("{sides} sides, {bounces} bounces");
        group.throughput(Throughput::Elements((SAMPLES * camera.film.pixels) as u64));
        group.bench_function(BenchmarkId::new("primal", &name), |b| {
            b.iter(|| paths.image(&world, &camera, SAMPLES, 1).expect("valid"));
        });
        let warped = WarpedArea { samples: SAMPLES, paths, ..WarpedArea::default() };
        let methods: [(&str, Box<dyn Method>); 4] = [
            ("warped area", Box::new(warped)),
            ("harmonic field", Box::new(WarpedArea { construction: Construction::Harmonic, ..warped })),
            ("interior", Box::new(WarpedArea { construction: Construction::Still, ..warped })),
            ("edge sampling", Box::new(EdgeSampling { samples: SAMPLES, paths, ..EdgeSampling::default() })),
        ];
        for (method_name, method) in methods {
            group.bench_function(BenchmarkId::new(method_name, &name), |b| {
                b.iter(|| method.forward(&world, &camera, &change).expect("valid"));
            });
        }
    }
}

fn exact(c: &mut Criterion) {
    let (world, camera, change) = room(10);
    let mut group = c.benchmark_group("transport/exact");
    group.sample_size(10);
    let exact = Exact { bounces: 1, ..Exact::default() };
    group.bench_function("image", |b| b.iter(|| exact.image(&world, &camera).expect("exact")));
    group.bench_function("gradient", |b| {
        b.iter(|| exact.gradient(&world, &camera, &change).expect("differentiable"));
    });
    let radiosity = Radiosity { bounces: Some(3), parts: 1, ..Radiosity::default() };
    group.bench_function("radiosity, three bounces", |b| {
        b.iter(|| radiosity.gradient(&world, &camera, &change).expect("diffuse"));
    });
}

criterion_group!(benches, rays, paths, exact);
criterion_main!(benches);
