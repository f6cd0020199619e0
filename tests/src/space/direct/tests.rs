use flatland::random::{open01, stream};

use super::*;
use crate::effort::pick;
use crate::space::worlds::{self, DirectCase, DirectKind, DirectKnobs};

fn image(scene: &DirectScene, tolerance: f64, label: &str) -> Vec<Pixel> {
    scene.image(tolerance).unwrap_or_else(|e| panic!("{e}\n{label}"))
}

/// Each film point's derivative is that of its value; this leaves to the next test what no point
/// shows, whether edges that cross the film add a term of their own.
#[test]
fn points_of_the_film_have_the_derivatives_of_their_values() {
    let mut worst = (0.0, String::new());
    for seed in 0..60 {
        let DirectCase { scene, label } = worlds::direct(seed);
        let displaced = |h: f64| [h, -h].map(|h| scene.displaced(h));
        let steps = [1e-4, 1e-5, 1e-6].map(|h| (h, displaced(h)));
        let mut rng = stream(seed, &[]);
        for _ in 0..30 {
            let u = DVec2::new(open01(&mut rng), open01(&mut rng)) * scene.camera.width as f64;
            let at = |scene: &DirectScene| scene.radiance(u).unwrap_or_else(|e| panic!("{e}\n{label}"));
            let exact = at(&scene);
            let [value, derivative] = exact.magnitudes();
            let error = |(h, [ahead, behind]): &(f64, [DirectScene; 2])| {
                let quotient = (at(ahead).value - at(behind).value) / (2.0 * h);
                (quotient - exact.derivative).abs().max_element() / (value + derivative + 1e-3)
            };
            let error = steps.iter().map(error).fold(f64::INFINITY, f64::min);
            worst = if error > worst.0 { (error, label.clone()) } else { worst };
        }
    }
    println!("worst: {:e}, {}", worst.0, worst.1);
    assert!(worst.0 < 1e-6, "{:e}, {}", worst.0, worst.1);
}

#[test]
fn pixels_have_the_derivatives_of_their_values() {
    // The error is of order h, because second derivatives jump, and that of quadrature over h. It is
    // relative to the whole image: in a pixel that is all but dark no difference can be accurate.
    const STEP: f64 = 1e-2;
    let mut worst = (0.0, String::new());
    for kind in [DirectKind::Shadow, DirectKind::Glowing] {
        for seed in 2..pick(3, 4) {
            let knobs = DirectKnobs { filter: Filter::Tent, ..DirectKnobs::random(seed, kind) };
            let DirectCase { scene, label } = knobs.build();
            let exact = image(&scene, 1e-4, &label);
            let [ahead, behind] = [STEP, -STEP].map(|h| image(&scene.displaced(h), 1e-4, &label));
            let largest = |p: &Pixel| p.value.max_element().max(p.derivative.abs().max_element());
            let scale = exact.iter().map(largest).fold(0.0, f64::max);
            for (pixel, (a, b)) in exact.iter().zip(ahead.iter().zip(&behind)) {
                let error = (a.value - b.value) / (2.0 * STEP) - pixel.derivative;
                let error = error.abs().max_element() / scale;
                worst = if error > worst.0 { (error, label.clone()) } else { worst };
            }
        }
    }
    println!("worst: {:e}, {}", worst.0, worst.1);
    assert!(worst.0 < 2e-3, "{:e}, {}", worst.0, worst.1);
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
        let DirectCase { scene, label } = worlds::direct(seed);
        let film = Film::new(scene.camera.width, scene.camera.height, scene.filter).expect("a film");
        let (min, max) = film.extent();
        for k in 0..400 {
            let share = DVec2::new(f64::from(k % 20) / 19.0, f64::from(k / 20) / 19.0);
            let ray = scene.camera.ray(&scene.camera_motion, min + (max - min) * share);
            let x = Receiver::on_ray(&ray, &scene.ground).unwrap_or_else(|e| panic!("{e} {label}"));
            assert!(x.point.length() < 19.0, "{label}: {}", x.point);
            for surface in &scene.world.surfaces {
                let p = &surface.vertices;
                let normal = (p[1] - p[0]).cross(p[2] - p[0]);
                let t = normal.dot(p[0] - ray.origin) / normal.dot(ray.direction);
                let at = ray.origin + t * ray.direction;
                let inside = |k: usize| (p[(k + 1) % p.len()] - p[k]).cross(at - p[k]).dot(normal) >= 0.0;
                assert!(!(t > 0.0 && (0..p.len()).all(inside)), "{label}");
            }
        }
    }
}

/// The rate of a camera's ray is that of the ray of the displaced camera.
#[test]
fn rays_move_with_the_camera() {
    for seed in 0..50 {
        let case = worlds::coverage(seed);
        let motion = CameraMotion {
            origin: DVec3::new(1.0, -2.0, 0.5),
            angular: DVec3::new(0.4, 0.3, -0.2),
            field_of_view: 0.3,
        };
        let (u, h) = (DVec2::new(1.3, 2.9), 1e-5);
        let ray = case.camera.ray(&motion, u);
        let at = |h: f64| case.camera.displaced(&motion, h).direction(u);
        let rate = (at(h) - at(-h)) / (2.0 * h);
        // The axes turn, so only what is across the direction counts; here all of it agrees.
        assert!((rate - ray.direction_rate).length() < 1e-8, "{rate} {}", ray.direction_rate);
        assert_eq!(ray.origin_velocity, motion.origin);
    }
}

#[test]
fn under_an_environment_alone_every_pixel_is_the_albedo() {
    let mut scene = worlds::direct(3).scene;
    scene.world = World { surfaces: vec![], environment: DVec3::new(2.0, 1.0, 0.5) };
    for pixel in image(&scene, 1e-4, "environment") {
        let error = (pixel.value - scene.albedo * scene.world.environment).abs().max_element();
        // The Gaussian is no polynomial.
        assert!(error < 1e-6 && pixel.derivative == DVec3::ZERO, "{pixel:?}");
    }
}

#[test]
fn what_has_no_ground_is_an_error_that_names_the_place() {
    let mut scene = worlds::direct(0).scene;
    scene.ground.corners = [DVec3::ZERO; 3];
    let error = format!("{:#}", scene.image(1e-3).expect_err("no ground"));
    assert!(
        error.starts_with("at the film's point [") && error.ends_with("the ray meets no receiver"),
        "{error}"
    );
    scene.camera.field_of_view = f64::NAN;
    assert!(scene.image(1e-3).expect_err("no camera").to_string().contains("field of view"));
}

#[test]
fn cases_are_built_quickly_and_the_same_every_time() {
    for kind in DirectKind::ALL {
        for seed in 0..500 {
            let build = || format!("{:?}", DirectKnobs::random(seed, kind).build());
            assert_eq!(build(), build());
        }
    }
}
