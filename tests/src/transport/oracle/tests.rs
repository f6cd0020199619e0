//! The oracle against closed forms and against central differences of itself.

use flatland::plane::Filter;
use flatland::transport::{Camera, Film, Material, Shape, Tangent, World};
use glam::DVec2;
use rayon::prelude::*;

use super::*;
use crate::transport::constants::{Constant, constants};
use crate::transport::worlds::{Case, Kind, Knobs, Moving};

/// Differences of the oracle's values: central, or one-sided if the other side is no valid world, such as an
/// environment of negative radiance; both of second order in the step.
fn difference(case: &Case, bounces: usize, step: f64) -> Option<Vec<f64>> {
    let values = |theta: f64| {
        let world = case.world.displaced(&case.change, theta).ok()?;
        let camera: Camera = case.change.displaced_camera(&case.camera, theta);
        let pixels = image(&world, &camera, &Tangent::none(&world), bounces);
        Some(pixels.into_iter().map(|p| p.value).collect::<Vec<_>>())
    };
    let (minus, now, plus, far) = (values(-step), values(0.0)?, values(step)?, values(2.0 * step)?);
    let difference = |i: usize| match &minus {
        Some(minus) => (plus[i] - minus[i]) / (2.0 * step),
        None => (4.0 * plus[i] - 3.0 * now[i] - far[i]) / (2.0 * step),
    };
    Some((0..case.camera.film.pixels).map(difference).collect())
}

/// Every pixel whose derivative differs from the derivative of its values, over all cases that stay valid
/// worlds when displaced.
fn mismatches(knobs: &[Knobs], bounces: usize, step: f64, tolerance: f64) -> (usize, Vec<String>) {
    let check = |knobs: &Knobs| {
        let case = knobs.build();
        let expected = difference(&case, bounces, step)?;
        let found = image(&case.world, &case.camera, &case.change, bounces);
        let scale: f64 = found.iter().map(|p| p.absolute + p.value).fold(0.0, f64::max);
        let wrong = |(i, (p, d)): (usize, (&PixelOracle, &f64))| {
            let fine = (p.derivative - d).abs() <= tolerance * scale;
            (!fine).then(|| format!("{} pixel {i}: {p:?} for {d}", case.label))
        };
        Some(found.iter().zip(&expected).enumerate().filter_map(wrong).collect::<Vec<_>>())
    };
    let all: Vec<_> = knobs.par_iter().filter_map(check).collect();
    (all.len(), all.concat())
}

fn knobs(kinds: &[Kind], per_kind: u64) -> Vec<Knobs> {
    let of = |&kind: &Kind| {
        Moving::ALL.into_iter().flat_map(move |moving| {
            (0..per_kind).map(move |seed| Knobs { moving, ..Knobs::random(seed, kind) })
        })
    };
    kinds.iter().flat_map(of).collect()
}

#[test]
fn derivatives_are_those_of_the_values() {
    let knobs = knobs(&Kind::GENERIC, 6);
    let (count, failures) = mismatches(&knobs, 1, 1e-6, 1e-6);
    println!("{count} of {} cases", knobs.len());
    assert!(failures.is_empty(), "{} failures\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn derivatives_are_those_of_the_values_of_light_scattered_twice() {
    let small = |k: &Knobs| Knobs { shapes: 1, pixels: 4, ..*k };
    let knobs: Vec<_> = knobs(&[Kind::Shadows, Kind::Glossy, Kind::Glowing], 2).iter().map(small).collect();
    // A value is known to about 10⁻⁸ only, and a longer step changes visibility.
    let (count, failures) = mismatches(&knobs, 2, 1e-4, 1e-4);
    println!("{count} of {} cases", knobs.len());
    assert!(failures.is_empty(), "{} failures\n{}", failures.len(), failures.join("\n"));
}

/// Values and derivatives known by an argument, to `tolerance` of the terms' absolute sum.
fn check_constants(filters: &[Filter], bounces: usize, tolerance: f64) {
    let wrong = |c: &Constant| {
        let Case { world, camera, change, label } = &c.case;
        let pixels = image(world, camera, change, bounces);
        let fine = |p: &PixelOracle| {
            (p.derivative - c.derivative).abs() <= tolerance * (p.absolute + p.value)
                && c.value.is_none_or(|value| (p.value - value).abs() <= tolerance * value)
        };
        let worst = pixels.iter().find(|p| !fine(p))?;
        Some(format!("{label}: {worst:?} for {:?}, {}", c.value, c.derivative))
    };
    let failures: Vec<String> = constants(filters, bounces).par_iter().filter_map(wrong).collect();
    assert!(failures.is_empty(), "{} failures\n{}", failures.len(), failures.join("\n"));
}

#[test]
fn constants_are_found() {
    let filters = [Filter::Box, Filter::Tent, Filter::Gaussian];
    check_constants(&filters, 0, 1e-12);
    check_constants(&filters, 1, 1e-11);
}

#[test]
fn constants_of_light_scattered_twice_are_found() {
    check_constants(&[Filter::Box], 2, 1e-6);
}

/// A pixel so small that it is a ray: irradiance from a segment is a difference of sines.
#[test]
fn a_narrow_pixel_is_a_ray() {
    let floor = Shape::open([DVec2::new(-3.0, 0.0), DVec2::new(3.0, 0.0)], Material::diffuse(0.7));
    let (a, b) = (DVec2::new(-0.5, 1.5), DVec2::new(0.9, 2.0));
    let light = Shape::open([a, b], Material::emitter(3.0));
    let world = World::new(0.0, vec![floor, light]).expect("a world");
    let film = Film { pixels: 1, filter: Filter::Box };
    let (position, angle) = (DVec2::new(0.4, 1.0), -0.5 * std::f64::consts::PI);
    let camera = Camera { position, angle, field_of_view: 1e-6, film };
    let velocity = DVec2::new(0.6, -0.3);
    let change = Tangent::translate(&world, [1], velocity);
    let pixel = image(&world, &camera, &change, 1)[0];
    // At (0.4, 0): sin φ = d_x/|d|, and its derivative is d_y (d × ḋ)/|d|³ turned.
    let sine = |v: DVec2| (v - DVec2::new(0.4, 0.0)).x / v.distance(DVec2::new(0.4, 0.0));
    let rate = |v: DVec2| {
        let d = v - DVec2::new(0.4, 0.0);
        d.y * velocity.perp_dot(d) / d.length().powi(3)
    };
    let factor = 3.0 * 0.7 * 0.5;
    assert!((pixel.value - factor * (sine(b) - sine(a))).abs() < 1e-12, "{pixel:?}");
    assert!((pixel.derivative - factor * (rate(b) - rate(a))).abs() < 1e-12, "{pixel:?}");
}
