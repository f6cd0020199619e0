//! Seconds a gradient, on all threads: a sphere of 1,280 triangles that turns over a plane under a
//! rectangular light, 64 × 64 pixels of 16 samples.
//!
//! `cargo bench -p volume3d --bench gradient`; with `-- --quick` in less than a minute. Methods differ in
//! noise and bias as well: how they compare at equal error, figures tell.

mod icosphere;

use criterion::{Criterion, criterion_group, criterion_main};
use glam::{DAffine3, DVec3};
use icosphere::icosphere;
use volume3d::Image;
use volume3d::geometry::Mesh;
use volume3d::gradient::{
    ActiveParameters, EdgeSampling, Field, FiniteDifference, Progress, Rotation, Tangent, WarpedArea, render,
};
use volume3d::scene::{Camera, Description, Film, Filter, Integrator, Material, Scene};

const SIDE: usize = 64;
const SAMPLES: usize = 16;
/// Splits of an icosahedron: 20 · 4³ = 1,280 triangles.
const LEVELS: usize = 3;

/// The scene and the change: the sphere turns about an axis beside it, so that its silhouette and its shadow
/// move.
fn turning_sphere() -> (Scene, Tangent) {
    let camera = Camera::look_at(DVec3::new(0.0, 2.5, 6.0), DVec3::new(0.0, 0.6, 0.0), DVec3::Y, 0.7);
    let film = Film {
        width: SIDE,
        height: SIDE,
        crop: None,
        sample_border: true,
        filter: Filter::Tent { radius: 1.0 },
    };
    let mut description = Description::new(camera, film);
    description.integrator = Integrator { max_depth: Some(2), rr_depth: 5 };
    let white = description.add_material(Material::diffuse("white", DVec3::splat(0.7)));
    let level = DAffine3::from_rotation_x(-std::f64::consts::FRAC_PI_2);
    let floor = level * DAffine3::from_scale(DVec3::splat(5.0));
    description.add_shape("floor", Mesh::rectangle().transformed(&floor), white);
    let raised = DAffine3::from_translation(DVec3::new(0.4, 1.1, 0.0));
    let (positions, triangles) = icosphere(LEVELS);
    let sphere = Mesh::new(positions, triangles).expect("a mesh").transformed(&raised);
    let sphere = description.add_shape("sphere", sphere, white);
    let above =
        DAffine3::from_translation(4.0 * DVec3::Y) * DAffine3::from_rotation_x(std::f64::consts::FRAC_PI_2);
    description.add_emitter("lamp", Mesh::rectangle().transformed(&above), DVec3::splat(8.0));
    let scene = Scene::new(description).expect("a scene");
    let mut change = Tangent::still(&scene);
    change.rotate(&scene, sphere, DVec3::ZERO, DVec3::Z);
    (scene, change)
}

fn forward(c: &mut Criterion) {
    let (scene, change) = turning_sphere();
    let mut group = c.benchmark_group("forward");
    group.sample_size(10);
    let warped = WarpedArea { samples: SAMPLES, ..WarpedArea::default() };
    let rays = WarpedArea { field: Field::AuxiliaryRays, ..warped.clone() };
    for (name, method) in [("warped area, silhouettes", &warped), ("warped area, auxiliary rays", &rays)] {
        group.bench_function(name, |b| {
            b.iter(|| method.forward(&scene, &change, &Progress::none()).expect("valid"));
        });
    }
    let edges = EdgeSampling {
        samples: SAMPLES,
        primary: SAMPLES,
        secondary: SAMPLES,
        bounces: SAMPLES,
        ..EdgeSampling::default()
    };
    group.bench_function("edge sampling", |b| {
        b.iter(|| edges.forward(&scene, &change, &Progress::none()).expect("valid"));
    });
    let rotation = Rotation { samples: SAMPLES, ..Rotation::default() };
    group.bench_function("rotation", |b| {
        b.iter(|| rotation.forward(&scene, &change, &Progress::none()).expect("valid"));
    });
    let differences = FiniteDifference { samples: SAMPLES, ..FiniteDifference::default() };
    group.bench_function("finite differences", |b| {
        b.iter(|| differences.forward(&scene, &change, &Progress::none()).expect("valid"));
    });
}

/// The gradient of Σ pixels by all vertices of the sphere, which costs what one number costs.
fn reverse(c: &mut Criterion) {
    let (scene, _) = turning_sphere();
    let adjoint = Image::constant(SIDE, SIDE, DVec3::ONE);
    let mut active = ActiveParameters::nothing(&scene);
    active.shapes[scene.shape("sphere").expect("a sphere")] = true;
    let method = WarpedArea { samples: SAMPLES, ..WarpedArea::default() };
    let mut group = c.benchmark_group("reverse");
    group.sample_size(10).bench_function("warped area, silhouettes", |b| {
        b.iter(|| method.reverse(&scene, &adjoint, &active, &Progress::none()).expect("valid"));
    });
}

fn primal(c: &mut Criterion) {
    let (scene, _) = turning_sphere();
    let mut group = c.benchmark_group("primal");
    group.sample_size(10).bench_function("render", |b| {
        b.iter(|| render(&scene, SAMPLES, 0, &Progress::none()).expect("valid"));
    });
}

criterion_group!(benches, primal, forward, reverse);
criterion_main!(benches);
