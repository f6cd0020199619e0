//! Seconds to move all vertices of a scene, against those to build it anew.
//!
//! `cargo bench -p volume3d --bench update`. Elements are triangles.

mod icosphere;

use criterion::{BatchSize, BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use glam::DVec3;
use icosphere::icosphere;
use volume3d::geometry::Mesh;
use volume3d::scene::{Camera, Description, Film, Filter, Material, Scene};

/// A sphere with waves on it.
fn description(levels: usize, smooth: bool) -> Description {
    let camera = Camera::look_at(DVec3::new(0.0, 2.5, 6.0), DVec3::ZERO, DVec3::Y, 0.7);
    let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
    let mut description = Description::new(camera, film);
    let white = description.add_material(Material::diffuse("white", DVec3::ONE));
    let (positions, triangles) = icosphere(levels);
    let mesh = Mesh::new(waves(&positions, 0.0), triangles).expect("a mesh");
    description.add_shape("ball", if smooth { mesh.smooth() } else { mesh }, white);
    description
}

fn waves(positions: &[DVec3], phase: f64) -> Vec<DVec3> {
    positions.iter().map(|p| *p * (1.0 + 0.1 * (9.0 * p.x + phase).sin() * (8.0 * p.y).cos())).collect()
}

fn update(c: &mut Criterion) {
    let mut group = c.benchmark_group("update");
    group.sample_size(10);
    for (levels, smooth) in [(4, true), (6, true), (8, true), (8, false)] {
        let description = description(levels, smooth);
        let count = description.shapes[0].mesh.triangles().len();
        group.throughput(Throughput::Elements(count as u64));
        let name = if smooth { "smooth" } else { "flat" };
        group.bench_function(BenchmarkId::new(format!("new, {name}"), count), |b| {
            b.iter_batched(|| description.clone(), Scene::new, BatchSize::PerIteration);
        });
        let mesh = description.shapes[0].mesh.clone();
        let mut scene = Scene::new(description).expect("a scene");
        let mut phase = 0.0;
        group.bench_function(BenchmarkId::new(format!("moved, {name}"), count), |b| {
            b.iter_batched(
                || {
                    phase += 0.01;
                    mesh.clone().with_positions(waves(mesh.positions(), phase)).expect("a mesh")
                },
                |mesh| scene.set_meshes([(0, mesh)]),
                BatchSize::PerIteration,
            );
        });
    }
}

criterion_group!(benches, update);
criterion_main!(benches);
