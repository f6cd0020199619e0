use flatland::random::{open01, stream};

use super::*;
use crate::effort::pick;
use crate::space::worlds::{DirectCase, DirectKind, DirectKnobs};
use crate::worst;

fn image(scene: &DirectScene, tolerance: f64, label: &str) -> Vec<Pixel> {
    scene.image(tolerance).unwrap_or_else(|e| panic!("{e}\n{label}"))
}

/// The largest error of a difference quotient of L at points of the film, the best of a sweep of steps,
/// relative to value and derivative. `quotient` has the value at ±h and ±h/2.
pub(super) fn error_of_points(
    DirectCase { scene, label }: &DirectCase,
    (seed, points): (u64, usize),
    steps: &[f64],
    quotient: fn([DVec3; 4], f64) -> DVec3,
) -> f64 {
    let moved = |h: f64| (h, [h, -h, 0.5 * h, -0.5 * h].map(|h| scene.displaced(h)));
    let steps: Vec<_> = steps.iter().map(|&h| moved(h)).collect();
    let mut rng = stream(seed, &[]);
    let of_point = |_| {
        let u = DVec2::new(open01(&mut rng), open01(&mut rng)) * scene.camera.width as f64;
        let at = |scene: &DirectScene| scene.radiance(u).unwrap_or_else(|e| panic!("{e}\n{label}"));
        let exact = at(scene);
        let [value, derivative] = exact.magnitudes();
        let error = |(h, moved): &(f64, [DirectScene; 4])| {
            let found = quotient(moved.each_ref().map(|scene| at(scene).value), *h);
            (found - exact.derivative).abs().max_element() / (value + derivative + 1e-3)
        };
        steps.iter().map(error).fold(f64::INFINITY, f64::min)
    };
    (0..points).map(of_point).fold(0.0, f64::max)
}

/// Each film point's derivative is the derivative of its value. The next test covers edges that cross the
/// film, which might add a term that no single point shows.
#[test]
fn points_of_the_film_have_the_derivatives_of_their_values() {
    worst::assert_below(1e-6, 0..60, |seed| {
        let case = DirectKnobs::any(seed).build();
        let quotient = |[ahead, behind, ..]: [DVec3; 4], h: f64| (ahead - behind) / (2.0 * h);
        (error_of_points(&case, (seed, 30), &[1e-4, 1e-5, 1e-6], quotient), case.label)
    });
}

#[test]
fn pixels_have_the_derivatives_of_their_values() {
    // The error is of order h, because second derivatives are discontinuous, plus the error of quadrature
    // over h. It is relative to the whole image: in a nearly dark pixel no difference can be accurate.
    const STEP: f64 = 1e-2;
    let kinds = [DirectKind::Shadow, DirectKind::Glowing];
    let cases = kinds.into_iter().flat_map(|kind| (2..pick(3, 4)).map(move |seed| (seed, kind)));
    worst::assert_below(2e-3, cases, |(seed, kind)| {
        let knobs = DirectKnobs { filter: Filter::Tent, ..DirectKnobs::random(seed, kind) };
        let DirectCase { scene, label } = knobs.build();
        let exact = image(&scene, 1e-4, &label);
        let [ahead, behind] = [STEP, -STEP].map(|h| image(&scene.displaced(h), 1e-4, &label));
        let largest = |p: &Pixel| p.value.max_element().max(p.derivative.abs().max_element());
        let scale = exact.iter().map(largest).fold(0.0, f64::max);
        let errors = exact.iter().zip(ahead.iter().zip(&behind)).map(|(pixel, (a, b))| {
            ((a.value - b.value) / (2.0 * STEP) - pixel.derivative).abs().max_element()
        });
        (errors.fold(0.0, f64::max) / scale, label)
    });
}

#[test]
fn errors_are_what_a_finer_rule_finds() {
    let mut evaluated = 0;
    for kind in DirectKind::ALL {
        for seed in 10..12 {
            let DirectCase { scene, label } = DirectKnobs::random(seed, kind).build();
            let (coarse, fine) = (image(&scene, 1e-2, &label), image(&scene, 1e-3, &label));
            for (coarse, fine) in coarse.iter().zip(&fine) {
                let value = (coarse.value - fine.value).abs().max_element();
                let derivative = (coarse.derivative - fine.derivative).abs().max_element();
                let [by_value, by_derivative] =
                    [coarse.value_error + fine.value_error, coarse.derivative_error + fine.derivative_error];
                let fits = value <= by_value + 1e-14 && derivative <= by_derivative + 1e-14;
                assert!(fits, "{label}: {coarse:?} {fine:?}");
                evaluated += 1;
            }
        }
    }
    assert!(evaluated >= 54);
}

#[test]
fn the_camera_sees_the_ground_only() {
    for seed in 0..60 {
        let DirectCase { scene, label } = DirectKnobs::any(seed).build();
        let film = Film::new(scene.camera.width, scene.camera.height, scene.filter).expect("a film");
        let (min, max) = film.extent();
        for k in 0..400 {
            let share = DVec2::new(f64::from(k % 20) / 19.0, f64::from(k / 20) / 19.0);
            let ray = scene.camera.ray(&scene.camera_motion, min + (max - min) * share);
            let x = Receiver::on_ray(&ray, &scene.ground).unwrap_or_else(|e| panic!("{e} {label}"));
            assert!(x.point.length() < 19.0, "{label}: {}", x.point);
            // Farther than any body above the ground.
            let far = ray.origin + 40.0 * ray.direction;
            assert!(!scene.world.surfaces.iter().any(|s| s.hides(ray.origin, far)), "{label}");
        }
    }
}

#[test]
fn under_an_environment_alone_every_pixel_is_the_albedo() {
    let mut scene = DirectKnobs::any(3).build().scene;
    scene.world = World { surfaces: vec![], environment: DVec3::new(2.0, 1.0, 0.5) };
    for pixel in image(&scene, 1e-4, "environment") {
        let error = (pixel.value - scene.albedo * scene.world.environment).abs().max_element();
        // The Gaussian is no polynomial.
        assert!(error < 1e-6 && pixel.derivative == DVec3::ZERO, "{pixel:?}");
    }
}

#[test]
fn what_has_no_ground_is_an_error_that_names_the_place() {
    let mut scene = DirectKnobs::any(0).build().scene;
    scene.ground.corners = [DVec3::ZERO; 3];
    let error = format!("{:#}", scene.image(1e-3).expect_err("no ground"));
    assert!(
        error.starts_with("at the film's point [") && error.ends_with("the ray meets no receiver"),
        "{error}"
    );
    scene.camera.field_of_view = f64::NAN;
    assert!(scene.image(1e-3).expect_err("no camera").to_string().contains("field of view"));
}
