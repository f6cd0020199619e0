//! Tests of the pilot's error estimates and of its choice of method.

use super::*;
use crate::gradient::{Field, Method, Pilot, Survey};
use crate::scene::{Crop, Film};

/// A ground under a lamp, with a shape above it.
fn scene(size: usize, mesh: Mesh) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, -3.0, 2.5), DVec3::new(0.0, 0.0, 0.3), DVec3::Z, 0.7);
    let mut d = Description::new(camera, film(size, Filter::Tent { radius: 1.0 }));
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

/// A ball with so many waves that most of its edges are silhouettes from somewhere.
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

/// The squared error of a method's image, estimated from several runs.
fn measured(method: &Method, scene: &Scene, change: &Tangent) -> f64 {
    const RUNS: u64 = 8;
    let run = |seed| method.with_seed(seed).forward(scene, change, &Progress::none()).unwrap().gradient;
    let images: Vec<Image> = (0..RUNS).map(|r| run(100 + r)).collect();
    let of_pixel = |i: usize| {
        let mean = images.iter().map(|image| image.pixels[i]).sum::<DVec3>() / RUNS as f64;
        images.iter().map(|image| (image.pixels[i] - mean).length_squared()).sum::<f64>() / (RUNS - 1) as f64
    };
    (0..images[0].pixels.len()).map(of_pixel).sum()
}

/// The measured error of both candidates is close to the pilot's estimate, and the one with the smaller error
/// is chosen: edge sampling where there are few edges, the field where there are many. Samples are allocated
/// over the film for one view, and uniformly for several.
#[test]
fn a_pilot_foresees_errors() {
    let none = Progress::none();
    for (name, size, samples, mesh, views, edges) in [
        ("block", 24, 64, block(), 1, Some(true)),
        ("block on a large film", 40, 64, block(), 1, None),
        ("block in two views", 40, 64, block(), 2, None),
        ("rough ball", 48, 60, rough_ball(), 1, Some(false)),
    ] {
        let scene = scene(size, mesh);
        let change = moved(&scene);
        let pilot = Pilot { samples, seed: 3 };
        let survey = pilot.look(&scene, &change, None, false, &none).unwrap();
        let choice = pilot.choice(&Survey::of_all(vec![survey; views]));
        assert_eq!(choice.candidates.len(), 2);
        if let Some(edges) = edges {
            assert_eq!(matches!(choice.method, Method::EdgeSampling(_)), edges, "{name}: {choice:?}");
        }
        let errors = [0, 1].map(|i| {
            let candidate = &choice.candidates[i];
            if let Method::WarpedArea(warped) = &candidate.method {
                assert_eq!(warped.allocation.is_some(), views == 1 && warped.samples >= 16, "{name}");
            }
            let error = views as f64 * measured(&candidate.method, &scene, &change);
            let ratio = error / candidate.expected_squared_error;
            println!("{name}: {}: measured {ratio:.2} times what was expected", candidate.method);
            // Area samples are stratified, which a pilot of two samples cannot take into account.
            assert!((0.33..2.5).contains(&ratio), "{name}: {}: {ratio}", candidate.method);
            error
        });
        println!("{name}: the choice errs {:.2} times as much as the other", errors[0] / errors[1]);
        assert!(edges.is_none() || errors[0] < errors[1], "{name}: {errors:?}");
    }
}

/// The choice is the same for any number of threads.
#[test]
fn a_pilot_chooses_alike_on_any_number_of_threads() {
    let scene = scene(24, block());
    let change = moved(&scene);
    let choices = [1, 3].map(|threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let pilot = Pilot { samples: 48, seed: 5 };
        let choice = pool.install(|| pilot.for_change(&scene, &change, &Progress::none())).unwrap();
        format!("{choice:?}")
    });
    assert_eq!(choices[0], choices[1]);
}

/// A sample count of zero for any kind of sample would leave out part of the derivative and is refused.
#[test]
fn none_of_a_kind_is_refused() {
    let scene = scene(8, block());
    let change = moved(&scene);
    for kind in 0..4 {
        let mut method = EdgeSampling::default();
        let EdgeSampling { samples, primary, secondary, bounces, .. } = &mut method;
        *[samples, primary, secondary, bounces][kind] = 0;
        let refused = method.forward(&scene, &change, &Progress::none());
        assert!(matches!(refused, Err(GradientError::Samples { samples: 0, .. })), "{kind}: {refused:?}");
    }
}

/// A cube under a sky, and nothing else: no shading point sees an edge in front of another surface.
fn lone_cube() -> (Scene, Tangent) {
    let camera = Camera::look_at(DVec3::new(0.0, -6.0, 3.0), DVec3::ZERO, DVec3::Z, 0.6);
    let mut d = Description::new(camera, film(16, Filter::Tent { radius: 1.0 }));
    d.integrator.max_depth = Some(3);
    let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
    let turned = at(0.0, 0.0, 0.0, 0.4) * DAffine3::from_rotation_z(0.4);
    d.add_shape("cube", Mesh::cube().transformed(&turned), paper);
    d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::new(1.0, 0.3, 0.0));
    (scene, change)
}

/// A strip of the penumbra of a small lamp, in which an occluder's edge crosses the lamp's outline: the exact
/// mean has heavy tails there.
fn strip_of_penumbra() -> (Scene, Tangent) {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 1.0);
    let of_pixels = Film {
        width: 128,
        height: 128,
        crop: Some(Crop { x: 52, y: 40, width: 24, height: 2 }),
        sample_border: true,
        filter: Filter::Box,
    };
    let mut d = Description::new(camera, of_pixels);
    d.integrator.max_depth = Some(3);
    let paper = d.add_material(Material::diffuse("paper", DVec3::splat(0.5)));
    d.add_shape("plane", Mesh::rectangle(), paper);
    let occluder = at(-1.0, 0.0, 0.5, 1.0) * DAffine3::from_rotation_y(std::f64::consts::FRAC_PI_2);
    d.add_shape("occluder", Mesh::rectangle().transformed(&occluder), paper);
    let lamp = Mesh::rectangle().transformed(&(at(-4.0, 0.0, 6.0, 0.2) * DAffine3::from_rotation_y(2.6)));
    d.add_emitter("lamp", lamp, DVec3::splat(40.0));
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 0, DVec3::X);
    change.translate(&scene, 1, DVec3::X);
    (scene, change)
}

/// A kind of curve that is absent from the scene never yields a contribution, and does not exclude edge
/// sampling, whose error should be four times smaller here. Control: the other methods do have four times the
/// error.
#[test]
fn what_is_nowhere_shuts_nothing_out() {
    let (scene, change) = lone_cube();
    let choice = Pilot { samples: 256, seed: 4 }.for_change(&scene, &change, &Progress::none()).unwrap();
    assert!(matches!(choice.method, Method::EdgeSampling(_)), "{choice:?}");
    assert!(!choice.is_lost && !choice.in_haste, "{choice:?}");
    let errors: Vec<f64> = choice.candidates.iter().map(|c| measured(&c.method, &scene, &change)).collect();
    println!("a lone cube: {errors:?}");
    assert!(errors[1..].iter().all(|error| *error > 4.0 * errors[0]), "{errors:?}");
}

/// In a penumbra the exact mean is chosen in none of 64 runs, however few of its samples reach the tails.
#[test]
fn the_exact_mean_is_not_chosen_in_a_penumbra() {
    let (scene, change) = strip_of_penumbra();
    let exact = |samples, seed| {
        let choice = Pilot { samples, seed }.for_change(&scene, &change, &Progress::none()).unwrap();
        matches!(choice.method, Method::WarpedArea(WarpedArea { field: Field::JumpMean { .. }, .. }))
    };
    let chosen = [64, 128, 512, 2048].map(|n| (0..16).filter(|&seed| exact(n, seed)).count());
    assert_eq!(chosen, [0; 4]);
}

/// If listing the edges would take longer than a quarter of the requested samples, no pilot is run; with more
/// samples it is.
#[test]
fn there_is_no_pilot_in_haste() {
    let scene = scene(16, rough_ball());
    let change = moved(&scene);
    let choose = |samples| Pilot { samples, seed: 2 }.for_change(&scene, &change, &Progress::none()).unwrap();
    let [few, many] = [16, 500].map(choose);
    assert!(few.in_haste && few.candidates.is_empty() && !few.is_lost);
    assert!(matches!(
        few.method,
        Method::WarpedArea(WarpedArea { samples: 16, field: Field::JumpMean { .. }, .. })
    ));
    assert!(!many.in_haste && many.candidates.len() == 3);
}

/// If no trial finds a change, all of them fail, and the choice reports it.
#[test]
fn what_no_trial_finds_is_said() {
    let scene = scene(12, block());
    let black = Image::constant(12, 12, DVec3::ZERO);
    let mut active = ActiveParameters::nothing(&scene);
    active.shapes[1] = true;
    let choose = |adjoint: &Image| {
        let pilot = Pilot { samples: 64, seed: 1 };
        pilot.for_active(&scene, Some(adjoint), &active, &Progress::none()).unwrap()
    };
    assert!(choose(&black).is_lost && !choose(&Image::constant(12, 12, DVec3::ONE)).is_lost);
}

/// Edge sampling is not tried with a glossy surface in the scene.
#[test]
fn glossy_surfaces_are_not_for_edge_sampling() {
    let glossy = room(Filter::Box);
    let mut description = glossy.description().clone();
    description.materials[1].bsdf = description.materials[0].bsdf.clone();
    let diffuse = Scene::new(description).unwrap();
    let pilot = Pilot { samples: 16, seed: 1 };
    let count = |scene: &Scene| {
        let mut change = Tangent::still(scene);
        change.translate(scene, 2, DVec3::X);
        let choice = pilot.for_change(scene, &change, &Progress::none()).unwrap();
        assert!(choice.candidates.iter().any(|c| matches!(c.method, Method::WarpedArea(_))));
        choice.candidates.len()
    };
    assert_eq!([count(&diffuse), count(&glossy)], [2, 1]);
}

/// In reverse mode the pilot weights its estimates by the adjoint; where there is nothing to choose it
/// returns the exact mean.
#[test]
fn a_pilot_of_a_transpose() {
    let scene = scene(24, block());
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
