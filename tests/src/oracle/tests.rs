//! The oracle against answers known by hand, and its derivative against its own values.

use flatland::plane::{Attachment, Filter, Motion, Polygon, Shade, Shape};
use glam::DMat2;

use super::*;
use crate::effort::pick;
use crate::scenes::{Case, Kind, random};
use crate::worst;

fn polygon(points: &[(f64, f64)]) -> Polygon {
    Polygon::simple(points.iter().map(|&(x, y)| DVec2::new(x, y)).collect::<Vec<_>>()).unwrap()
}

fn white(polygon: Polygon) -> Scene {
    Scene::new(DVec3::ZERO, vec![Shape::new(polygon, Shade::constant(DVec3::ONE))]).unwrap()
}

fn square(x: f64, y: f64, side: f64) -> Polygon {
    polygon(&[(x, y), (x + side, y), (x + side, y + side), (x, y + side)])
}

fn assert_near(found: DVec3, exact: DVec3, tolerance: f64, what: &str) {
    let error = (found - exact).abs().max_element();
    assert!(error <= tolerance, "{what}: {found} for {exact}, off by {error:e} (tolerance {tolerance:e})");
}

#[test]
fn half_covered_pixel() {
    // The left half of pixel (1, 1) is covered, and the edge moves to the right.
    let scene = white(square(-2.5, -2.0, 4.0));
    let velocities = Motion::translate([0], DVec2::X).velocities(&scene).unwrap();
    let film = |filter| Film::new(3, 3, filter).unwrap();
    let boxed = pixel(&scene, &velocities, &film(Filter::Box), 1, 1);
    assert_near(boxed.value, DVec3::splat(0.5), 1e-15, "box value");
    assert_near(boxed.derivative, DVec3::splat(1.0), 1e-15, "box derivative");
    // Tent, pixel (1, 1) about (1.5, 1.5): y from 0.5 to 2 is covered, ∫ h dy = 7/8, and h(x = 1.5) = 1.
    let tent = pixel(&scene, &velocities, &film(Filter::Tent), 1, 1);
    assert_near(tent.value, DVec3::splat(0.5 * 0.875), 1e-15, "tent value");
    assert_near(tent.derivative, DVec3::splat(0.875), 1e-15, "tent derivative");
    assert!(tent.absolute >= 0.875 && tent.absolute < 20.0, "{}", tent.absolute);
    // After half a unit to the right h(x = 2) = ½ and the value is 1 − ½·½² of 7/8.
    let scene = white(square(-2.0, -2.0, 4.0));
    let tent = pixel(&scene, &velocities, &film(Filter::Tent), 1, 1);
    assert_near(tent.value, DVec3::splat(0.875 * 0.875), 1e-15, "tent value");
    assert_near(tent.derivative, DVec3::splat(0.5 * 0.875), 1e-15, "tent derivative");
}

#[test]
fn a_uniform_plane_has_the_value_of_its_shade() {
    let scene = white(square(-20.0, -20.0, 50.0));
    let velocities = vec![DVec2::new(0.3, 0.7); 4];
    for filter in [Filter::Box, Filter::Tent, Filter::Gaussian] {
        for p in image(&scene, &velocities, &Film::new(3, 2, filter).unwrap()) {
            assert_near(p.value, DVec3::ONE, 2e-15, "value");
            assert_near(p.derivative, DVec3::ZERO, 2e-15, "derivative");
        }
    }
}

#[test]
fn a_disc_about_its_centre_keeps_its_area() {
    let corner = |k: u32| DVec2::from_angle(f64::from(k) * std::f64::consts::TAU / 64.0) * 1.3;
    let centre = DVec2::new(1.6, 1.7);
    let disc = Polygon::simple((0..64).map(|k| centre + corner(k)).collect::<Vec<_>>()).unwrap();
    let scene = white(disc);
    let velocities = Motion::rotate([0], centre).velocities(&scene).unwrap();
    let film = Film::new(4, 4, Filter::Box).unwrap();
    let pixels = image(&scene, &velocities, &film);
    let area: f64 = pixels.iter().map(|p| p.value.x).sum();
    let exact = 32.0 * 1.69 * (std::f64::consts::TAU / 64.0).sin();
    assert!((area - exact).abs() < 1e-13, "area {area} for {exact}");
    let rate: f64 = pixels.iter().map(|p| p.derivative.x).sum();
    assert!(rate.abs() < 1e-13, "rate {rate:e}");
    // A pixel at its rim, however, sees corners pass.
    assert!(pixels.iter().any(|p| p.derivative.x.abs() > 1e-4));
}

#[test]
fn shades_of_the_image_stay_and_shades_of_the_material_go_along() {
    // f = x over a square that covers the pixel; rows of the film are alike.
    let film = Film::new(3, 3, Filter::Tent).unwrap();
    for (attachment, rate) in [(Attachment::Image, 0.0), (Attachment::Material, -1.0)] {
        let shade = Shade::linear(DVec2::ZERO, DVec3::ZERO, [DVec2::X; 3], attachment);
        let scene = Scene::new(DVec3::ZERO, vec![Shape::new(square(-5.0, -5.0, 13.0), shade)]).unwrap();
        let velocities = Motion::translate([0], DVec2::X).velocities(&scene).unwrap();
        let p = pixel(&scene, &velocities, &film, 1, 1);
        assert_near(p.value, DVec3::splat(1.5), 1e-14, "value");
        assert_near(p.derivative, DVec3::splat(rate), 1e-14, "translated");
        // Under scaling about the origin v = u, and −∇f·v has the mean of −x.
        let velocities = Motion::scale([0], DVec2::ZERO).velocities(&scene).unwrap();
        let p = pixel(&scene, &velocities, &film, 1, 1);
        assert_near(p.derivative, DVec3::splat(1.5 * rate), 1e-14, "scaled");
    }
}

#[test]
fn a_quadratic_shade_under_a_tent() {
    // ∫ h (x − c)² du = 1/6, ∫ h (x − c)(y − c) du = 0.
    let hessian = DMat2::from_cols_array(&[2.0, 0.7, 0.7, 4.0]);
    let shade = Shade::quadratic(
        DVec2::splat(1.5),
        DVec3::splat(0.25),
        [DVec2::new(3.0, -2.0); 3],
        [hessian; 3],
        Attachment::Image,
    );
    let scene = Scene::new(DVec3::ZERO, vec![Shape::new(square(-5.0, -5.0, 13.0), shade)]).unwrap();
    let p = pixel(&scene, &[DVec2::ONE; 4], &Film::new(3, 3, Filter::Tent).unwrap(), 1, 1);
    assert_near(p.value, DVec3::splat(0.25 + 1.0 / 6.0 + 2.0 / 6.0), 1e-14, "value");
}

#[test]
fn crossings_of_nearly_coincident_edges_are_found_where_they_are() {
    // Two edges that cross at (1.5, y) at an angle of 2·10⁻¹³ and part at speed 1: the upper square reveals
    // the lower one's colour on the left half only.
    let gap = 1e-13;
    let below = polygon(&[(0.0, 0.0), (3.0, 0.0), (3.0, 1.5 + gap), (0.0, 1.5 - gap)]);
    let above = polygon(&[(0.0, 0.0), (3.0, 0.0), (3.0, 1.5 - gap), (0.0, 1.5 + gap)]);
    let shape = |p, colour| Shape::new(p, Shade::constant(colour));
    let scene = Scene::new(DVec3::ZERO, vec![shape(below, DVec3::X), shape(above, DVec3::Y)]).unwrap();
    let velocities = Motion::translate([0], DVec2::Y).velocities(&scene).unwrap();
    let film = Film::new(3, 3, Filter::Box).unwrap();
    let p = pixel(&scene, &velocities, &film, 1, 1);
    // Left of 1.5 the lower polygon's edge is hidden, right of it seen.
    let crossing = {
        let (a, b) = (1.5 + gap - 1.5, 1.5 - (1.5 - gap));
        assert!(a > 0.0 && b > 0.0);
        1.5 * 2.0 * b / (a + b)
    };
    assert_near(p.derivative, DVec3::new(2.0 - crossing, 0.0, 0.0), 1e-12, "derivative");
}

/// The stencil (−f(2h) + 8 f(h) − 8 f(−h) + f(−2h))/12h of the oracle's own values.
fn stencil(case: &Case, step: f64) -> Vec<DVec3> {
    let still = vec![DVec2::ZERO; case.scene.vertices().len()];
    let images = [-2.0, -1.0, 1.0, 2.0].map(|k| {
        let scene = case.motion.displace(&case.scene, k * step).unwrap();
        Oracle::new(&scene, &still, &case.film).material(&case.scene).image()
    });
    (0..images[0].len())
        .map(|i| {
            let [a, b, c, d] = [0, 1, 2, 3].map(|k| images[k][i].value);
            ((a - d) + 8.0 * (c - b)) / (12.0 * step)
        })
        .collect()
}

/// Every kind, with a tolerance for finite differences: next to a degenerate configuration the image is only
/// once differentiable, and the error is of the order of the step.
#[test]
fn derivatives_are_those_of_the_values() {
    let smooth = |kind| {
        matches!(kind, Kind::Generic | Kind::CoincidentTogether | Kind::NestedCopies | Kind::FilledHole)
    };
    let mut failures = vec![];
    let mut count = 0;
    for kind in Kind::ALL.into_iter().filter(|&k| k != Kind::NearlyCoincident) {
        let (steps, tolerance) =
            if smooth(kind) { ([1e-3, 1e-4, 1e-5], 1e-8) } else { ([1e-5, 1e-6, 1e-7], 1e-5) };
        for seed in 0..pick(5, 8) {
            let case = random(seed, kind);
            let exact = image(&case.scene, &case.velocities(), &case.film);
            // An event within the stencil spoils one step, not the others.
            let stencils = steps.map(|h| stencil(&case, h));
            for (i, pixel) in exact.iter().enumerate() {
                let error = |s: &Vec<DVec3>| (s[i] - pixel.derivative).abs().max_element();
                let error = stencils.iter().map(error).fold(f64::INFINITY, f64::min);
                let tolerance = tolerance * pixel.absolute.max(1.0);
                count += 1;
                if error.is_nan() || error > tolerance {
                    let what = format!("pixel {i} of {}: {pixel:?}", case.label);
                    failures.push(format!("{what} off by {error:e} (tolerance {tolerance:e})"));
                }
            }
        }
    }
    assert!(failures.is_empty(), "{} of {count} failures\n{}", failures.len(), failures.join("\n"));
}

/// Cases of every kind and some seeds.
fn cases(seeds: std::ops::Range<u64>) -> impl Iterator<Item = (Kind, u64)> {
    Kind::ALL.into_iter().flat_map(move |kind| seeds.clone().map(move |seed| (kind, seed)))
}

#[test]
fn no_angle_is_special() {
    worst::assert_below(1e-12, cases(100..pick(108, 124)), |(kind, seed)| {
        let case = random(seed, kind);
        let velocities = case.velocities();
        let oracle = |frame| Oracle::turned(&case.scene, &velocities, &case.film, frame).image();
        let chosen = oracle(Frame::new(&case.scene));
        let error = |(a, b): (PixelOracle, &PixelOracle)| {
            let derivative = (a.derivative - b.derivative).abs().max_element() / b.absolute.max(1.0);
            derivative.max((a.value - b.value).abs().max_element())
        };
        let others = [0.27, 0.71, 1.13].into_iter().flat_map(|angle| oracle(Frame::at(angle)));
        (others.zip(chosen.iter().cycle()).map(error).fold(0.0, f64::max), case.label)
    });
}

#[test]
fn a_vertex_halfway_between_two_events_counts_once() {
    // Vertices below the pixel are no events of it. Here, at this angle, one lies exactly below the middle of
    // a slab, where two edges end and begin.
    let quad = polygon(&[(17.75, 11.25), (18.25, 11.25), (18.25, 12.5), (17.75, 12.5)]);
    let scene = white(quad);
    let film = Film::placed(6, 6, Filter::Tent, DVec2::new(16.5, 11.0), 0.5).unwrap();
    let still = [DVec2::ZERO; 4];
    for (angle, x) in [(1.13, 0), (0.71, 0), (0.44, 5)] {
        let pixel = Oracle::turned(&scene, &still, &film, Frame::at(angle)).pixel(x, 3);
        assert_eq!(pixel, PixelOracle::default(), "at {angle}");
    }
}

#[test]
fn values_are_those_of_what_the_scene_shows() {
    // Reference: sums over a grid, whose error is about the length of the edges times the grid spacing.
    const SIDE: i32 = 60;
    worst::assert_below(0.02, cases(200..206), |(kind, seed)| {
        let case = random(seed, kind);
        let pixels = image(&case.scene, &case.velocities(), &case.film);
        let error = |(i, pixel): (usize, &PixelOracle)| {
            let centre = case.film.centre(i % case.film.width(), i / case.film.width());
            let (min, max) = case.film.support(centre);
            let (mut sum, mut mass) = (DVec3::ZERO, 0.0);
            for k in 0..SIDE * SIDE {
                let at = DVec2::new(f64::from(k % SIDE) + 0.5, f64::from(k / SIDE) + 0.5) / f64::from(SIDE);
                let u = min + (max - min) * at;
                let h = case.film.filter_value(centre, u);
                sum += h * case.scene.value(case.scene.hit(u).as_ref(), u);
                mass += h;
            }
            (sum / mass - pixel.value).abs().max_element()
        };
        (pixels.iter().enumerate().map(error).fold(0.0, f64::max), case.label)
    });
}
