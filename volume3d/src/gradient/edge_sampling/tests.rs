//! Edge sampling against closed forms and warped area.

use glam::DVec3;

use super::*;
use crate::geometry::{Attribute, Mesh, Normals};
use crate::gradient::tests::{Comparisons, at, down, film, filters, random_change, rate_of_square, room};
use crate::gradient::tests::{square, terms, thorough, total, up};
use crate::scene::{Camera, Description, Filter, Integrator, Material};
use flatland::random::{open01, stream};
use glam::{DAffine3, DQuat};

#[test]
fn the_edge_of_a_square_moves_its_area() {
    let mut comparisons = Comparisons::of("edge_sampling::the_edge_of_a_square_moves_its_area");
    for filter in filters() {
        let scene = square(filter);
        let mut change = Change::still(&scene);
        change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
        let found = total(|seed| {
            let method = EdgeSampling {
                samples: 8,
                primary: if thorough() { 400 } else { 40 },
                seed,
                ..EdgeSampling::default()
            };
            method.forward(&scene, &change, &Progress::none()).unwrap().gradient
        });
        // Gaussians cut off are no partition of unity: their sum over pixels is 1 to about a thousandth.
        let slack = if matches!(filter, Filter::Gaussian { .. }) { 2e-3 } else { 1e-9 };
        let exact = rate_of_square();
        comparisons.add(format!("{filter:?}"), found, (exact, 0.0), slack * exact, exact);
    }
    comparisons.finish();
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
            let reverse = gradient.change.dot(&change);
            assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
        }
    }
}

/// A wall that sees no lamp, but a lit sheet beside it whose normals are bent as those of a bulge: it turns its other
/// side somewhere in the view of every point of the wall. There may be a second wall to reflect the light again.
fn bulge(depth: usize, walls: usize) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 3.0), DVec3::ZERO, DVec3::Y, 0.3);
    let mut d = Description::new(camera, film(3, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 100 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("wall", Mesh::rectangle().transformed(&at(0.0, 0.0, 0.0, 2.0)), white);
    let facing = |normal: DVec3, place: DVec3, half: f64| {
        let turn = DQuat::from_rotation_arc(DVec3::Z, normal.normalize());
        DAffine3::from_scale_rotation_translation(DVec3::splat(half), turn, place)
    };
    let sheet =
        Mesh::rectangle().transformed(&facing(DVec3::new(0.17, 0.1, -0.98), DVec3::new(1.2, 0.1, 0.9), 0.5));
    let centre = sheet.positions().iter().sum::<DVec3>() / 4.0;
    let bent =
        sheet.positions().iter().map(|p| DVec3::new(0.17, 0.1, -0.98).normalize() + 3.0 * (*p - centre));
    let normals = Attribute { values: bent.collect(), triangles: sheet.triangles().to_vec() };
    d.add_shape("sheet", sheet.with_normals(Normals::Given(normals)).unwrap(), white);
    let lamp = facing(DVec3::new(-0.3, 0.0, 1.0), DVec3::new(1.7, -0.2, 0.2), 0.3);
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(20.0));
    if walls > 1 {
        let place = facing(DVec3::new(1.0, 0.0, -0.2), DVec3::new(-1.2, 0.0, 1.0), 1.0);
        d.add_shape("second", Mesh::rectangle().transformed(&place), white);
    }
    Scene::new(d).unwrap()
}

/// Against central differences; and what is found without these flips is rejected.
#[test]
fn surfaces_turn_their_other_side_to_one_another() {
    let turn = DVec3::new(0.2, 1.0, 0.1);
    let still = |scene: &Scene| Change::still(scene);
    let normals = |scene: &Scene| {
        let mut change = Change::still(scene);
        let range = scene.normal_range(1);
        for (rate, n) in change.normals[range.clone()].iter_mut().zip(&scene.normals[range]) {
            *rate = turn.cross(*n);
        }
        change
    };
    let sheet_moves = |scene: &Scene| {
        let mut change = still(scene);
        change.translate(scene, 1, DVec3::new(0.2, 0.5, -0.3));
        change.positions_of_mut(scene, 1)[0] += DVec3::new(0.3, 0.2, 0.6);
        change
    };
    let wall_moves = |scene: &Scene| {
        let mut change = still(scene);
        change.translate(scene, 0, DVec3::new(0.2, 0.5, 0.3));
        change
    };
    type Case<'c> = (&'c str, Scene, &'c dyn Fn(&Scene) -> Change);
    let cases: [Case<'_>; 3] = [
        ("normals turn", bulge(3, 1), &normals),
        ("a wall moves", bulge(3, 1), &wall_moves),
        ("a sheet moves between walls", bulge(5, 2), &sheet_moves),
    ];
    let mut comparisons = Comparisons::of("edge_sampling::surfaces_turn_their_other_side_to_one_another");
    // The others take longer: their terms cancel all the more.
    let (count, more) = if thorough() { (3, 3) } else { (1, 1) };
    for (name, scene, moves) in &cases[..count] {
        let (change, none) = (moves(scene), Progress::none());
        let differences = total(|seed| {
            let method = super::super::FiniteDifference {
                samples: if thorough() { 8192 } else { 6144 },
                step: 4e-2,
                seed: 50 + seed,
            };
            method.forward(scene, &change, &none).unwrap().gradient
        });
        let samples = 192 * more;
        let method = |seed| EdgeSampling { samples, primary: 8, secondary: 8 * samples, seed };
        let scale = terms(&method(9).forward_terms(scene, &change, &none).unwrap());
        let edges = total(|seed| method(seed).forward(scene, &change, &none).unwrap().gradient);
        let motion = Motion::new(scene, &change);
        let moving = Moving::of(scene, &motion);
        let paths = Paths::new(scene, Kernels::default());
        let flips = total(|seed| {
            let driver = method(seed).driver(scene, Term::Secondary);
            driver.forward(&InnerFlips::new(&paths, &moving), &motion, &none).unwrap().mean
        });
        // The error of differences grows with the square of their step: in these units it is less than 4 thousandths.
        comparisons.add((*name).to_owned(), edges, differences, 4e-3 * scale, scale);
        let without = (edges.0 - flips.0, edges.1.hypot(flips.1));
        comparisons.reject(&format!("{name}, without inner flips"), without, differences);
    }
    comparisons.finish();
}

/// Sums of light that overflow are left out and reported, forwards and backwards.
#[test]
fn samples_that_are_not_finite_are_reported() {
    let mut d = shadow(Filter::Tent { radius: 1.0 }, leaf(), 2).description().clone();
    d.shapes[2].radiance = Some(DVec3::splat(0.9 * f64::MAX));
    let scene = Scene::new(d).unwrap();
    let mut change = Change::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.7, 0.3, -0.4));
    let method = EdgeSampling { samples: 4, primary: 16, secondary: 64, seed: 0 };
    let motion = Motion::new(&scene, &change);
    let (paths, list, moving) =
        (Paths::new(&scene, Kernels::default()), EdgeList::new(&scene), Moving::of(&scene, &motion));
    let part = Secondary::new(&paths, &list, &moving, Light::Emitted);
    let driver = method.driver(&scene, Term::Secondary);
    let forward = driver.forward(&part, &motion, &Progress::none()).unwrap();
    assert!(!forward.non_finite.is_empty() && forward.mean.iter().all(|g| g.is_finite()));
    let mut gradient = Gradient::from(Change::still(&scene));
    let mut wanted = Wanted::nothing(&scene);
    wanted.shapes[1] = true;
    driver.reverse(&part, &[DVec3::ONE; 36], &wanted, &Progress::none(), &mut gradient).unwrap();
    assert_eq!(gradient.non_finite, forward.non_finite);
    assert!(gradient.change.positions.iter().all(|g| g.is_finite()));
    let whole = method.forward(&scene, &change, &Progress::none()).unwrap();
    assert!(whole.non_finite.len() >= forward.non_finite.len());
}
