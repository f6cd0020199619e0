//! Tests of derivatives under filters with negative lobes, pixel by pixel.

use glam::DVec3;
use rayon::prelude::*;

use super::{at, film, statistics};
use crate::Image;
use crate::geometry::Mesh;
use crate::gradient::film::filter::{integral, weight};
use crate::gradient::{EdgeSampling, Progress, Tangent, WarpedArea};
use crate::scene::{Camera, Description, Filter, Scene};

const SIDE: usize = 7;

/// A square emitter of radiance 2, at 8 pixels per unit of length, and the derivative of each pixel as it
/// moves to the right.
fn moving_square(filter: Filter) -> (Scene, Vec<f64>) {
    let half_angle = (SIDE as f64 / 64.0).atan();
    let camera = Camera::look_at(DVec3::new(0.0, 0.0, 4.0), DVec3::ZERO, DVec3::Y, 2.0 * half_angle);
    let mut d = Description::new(camera, film(SIDE, filter));
    let (x, y, half) = (0.1, -0.06, 0.15);
    d.integrator.max_depth = Some(1);
    d.add_emitter("square", Mesh::rectangle().transformed(&at(x, y, 0.0, half)), DVec3::splat(2.0));
    let exact = (0..SIDE * SIDE).map(|pixel| {
        let [column, row] = [pixel % SIDE, pixel / SIDE].map(|at| at as f64 + 0.5 - 0.5 * SIDE as f64);
        let (left, right) = (8.0 * (x - half) - column, 8.0 * (x + half) - column);
        let high = integral(filter, 8.0 * (-y - half) - row, 8.0 * (-y + half) - row);
        2.0 * 8.0 * (weight(filter, right) - weight(filter, left)) * high
    });
    let exact = exact.collect();
    (Scene::new(d).unwrap(), exact)
}

/// Largest deviation of the mean of gradient images, in standard errors, and the largest standard error.
fn worst(images: &[Image], exact: &[f64]) -> (f64, f64) {
    let off = exact.iter().enumerate().map(|(pixel, exact)| {
        let values: Vec<f64> = images.iter().map(|image| image.pixels[pixel].x).collect();
        let (mean, error) = statistics(&values);
        ((mean - exact).abs() / error.max(1e-12), error)
    });
    off.fold((0.0, 0.0), |(a, b), (c, d)| (f64::max(a, c), f64::max(b, d)))
}

/// A square whose derivative is known, by warped area and by edge sampling. The test detects a twentieth of
/// the largest derivative; the control is the derivative under a Gaussian, which resembles these filters.
#[test]
fn derivatives_under_negative_lobes() {
    const RUNS: u64 = 400;
    let none = Progress::none();
    let gaussian = moving_square(Filter::Gaussian { deviation: 0.5 }).1;
    for filter in [
        Filter::Cubic { b: 1.0 / 3.0, c: 1.0 / 3.0 },
        Filter::Cubic { b: 0.0, c: 0.5 },
        Filter::Lanczos { lobes: 3 },
    ] {
        let (scene, exact) = moving_square(filter);
        let mut change = Tangent::still(&scene);
        change.translate(&scene, 0, DVec3::X);
        let largest = exact.iter().fold(0.0_f64, |a, b| a.max(b.abs()));
        assert!(exact.iter().any(|x| *x < -0.02 * largest) && exact.iter().any(|x| *x > 0.02 * largest));
        let area = |seed| {
            let method = WarpedArea { samples: 32, seed, ..WarpedArea::default() };
            method.forward(&scene, &change, &none).unwrap().gradient
        };
        let edges = |seed| {
            let method = EdgeSampling { samples: 32, seed, ..EdgeSampling::default() };
            method.forward(&scene, &change, &none).unwrap().gradient
        };
        for (name, images) in [
            ("area", (0..RUNS).into_par_iter().map(area).collect::<Vec<_>>()),
            ("edges", (0..RUNS).into_par_iter().map(edges).collect()),
        ] {
            let ((off, error), (control, _)) = (worst(&images, &exact), worst(&images, &gaussian));
            println!(
                "{filter:?}, {name}: off by {off:.2} errors of at most {:.4} of the largest",
                error / largest
            );
            assert!(off < 5.5, "{filter:?}, {name}: {off}");
            assert!(5.5 * error < 0.05 * largest, "{filter:?}, {name}: {error} of {largest}");
            assert!(control > 11.0, "{filter:?}, {name}: the control is off by {control}");
        }
    }
}
