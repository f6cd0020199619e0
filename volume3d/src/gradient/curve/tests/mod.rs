//! Tests of edge sampling against closed forms and warped area.

mod normals;

use glam::DVec3;

use self::normals::{bent, sheet};
use super::budget::Kind;
use super::drawing::EdgeList;
use super::driver::Driver;
use super::field::Zero;
use super::inner_sign_changes::InnerSignChanges;
use super::moving::Moving;
use super::outlines::Outlines;
use super::reflected_outlines::ReflectedOutlines;
use super::shadow_edges::ShadowEdges;
use crate::geometry::Mesh;
use crate::gradient::modes::accumulator::Sums;
use crate::gradient::tests::{
    Comparisons, at, down, film, filters, random_adjoint, random_tangent, rate_of_square, room, square,
    terms, thorough, total, up,
};
use crate::gradient::warp::motion::Motion;
use crate::gradient::{ActiveParameters, EdgeSampling, FiniteDifference, Progress, Tangent};
use crate::path::{Kernels, Paths};
use crate::scene::{Camera, Description, Filter, Integrator, Material, Scene};

#[test]
fn the_edge_of_a_square_moves_its_area() {
    let mut comparisons = Comparisons::of("edge_sampling::the_edge_of_a_square_moves_its_area");
    for filter in filters() {
        let scene = square(filter);
        let mut change = Tangent::still(&scene);
        change.scale(&scene, 0, DVec3::new(0.05, -0.02, -3.0), 1.0);
        let found = total(|seed| {
            let method = EdgeSampling {
                samples: 8,
                primary: if thorough() { 200 } else { 40 },
                seed,
                ..EdgeSampling::default()
            };
            method.forward(&scene, &change, &Progress::none()).unwrap().gradient.pixels
        });
        // Truncated Gaussians are not a partition of unity: their sum over pixels is 1 to about a thousandth.
        let slack = if matches!(filter, Filter::Gaussian { .. }) { 2e-3 } else { 1e-9 };
        let exact = rate_of_square();
        comparisons.add(format!("{filter:?}"), found, (exact, 0.0), slack * exact, exact);
    }
    comparisons.finish();
}

/// A floor under a small lamp, with an occluder in between.
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
            let mut change = random_tangent(&scene, 3);
            change.normals.fill(DVec3::ZERO);
            let adjoint = random_adjoint(scene.size());
            let method = EdgeSampling {
                samples: 4,
                primary: 4,
                secondary: 20,
                bounces: 20,
                seed: 0,
                allow_missing: vec![],
            };
            let image = method.forward(&scene, &change, &Progress::none()).unwrap();
            let active = ActiveParameters::everything(&scene);
            let gradient = method.reverse(&scene, &adjoint, &active, &Progress::none()).unwrap();
            let forward: f64 =
                image.gradient.pixels.iter().zip(&adjoint.pixels).map(|(a, b)| a.dot(*b)).sum();
            let reverse = gradient.by_parameter.dot(&change);
            assert!((forward - reverse).abs() < 1e-9 * forward.abs().max(1.0), "{forward} {reverse}");
        }
    }
}

/// A wall that is lit only by a sheet whose normals turn: edge sampling against central differences. The
/// control leaves out the sign changes of the normals. Where the wall or the sheet moves, terms cancel, so
/// that no affordable number of samples shows a bias of 15 %; warped area, which samples the same curves, is
/// tested for that.
#[test]
fn surfaces_turn_their_other_side_to_one_another() {
    let scene = sheet(3);
    let (change, none) = (bent(&scene), Progress::none());
    let differences = total(|seed| {
        let samples = if thorough() { 8192 } else { 6144 };
        let method = FiniteDifference { samples, step: 4e-2, seed: 50 + seed };
        method.forward(&scene, &change, &none).unwrap().gradient.pixels
    });
    let samples = if thorough() { 384 } else { 192 };
    let method = |seed| EdgeSampling {
        samples,
        primary: 8,
        secondary: 8 * samples,
        bounces: 8 * samples,
        seed,
        allow_missing: vec![],
    };
    let scale = terms(&method(9).forward_terms(&scene, &change, &none).unwrap());
    let edges = total(|seed| method(seed).forward(&scene, &change, &none).unwrap().gradient.pixels);
    let motion = Motion::new(&scene, &change);
    let moving = Moving::of(&scene, &motion);
    let paths = Paths::new(&scene, Kernels::default());
    let sign_changes = total(|seed| {
        let driver = Driver::of(&scene, &method(seed).budget(), Kind::InnerSignChanges);
        driver.forward(&InnerSignChanges::new(&paths, &moving, Zero), &motion, &none).unwrap().mean
    });
    let mut comparisons = Comparisons::of("edge_sampling::surfaces_turn_their_other_side_to_one_another");
    // The error of differences grows with the square of their step: here it is less than 4 thousandths of
    // `scale`.
    comparisons.add("normals turn".to_owned(), edges, differences, 4e-3 * scale, scale);
    let without = (edges.0 - sign_changes.0, edges.1.hypot(sign_changes.1));
    comparisons.reject("normals turn, without inner sign changes", without, differences);
    comparisons.finish();
}

/// A floor lit only, or almost only, by the ceiling that the lamps below it light.
fn below_a_ceiling(lamps: &[Mesh]) -> Scene {
    let camera = Camera::look_at(DVec3::new(0.8, -0.2, 2.5), DVec3::new(0.4, -1.0, 0.0), DVec3::Y, 1.0);
    let mut d = Description::new(camera, film(6, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(3), rr_depth: 5 };
    let white = d.add_material(Material::diffuse("white", DVec3::new(0.8, 0.7, 0.6)));
    d.add_shape("floor", Mesh::rectangle().transformed(&(at(0.0, -1.0, 0.0, 2.0) * down())), white);
    d.add_shape("ceiling", Mesh::rectangle().transformed(&(at(0.0, 1.0, 0.0, 2.0) * up())), white);
    for (name, lamp) in ["lamp", "other lamp"].into_iter().zip(lamps) {
        d.add_emitter(name, lamp.clone(), DVec3::splat(5.0));
    }
    Scene::new(d).unwrap()
}

/// Outlines of lamps seen from a ceiling, traced from the lamp, against paths traced from the camera that see
/// them after a bounce. The lamps: one symmetric about its centre, one not, a closed one, two of which one
/// may occlude the other, and one with a fin in it.
#[test]
fn outlines_of_emitters_are_seen_after_a_bounce() {
    let plate = |x: f64, size: f64| Mesh::rectangle().transformed(&(at(x, 0.2, 0.0, size) * down()));
    let corners = [[-1.4, 0.2, -0.4], [-0.7, 0.2, 0.5], [-0.5, 0.2, -0.3]].map(DVec3::from);
    // Emission is discontinuous at the fold on which the fin stands, although no silhouette is visible there.
    let fin = Mesh::new(
        [[-0.75, 0.25, -0.5], [-0.25, 0.75, -0.5], [-0.25, 0.75, 0.5], [-0.75, 0.25, 0.5]]
            .map(DVec3::from)
            .to_vec(),
        vec![[0, 1, 2], [0, 2, 3]],
    )
    .unwrap();
    let kinds = [
        ("a rectangle", vec![plate(-0.9, 0.4)], None),
        ("a triangle", vec![Mesh::new(corners.to_vec(), vec![[0, 1, 2]]).unwrap()], None),
        ("a cube", vec![Mesh::cube().transformed(&at(-0.9, 0.2, 0.0, 0.3))], None),
        ("two rectangles", vec![plate(-0.9, 0.4), plate(-0.3, 0.1)], None),
        ("a cube with a fin", vec![Mesh::cube().transformed(&at(-0.75, 0.25, 0.0, 0.25))], Some(fin)),
    ];
    let mut comparisons = Comparisons::of("edge_sampling::outlines_of_emitters_are_seen_after_a_bounce");
    for (name, lamps, fin) in kinds {
        let mut d = below_a_ceiling(&lamps).description().clone();
        let black = d.add_material(Material::diffuse("black", DVec3::ZERO));
        let moved = [Some(2), fin.map(|fin| d.add_shape("fin", fin, black))];
        let scene = Scene::new(d).unwrap();
        let mut change = Tangent::still(&scene);
        for shape in moved.into_iter().flatten() {
            change.scale(&scene, shape, DVec3::new(-0.9, 0.2, 0.0), 1.0);
            change.translate(&scene, shape, DVec3::new(0.1, 0.05, -0.1));
        }
        let (motion, list) = (Motion::new(&scene, &change), EdgeList::new(&scene));
        let (paths, moving) = (Paths::new(&scene, Kernels::default()), Moving::of(&scene, &motion));
        let driver = |seed| {
            let method = EdgeSampling { bounces: 256, seed, ..EdgeSampling::default() };
            Driver::of(&scene, &method.budget(), Kind::ReflectedOutlines)
        };
        let none = Progress::none();
        let from_camera = |seed, longest| {
            let outlines = Outlines::seen_by(&paths, &list, &moving, Zero, longest);
            driver(50 + seed).forward(&outlines, &motion, &none).unwrap().mean
        };
        let outlines = ReflectedOutlines::new(&paths, &list, &moving);
        let found = total(|seed| driver(seed).forward(&outlines, &motion, &none).unwrap().mean);
        // First points use the same random numbers in both.
        let reference = total(|seed| {
            let (both, first) = (from_camera(seed, 2), from_camera(seed, 1));
            both.into_iter().zip(first).map(|(both, first)| both - first).collect()
        });
        comparisons.add(name.to_owned(), found, reference, 0.0, reference.0);
        let first = total(|seed| from_camera(seed, 1));
        comparisons.reject(&format!("{name}, first points"), first, reference);
    }
    comparisons.finish();
}

/// A dark frame that shares an edge with the lamp does not reduce the term of the lamp's outline when both
/// move.
#[test]
fn a_frame_leaves_the_outline_to_its_lamp() {
    let lamp = Mesh::rectangle().transformed(&(at(-0.2, 0.2, 0.0, 0.4) * up()));
    let frame = Mesh::rectangle().transformed(&(at(0.6, 0.2, 0.0, 0.4) * up()));
    let outlines = |framed: bool| {
        let mut d = below_a_ceiling(std::slice::from_ref(&lamp)).description().clone();
        if framed {
            d.add_shape("frame", frame.clone(), 0);
        }
        let scene = Scene::new(d).unwrap();
        let mut change = Tangent::still(&scene);
        for shape in 2..scene.description().shapes.len() {
            change.translate(&scene, shape, DVec3::new(0.0, -1.0, 0.0));
        }
        let (motion, list) = (Motion::new(&scene, &change), EdgeList::new(&scene));
        let (paths, moving) = (Paths::new(&scene, Kernels::default()), Moving::of(&scene, &motion));
        let outlines = Outlines::new(&paths, &list, &moving, Zero);
        let method = EdgeSampling { secondary: 16384, ..EdgeSampling::default() };
        let driver = Driver::of(&scene, &method.budget(), Kind::Outlines);
        driver.forward(&outlines, &motion, &Progress::none()).unwrap().mean.iter().sum::<DVec3>().x
    };
    let [framed, alone] = [true, false].map(outlines);
    println!("{framed} framed, {alone} alone");
    // The loss of half of the outline on one of the lamp's four sides would be 12 %.
    assert!((framed / alone - 1.0).abs() < 0.05, "{framed} {alone}");
}

/// Samples whose radiance overflows are left out and reported, in forward and in reverse mode.
#[test]
fn samples_that_are_not_finite_are_reported() {
    let mut d = shadow(Filter::Tent { radius: 1.0 }, leaf(), 2).description().clone();
    d.shapes[2].radiance = Some(DVec3::splat(0.9 * f64::MAX));
    // With 3,600 pixels each sample has a large weight, and hardly any pixel has two samples.
    (d.film.width, d.film.height) = (60, 60);
    let scene = Scene::new(d).unwrap();
    let mut change = Tangent::still(&scene);
    change.translate(&scene, 1, DVec3::new(0.7, 0.3, -0.4));
    let method =
        EdgeSampling { samples: 1, primary: 1, secondary: 1, bounces: 1, seed: 0, allow_missing: vec![] };
    let motion = Motion::new(&scene, &change);
    let (paths, list, moving) =
        (Paths::new(&scene, Kernels::default()), EdgeList::new(&scene), Moving::of(&scene, &motion));
    let part = ShadowEdges::new(&paths, &list, &moving, Zero);
    let driver = Driver::of(&scene, &method.budget(), Kind::ShadowEdges);
    let forward = driver.forward(&part, &motion, &Progress::none()).unwrap();
    assert!(!forward.non_finite.is_empty() && forward.mean.iter().all(|g| g.is_finite()));
    let mut sums = Sums::new(&scene);
    let mut active = ActiveParameters::nothing(&scene);
    active.shapes[1] = true;
    driver.reverse(&part, &vec![DVec3::ONE; 3600], &active, &Progress::none(), &mut sums).unwrap();
    let gradient = sums.finish(&scene, &active);
    assert_eq!(gradient.non_finite, forward.non_finite);
    assert!(gradient.by_parameter.positions.iter().all(|g| g.is_finite()));
    let whole = method.forward(&scene, &change, &Progress::none()).unwrap();
    assert!(whole.non_finite.len() >= forward.non_finite.len());
}
