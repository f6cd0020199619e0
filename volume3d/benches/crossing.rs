//! Seconds to find where surfaces pass through one another: in one sphere, which does not, and in two spheres
//! that do.
//!
//! `cargo bench -p volume3d --bench crossing`. The query is made once a scene, by the first geometric
//! gradient.

mod icosphere;

use criterion::{BatchSize, BenchmarkId, Criterion, criterion_group, criterion_main};
use glam::{DAffine3, DVec3};
use icosphere::icosphere;
use volume3d::geometry::Mesh;
use volume3d::scene::{Camera, Description, Film, Filter, Material, Scene};

fn scene(levels: usize, spheres: usize) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 2.5, 6.0), DVec3::ZERO, DVec3::Y, 0.7);
    let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
    let mut description = Description::new(camera, film);
    let white = description.add_material(Material::diffuse("white", DVec3::ONE));
    let (positions, triangles) = icosphere(levels);
    let mesh = Mesh::new(positions, triangles).expect("a mesh");
    for i in 0..spheres {
        let aside = DAffine3::from_translation(DVec3::new(0.71, 0.13, 0.37) * i as f64);
        description.add_shape(&i.to_string(), mesh.clone().transformed(&aside), white);
    }
    Scene::new(description).expect("a scene")
}

fn find(c: &mut Criterion) {
    let mut group = c.benchmark_group("crossings");
    group.sample_size(10);
    for (levels, spheres) in [(6, 1), (6, 2), (8, 1)] {
        let triangles = spheres * 20 * 4_usize.pow(levels as u32);
        let segments = scene(levels, spheres).crossing_shapes().iter().map(|s| s.segments).sum::<usize>();
        let id = BenchmarkId::new(format!("{segments} segments"), triangles);
        group.bench_function(id, |b| {
            b.iter_batched(
                || scene(levels, spheres),
                |scene| (scene.crossing_shapes(), scene),
                BatchSize::PerIteration,
            );
        });
    }
}

criterion_group!(benches, find);
criterion_main!(benches);
