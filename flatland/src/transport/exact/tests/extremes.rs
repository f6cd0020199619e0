//! Tests of the cases most prone to cancellation: tiny emitters, grazing light, nearby walls, narrow lobes.

use super::super::{Exact, Surface, SurfaceMotion};
use super::*;
use crate::quadrature::adaptive;

fn floor(material: Material) -> Shape {
    Shape::open([DVec2::new(-1.0, 0.0), DVec2::new(1.0, 0.0)], material)
}

fn lamp(from: f64, to: f64, height: f64, emission: f64) -> Shape {
    Shape::open([DVec2::new(from, height), DVec2::new(to, height)], Material::emitter(emission))
}

fn relative(found: f64, expected: f64) -> f64 {
    (found / expected - 1.0).abs()
}

#[test]
fn an_emitter_of_length_1e_12() {
    let world = World::new(0.0, vec![floor(Material::diffuse(0.5)), lamp(-5e-13, 5e-13, 2.0, 1e12)]);
    let world = world.expect("a world");
    for s in [0.0, 0.2, 0.5, 0.9] {
        let x = 2.0 * s - 1.0;
        // A point source of intensity 1: cos²/r.
        let r = f64::hypot(x, 2.0);
        let expected = 4.0 / r.powi(3);
        let surface = Surface::new(&world, 0, s, DVec2::Y);
        assert!(relative(surface.irradiance(), expected) < 1e-14, "{s}");
        // The derivative is the difference of two numbers of size 10¹², each known to 16 digits.
        let change = Tangent::translate(&world, [1], DVec2::X);
        let rate = surface.rate(&change, &SurfaceMotion::default());
        let expected = 0.25 * 3.0 * 4.0 * x / r.powi(5);
        assert!((rate.boundary - expected).abs() < 1e-15 * rate.magnitude, "{rate:?} {expected}");
    }
}

#[test]
fn light_that_grazes() {
    for height in [1e-3, 1e-6, 1e-9] {
        let world = World::new(0.0, vec![floor(Material::diffuse(1.0)), lamp(1.5, 2.5, height, 1.0)]);
        let world = world.expect("a world");
        let found = Surface::new(&world, 0, 0.75, DVec2::Y).irradiance();
        // sin − sin = (cos² − cos²)/(sin + sin).
        let [a, b] = [1.0, 2.0].map(|d| (height / f64::hypot(d, height), d / f64::hypot(d, height)));
        let expected = (a.0 + b.0) * (a.0 - b.0) / (a.1 + b.1);
        assert!(relative(found, expected) < 1e-13, "{height} {found} {expected}");
    }
}

#[test]
fn a_camera_near_a_wall() {
    let world = World::new(0.0, vec![floor(Material::diffuse(0.5)), lamp(-0.5, 0.5, 2.0, 3.0)]);
    let world = world.expect("a world");
    let film = Film { pixels: 1, filter: Filter::Box };
    for height in [1e-3, 1e-6, 1e-9] {
        let position = DVec2::new(0.0, height);
        let camera = Camera { position, angle: -0.2, field_of_view: 0.5, film };
        let image = Exact::default().image(&world, &camera).expect("an image");
        // In y = ln tan of the angle below the horizon.
        let radiance = |x: f64| {
            let sine = |a: f64| (a - x) / f64::hypot(a - x, 2.0);
            0.25 * 3.0 * (sine(0.5) - sine(-0.5))
        };
        let integrand = |y: f64| {
            let slope = y.exp();
            let below = slope.atan();
            // du/dψ = 1/(2T) / cos²(ψ − axis), dψ/dy = slope/(1 + slope²).
            let turned = 0.5 / camera.half_width() / (0.2 - below).cos().powi(2);
            let value = radiance(height / slope) * turned * slope / (1.0 + slope * slope);
            ([value], value)
        };
        let ends = [height.ln(), 0.45_f64.tan().ln()];
        let pieces: Vec<[f64; 2]> = (0..20)
            .map(|k| [k, k + 1].map(|k| ends[0] + (ends[1] - ends[0]) * f64::from(k) / 20.0))
            .collect();
        let expected = adaptive(&pieces, integrand, 1e-13).value[0];
        assert!(relative(image.pixels[0], expected) < 1e-10, "{height} {image:?} {expected}");
    }
}

#[test]
fn a_lobe_as_narrow_as_a_mirror() {
    let camera = Camera {
        position: DVec2::new(-0.8, 1.1),
        angle: -1.0,
        field_of_view: 0.8,
        film: Film { pixels: 4, filter: Filter::Tent },
    };
    let strength = 0.7;
    for width in [1e-3, 1e-4, 1e-5, 1e-6] {
        let world = World::new(0.0, vec![floor(Material::glossy(strength, width)), lamp(0.2, 0.6, 1.3, 2.0)]);
        let world = world.expect("a world");
        let change = Tangent::translate(&world, [1], DVec2::new(1.0, 0.5));
        let gradient = Exact::default().gradient(&world, &camera, &change).expect("a gradient");
        // In the limit, the lamp's mirror image is seen through the floor.
        let ends = [(0.2, -1.0), (0.6, 1.0)].map(|(x, sign)| {
            let image = DVec2::new(x, -1.3);
            let u = camera.project(image).expect("in front");
            let rate = camera.film_rate(u, image.distance(camera.position)).0.dot(DVec2::new(1.0, -0.5));
            // ∫ g cos φ: the lobe's weight is cos φ of the mirror direction.
            let cosine = -camera.direction(u).y;
            (u, sign * strength * cosine * 2.0 * rate)
        });
        for p in 0..4 {
            let expected: f64 = ends.iter().map(|(u, step)| camera.film.filter_value(p, *u) * step).sum();
            let found = gradient.pixels[p].secondary + gradient.pixels[p].interior;
            // The tails of the lobe contribute some w ln(1/w).
            assert!((found - expected).abs() < 100.0 * width, "{width} {p}: {found} {expected}");
            assert!(
                gradient.errors[p] <= 2e-11 * gradient.scales[p],
                "{width} {p}: {:e}",
                gradient.errors[p]
            );
        }
    }
}

#[test]
fn many_segments() {
    let mut rng = stream(9, &[]);
    let world = random_world(&mut rng, 18, true);
    let camera = random_camera(&mut rng, Filter::Tent);
    let camera = Camera { film: Film { pixels: 64, filter: Filter::Tent }, ..camera };
    let change = random_vertices(&mut rng, &world);
    let begin = std::time::Instant::now();
    let image = Exact::default().image(&world, &camera).expect("an image");
    let between = std::time::Instant::now();
    let gradient = Exact::default().gradient(&world, &camera, &change).expect("a gradient");
    println!(
        "{} segments: image {:?}, gradient {:?}",
        world.segments().len(),
        between - begin,
        between.elapsed()
    );
    assert!(image.errors.iter().zip(&image.scales).all(|(e, s)| *e <= 1e-10 * s));
    assert!(gradient.errors.iter().zip(&gradient.scales).all(|(e, s)| *e <= 1e-10 * s));
}
