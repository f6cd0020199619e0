//! Visits of a grid of 64³ cells, one thread: φ and ∇φ, all second derivatives besides, and the transpose.
//! Then the same of networks of 4 × 64 neurons, without an encoding and with six frequencies, one point at a
//! time in double precision, and many in single.
//!
//! `cargo bench -p volume3d --bench sdf`; an iteration is one visit, or, where elements are counted, 4096 of
//! them.

use std::hint::black_box;

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use flatland::random::{open01, stream};
use flatland::sdf::{Jet, Sdf};
use glam::DVec3;
use volume3d::sdf::network::{Architecture, Network, SingleNetwork};
use volume3d::sdf::{Grid, Interpolation};

fn points() -> Vec<DVec3> {
    let mut random = stream(1, &[]);
    (0..4096).map(|_| DVec3::from_array([(); 3].map(|()| 1.8 * open01(&mut random) - 0.9))).collect()
}

fn visits(c: &mut Criterion) {
    let points = points();
    for interpolation in [Interpolation::Trilinear, Interpolation::Cubic] {
        let corners = (DVec3::NEG_ONE, DVec3::ONE);
        let grid = Grid::sampled(interpolation, corners, 64, |x| x.length() - 0.6).expect("a ball");
        let mut group = c.benchmark_group(format!("{interpolation:?}"));
        let mut point = points.iter().cycle();
        let mut next = || *point.next().expect("a cycle");
        group.bench_function("jet", |b| b.iter(|| black_box(grid.jet(next()))));
        group.bench_function("second order", |b| b.iter(|| black_box(grid.second_order(next()))));
        let mut gradient = vec![0.0; grid.parameter_count()];
        let covector = Jet { value: 0.1, gradient: DVec3::ONE };
        group.bench_function("transpose", |b| {
            b.iter(|| grid.add_parameter_gradient(next(), covector, &mut gradient));
        });
    }
}

fn networks(c: &mut Criterion) {
    let points = points();
    let covectors = vec![Jet { value: 0.1, gradient: DVec3::ONE }; points.len()];
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().expect("a thread");
    for frequencies in [0, 6] {
        let architecture = Architecture { frequencies, ..Architecture::default() };
        let network = Network::sphere(architecture, 0.5, 1).expect("a network");
        let mut gradient = vec![0.0; network.parameter_count()];
        let mut group = c.benchmark_group(format!("4 × 64, {frequencies} frequencies"));
        let mut point = points.iter().cycle();
        let mut next = || *point.next().expect("a cycle");
        group.bench_function("jet", |b| b.iter(|| black_box(network.jet(next()))));
        group.bench_function("transpose", |b| {
            b.iter(|| network.add_parameter_gradient(next(), covectors[0], &mut gradient));
        });
        let single = SingleNetwork::new(&network).expect("small weights");
        group.throughput(Throughput::Elements(points.len() as u64));
        group.bench_function("values, single", |b| {
            pool.install(|| b.iter(|| black_box(single.values(&points))));
        });
        group.bench_function("jets, single", |b| {
            pool.install(|| b.iter(|| black_box(single.jets(&points))));
        });
        group.bench_function("transpose, single", |b| {
            pool.install(|| {
                b.iter(|| single.add_parameter_gradient(&points, &covectors, &mut gradient).expect("counts"));
            });
        });
        group.bench_function("copy, single", |b| b.iter(|| black_box(SingleNetwork::new(&network))));
    }
}

criterion_group!(benches, visits, networks);
criterion_main!(benches);
