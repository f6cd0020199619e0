//! Unbiasedness of primary visibility: meshes of constant radiance before a moving camera, against
//! the exact derivative of their coverage, with the controls that must be rejected on the same scenes.
//!
//! Films have all three filters, borders that silhouettes cross, and in every fourth scene a crop
//! window. Seeds are fixed, and the false-alarm rate is that of the whole suite.

use std::sync::LazyLock;

use flatland::warp::{Adaptive, AuxiliaryPoints, Debias, Warp, Weighting};
use glam::DVec3;
use tests::campaign::Estimate;
use tests::space::campaign::{Known, REPETITIONS, accept, coverage, passes, pulled, reject, verdict};
use tests::space::worlds::CoverageKind;
use tests::statistics::{Moments, suite_threshold};
use volume3d::Kernels;
use volume3d::gradient::{EdgeSampling, Field, Progress, Wanted, WarpedArea};

/// Nothing degenerate about them.
static GENERIC: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let known = coverage(&CoverageKind::GENERIC, 36);
    assert!(known.len() >= 160, "{} scenes", known.len());
    known
});

/// Worlds a million times smaller, larger or farther from the origin.
static FAR: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let known = coverage(&[CoverageKind::Small, CoverageKind::Large, CoverageKind::FarFromOrigin], 18);
    assert!(known.len() >= 50, "{} scenes", known.len());
    known
});

/// Samples a pixel in each of [`REPETITIONS`] runs: one in each of a run's groups.
const SAMPLES: usize = 8;

fn warped() -> WarpedArea {
    WarpedArea { samples: SAMPLES, ..WarpedArea::default() }
}

fn with(warp: Warp) -> WarpedArea {
    WarpedArea { field: Field::AuxiliaryRays, warp, ..warped() }
}

/// The velocity of what is seen, as it is, and its divergence: a pair of auxiliary rays so close that it sees what the
/// sample sees. With δ of variance 1/κ, E[κ δ·(V(u + δ) − V(u − δ))/2] is ∇·V wherever V is smooth, and of the pairs that
/// straddle a silhouette there are too few to find one.
fn direct() -> WarpedArea {
    // Apart by 10⁻⁸ pixels: 10⁵ times what rounding moves a film point by, and a sample in 10⁷ may straddle.
    let kernels = Kernels { film: 1e16, ..Kernels::default() };
    let debias = Debias::Consistent { rays: 2 };
    let points = AuxiliaryPoints::Antithetic;
    let pair = Warp { weighting: Weighting::Gaussian, points, focus: 1.0, debias, ..Warp::default() };
    // What is subtracted integrates to nothing only if V is continuous.
    WarpedArea { kernels, baseline: 0, ..with(pair) }
}

#[test]
fn warped_area_is_unbiased() {
    accept("warped area", &GENERIC, &warped());
}

#[test]
fn worlds_of_all_sizes_are_as_good() {
    accept("small, large and far", &FAR, &warped());
}

#[test]
fn other_warps_are_unbiased() {
    let some = &coverage(&CoverageKind::GENERIC, 16);
    let warp = WarpedArea::default().warp;
    let points = AuxiliaryPoints::Stratified;
    accept("stratified points", some, &with(Warp { points, ..warp }));
    accept("adaptive rays", some, &with(Warp { adaptive: Some(Adaptive::default()), ..warp }));
}

/// Without the image that is subtracted, samples are so noisy that only zero, or half, can be told apart.
#[test]
fn the_baseline_is_not_needed() {
    let some = &coverage(&CoverageKind::GENERIC, 16);
    let method = WarpedArea { baseline: 0, ..warped() };
    let v = verdict("no baseline", some, |k, half| k.estimate(half, &method));
    assert!(passes(&v) && suite_threshold() * v.slope_error < 0.8, "{v:?}");
}

#[test]
fn edge_sampling_is_unbiased() {
    let v = verdict("edge sampling", &GENERIC, |k, half| {
        k.repeated(half, |seed| {
            let method = EdgeSampling { samples: 2, primary: 16, secondary: 1, seed };
            let found = method.forward(&k.scene, &k.change, &Progress::none());
            k.weighted(&found.unwrap_or_else(|e| panic!("{e}\n{}", k.label)).gradient)
        })
    });
    assert!(passes(&v) && suite_threshold() * v.slope_error < 0.05, "{v:?}");
}

/// Russian roulette has infinite variance: no single scene's error is normal, and what is tested is the
/// regression over all of them.
#[test]
fn russian_roulette_is_unbiased() {
    let debias = Debias::RussianRoulette { rays: 8, tail: 1.5 };
    let method = with(Warp { debias, ..Warp::default() });
    let v = verdict("Russian roulette", &GENERIC, |k, half| k.estimate(half, &method));
    assert!(v.slope_z().abs() < suite_threshold() && suite_threshold() * v.slope_error < 0.3, "{v:?}");
}

/// What is thinner than samples are apart is found by few of them: how much of it, is said.
#[test]
fn slivers_and_grazing_triangles() {
    for kind in [CoverageKind::Sliver, CoverageKind::Grazing] {
        let known = coverage(&[kind], 24);
        let v = verdict(&format!("{kind:?}"), &known, |k, half| k.estimate(half, &warped()));
        println!("{kind:?}: finds {:.1}% ± {:.1}%", 100.0 * v.slope, 100.0 * v.slope_error);
        assert!(v.slope_z().abs() < suite_threshold(), "{v:?}");
    }
}

/// The same numbers, forwards and backwards, for all kinds and all parameters at once.
#[test]
fn reverse_mode_is_the_transpose() {
    transposes(false);
}

/// The same with the reflectance of black surfaces, behind which forward mode need not look.
#[test]
fn reverse_mode_is_the_transpose_with_materials() {
    transposes(true);
}

fn transposes(materials: bool) {
    let mut worst = 0.0_f64;
    for k in GENERIC.iter().step_by(3).chain(FAR.iter().step_by(3)) {
        let method = WarpedArea { samples: 2, seed: 11, ..WarpedArea::default() };
        let image = k.run(&method);
        let forward = k.weighted(&image.gradient);
        let scale: f64 =
            k.weights.iter().zip(&image.gradient).map(|(w, g)| (*w * *g).abs().element_sum()).sum();
        let materials = vec![materials; k.scene.description().materials.len()];
        let wanted = Wanted { materials, ..Wanted::everything(&k.scene) };
        let reverse =
            pulled(method.reverse(&k.scene, &k.weights, &wanted, &Progress::none()).expect("valid"));
        // Sums over parameters may cancel: rounding is measured against their absolute values.
        let error = (reverse.dot(&k.change) - forward).abs() / scale.max(magnitude(&reverse, &k.change));
        assert!(error < 1e-9, "{forward} {} {}", reverse.dot(&k.change), k.label);
        worst = worst.max(error);
    }
    println!("forward against reverse: worst {worst:.1e}");
}

/// Σ |gradient · rate| over positions and camera.
fn magnitude(gradient: &volume3d::gradient::Change, change: &volume3d::gradient::Change) -> f64 {
    let positions = gradient.positions.iter().zip(&change.positions);
    let camera = [
        (gradient.camera.translation, change.camera.translation),
        (gradient.camera.rotation, change.camera.rotation),
        (DVec3::splat(gradient.camera.field_of_view), DVec3::splat(change.camera.field_of_view) / 3.0),
    ];
    positions.map(|(g, r)| (*g * *r).abs().element_sum()).sum::<f64>()
        + camera.iter().map(|(g, r)| (*g * *r).abs().element_sum()).sum::<f64>()
}

/// The standard error that a gradient image states for each pixel is, in the mean, what repetitions show.
#[test]
fn stated_standard_errors_are_what_repetitions_show() {
    let mut ratios = Moments::new();
    for k in GENERIC.iter().step_by(8) {
        let runs: Vec<_> = (0..REPETITIONS)
            .map(|seed| k.run(&WarpedArea { samples: 32, seed, ..WarpedArea::default() }))
            .collect();
        let (mut stated, mut shown) = (0.0, 0.0);
        for i in 0..k.weights.len() {
            let spread: Moments = runs.iter().map(|r| r.gradient[i].y).collect();
            shown += spread.variance();
            stated += runs.iter().map(|r| r.standard_error[i].y.powi(2)).sum::<f64>() / runs.len() as f64;
        }
        ratios.push((stated / shown).ln());
    }
    println!("ln(stated/shown variance): {:.3} ± {:.3}", ratios.mean(), ratios.standard_error());
    assert!(ratios.mean().abs() < 5.0 * ratios.standard_error() && ratios.standard_error() < 0.15);
}

/// Where the camera turns or zooms all that is seen moves alike, and velocities jump nowhere: the control that is
/// rejected below fails for its silhouettes alone.
#[test]
fn the_direct_field_is_unbiased_where_nothing_passes_before_anything() {
    let known = coverage(&CoverageKind::GENERIC, 48);
    let turns = |k: &Known| {
        k.change.positions.iter().all(|v| *v == DVec3::ZERO) && k.change.camera.translation == DVec3::ZERO
    };
    let turning: Vec<Known> = known.into_iter().filter(turns).collect();
    assert!(turning.len() >= 16, "{} scenes", turning.len());
    let v = verdict("direct field, turning camera", &turning, |k, half| k.estimate(half, &direct()));
    assert!(passes(&v) && suite_threshold() * v.slope_error < 0.3, "{v:?}");
}

#[test]
fn controls_are_rejected() {
    let some = &coverage(&CoverageKind::GENERIC, 16)[..];
    reject("zero", some, |k, half| Estimate { mean: 0.0, ..k.estimate(half, &warped()) });
    reject("sign flipped", some, |k, half| {
        let estimate = k.estimate(half, &warped());
        Estimate { mean: -estimate.mean, ..estimate }
    });
    let still = WarpedArea { warps: false, ..warped() };
    reject("interior only", some, |k, half| k.estimate(half, &still));
    reject("direct field", some, |k, half| k.estimate(half, &direct()));
    let gaussian = with(Warp { weighting: Weighting::Gaussian, focus: 1.0, ..Warp::default() });
    reject("Gaussian weights", some, |k, half| k.estimate(half, &gaussian));
    for rays in [2, 4] {
        let few = with(Warp { debias: Debias::Consistent { rays }, ..Warp::default() });
        reject(&format!("{rays} rays as they are"), some, |k, half| k.estimate(half, &few));
    }
    // Not a control: how near 64 rays come.
    let many = with(Warp { debias: Debias::Consistent { rays: 64 }, ..Warp::default() });
    let v = verdict("64 rays as they are", &some[..some.len() / 2], |k, half| k.estimate(half, &many));
    assert!((v.slope - 1.0).abs() < 0.1 || passes(&v), "{v:?}");
}
