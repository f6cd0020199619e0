//! Test that errors of the pilot's candidates fall as n^−½ where silhouettes of different velocities cross,
//! are dense, or run 10⁻⁶ apart.

use flatland::random::{open01, stream};

use super::*;
use crate::gradient::{Field, Method, Pilot};

const RUNS: u64 = 16;

/// A ground seen from above, on a film of `pixels`² pixels.
fn ground(pixels: usize) -> (Description, usize) {
    let camera = Camera::look_at(DVec3::new(0.0, -0.5, 3.0), DVec3::ZERO, DVec3::Y, 0.6);
    let mut d = Description::new(camera, film(pixels, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let paper = d.add_material(Material::diffuse("paper", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("ground", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 2.0)), paper);
    (d, paper)
}

fn lamp(d: &mut Description, size: f64) {
    let lamp = Mesh::rectangle().transformed(&(at(0.6, 0.4, 3.5, size) * DAffine3::from_rotation_x(3.1)));
    d.add_emitter("lamp", lamp, DVec3::splat(1.0 / (size * size)));
}

/// A block above the ground, outside the picture, in front of a small lamp: in the penumbra its silhouettes
/// cross those of the lamp.
fn penumbra() -> (Scene, Tangent) {
    let (mut d, paper) = ground(12);
    d.add_shape("block", Mesh::cube().transformed(&at(0.1, 0.05, 0.6, 0.25)), paper);
    lamp(&mut d, 0.08);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.rotate(&scene, 1, DVec3::new(0.1, 0.0, 0.6), DVec3::new(0.4, 0.7, 1.0));
    (scene, change)
}

/// Many leaves, each a shape with a rotation of its own.
fn clutter() -> (Scene, Tangent) {
    let (mut d, paper) = ground(12);
    let mut random = stream(7, &[1]);
    let mut number = || 2.0 * open01(&mut random) - 1.0;
    let mut motions = vec![];
    for i in 0..60 {
        let place = DVec3::new(0.8 * number(), 0.8 * number(), 0.6 + 0.4 * number());
        let axis = DVec3::new(number(), number(), number()).normalize();
        let map = DAffine3::from_translation(place)
            * DAffine3::from_axis_angle(axis, 3.0 * number())
            * DAffine3::from_scale(DVec3::new(0.12, 0.03, 1.0));
        d.add_shape(&format!("leaf {i}"), Mesh::rectangle().transformed(&map), paper);
        motions.push((place, DVec3::new(number(), number(), number())));
    }
    lamp(&mut d, 0.3);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    for (i, (place, turn)) in motions.into_iter().enumerate() {
        change.rotate(&scene, 1 + i, place, turn);
    }
    (scene, change)
}

/// Two sheets whose edges are 10⁻⁶ apart and move relative to each other.
fn gap() -> (Scene, Tangent) {
    let (mut d, paper) = ground(12);
    let half =
        |x: f64| Mesh::rectangle().transformed(&(at(x, 0.0, 0.5, 0.3) * DAffine3::from_rotation_z(0.0)));
    d.add_shape("left", half(-0.3), paper);
    d.add_shape("right", half(0.3 + 1e-6), paper);
    lamp(&mut d, 0.3);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.3, 0.5, 0.0));
    change.translate(&scene, 2, DVec3::new(-0.4, 0.2, 0.1));
    (scene, change)
}

/// The method with `factor` times the samples.
fn scaled(method: &Method, factor: usize) -> Method {
    match method.clone() {
        Method::WarpedArea(m) => {
            let Field::Softened { film, lobe, softness, silhouettes, shadows, bounces } = m.field else {
                panic!("the field is not softened")
            };
            let (silhouettes, shadows) = (factor * silhouettes, factor * shadows);
            let bounces = factor * bounces;
            let field = Field::Softened { film, lobe, softness, silhouettes, shadows, bounces };
            let sign_changes = factor * m.sign_changes;
            // Without the pilot's allocation, which has sample counts of its own.
            let (samples, allocation) = (factor * m.samples, None);
            Method::WarpedArea(WarpedArea { samples, allocation, sign_changes, field, ..m })
        }
        Method::EdgeSampling(m) => Method::EdgeSampling(EdgeSampling {
            samples: factor * m.samples,
            primary: factor * m.primary,
            secondary: factor * m.secondary,
            bounces: factor * m.bounces,
            ..m
        }),
    }
}

/// The variance of one image, summed over pixels and channels.
fn variance(method: &Method, scene: &Scene, change: &Tangent) -> f64 {
    let run =
        |seed| method.with_seed(seed).forward(scene, change, &Progress::none()).unwrap().gradient.pixels;
    let images: Vec<Vec<DVec3>> = (0..RUNS).map(|r| run(500 + r)).collect();
    let mut sum = 0.0;
    for i in 0..images[0].len() {
        let mean = images.iter().map(|image| image[i]).sum::<DVec3>() / RUNS as f64;
        sum += images.iter().map(|image| (image[i] - mean).length_squared()).sum::<f64>();
    }
    sum / (RUNS - 1) as f64
}

/// The exponent of the error over three doublings of the samples is −½, or steeper where samples are
/// stratified. The standard error of an estimate from 16 runs is about 0.026; values below −0.45 pass.
#[test]
fn errors_fall_as_the_root_of_samples() {
    for (name, (scene, change)) in [("penumbra", penumbra()), ("clutter", clutter()), ("gap", gap())] {
        let choice = Pilot { samples: 16, seed: 5 }.for_change(&scene, &change, &Progress::none()).unwrap();
        for candidate in &choice.candidates {
            let errors =
                [1, 8].map(|factor| variance(&scaled(&candidate.method, factor), &scene, &change).sqrt());
            let exponent = (errors[1] / errors[0]).log2() / 3.0;
            println!("{name}: {}: exponent {exponent:.3}, errors {errors:?}", candidate.method);
            assert!(exponent < -0.45, "{name}: {}: {exponent}", candidate.method);
        }
    }
}
