//! Edge sampling against closed forms and warped area.

use glam::DVec3;

use super::*;
use crate::geometry::Mesh;
use crate::gradient::tests::{at, down, film, random_change, room, up};
use crate::gradient::tests::{filters, square};
use crate::scene::{Camera, Description, Environment, Filter, Integrator, Material};
use flatland::random::{open01, stream};
use glam::DAffine3;

#[test]
fn the_edge_of_a_square_moves_its_area() {
    for filter in filters() {
        let scene = square(filter);
        let mut change = Change::still(&scene);
        change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
        let method = EdgeSampling { samples: 8, primary: 400, ..EdgeSampling::default() };
        let result = method.forward(&scene, &change, &Progress::none()).unwrap();
        let total: f64 = result.gradient.iter().map(|g| g.x).sum();
        let error: f64 = result.standard_error.iter().map(|e| e.x * e.x).sum::<f64>().sqrt();
        let focal = 3.0 / 0.5_f64.tan();
        let area = (1.4 * focal / 3.0_f64).powi(2);
        let exact = 2.0 * area * 1.5;
        // Gaussians cut off are no partition of unity: their sum over pixels is 1 to about a thousandth.
        let slack = if matches!(filter, Filter::Gaussian { .. }) { 2e-3 * exact } else { 1e-9 };
        assert!(
            (total - exact).abs() < 5.0 * error + slack,
            "{filter:?}: {total} ± {error}, exactly {exact}"
        );
        assert!(error < 0.06 * exact, "{filter:?}: {error}");
    }
}

/// A floor under a small lamp, with something between them.
fn shadow(filter: Filter, occluder: Mesh, depth: usize) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.3, 2.0, 3.0), DVec3::new(0.0, 0.2, 0.0), DVec3::Y, 0.8);
    let mut d = Description::new(camera, film(6, filter));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 5 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, 0.0, 0.0, 2.0) * down())), white);
    d.add_shape("occluder", occluder, white);
    d.add_emitter(
        "lamp",
        Mesh::rectangle().transformed(&(at(0.3, 2.4, 0.2, 0.3) * up())),
        DVec3::splat(20.0),
    );
    Scene::new(d).unwrap()
}

fn leaf() -> Mesh {
    Mesh::rectangle().transformed(&(at(0.1, 0.7, 0.1, 0.4) * down()))
}

fn block() -> Mesh {
    Mesh::cube().transformed(&(at(0.1, 0.3, 0.1, 0.3) * DAffine3::from_rotation_y(0.5)))
}

/// Mean and variance of the mean of every pixel's green, over runs with seeds of their own.
fn statistics(runs: u64, run: impl Fn(u64) -> GradientImage) -> Vec<(f64, f64)> {
    let all: Vec<Vec<DVec3>> = (0..runs).map(|seed| run(seed).gradient).collect();
    let n = runs as f64;
    (0..all[0].len())
        .map(|i| {
            let mean = all.iter().map(|g| g[i].y).sum::<f64>() / n;
            let squares: f64 = all.iter().map(|g| (g[i].y - mean).powi(2)).sum();
            (mean, squares / (n * (n - 1.0)))
        })
        .collect()
}

/// The largest |z| of the difference from warped area over all pixels. With 8 runs of each method and 36 pixels,
/// Student's t of about 10 degrees of freedom exceeds 8 in one of 3000 comparisons of images.
fn worst(scene: &Scene, shapes: &[usize]) -> f64 {
    let mut change = Change::still(scene);
    for &s in shapes {
        change.translate(scene, s, DVec3::new(0.7, 0.3, -0.4));
        change.rotate(scene, s, DVec3::new(0.2, 0.5, 0.0), DVec3::new(0.3, -0.2, 0.5));
    }
    let warped = statistics(8, |seed| {
        let method = WarpedArea { samples: 128, seed: 100 + seed, ..WarpedArea::default() };
        method.forward(scene, &change, &Progress::none()).unwrap()
    });
    let edges = statistics(8, |seed| {
        let method = EdgeSampling { samples: 64, primary: 32, secondary: 128, seed };
        method.forward(scene, &change, &Progress::none()).unwrap()
    });
    let z = |((m, v), (n, w)): (&(f64, f64), &(f64, f64))| (m - n).abs() / (v + w).sqrt().max(1e-9);
    warped.iter().zip(&edges).map(z).fold(0.0, f64::max)
}

#[test]
fn edge_sampling_and_warped_area_agree() {
    let tent = Filter::Tent { radius: 1.0 };
    let mut sky = shadow(tent, leaf(), 2).description().clone();
    sky.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::ONE });
    let cases = [
        ("a leaf moves", shadow(tent, leaf(), 2), 1),
        ("a block moves", shadow(Filter::Box, block(), 2), 1),
        ("the floor moves", shadow(tent, block(), 2), 0),
        ("the lamp moves", shadow(tent, leaf(), 2), 2),
        ("a leaf moves under a sky", Scene::new(sky).unwrap(), 1),
        ("a block moves, two bounces", shadow(tent, block(), 3), 1),
    ];
    let z: Vec<_> = cases.iter().map(|(name, scene, shape)| (name, worst(scene, &[*shape]))).collect();
    println!("{z:?}");
    assert!(z.iter().all(|(_, z)| *z < 8.0), "{z:?}");
}

#[test]
fn forward_and_reverse_are_transposes() {
    for filter in filters() {
        for scene in [room(filter), square(filter)] {
            let mut change = random_change(&scene, 3);
            change.normals.fill(DVec3::ZERO);
            let mut rng = stream(5, &[]);
            let pixels = scene.size().0 * scene.size().1;
            let mut random = || DVec3::from_array(std::array::from_fn(|_| open01(&mut rng) - 0.5));
            let adjoint: Vec<DVec3> = (0..pixels).map(|_| random()).collect();
            let method = EdgeSampling { samples: 4, primary: 4, secondary: 20, seed: 0 };
            let image = method.forward(&scene, &change, &Progress::none()).unwrap();
            let wanted = Wanted::everything(&scene);
            let gradient = method.reverse(&scene, &adjoint, &wanted, &Progress::none()).unwrap();
            let forward: f64 = image.gradient.iter().zip(&adjoint).map(|(a, b)| a.dot(*b)).sum();
            let reverse = gradient.dot(&change);
            assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
        }
    }
}
