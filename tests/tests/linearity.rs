//! Forward and reverse mode are a linear map and its transpose, both forms of the area integral agree sample
//! by sample, and no result depends on the number of threads.

use flatland::estimator::{
    Construction, EdgeSampling, EstimatorError, Exact, FiniteDifference, Form, Method, Rotation, WarpedArea,
};
use flatland::plane::exact::ExactError;
use flatland::plane::{Film, Filter, Image};
use flatland::warp::{Debias, Warp};
use glam::DVec3;
use rayon::prelude::*;
use tests::effort::pick;
use tests::scenes::{self, Case, Kind};

/// Relative difference allowed between samples that are equal up to rounding.
const ROUNDING: f64 = 1e-12;

const MEAN: Construction = Construction::JumpMean { reach: 1.2 };
const SOFTENED: Construction = Construction::Softened { reach: 1.2, softness: 0.3 };

fn adjoint(film: &Film) -> Image {
    let value = |i: usize| {
        let t = i as f64;
        DVec3::new((3.1 * t).sin(), (1.7 * t).cos(), 0.5 - (0.9 * t).sin())
    };
    Image::from_pixels(film, (0..film.width() * film.height()).map(value).collect())
}

fn cases() -> Vec<Case> {
    let kinds = [Kind::Generic, Kind::TJunction, Kind::Sliver, Kind::GridAligned, Kind::Touching];
    kinds.into_iter().flat_map(|kind| (0..20).map(move |seed| scenes::random(seed, kind))).collect()
}

/// ⟨adjoint, J ṗ⟩ = ⟨Jᵀ adjoint, ṗ⟩, and the sum of absolute terms to which the difference is relative.
fn dot_test(method: &impl Method, case: &Case) -> Result<f64, EstimatorError> {
    let adjoint = adjoint(&case.film);
    let velocities = case.velocities();
    let reverse = method.reverse(&case.scene, &case.film, &adjoint)?;
    let forward = method.forward(&case.scene, &case.motion, &case.film)?;
    let terms = reverse.mean.iter().zip(&velocities).map(|(g, v)| g.dot(*v));
    let (dot, size) = terms.fold((0.0, 0.0), |(dot, size), t: f64| (dot + t, size + t.abs()));
    let pixels = adjoint.zip(&forward.mean, |a, m| (a * m).abs());
    let size = size + pixels.pixels().iter().map(|p| p.element_sum()).sum::<f64>();
    Ok((dot - adjoint.dot(&forward.mean)).abs() / size.max(f64::MIN_POSITIVE))
}

#[test]
fn reverse_is_the_transpose_of_forward() {
    let error = |case: Case| {
        let mut worst = 0.0_f64;
        let warps = [Warp::default(), Warp::original(6)];
        let mut errors: Vec<_> = warps
            .into_iter()
            .map(Construction::from)
            .chain([MEAN, SOFTENED])
            .map(|construction| {
                dot_test(&WarpedArea { samples: 20, construction, ..WarpedArea::default() }, &case)
            })
            .collect();
        errors.push(dot_test(&EdgeSampling { samples: 20, seed: 1 }, &case));
        errors.push(dot_test(&Rotation { samples: 20, ..Rotation::default() }, &case));
        match dot_test(&Exact, &case) {
            // In reverse mode every vertex moves alone, and coincident edges then have no derivative.
            Err(EstimatorError::Exact(ExactError::EdgesPart { .. } | ExactError::PixelEdge { .. })) => {}
            exact => errors.push(exact),
        }
        for error in errors {
            let error = error.unwrap_or_else(|e| panic!("{e}\n{}", case.label));
            assert!(error < ROUNDING, "off by {error:e} on {}", case.label);
            worst = worst.max(error);
        }
        worst
    };
    let worst = cases().into_par_iter().map(error).reduce(|| 0.0, f64::max);
    println!("worst relative difference {worst:.1e}");
}

#[test]
fn finite_differences_in_reverse_are_differences_of_every_vertex() {
    let case = scenes::random(3, Kind::Generic);
    let method = FiniteDifference { samples: 64, step: 1e-3, seed: 1 };
    let adjoint = adjoint(&case.film);
    let reverse = method.reverse(&case.scene, &case.film, &adjoint).expect("small steps");
    let motion = flatland::plane::Motion::vertex(0, 1, glam::DVec2::Y);
    let forward = method.forward(&case.scene, &motion, &case.film).expect("small steps");
    assert_eq!(reverse.mean[1].y, adjoint.dot(&forward.mean));
}

#[test]
fn both_forms_agree_sample_by_sample() {
    let mut worst = 0.0_f64;
    for case in cases() {
        for (seed, construction) in (0..4).map(|seed| (seed, Construction::default())).chain([(0, MEAN)]) {
            let area = WarpedArea { samples: 1, seed, construction, ..WarpedArea::default() };
            let reparameterised = WarpedArea { form: Form::Reparameterised, ..area };
            let [a, b] = [area, reparameterised]
                .map(|m| m.forward(&case.scene, &case.motion, &case.film).expect("valid").mean);
            for (a, b) in a.pixels().iter().zip(b.pixels()) {
                let error = (*a - *b).abs().max_element() / (1.0 + a.abs().max_element());
                assert!(error < ROUNDING, "{a} and {b}, off by {error:e} on {}", case.label);
                worst = worst.max(error);
            }
        }
    }
    println!("worst difference of a sample {worst:.1e}");
}

#[test]
fn the_same_bits_at_1_2_and_4_threads() {
    let case = scenes::random(5, Kind::Generic);
    let adjoint = adjoint(&case.film);
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
        pool.install(|| {
            let warped = WarpedArea { samples: 40, ..WarpedArea::default() };
            let edges = EdgeSampling { samples: 40, seed: 2 };
            let mut bits: Vec<u64> = vec![];
            let methods: [&dyn Method; 3] = [&warped, &edges, &Exact];
            for method in methods {
                let forward = method.forward(&case.scene, &case.motion, &case.film).expect("valid");
                let reverse = method.reverse(&case.scene, &case.film, &adjoint).expect("valid");
                let images = [forward.mean, forward.standard_error];
                let pixels = images.iter().flat_map(|i| i.pixels().iter().flat_map(DVec3::to_array));
                bits.extend(pixels.map(f64::to_bits));
                bits.extend(reverse.mean.iter().flat_map(glam::DVec2::to_array).map(f64::to_bits));
            }
            bits
        })
    };
    let one = run(1);
    assert_eq!(one, run(2));
    assert_eq!(one, run(4));
}

#[test]
fn bias_falls_with_the_number_of_auxiliary_rays() {
    use tests::statistics::regression_slope;
    // A rigid quadrilateral, one pixel, over three octaves of N'.
    let corners = [(0.3, -0.4), (2.5, 0.1), (2.1, 2.4), (-0.2, 1.9)];
    let polygon = flatland::plane::Polygon::simple(corners.map(|(x, y)| glam::DVec2::new(x, y)));
    let shape =
        flatland::plane::Shape::new(polygon.expect("simple"), flatland::plane::Shade::constant(DVec3::ONE));
    let scene = flatland::plane::Scene::new(DVec3::ZERO, vec![shape]).expect("a scene");
    let motion = flatland::plane::Motion::translate([0], glam::DVec2::new(1.0, 0.4));
    let film = Film::placed(1, 1, Filter::Tent, glam::DVec2::new(-0.3, 0.3), 1.0).expect("a film");
    let exact = Exact.forward(&scene, &motion, &film).expect("differentiable").mean.pixel(0, 0).x;
    for (name, of) in [
        ("original", Warp::original as fn(usize) -> Warp),
        ("default", |rays| Warp { debias: Debias::Consistent { rays }, ..Warp::default() }),
    ] {
        let rays = [4_usize, 8, 16, 32];
        let bias = rays.into_par_iter().map(|n| {
            let method = WarpedArea {
                samples: pick(150_000, 250_000),
                construction: of(n).into(),
                seed: 9,
                ..WarpedArea::default()
            };
            let g = method.forward(&scene, &motion, &film).expect("valid");
            let error = g.standard_error.pixel(0, 0).x / exact.abs();
            let bias = (1.0 - g.mean.pixel(0, 0).x / exact).abs();
            println!("{name}, N' = {n}: bias {:.2}% ± {:.2}%", 100.0 * bias, 100.0 * error);
            bias
        });
        let bias: Vec<f64> = bias.collect();
        let [x, y] = [rays.map(|n| (n as f64).ln()).to_vec(), bias.iter().map(|b| b.ln()).collect()];
        let rate = regression_slope(&x, &y);
        println!("{name}: bias falls as N'^{rate:.2}");
        assert!(bias.windows(2).all(|w| w[1] < w[0]), "{name}: {bias:?}");
        assert!(rate < -0.8, "{name}: N'^{rate}");
    }
}
