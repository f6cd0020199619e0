//! Time per sample of the methods, and of the scene's three queries, from 10 to 100,000 edges.
//!
//! `cargo bench -p flatland`; a single benchmark by its name, as in `cargo bench -p flatland -- hit`.

use std::hint::black_box;

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use flatland::estimator::{Construction, EdgeSampling, Method, Rotation, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::plane::fields::scene_stencil;
use flatland::plane::{Film, Filter, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::{open01, stream};
use flatland::warp::{Debias, Plane, Warp};
use glam::{DVec2, DVec3};

/// A blob of `edges` edges with a wavy outline, about 40 pixels across.
fn blob(edges: usize) -> Scene {
    let corner = |i: usize| {
        let t = std::f64::consts::TAU * i as f64 / edges as f64;
        DVec2::splat(32.0) + (20.0 + 3.0 * (7.0 * t).sin()) * DVec2::from_angle(t)
    };
    let polygon = Polygon::simple((0..edges).map(corner).collect::<Vec<_>>()).expect("simple");
    Scene::new(DVec3::ZERO, vec![Shape::new(polygon, Shade::constant(DVec3::ONE))]).expect("a scene")
}

/// `edges`/3 small triangles all over the film.
fn confetti(edges: usize) -> Scene {
    let mut rng = stream(1, &[]);
    let count = edges.div_ceil(3);
    // Sized so that the coverage does not depend on their number.
    let size = 40.0 / (count as f64).sqrt();
    let shapes = (0..count).map(|_| {
        let centre = 64.0 * DVec2::new(open01(&mut rng), open01(&mut rng));
        let turn = 6.0 * open01(&mut rng);
        let corner = |k: f64| centre + size * DVec2::from_angle(turn + 2.1 * k);
        let polygon = Polygon::simple([corner(0.0), corner(1.0), corner(2.0)]).expect("simple");
        Shape::new(polygon, Shade::constant(DVec3::splat(open01(&mut rng))))
    });
    Scene::new(DVec3::ZERO, shapes.collect()).expect("a scene")
}

const SIZES: [usize; 5] = [10, 100, 1_000, 10_000, 100_000];

type Make = fn(usize) -> Scene;
const SCENES: [(&str, Make); 2] = [("blob", blob), ("confetti", confetti)];

/// Queries of the visible point and of the distance to its boundary.
fn questions(c: &mut Criterion) {
    for (name, make) in SCENES {
        let mut group = c.benchmark_group(format!("questions/{name}"));
        for size in SIZES {
            let scene = make(size);
            let mut rng = stream(2, &[]);
            group.bench_function(BenchmarkId::new("hit", size), |b| {
                b.iter(|| {
                    let u = 64.0 * DVec2::new(open01(&mut rng), open01(&mut rng));
                    let hit = scene.hit(u);
                    scene.boundary_distance(black_box(hit.as_ref()), u, 0.4)
                });
            });
        }
    }
}

/// One sample of every method: the whole film once.
fn sample(c: &mut Criterion) {
    let film = Film::new(64, 64, Filter::Tent).expect("a film");
    let pixels = (film.width() * film.height()) as u64;
    for (name, make) in SCENES {
        let mut group = c.benchmark_group(format!("sample/{name}"));
        group.sample_size(10).throughput(Throughput::Elements(4 * pixels));
        for size in SIZES {
            let scene = make(size);
            let motion = Motion::rotate(0..scene.shapes().len(), DVec2::splat(32.0));
            let jumps = Construction::JumpMean { reach: 0.6 };
            let methods: [(&str, Box<dyn Method>); 5] = [
                ("warped area", Box::new(WarpedArea { samples: 4, ..WarpedArea::default() })),
                (
                    "warped area, 16 rays",
                    Box::new(WarpedArea {
                        samples: 4,
                        construction: Warp::original(16).into(),
                        ..WarpedArea::default()
                    }),
                ),
                (
                    "mean over jumps",
                    Box::new(WarpedArea { samples: 4, construction: jumps, ..WarpedArea::default() }),
                ),
                ("edge sampling", Box::new(EdgeSampling { samples: 4, seed: 0 })),
                ("rotation", Box::new(Rotation { samples: 4, ..Rotation::default() })),
            ];
            for (method_name, method) in methods {
                group.bench_function(BenchmarkId::new(method_name, size), |b| {
                    b.iter(|| method.forward(&scene, &motion, &film).expect("valid"));
                });
            }
        }
    }
}

/// The estimate of (V, ∇·V) alone.
fn stencil(c: &mut Criterion) {
    let scene = blob(100);
    let mut group = c.benchmark_group("stencil");
    let consistent = |rays| Warp { debias: Debias::Consistent { rays }, ..Warp::default() };
    for (name, warp) in
        [("16 rays", consistent(16)), ("256 rays", consistent(256)), ("multilevel", Warp::default())]
    {
        let mut rng = stream(3, &[]);
        group.bench_function(name, |b| {
            b.iter(|| {
                let u = DVec2::splat(32.0) + 20.0 * DVec2::from_angle(6.0 * open01(&mut rng));
                scene_stencil(&scene, &warp, 44.0, u, &mut rng)
            });
        });
        group.bench_function(format!("{name}, without the scene"), |b| {
            b.iter(|| warp.stencil::<Plane, _>(DVec2::ZERO, 44.0, &mut rng, |u| (u, u.x.abs())));
        });
    }
}

/// Building the scene, its arrangement, and the exact integrals of a film.
fn exact(c: &mut Criterion) {
    let film = Film::new(64, 64, Filter::Tent).expect("a film");
    let mut group = c.benchmark_group("exact");
    group.sample_size(10);
    for size in SIZES {
        group.bench_function(BenchmarkId::new("scene", size), |b| b.iter(|| blob(size)));
        let scene = blob(size);
        group.bench_function(BenchmarkId::new("arrangement", size), |b| {
            b.iter(|| Arrangement::new(&scene, &film).expect("an arrangement"));
        });
        let arrangement = Arrangement::new(&scene, &film).expect("an arrangement");
        let motion = Motion::rotate([0], DVec2::splat(32.0));
        let velocities = motion.velocities(&scene).expect("the motion fits");
        group.bench_function(BenchmarkId::new("edge integral", size), |b| {
            b.iter(|| arrangement.boundary(&film, &velocities).expect("differentiable"));
        });
        group.bench_function(BenchmarkId::new("primal", size), |b| b.iter(|| arrangement.primal(&film)));
    }
}

criterion_group!(benches, questions, stencil, sample, exact);
criterion_main!(benches);
