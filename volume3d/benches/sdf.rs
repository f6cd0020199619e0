//! Visits of a grid of 64³ cells, one thread: φ and ∇φ, all second derivatives besides, and the transpose.
//!
//! `cargo bench -p volume3d --bench sdf`; an iteration is one visit.

use std::hint::black_box;

use criterion::{Criterion, criterion_group, criterion_main};
use flatland::random::{open01, stream};
use flatland::sdf::{Jet, Sdf};
use glam::DVec3;
use volume3d::sdf::{Grid, Interpolation};

fn visits(c: &mut Criterion) {
    let mut random = stream(1, &[]);
    let points: Vec<DVec3> =
        (0..4096).map(|_| DVec3::from_array([(); 3].map(|()| 1.8 * open01(&mut random) - 0.9))).collect();
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

criterion_group!(benches, visits);
criterion_main!(benches);
