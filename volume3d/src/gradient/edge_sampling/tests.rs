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

fn probe(name: &str, scene: &Scene, shapes: &[usize], warped: usize) {
    println!("== {name}");
    let mut change = Change::still(scene);
    for &s in shapes {
        change.translate(scene, s, DVec3::new(0.7, 0.3, -0.4));
        change.rotate(scene, s, DVec3::new(0.2, 0.5, 0.0), DVec3::new(0.3, -0.2, 0.5));
    }
    let runs = 12;
    let stats = |f: &dyn Fn(u64) -> GradientImage| {
        let all: Vec<Vec<DVec3>> = (0..runs).map(|s| f(s).gradient).collect();
        let n = runs as f64;
        let mut out = vec![];
        let pixels = all[0].len();
        for i in 0..=pixels {
            let v: Vec<f64> =
                all.iter().map(|g| if i == pixels { g.iter().map(|g| g.y).sum() } else { g[i].y }).collect();
            let m = v.iter().sum::<f64>() / n;
            out.push((m, v.iter().map(|x| (x - m).powi(2)).sum::<f64>() / n / (n - 1.0)));
        }
        out
    };
    let a = stats(&|s| {
        WarpedArea { samples: warped, seed: 100 + s, ..WarpedArea::default() }
            .forward(scene, &change, &Progress::none())
            .unwrap()
    });
    let b = stats(&|s| {
        EdgeSampling { samples: 100, primary: 50, secondary: 300, seed: s }
            .forward(scene, &change, &Progress::none())
            .unwrap()
    });
    let z: Vec<f64> = a.iter().zip(&b).map(|(a, b)| (b.0 - a.0) / (a.1 + b.1).sqrt().max(1e-12)).collect();
    let total = z.len() - 1;
    let chi = z[..total].iter().map(|z| z * z).sum::<f64>() / total as f64;
    let worst = (0..total).max_by(|&i, &j| z[i].abs().total_cmp(&z[j].abs())).unwrap();
    println!(
        "total warped {:.4} +- {:.4} edges {:.4} +- {:.4} z {:.2}  chi {chi:.2} worst z {:.2} at {worst} {:?} {:?}",
        a[total].0,
        a[total].1.sqrt(),
        b[total].0,
        b[total].1.sqrt(),
        z[total],
        z[worst],
        a[worst],
        b[worst]
    );
    println!("worst");
}

#[test]
fn probes() {
    let tent = Filter::Tent { radius: 1.0 };
    let n = 1000;
    probe("floor moves", &shadow(tent, block(), 2), &[0], n);
    let mut s = room(tent).description().clone();
    s.integrator.max_depth = Some(2);
    s.materials[1] = Material::diffuse("glossy", DVec3::splat(0.6));
    probe("smooth block 2", &Scene::new(s.clone()).unwrap(), &[2], n);
    s.shapes[2].mesh = Mesh::cube().transformed(&at(0.1, -0.5, 0.0, 0.3));
    probe("flat block 2", &Scene::new(s.clone()).unwrap(), &[2], n);
    s.integrator.max_depth = Some(3);
    probe("flat block 3", &Scene::new(s).unwrap(), &[2], n);
    probe("room block", &room(tent), &[2], n);
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
