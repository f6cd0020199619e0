//! Tests of several bounces against known constants, the closed forms of one bounce, and differences.

use super::super::{Exact, ExactError, Integrated, Radiosity};
use super::surfaces::{SWEEP, central_differences};
use super::*;
use crate::quadrature::adaptive;

/// Step sizes of the central differences; two only, as an image takes a second. Panels are chosen anew in
/// each world, and solutions on different panels differ by their error, which shorter steps would amplify.
const STEPS: [f64; 2] = [1e-3, 3e-4];

fn camera(pixels: usize) -> Camera {
    Camera {
        position: DVec2::new(0.31, 0.17),
        angle: 0.4,
        field_of_view: 1.9,
        film: Film { pixels, filter: Filter::Tent },
    }
}

fn room(reflectance: f64, emission: f64) -> World {
    let corners = [(-1.0, -1.0), (1.25, -1.125), (1.0, 1.0), (-1.125, 0.875)].map(|(x, y)| DVec2::new(x, y));
    let material = Material::diffuse(reflectance).with_emission(emission);
    World::new(0.0, vec![Shape::closed(corners, material)]).expect("a world")
}

#[test]
fn white_furnace() {
    // L = e/(1 − ρ) everywhere in a closed room.
    for reflectance in [0.3, 0.7] {
        let room = room(reflectance, 1.0 - reflectance);
        let image = Radiosity::default().image(&room, &camera(6)).expect("an image");
        for (value, error) in image.pixels.iter().zip(&image.errors) {
            assert!((value - 1.0).abs() < 1e-11, "{value} {error:e}");
        }
    }
}

#[test]
fn the_white_furnace_has_no_derivative() {
    let room = room(0.6, 0.4);
    let mut rng = stream(23, &[]);
    let change = random_vertices(&mut rng, &room).and(&random_camera_tangent(&mut rng, &room));
    let [_, slopes] = Radiosity::default().gradient(&room, &camera(4), &change).expect("a gradient");
    for slope in &slopes.pixels {
        assert!(slope.abs() < 1e-11, "{slope:e}");
    }
}

/// L after two bounces at the point where the ray of u ends.
fn seen_after_two_bounces(world: &World, camera: &Camera, u: f64) -> f64 {
    let (ray, eye) = (camera.direction(u), crate::transport::Origin::free(camera.position));
    let hit = world.trace(eye, ray);
    hit.map_or(world.environment(), |hit| two_bounces(world, hit.segment, hit.s, -ray, 0, 1e-8))
}

#[test]
fn two_bounces_agree_with_nested_quadrature() {
    let mut worst = 0.0_f64;
    for i in 0..3 {
        let mut rng = stream(24, &[i]);
        let world = random_world(&mut rng, 5, false);
        let mut camera = random_camera(&mut rng, Filter::Box);
        camera.film.pixels = 3;
        let found = Radiosity { bounces: Some(2), ..Radiosity::default() }.image(&world, &camera);
        let found = found.expect("an image");
        let partition =
            super::super::partition::Partition::new(&world, &camera, |i| world.material(i).scatters())
                .expect("a camera");
        for pixel in 0..3 {
            let mut pieces = vec![];
            camera.film.cells(pixel).for_each(|cell| partition.pieces(cell, &mut pieces));
            let integrand = |u: f64| {
                let value = seen_after_two_bounces(&world, &camera, u);
                ([value], value)
            };
            let expected = adaptive(&pieces, integrand, 1e-7).value[0];
            let error = (found.pixels[pixel] / expected - 1.0).abs();
            worst = worst.max(error);
        }
    }
    println!("worst {worst:e}");
    assert!(worst < 1e-7, "{worst:e}");
}

#[test]
fn a_room_with_one_bright_wall() {
    // Corners, where interreflection is not smooth, and a block that shades them.
    let corners = [(-1.0, -1.0), (1.25, -1.125), (1.0, 1.0)].map(|(x, y)| DVec2::new(x, y));
    let dark = Shape::open(corners, Material::diffuse(0.7));
    let bright = Shape::open(
        [(0.75, 1.0), (-1.0, 1.0)].map(|(x, y)| DVec2::new(x, y)),
        Material::diffuse(0.5).with_emission(1.0),
    );
    let block = [(-0.25, -0.5), (0.25, -0.5), (0.0, -0.25)].map(|(x, y)| DVec2::new(x, y));
    let block = Shape::closed(block, Material::diffuse(0.8));
    let world = World::new(0.25, vec![dark, bright, block]).expect("a world");
    let change =
        Tangent::rotate(&world, [2], DVec2::new(0.0, -0.4)).and(&Tangent::translate(&world, [1], DVec2::Y));
    let camera = camera(4);
    let largest =
        |i: &Integrated<f64>| i.errors.iter().zip(&i.scales).map(|(e, s)| e / s).fold(0.0, f64::max);
    let mut errors = vec![];
    for parts in [1, 2] {
        let radiosity = Radiosity { parts, ..Radiosity::default() };
        let [image, slope] = radiosity.gradient(&world, &camera, &change).expect("a gradient");
        println!("{parts} parts: image {:e}, slope {:e}", largest(&image), largest(&slope));
        // Close to the stated error, 10⁻⁶ by default, even with the fewest panels.
        assert!(largest(&image) < 1e-7 && largest(&slope) < 2e-6);
        errors.push(slope);
    }
    // Light scattered twice has all its kinks at ends of panels.
    let twice = Radiosity { bounces: Some(2), parts: 1, ..Radiosity::default() };
    let [image, slope] = twice.gradient(&world, &camera, &change).expect("a gradient");
    println!("two bounces: image {:e}, slope {:e}", largest(&image), largest(&slope));
    assert!(largest(&image) < 1e-9 && largest(&slope) < 1e-8);
    let fewest = Radiosity { parts: 1, ..Radiosity::default() };
    let moved = |h: f64| Some(fewest.image(&world.displaced(&change, h).ok()?, &camera).ok()?.pixels);
    let found = central_differences(&SWEEP, moved).expect("worlds");
    for (p, found) in found.into_iter().enumerate() {
        for slope in &errors {
            let error = (found - slope.pixels[p]).abs() / slope.scales[p];
            println!("{p} {error:e}");
            assert!(error < 2e-6, "{p}: {found} {}", slope.pixels[p]);
        }
    }
}

/// The corner of two surfaces is in view. At the corner each surface sees of the other only the corner
/// itself, and each has a radiance of its own; the difference times the velocity of the corner over the film
/// is a part of the derivative.
#[test]
fn a_corner_that_moves_over_the_film() {
    let lamp = [(-0.625, 0.25), (-0.5, 0.0)].map(|(x, y)| DVec2::new(x, y));
    let lamp = Shape::open(lamp, Material::emitter(2.0));
    let walls = room(0.7, 0.0).shapes()[0].clone();
    let world = World::new(0.0, vec![walls, lamp]).expect("a world");
    let turning = CameraTangent { position: DVec2::new(0.5, 0.25), angle: 1.0, field_of_view: 0.0 };
    let change = Tangent::of_camera(&world, turning).and(&Tangent::scale(&world, [0], DVec2::ZERO));
    // Two corners each, four in all: which end of which segment a corner is differs.
    for angle in [1.78, 4.6] {
        let camera = Camera { angle, ..camera(2) };
        let radiosity = Radiosity { bounces: Some(2), parts: 1, tolerance: 1e-9 };
        let [_, slope] = radiosity.gradient(&world, &camera, &change).expect("a gradient");
        let moved = |h: f64| {
            let moved = world.displaced(&change, h).ok()?;
            Some(radiosity.image(&moved, &change.displaced_camera(&camera, h)).ok()?.pixels)
        };
        let found = central_differences(&STEPS, moved).expect("worlds");
        for (p, found) in found.into_iter().enumerate() {
            let error = (found - slope.pixels[p]).abs() / slope.scales[p];
            println!("{angle} {p} {error:e}");
            assert!(error < 1e-7, "{angle} {p}: {found} {}", slope.pixels[p]);
        }
    }
}

#[test]
fn one_bounce_is_the_closed_form() {
    for i in 0..6 {
        let mut rng = stream(21, &[i]);
        let world = random_world(&mut rng, 4, false);
        let camera = random_camera(&mut rng, Filter::Tent);
        let change = random_vertices(&mut rng, &world);
        for bounces in [0, 1] {
            let exact =
                Exact { bounces, tolerance: 1e-11 }.gradient(&world, &camera, &change).expect("exact");
            let [_, found] = Radiosity { bounces: Some(bounces), ..Radiosity::default() }
                .gradient(&world, &camera, &change)
                .expect("radiosity");
            for (p, terms) in exact.pixels.iter().enumerate() {
                assert!((terms.total() - found.pixels[p]).abs() <= 1e-9 * exact.scales[p]);
            }
        }
    }
}

#[test]
fn derivatives_agree_with_differences() {
    let (mut worst, mut worst_error, mut worst_slope, mut tested) = (0.0_f64, 0.0_f64, 0.0_f64, 0);
    for i in 0..2 {
        let mut rng = stream(22, &[i]);
        let world = random_world(&mut rng, 4, false);
        let camera = random_camera(&mut rng, Filter::Tent);
        let change = random_vertices(&mut rng, &world).and(&random_camera_tangent(&mut rng, &world));
        // One part: the differences test the derivative of the discretised solution, however coarse.
        let radiosity = Radiosity { parts: 1, ..Radiosity::default() };
        let [image, slopes] = radiosity.gradient(&world, &camera, &change).expect("radiosity");
        let moved = |h: f64| {
            let moved = world.displaced(&change, h).ok()?;
            Some(radiosity.image(&moved, &change.displaced_camera(&camera, h)).ok()?.pixels)
        };
        let found = central_differences(&STEPS, moved);
        for p in 0..6 {
            worst_error = worst_error.max(image.errors[p] / image.scales[p]);
            worst_slope = worst_slope.max(slopes.errors[p] / slopes.scales[p]);
            if let Some(found) = &found {
                tested += 1;
                worst = worst.max((found[p] - slopes.pixels[p]).abs() / slopes.scales[p].max(0.1));
            }
        }
    }
    println!("{tested} differences {worst:e}, image {worst_error:e}, slope {worst_slope:e}");
    assert!(worst < 1e-6 && worst_error < 1e-6 && worst_slope < 1e-6);
}

#[test]
fn what_radiosity_cannot_do_is_refused() {
    let glossy = Shape::open([DVec2::X, DVec2::Y], Material::glossy(0.5, 0.1));
    let world = World::new(1.0, vec![glossy]).expect("a world");
    let refused = Radiosity::default().image(&world, &camera(2));
    assert_eq!(refused, Err(ExactError::Glossy { shape: 0 }));
    let refused = Radiosity::default().image(&room(1.0, 0.0), &camera(2));
    assert_eq!(refused, Err(ExactError::NoAbsorption { shape: 0 }));
    let none = Radiosity { parts: 0, ..Radiosity::default() };
    assert_eq!(none.image(&room(0.5, 0.0), &camera(2)), Err(ExactError::Parts { parts: 0 }));
    let bounded = Radiosity { bounces: Some(3), ..Radiosity::default() };
    assert!(bounded.image(&room(1.0, 0.0), &camera(2)).is_ok());
}
