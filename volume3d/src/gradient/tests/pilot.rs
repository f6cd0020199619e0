//! What a pilot foresees, and what it chooses.

use super::*;
use crate::gradient::{Field, Method, Pilot};

/// A ground under a lamp, with a shape above it.
fn scene(mesh: Mesh) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, -3.0, 2.5), DVec3::new(0.0, 0.0, 0.3), DVec3::Z, 0.7);
    let mut d = Description::new(camera, film(24, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(2);
    let paper = d.add_material(Material::diffuse("paper", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("ground", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 2.0)), paper);
    d.add_shape("shape", mesh, paper);
    let lamp = Mesh::rectangle().transformed(&(at(0.5, 0.3, 3.0, 0.4) * DAffine3::from_rotation_x(3.0)));
    d.add_emitter("lamp", lamp, DVec3::splat(20.0));
    Scene::new(d).unwrap()
}

fn moved(scene: &Scene) -> Tangent {
    let mut change = Tangent::still(scene);
    change.rotate(scene, 1, DVec3::new(0.0, 0.0, 0.5), DVec3::new(0.3, 0.5, 0.2));
    change
}

fn block() -> Mesh {
    Mesh::cube().transformed(&(at(0.0, 0.0, 0.7, 0.3) * DAffine3::from_rotation_z(0.4)))
}

/// A ball with so many waves that most of its edges are silhouettes somewhere.
fn rough_ball() -> Mesh {
    let (rows, columns) = (120u32, 240u32);
    let mut positions = vec![];
    for i in 0..=rows {
        for j in 0..columns {
            let (a, b) = (
                std::f64::consts::PI * (f64::from(i) + 0.001) / (f64::from(rows) + 0.002),
                std::f64::consts::TAU * f64::from(j) / f64::from(columns),
            );
            let radius = 0.5 + 0.03 * (34.0 * a).sin() * (46.0 * b).cos();
            positions.push(DVec3::new(a.sin() * b.cos(), a.sin() * b.sin(), a.cos()) * radius);
        }
    }
    let mut triangles = vec![];
    for i in 0..rows {
        for j in 0..columns {
            let at = |i: u32, j: u32| i * columns + j % columns;
            triangles.push([at(i, j), at(i + 1, j), at(i + 1, j + 1)]);
            triangles.push([at(i, j), at(i + 1, j + 1), at(i, j + 1)]);
        }
    }
    Mesh::new(positions, triangles).unwrap().transformed(&at(0.0, 0.0, 0.7, 1.0))
}

/// The noise of both candidates is about what the pilot foresees, and the one that errs less is chosen: edge sampling where there are few
/// edges, the field where there are many.
#[test]
fn a_pilot_foresees_errors() {
    const RUNS: u64 = 12;
    let none = Progress::none();
    for (name, mesh, edges) in [("block", block(), true), ("rough ball", rough_ball(), false)] {
        let scene = scene(mesh);
        let change = moved(&scene);
        let choice = Pilot { samples: 64, seed: 3 }.for_change(&scene, &change, &none).unwrap();
        assert_eq!(matches!(choice.method, Method::EdgeSampling(_)), edges, "{name}: {choice:?}");
        assert_eq!(choice.candidates.len(), 2);
        let mut measured = vec![];
        for candidate in &choice.candidates {
            let run =
                |seed| candidate.method.with_seed(seed).forward(&scene, &change, &none).unwrap().gradient;
            let images: Vec<Image> = (0..RUNS).map(|r| run(100 + r)).collect();
            let mut error = 0.0;
            for i in 0..images[0].pixels.len() {
                let mean = images.iter().map(|image| image.pixels[i]).sum::<DVec3>() / RUNS as f64;
                error += images.iter().map(|image| (image.pixels[i] - mean).length_squared()).sum::<f64>();
            }
            measured.push(error / (RUNS - 1) as f64);
            let ratio = measured[measured.len() - 1] / candidate.expected_squared_error;
            println!("{name}: {}: measured {ratio:.2} times what was expected", candidate.method);
            // Samples of the area are stratified, of which a pilot of two knows nothing.
            assert!((0.33..2.0).contains(&ratio), "{name}: {}: {ratio}", candidate.method);
        }
        println!("{name}: the choice errs {:.2} times as much as the other", measured[0] / measured[1]);
        assert!(measured[0] < measured[1], "{name}: {measured:?}");
    }
}

/// In reverse the pilot looks where the adjoint does; and where nothing is to be chosen it is the exact mean.
#[test]
fn a_pilot_of_a_transpose() {
    let scene = scene(block());
    let none = Progress::none();
    let (pilot, mut active) = (Pilot { samples: 32, seed: 1 }, ActiveParameters::nothing(&scene));
    active.lights = true;
    let choice = pilot.for_active(&scene, None, &active, &none).unwrap();
    assert!(choice.candidates.is_empty());
    assert!(matches!(
        choice.method,
        Method::WarpedArea(WarpedArea { samples: 32, field: Field::JumpMean { .. }, .. })
    ));
    active.shapes[1] = true;
    let expected = |adjoint: Option<&Image>| {
        let choice = pilot.for_active(&scene, adjoint, &active, &none).unwrap();
        choice.candidates.iter().map(|c| c.expected_squared_error).collect::<Vec<_>>()
    };
    let flat = Image::constant(24, 24, DVec3::splat(2.0));
    let (plain, doubled) = (expected(None), expected(Some(&flat)));
    assert!(plain.iter().zip(&doubled).all(|(a, b)| (b / a - 4.0).abs() < 1e-9), "{plain:?} {doubled:?}");
    let wrong = Image::constant(3, 3, DVec3::ONE);
    assert!(matches!(
        pilot.for_active(&scene, Some(&wrong), &active, &none),
        Err(GradientError::Adjoint { .. })
    ));
    assert!(matches!(
        Pilot { samples: 0, seed: 0 }.for_active(&scene, None, &active, &none),
        Err(GradientError::Samples { .. })
    ));
}
