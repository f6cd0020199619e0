//! Tests of scenes far from the origin, as with map coordinates: results do not depend on the position.

use flatland::sdf::shapes::Ball;
use glam::{DAffine3, DQuat, DVec3};

use super::{Comparisons, down, film, total};
use crate::Image;
use crate::geometry::Mesh;
use crate::gradient::{ActiveParameters, EdgeSampling, Field, Progress, Tangent, WarpedArea, render};
use crate::scene::{Camera, Description, Environment, Filter, Integrator, Light, Material, Placement, Scene};

/// A cube over a floor, under a tilted lamp. With `snap`, coordinates have so few bits that all sums with
/// offsets of 2³² are exact.
fn cube(depth: usize, snap: bool) -> Description {
    let snapped = |place: DAffine3| {
        let round = |x: f64| if snap { (x * 4096.0).round() / 4096.0 } else { x };
        DAffine3::from_cols_array(&place.to_cols_array().map(round))
    };
    let camera = Camera::look_at(DVec3::new(0.0, 2.0, 5.0), DVec3::ZERO, DVec3::Y, 0.6);
    let mut d = Description::new(camera, film(16, Filter::Tent { radius: 1.0 }));
    d.integrator = Integrator { max_depth: Some(depth), rr_depth: 5 };
    let red = d.add_material(Material::diffuse("red", DVec3::new(0.7, 0.3, 0.2)));
    let grey = d.add_material(Material::diffuse("grey", DVec3::splat(0.5)));
    let place = |scale: f64, turn: DQuat, at: DVec3| {
        snapped(DAffine3::from_scale_rotation_translation(DVec3::splat(scale), turn, at))
    };
    let turn = DQuat::from_axis_angle(DVec3::new(1.0, 1.0, 0.0).normalize(), 0.576);
    d.add_shape("cube", Mesh::cube().transformed(&place(0.35, turn, DVec3::Y * 0.1)), red);
    let flat = snapped(
        DAffine3::from_translation(DVec3::Y * -0.6) * down() * DAffine3::from_scale(DVec3::splat(2.0)),
    );
    d.add_shape("floor", Mesh::rectangle().transformed(&flat), grey);
    let lamp = place(0.7, DQuat::from_rotation_x(1.92), DVec3::new(0.0, 2.5, 1.0));
    d.add_emitter("lamp", Mesh::rectangle().transformed(&lamp), DVec3::splat(5.0));
    d
}

fn shifted(mut d: Description, offset: DVec3) -> Scene {
    for shape in &mut d.shapes {
        let moved = shape.mesh.positions().iter().map(|p| *p + offset).collect();
        shape.mesh = shape.mesh.clone().with_positions(moved).unwrap();
    }
    d.implicits.iter_mut().for_each(|shape| shape.placement.translation += offset);
    for light in &mut d.lights {
        if let Light::Point { position, .. } = light {
            *position += offset;
        }
    }
    d.camera.origin += offset;
    Scene::new(d).unwrap()
}

/// The cube moves, and rotates about its centre.
fn motion(scene: &Scene, offset: DVec3) -> Tangent {
    let mut change = Tangent::still(scene);
    change.translate(scene, 0, DVec3::new(1.0, 0.3, -0.2));
    change.rotate(scene, 0, offset + DVec3::Y * 0.125, DVec3::new(0.2, -0.1, 0.4));
    change
}

fn edges(seed: u64) -> EdgeSampling {
    EdgeSampling { samples: 4, primary: 64, secondary: 64, bounces: 64, seed, ..EdgeSampling::default() }
}

/// Largest relative difference of warped-area results. The field treats edges in a plane with a tolerance
/// that grows with the distance from the origin, so that additional edges may count; they hardly do.
const SLACK: f64 = 1e-4;

const OFFSETS: [DVec3; 2] =
    [DVec3::new(196_608.0, -327_680.0, 65_536.0), DVec3::new(4_294_967_296.0, 0.0, -2_147_483_648.0)];

/// Internal coordinates move with the scene exactly. At 10⁹ scene sizes from the origin, images and
/// edge-sampling gradients (forward and reverse) are bitwise equal, and warped-area gradients are equal to
/// within [`SLACK`].
#[test]
fn a_scene_far_away_is_the_same_to_the_bit() {
    let none = Progress::none();
    let softened = WarpedArea { samples: 8, seed: 3, field: Field::softened(1), ..WarpedArea::default() };
    let mean = WarpedArea { samples: 8, seed: 4, ..WarpedArea::default() };
    let adjoint = Image::constant(16, 16, DVec3::new(1.0, 0.5, 0.2));
    let found = |offset: DVec3| {
        let mut d = cube(3, true);
        d.environment = Some(Environment::Constant { id: "sky".to_owned(), radiance: DVec3::splat(0.5) });
        let scene = shifted(d, offset);
        let change = motion(&scene, offset);
        let mut active = ActiveParameters::nothing(&scene);
        (active.shapes[0], active.camera) = (true, true);
        let by_edges = edges(1);
        let image = render(&scene, 4, 9, &none).unwrap().image;
        let forward = by_edges.forward(&scene, &change, &none).unwrap().gradient;
        let reverse = by_edges.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
        let warped = [&mean, &softened].map(|method| {
            let reverse = method.reverse(&scene, &adjoint, &active, &none).unwrap().by_parameter;
            (method.forward(&scene, &change, &none).unwrap().gradient, reverse)
        });
        ((image, forward, reverse), warped)
    };
    let (here, warped_here) = found(DVec3::ZERO);
    for offset in OFFSETS {
        let (there, warped) = found(offset);
        assert!(here.0 == there.0 && here.1 == there.1 && here.2 == there.2, "{offset}");
        for ((forward, reverse), (expected, reverse_here)) in warped.iter().zip(&warped_here) {
            let size = reverse_here.dot(reverse_here).sqrt();
            let off = (reverse.dot(reverse) - reverse_here.dot(reverse_here)).abs() / (size * size);
            let differences = [difference(forward, expected), off];
            println!("{offset}: {differences:?}");
            assert!(differences.iter().all(|d| *d < SLACK), "{offset}: {differences:?}");
        }
    }
}

/// A scene with a placed implicit surface and a point light gives the same results far from the origin.
#[test]
fn an_implicit_surface_far_away_is_the_same() {
    let none = Progress::none();
    let found = |offset: DVec3| {
        let mut d = cube(2, true);
        let index = d.add_implicit("ball", Ball::new(DVec3::ZERO, 0.4).unwrap(), 0);
        d.implicits[index].placement =
            Placement { translation: DVec3::new(1.0, 0.0, 0.5), ..Placement::default() };
        let position = DVec3::new(-1.0, 2.0, 1.0);
        let bulb = Light::Point { id: "bulb".to_owned(), position, intensity: DVec3::ONE };
        let mut lit = d.clone();
        lit.lights.push(bulb);
        let image = render(&shifted(lit, offset), 4, 9, &none).unwrap().image;
        let scene = shifted(d, offset);
        let mut change = motion(&scene, offset);
        change.implicits[0].translation = DVec3::new(0.4, 0.2, -0.3);
        let method = WarpedArea { samples: 8, seed: 4, ..WarpedArea::default() };
        (image, method.forward(&scene, &change, &none).unwrap().gradient)
    };
    let (image, gradient) = found(DVec3::ZERO);
    for offset in OFFSETS {
        let (there, moved) = found(offset);
        assert!(image == there, "{offset}");
        assert!(difference(&moved, &gradient) < SLACK, "{offset}: {}", difference(&moved, &gradient));
    }
}

/// The sum of absolute differences over the sum of absolute values.
fn difference(found: &Image, expected: &Image) -> f64 {
    let pairs = || found.pixels.iter().zip(&expected.pixels);
    let apart: f64 = pairs().map(|(a, b)| (*a - *b).abs().element_sum()).sum();
    apart / pairs().map(|(_, b)| b.abs().element_sum()).sum::<f64>()
}

/// The terms of edge sampling at a depth: on the film, and at shadows and after bounces.
fn terms(mut d: Description, depth: usize, offset: DVec3, method: &EdgeSampling) -> [Image; 2] {
    d.integrator.max_depth = Some(depth);
    let scene = shifted(d, offset);
    let image = method.forward_terms(&scene, &motion(&scene, offset), &Progress::none()).unwrap();
    let terms = image.terms.unwrap();
    [terms.primary, terms.secondary]
}

/// Threshold on relative differences: larger than the random effect of rounding, which is 10⁻⁶.
const SEEN: f64 = 1e-4;

/// Rounded map coordinates: with the same random numbers all terms equal those at the origin, up to the
/// rounding of the input. The test detects 10⁻⁴ of a term, as the control shows.
#[test]
fn terms_do_not_depend_on_where_the_scene_is() {
    for depth in [2, 3] {
        let here = terms(cube(depth, false), depth, DVec3::ZERO, &edges(5));
        for offset in
            [DVec3::new(4.5e5, 150.0, 5.4e6), DVec3::new(1e7, -2e7, 3e7), DVec3::new(-1e9, 3e8, 7e8)]
        {
            let there = terms(cube(depth, false), depth, offset, &edges(5));
            let differences: Vec<f64> = (0..2).map(|i| difference(&there[i], &here[i])).collect();
            println!("{offset}: {differences:?}");
            assert!(differences.iter().all(|d| *d < SEEN), "{offset}: {differences:?}");
        }
        let less = here[1].with_pixels(here[1].pixels.iter().map(|p| *p * (1.0 - 1.1 * SEEN)).collect());
        assert!(difference(&less, &here[1]) > SEEN);
    }
}

/// All terms equal those at the origin also where the internal origin cannot be near the scene, because
/// another, tiny shape lies as far away on the other side: rays are offset from edges by the rounding of such
/// coordinates. The random numbers differ from those of the scene without that shape.
#[test]
fn terms_do_not_depend_on_how_large_the_scene_is() {
    let offset = 1e8 * DVec3::new(0.9, -0.3, 0.4);
    let mut alone = cube(3, false);
    alone.film = film(8, Filter::Tent { radius: 1.0 });
    let mut wide = alone.clone();
    let place = DAffine3::from_scale_rotation_translation(DVec3::splat(1e-6), DQuat::IDENTITY, -2.0 * offset);
    let black = wide.add_material(Material::diffuse("black", DVec3::ZERO));
    wide.add_shape("speck", Mesh::rectangle().transformed(&place), black);
    assert_eq!(shifted(wide.clone(), offset).offset(), DVec3::ZERO);
    let method = |seed| EdgeSampling {
        samples: 1,
        primary: 16,
        secondary: 32,
        bounces: 32,
        seed,
        ..EdgeSampling::default()
    };
    let mut comparisons = Comparisons::of("terms_do_not_depend_on_how_large_the_scene_is");
    for (depth, which) in [(2, 0), (2, 1), (3, 1)] {
        // Pixels are weighted by their expected derivatives.
        let weights = &terms(alone.clone(), depth, DVec3::ZERO, &edges(1000))[which];
        let projected = |d: &Description, offset: DVec3, seed: u64| -> Vec<DVec3> {
            let image = &terms(d.clone(), depth, offset, &method(seed))[which];
            image.pixels.iter().zip(&weights.pixels).map(|(a, b)| *a * *b).collect()
        };
        let here = total(|seed| projected(&alone, DVec3::ZERO, 100 + seed));
        let there = total(|seed| projected(&wide, offset, seed));
        let name = ["on the film", "seen from surfaces"][which];
        comparisons.add(format!("{name}, depth {depth}"), there, here, 0.0, here.0);
    }
    comparisons.finish();
}
