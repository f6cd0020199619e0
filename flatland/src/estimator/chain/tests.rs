//! Warped-area sampling of chains against exact derivatives.

use glam::DVec2;

use super::*;
use crate::chain::{ChainTerms, Curve, Exact, Light, Optics, Surface};
use crate::plane::Filter;
use crate::transport::Film;

/// Samples per pixel, and the relative bias that they reveal in every case.
const SAMPLES: usize = 20_000;
const VISIBLE: f64 = 0.25;

/// Standard errors beyond which a slope is rejected: by chance in 1 of 2·10⁶.
const LIMIT: f64 = 5.0;

fn camera(filter: Filter) -> Camera {
    Camera {
        position: DVec2::new(0.013, -1.0),
        angle: std::f64::consts::FRAC_PI_2,
        field_of_view: 0.9,
        film: Film { pixels: 6, filter },
    }
}

struct Case {
    name: &'static str,
    world: World,
    rates: Vec<f64>,
    /// Mistakes that the case must reveal.
    faults: Vec<Fault>,
}

/// Rates that translate surfaces and turn the camera.
fn rates(world: &World, moving: &[(usize, DVec2)], camera: [f64; 4]) -> Vec<f64> {
    let mut rates = vec![0.0; world.count()];
    for &(surface, v) in moving {
        let first = world.first_of_surface(surface);
        rates[first..first + 2].copy_from_slice(&v.to_array());
        if matches!(world.surfaces()[surface].curve, Curve::Segment(_)) {
            rates[first + 2..first + 4].copy_from_slice(&v.to_array());
        }
    }
    rates.extend(camera);
    rates
}

fn surface(curve: Curve, optics: Optics) -> Surface {
    Surface { curve, optics }
}

fn segment(a: [f64; 2], b: [f64; 2]) -> Curve {
    Curve::segment(a.into(), b.into())
}

fn cases() -> Vec<Case> {
    let emitter = surface(segment([-1.0, -2.0], [0.3, -2.0]), Optics::emitter([1.0, 1.8]));
    let mirror = Optics::Mirror { reflectance: 0.4 };
    let mut cases = vec![];
    let mut push = |name, surfaces: Vec<Surface>, lights, moving: &[(usize, DVec2)], faults: &[Fault]| {
        let world = World::new(0.5, surfaces, lights).expect("a world");
        let rates = rates(&world, moving, [0.0; 4]);
        cases.push(Case { name, world, rates, faults: faults.to_vec() });
    };
    use Fault::{FirstAlone, LastAlone, NoShadows, NoWarp, OneWeight};
    let curved = vec![surface(Curve::arc(DVec2::new(0.0, 4.0), 1.0, -2.0, 0.9), mirror), emitter];
    let flat = vec![surface(segment([-0.6, 2.0], [0.5, 2.2]), mirror), emitter];
    let aside = DVec2::new(0.7, 0.0);
    push("an emitter moves in a curved mirror", curved.clone(), vec![], &[(1, aside)], &[NoWarp, FirstAlone]);
    push("a curved mirror moves", curved, vec![], &[(0, -aside)], &[NoWarp, LastAlone, OneWeight]);
    push("an emitter moves in a flat mirror", flat.clone(), vec![], &[(1, aside)], &[NoWarp, FirstAlone]);
    push("a flat mirror moves", flat, vec![], &[(0, aside)], &[NoWarp, LastAlone, OneWeight]);
    push(
        "an emitter in glass",
        vec![
            surface(Curve::arc(DVec2::new(0.0, 3.2), 1.2, -2.4, 1.7), Optics::Glass { index: 1.0 / 1.5 }),
            surface(segment([-0.2, 4.0], [0.5, 4.1]), Optics::emitter([1.0, 2.0])),
        ],
        vec![],
        &[(0, DVec2::new(0.2, 0.1)), (1, DVec2::new(-0.3, 0.0))],
        &[NoWarp, FirstAlone],
    );
    push(
        "an emitter behind a lens",
        vec![
            surface(Curve::arc(DVec2::new(0.0, 1.0), 1.2, 1.0, 1.1), Optics::Glass { index: 1.0 / 1.5 }),
            surface(Curve::arc(DVec2::new(0.0, 2.8), 1.2, -2.1, 1.1), Optics::Glass { index: 1.0 / 1.5 }),
            surface(segment([-0.5, 2.8], [0.3, 2.8]), Optics::emitter([1.0, 2.0])),
        ],
        vec![],
        &[(0, DVec2::new(0.2, 0.1)), (1, DVec2::new(0.2, 0.1)), (2, DVec2::new(-0.3, 0.0))],
        &[NoWarp],
    );
    push(
        "an emitter behind an opening",
        vec![
            surface(
                segment([-0.6, 1.0], [0.3, 1.3]),
                Optics::Diffuse { reflectance: 0.0, emission: [0.4, 0.2], opacity: 0.4 },
            ),
            surface(segment([-0.2, 2.0], [1.2, 2.0]), Optics::emitter([1.0, 2.0])),
        ],
        vec![],
        &[(0, DVec2::new(0.3, 0.1)), (1, DVec2::new(-0.3, 0.0))],
        &[NoWarp, FirstAlone],
    );
    push(
        "a shadow of a light in a point",
        vec![
            surface(segment([-1.5, 3.0], [1.5, 2.8]), Optics::diffuse(0.8)),
            surface(segment([0.6, 1.2], [0.9, 1.5]), Optics::diffuse(0.5)),
        ],
        vec![Light::point(DVec2::new(1.4, -0.4), 3.0)],
        &[(1, DVec2::new(0.3, 0.1))],
        &[NoWarp, NoShadows],
    );
    push(
        "a shadow in a mirror",
        vec![
            surface(segment([-0.8, 2.0], [0.9, 2.3]), mirror),
            surface(segment([-1.5, -2.0], [1.5, -2.0]), Optics::diffuse(0.8)),
            surface(Curve::arc(DVec2::new(-0.9, -0.9), 0.2, 0.0, -6.0), Optics::diffuse(0.5)),
        ],
        vec![Light::Directional { angle: 2.0, irradiance: 2.0 }],
        &[(2, DVec2::new(0.4, 0.1))],
        &[NoWarp, NoShadows],
    );
    cases
}

#[test]
fn exact_derivatives_are_those_of_central_differences() {
    for filter in [Filter::Tent, Filter::Box] {
        let camera = camera(filter);
        for case in cases() {
            let exact = Exact::default().image(&case.world, &camera, &case.rates).expect("an image");
            let h = 1e-4;
            let [plus, minus] = [h, -h].map(|h| {
                let numbers: Vec<f64> =
                    case.world.numbers().iter().zip(&case.rates).map(|(n, r)| n + h * r).collect();
                let world = case.world.with(&numbers).expect("a world");
                Exact::default().image(&world, &camera, &case.rates).expect("an image").image
            });
            let size = exact.derivative.iter().map(|d| d.total().abs()).fold(0.0, f64::max);
            for (i, found) in exact.derivative.iter().enumerate() {
                let expected = (plus[i] - minus[i]) / (2.0 * h);
                let difference = (found.total() - expected).abs();
                assert!(difference < 1e-6 * size, "{} {filter:?}, pixel {i}: {found:?}", case.name);
            }
        }
    }
}

/// The slope of an estimate along the exact derivative d, Σ d·estimate/Σ d·d, which is 1, and its standard
/// error.
fn slope(case: &Case, filter: Filter, fault: Option<Fault>, samples: usize) -> [f64; 2] {
    let camera = camera(filter);
    let exact = Exact::default().image(&case.world, &camera, &case.rates).expect("an image");
    let method = WarpedArea { samples, fault, seed: 7, ..WarpedArea::default() };
    let estimate = method.forward(&case.world, &camera, &case.rates).expect("an estimate");
    assert!(estimate.non_finite.is_empty());
    let exact: Vec<f64> = exact.derivative.iter().map(ChainTerms::total).collect();
    let size: f64 = exact.iter().map(|d| d * d).sum();
    let along: f64 = exact.iter().zip(&estimate.mean).map(|(d, e)| d * e).sum();
    let variance: f64 = exact.iter().zip(&estimate.standard_error).map(|(d, e)| (d * e).powi(2)).sum();
    let [slope, error] = [along / size, variance.sqrt() / size];
    println!("{} {filter:?} {fault:?}: slope {slope:.4} ± {error:.4}", case.name);
    [slope, error]
}

#[test]
fn warped_area_is_unbiased() {
    for case in cases() {
        // The ends of a box filter are a term of their own.
        let is_boxed = ["a flat mirror moves", "a shadow of a light in a point"].contains(&case.name);
        let filters = [Filter::Tent, Filter::Box];
        for filter in &filters[..1 + usize::from(is_boxed)] {
            let [slope, error] = slope(&case, *filter, None, SAMPLES);
            assert!((slope - 1.0).abs() < LIMIT * error, "{} {filter:?}", case.name);
            assert!(LIMIT * error < VISIBLE, "{} {filter:?}: no power", case.name);
        }
    }
}

#[test]
fn mistakes_are_revealed() {
    for case in cases() {
        for &fault in &case.faults {
            let [slope, error] = slope(&case, Filter::Tent, Some(fault), SAMPLES);
            assert!((slope - 1.0).abs() > LIMIT * error, "{} {fault:?}", case.name);
        }
    }
}

#[test]
fn reverse_is_the_transpose_of_forward() {
    let camera = camera(Filter::Box);
    for case in cases() {
        let method = WarpedArea { samples: 16, ..WarpedArea::default() };
        let adjoint: Vec<f64> = (0..camera.film.pixels).map(|i| (i as f64 * 0.8).cos()).collect();
        let rates: Vec<f64> = (0..case.rates.len()).map(|i| (i as f64 * 1.3).sin()).collect();
        let forward = method.forward(&case.world, &camera, &rates).expect("an estimate").mean;
        let reverse = method.reverse(&case.world, &camera, &adjoint).expect("an estimate").mean;
        let along: f64 = forward.iter().zip(&adjoint).map(|(a, b)| a * b).sum();
        let back: f64 = reverse.iter().zip(&rates).map(|(a, b)| a * b).sum();
        assert!((along - back).abs() < 1e-9 * along.abs().max(1.0), "{}: {along} {back}", case.name);
    }
}

/// Chains of no points are black, and no parameter leads to a panic.
#[test]
fn no_points_are_black() {
    let camera = camera(Filter::Box);
    for case in cases() {
        let method = WarpedArea { samples: 2, longest: 0, ..WarpedArea::default() };
        let estimate = method.forward(&case.world, &camera, &case.rates).expect("an estimate");
        assert!(estimate.mean.iter().all(|&d| d == 0.0), "{}", case.name);
    }
}
