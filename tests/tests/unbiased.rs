//! Unbiasedness of every method that claims it, with the controls that must be rejected on the same
//! scenes (theory, section 11).
//!
//! The false-alarm rate is 10⁻⁶ for the whole suite: below 16 methods, at most 288 scenes and one
//! slope each, and what other files compare. Seeds are fixed.

use std::sync::LazyLock;

use flatland::estimator::{AreaIntegral, EdgeSampling, Form, GradientImage, Method, Rotation, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::plane::fields::DirectField;
use flatland::plane::{Film, Filter, Image, Motion, Polygon, Scene, Shade, Shape};
use flatland::warp::{AuxiliaryPoints, BoundaryFunction, Debias, Warp, Weighting};
use glam::{DVec2, DVec3};
use tests::campaign::{Estimate, Known, Verdict, known};
use tests::scenes::{Case, Kind};
use tests::statistics::suite_threshold as limit;

/// Kinds on which the Monte Carlo methods are tested. On nearly coincident edges that part, the
/// derivative exists only within their gap; the exact tests cover them.
const KINDS: [Kind; 12] = [
    Kind::Generic,
    Kind::CoincidentTogether,
    Kind::CoincidentHidden,
    Kind::SharedVertex,
    Kind::TJunction,
    Kind::Touching,
    Kind::EdgeThroughCorner,
    Kind::VertexOnCorner,
    Kind::GridAligned,
    Kind::Sliver,
    Kind::NestedCopies,
    Kind::FilledHole,
];

/// At least 200 scenes.
static KNOWN: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let known = known(&KINDS, 24);
    assert!(known.len() >= 200, "{} scenes", known.len());
    known
});

fn verdict(name: &str, estimate: impl Fn(&Known, u64) -> Estimate + Sync) -> Verdict {
    let v = Verdict::of(&KNOWN, estimate);
    println!(
        "{name}: {} scenes, worst |z| {:.2} (limit {:.2}), rms z {:.3}, slope {:.4} ± {:.4}; {}",
        v.count,
        v.worst,
        limit(),
        v.spread,
        v.slope,
        v.slope_error,
        v.worst_label
    );
    v
}

fn accept<M: Method>(name: &str, method: impl Fn(u64) -> M + Sync) {
    let v = verdict(name, |k, seed| k.run(&method(seed)));
    assert!(v.passes(limit()), "{name} is biased: {v:?}");
    // A test that could see no bias would prove nothing: one of 35% must not pass.
    assert!(limit() * v.slope_error < 0.35, "{name}: {v:?}");
}

fn reject(name: &str, estimate: impl Fn(&Known, u64) -> Estimate + Sync) {
    let v = verdict(name, estimate);
    assert!(!v.passes(limit()), "the control {name} was not rejected: {v:?}");
}

/// A pixel, in each of two halves.
const SAMPLES: usize = 256;

fn warped(warp: Warp, seed: u64) -> WarpedArea {
    WarpedArea { samples: SAMPLES, warp, seed, ..WarpedArea::default() }
}

#[test]
fn warped_area_with_multilevel_debiasing() {
    accept("warped area, default", |seed| warped(Warp::default(), seed));
}

/// One pixel on a corner of a rigid quadrilateral, and many samples: a bias of one percent would
/// show.
#[test]
fn warped_area_in_depth() {
    let corners = [(0.3, -0.4), (2.5, 0.1), (2.1, 2.4), (-0.2, 1.9)].map(|(x, y)| DVec2::new(x, y));
    let quad = Shape::new(Polygon::simple(corners).expect("simple"), Shade::constant(DVec3::ONE));
    let scene = Scene::new(DVec3::ZERO, vec![quad]).expect("a scene");
    let deep: Vec<Known> = [Filter::Box, Filter::Tent, Filter::Gaussian]
        .into_iter()
        .map(|filter| {
            let film = Film::placed(1, 1, filter, DVec2::new(-0.3, 0.3), 1.0).expect("a film");
            let motion = Motion::translate([0], DVec2::new(1.0, 0.4));
            Known::new(Case { scene: scene.clone(), motion, film, label: format!("{filter:?}") })
        })
        .collect();
    let method = |seed| WarpedArea { samples: 200_000, ..warped(Warp::default(), seed) };
    let v = Verdict::of(&deep, |k, seed| k.run(&method(seed)));
    println!("in depth: worst |z| {:.2}, slope {:.4} ± {:.4}", v.worst, v.slope, v.slope_error);
    assert!(v.passes(limit()) && v.slope_error < 0.01, "{v:?}");
}

#[test]
fn warped_area_at_other_concentrations() {
    for kappa in [10.0, 400.0] {
        accept(&format!("warped area, κ = {kappa}"), |seed| WarpedArea {
            kappa,
            ..warped(Warp::default(), seed)
        });
    }
}

#[test]
fn warped_area_with_every_pattern_of_points() {
    for points in [AuxiliaryPoints::Independent, AuxiliaryPoints::Stratified] {
        accept(&format!("warped area, {points:?}"), |seed| warped(Warp { points, ..Warp::default() }, seed));
    }
}

#[test]
fn warped_area_with_the_original_weight_debiased() {
    let debias = Debias::Multilevel { rays: 8, first: 0.5, ratio: 0.4 };
    accept("warped area, γ = 3, linear B", |seed| warped(Warp { debias, ..Warp::original(8) }, seed));
}

#[test]
fn warped_area_with_russian_roulette() {
    let debias = Debias::RussianRoulette { rays: 4, tail: 1.5 };
    // Its variance is infinite: its slope is known less well.
    let v = verdict("warped area, Russian roulette", |k, seed| {
        k.run(&warped(Warp { debias, ..Warp::default() }, seed))
    });
    assert!(v.passes(limit()) && v.slope_error < 0.15, "{v:?}");
}

#[test]
fn edge_sampling() {
    // It takes no scenes whose visible edges coincide.
    let apart: Vec<Known> = known(
        &[
            Kind::Generic,
            Kind::TJunction,
            Kind::SharedVertex,
            Kind::Touching,
            Kind::VertexOnCorner,
            Kind::Sliver,
        ],
        48,
    );
    assert!(apart.len() >= 200, "{} scenes", apart.len());
    let v = Verdict::of(&apart, |k, seed| k.run(&EdgeSampling { samples: SAMPLES, seed }));
    println!("edge sampling: worst |z| {:.2}, slope {:.4} ± {:.4}", v.worst, v.slope, v.slope_error);
    assert!(v.passes(limit()) && v.slope_error < 0.01, "{v:?}");
}

/// The area integral of a field that the arrangement knows.
fn with_field(
    k: &Known,
    integral: impl Fn(&Arrangement<'_>, &Scene, &[DVec2], &Film) -> GradientImage,
) -> Estimate {
    k.run_with(|scene: &Scene, motion: &Motion, film: &Film| {
        let velocities = motion.velocities(scene).expect("the motion fits");
        let arrangement = Arrangement::new(scene, film).expect("an arrangement");
        integral(&arrangement, scene, &velocities, film)
    })
}

fn integral(seed: u64) -> AreaIntegral {
    AreaIntegral { samples: SAMPLES, form: Form::Area, control_variate: true, seed }
}

#[test]
fn the_oracle_field() {
    let v = verdict("oracle field", |k, seed| {
        with_field(k, |a, scene, v, film| integral(seed).forward(scene, v, film, &a.oracle(v)))
    });
    assert!(v.passes(limit()) && v.slope_error < 0.05, "{v:?}");
}

#[test]
fn the_harmonic_field() {
    let v = verdict("harmonic field", |k, seed| {
        with_field(k, |a, scene, v, film| {
            integral(seed).forward(scene, v, film, &a.harmonic(v, 1e-7 * film.pixel()))
        })
    });
    assert!(v.passes(limit()) && v.slope_error < 0.05, "{v:?}");
}

#[test]
fn controls_are_rejected() {
    // Controls without noise of their own are given that of the method under test.
    reject("zero", |k, seed| Estimate { mean: 0.0, ..k.run(&warped(Warp::default(), seed)) });
    reject("sign flipped", |k, seed| {
        let e = k.run(&warped(Warp::default(), seed));
        Estimate { mean: -e.mean, ..e }
    });
    reject("interior only", |k, seed| {
        let noise = k.run(&warped(Warp::default(), seed));
        let interior = k.run_with(|scene, motion, film| {
            let velocities = motion.velocities(scene).expect("the motion fits");
            let arrangement = Arrangement::new(scene, film).expect("an arrangement");
            GradientImage {
                mean: arrangement.interior(film, &velocities).expect("velocities fit"),
                standard_error: Image::zero(film),
                rays: 0,
                non_finite: 0,
            }
        });
        Estimate { mean: interior.mean, ..noise }
    });
    let gaussian = Warp {
        weighting: Weighting::Gaussian,
        debias: Debias::Consistent { rays: 16 },
        focus: 1.0,
        ..Warp::default()
    };
    reject("Gaussian weights", |k, seed| k.run(&warped(gaussian, seed)));
    reject("direct field", |k, seed| {
        with_field(k, |_, scene, velocities, film| {
            let integral = AreaIntegral { control_variate: false, ..integral(seed) };
            integral.forward(scene, velocities, film, &DirectField { scene, velocities })
        })
    });
    // γ below 1/p + 1/2: no debiasing mends a field that is not boundary consistent.
    let boundary = BoundaryFunction::KernelScaled { scale: 0.6 };
    let weighting = Weighting::BoundaryAware { gamma: 0.75, boundary };
    reject("γ below its bound", |k, seed| k.run(&warped(Warp { weighting, ..Warp::default() }, seed)));
    reject("rotation", |k, seed| k.run(&Rotation { samples: SAMPLES, seed, ..Rotation::default() }));
    reject("4 auxiliary rays, taken as they are", |k, seed| k.run(&warped(Warp::original(4), seed)));
}
