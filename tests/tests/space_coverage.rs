//! Unbiasedness of primary visibility: meshes of constant radiance in front of a moving camera, compared with
//! the exact derivative of their coverage, with the controls that must be rejected on the same scenes.
//!
//! Films have all three filters, silhouettes that cross their borders, and a crop window in every fourth
//! scene. Seeds are fixed, and the false-alarm rate is shared by the whole suite.

use std::sync::LazyLock;

use flatland::random::{open01, stream};
use flatland::warp::{AuxiliaryPoints, Debias, Warp, Weighting};
use glam::DVec3;
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::space::campaign::{Known, REPETITIONS, accept, coverage, reject};
use tests::space::worlds::CoverageKind;
use tests::statistics::{Moments, student};
use volume3d::Kernels;
use volume3d::gradient::{EdgeSampling, Field, WarpedArea};

/// Scenes of each kind.
fn per_kind() -> u64 {
    pick(4, 10)
}

/// Scenes without degeneracies.
static GENERIC: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CoverageKind::GENERIC, per_kind()));

/// The number of scenes on which auxiliary rays are traced. In one scene of thirty their errors have tails so
/// heavy that this scene would decide: more samples of fewer scenes reveal more.
static FEW: LazyLock<Vec<Known>> = LazyLock::new(|| coverage(&CoverageKind::GENERIC, 4));

/// Worlds a million times smaller, larger or farther from the origin.
static FAR: LazyLock<Vec<Known>> = LazyLock::new(|| {
    coverage(&[CoverageKind::Small, CoverageKind::Large, CoverageKind::FarFromOrigin], pick(6, 12))
});

/// Samples per pixel in each of [`REPETITIONS`] runs: one in each of a run's groups.
const SAMPLES: usize = 8;

fn warped() -> WarpedArea {
    WarpedArea { samples: SAMPLES, ..WarpedArea::default() }
}

fn with(warp: Warp) -> WarpedArea {
    WarpedArea { field: Field::AuxiliaryRays, warp, ..warped() }
}

/// The velocity of the visible point, and its divergence from a pair of auxiliary rays so close together that
/// both see the sample's surface. With δ of variance 1/κ, E[κ δ·(V(u + δ) − V(u − δ))/2] is ∇·V wherever V is
/// smooth, and almost no pair straddles a silhouette.
fn direct() -> WarpedArea {
    // Rays 10⁻⁸ pixels apart: 10⁵ times the rounding of a film point, and one sample in 10⁷ may straddle.
    let kernels = Kernels { film: 1e16, ..Kernels::default() };
    let debias = Debias::Consistent { rays: 2 };
    let points = AuxiliaryPoints::Antithetic;
    let pair = Warp { weighting: Weighting::Gaussian, points, radial_exponent: 1.0, debias };
    // The integral of the control variate's term is 0 only if V is continuous.
    WarpedArea { kernels, control_variate: 0, ..with(pair) }
}

#[test]
fn warped_area_is_unbiased() {
    let mut power = Power::of("space_coverage::warped_area_is_unbiased");
    accept(&mut power, "warped area", &GENERIC, &warped());
    accept(&mut power, "small, large and far", &FAR, &warped());
    // Samples without the control variate are noisier.
    accept(&mut power, "no control variate", &GENERIC, &WarpedArea { control_variate: 0, ..warped() });
}

#[test]
fn other_warps_are_unbiased() {
    let mut power = Power::of("space_coverage::other_warps_are_unbiased");
    let warp = WarpedArea::default().warp;
    let points = AuxiliaryPoints::Stratified;
    let longer = |warp| WarpedArea { samples: pick(1, 4) * SAMPLES, ..with(warp) };
    accept(&mut power, "stratified points", &FEW, &longer(Warp { points, ..warp }));
}

/// Features thinner than the spacing of samples are found by edge sampling, which lists the edges. Warped
/// area samples too few of them for a verdict: `RESULTS.md` shows its results.
#[test]
fn edge_sampling_is_unbiased() {
    let mut power = Power::of("space_coverage::edge_sampling_is_unbiased");
    let thin = coverage(&[CoverageKind::Sliver, CoverageKind::Grazing], per_kind());
    let edges =
        EdgeSampling { samples: 2, primary: 16, secondary: 1, bounces: 1, seed: 0, allow_missing: vec![] };
    accept(&mut power, "edge sampling", &GENERIC, &edges);
    accept(&mut power, "edge sampling, slivers and grazing triangles", &thin, &edges);
}

/// The same numbers, forward and in reverse, for all kinds and all parameters at once.
#[test]
fn reverse_mode_is_the_transpose() {
    transposes(false);
}

/// The same with the reflectance of black surfaces, behind which forward mode need not trace.
#[test]
fn reverse_mode_is_the_transpose_with_materials() {
    transposes(true);
}

fn transposes(materials: bool) {
    let method = WarpedArea { samples: 2, seed: 11, ..WarpedArea::default() };
    let some = GENERIC.iter().step_by(3).chain(FAR.iter().step_by(3));
    let worst = some.map(|k| k.assert_transposed(&method, &k.everything(materials))).fold(0.0, f64::max);
    println!("forward against reverse: worst {worst:.1e}");
}

/// The mean of the standard errors that a gradient image states for its pixels agrees with the spread of
/// repetitions.
#[test]
fn stated_standard_errors_are_what_repetitions_show() {
    let mut ratios = Moments::new();
    for k in GENERIC.iter() {
        let runs: Vec<_> = (0..4 * REPETITIONS)
            .map(|seed| k.run(&WarpedArea { samples: 32, seed, ..WarpedArea::default() }))
            .collect();
        let (mut stated, mut shown) = (0.0, 0.0);
        for i in 0..k.weights.len() {
            let spread: Moments = runs.iter().map(|r| r.gradient.pixels[i].y).collect();
            shown += spread.variance();
            stated +=
                runs.iter().map(|r| r.standard_error.pixels[i].y.powi(2)).sum::<f64>() / runs.len() as f64;
        }
        // Where nothing moves on the film, both are 0.
        if shown > 0.0 || stated > 0.0 {
            ratios.push(0.5 * (stated / shown).ln());
        }
    }
    let found = Estimate { mean: ratios.mean(), standard_error: ratios.standard_error() };
    let mut power = Power::of("space_coverage::stated_standard_errors_are_what_repetitions_show");
    let compared =
        Comparison { found, reference: Estimate::exact(0.0), limit: student(ratios.count() - 1), slack: 0.0 };
    compared.accept(&mut power, "ratio of the errors", 1.0);
}

/// The largest share of one number in the spread Σ (x − mean)² of several: 10% on average for 64 normal
/// deviates, and most of the spread for tails without a variance, whatever their count.
fn largest_share(numbers: &[f64]) -> f64 {
    let mean = numbers.iter().sum::<f64>() / numbers.len() as f64;
    let squares: Vec<f64> = numbers.iter().map(|x| (x - mean).powi(2)).collect();
    squares.iter().copied().fold(0.0, f64::max) / squares.iter().sum::<f64>()
}

/// The default field's variance is finite here: no run of 64 has a large share of their spread, in the median
/// over scenes.
#[test]
fn no_run_carries_the_spread() {
    let median = |mut shares: Vec<f64>| {
        shares.retain(|share| share.is_finite());
        shares.sort_by(f64::total_cmp);
        shares[shares.len() / 2]
    };
    let runs =
        |k: &Known| -> Vec<f64> { (0..64).map(|seed| k.sample(&WarpedArea { seed, ..warped() })).collect() };
    let found = median(GENERIC.iter().step_by(pick(6, 4)).map(|k| largest_share(&runs(k))).collect());
    // The control: u^-½, whose variance is just infinite, and 1/u, which has no mean.
    let heavy = |power: f64| {
        let one =
            |seed| (0..64).map(move |i| open01(&mut stream(seed, &[i])).powf(power)).collect::<Vec<_>>();
        median((0..30).map(|seed| largest_share(&one(seed))).collect())
    };
    let [half, one] = [heavy(-0.5), heavy(-1.0)];
    println!("largest share of 64 runs, median: {found:.3}; of heavy tails {half:.3} and {one:.3}");
    assert!(found < 0.2 && half > 0.2 && one > 0.5, "{found} {half} {one}");
}

/// Where the camera rotates or zooms, everything visible moves alike, and velocities are continuous: the
/// control that is rejected below fails only because of its silhouettes.
#[test]
fn the_direct_field_is_unbiased_where_nothing_passes_before_anything() {
    let mut power =
        Power::of("space_coverage::the_direct_field_is_unbiased_where_nothing_passes_before_anything");
    let known = coverage(&CoverageKind::GENERIC, pick(24, 48));
    let turns = |k: &Known| {
        k.change.positions.iter().all(|v| *v == DVec3::ZERO) && k.change.camera.translation == DVec3::ZERO
    };
    let turning: Vec<Known> = known.into_iter().filter(turns).collect();
    assert!(turning.len() >= 16, "{} scenes", turning.len());
    accept(&mut power, "direct field, turning camera", &turning, &direct());
}

#[test]
fn controls_are_rejected() {
    let some = &coverage(&CoverageKind::GENERIC, pick(2, 8))[..];
    reject("sign flipped", some, |k, half| k.estimate(half, &warped()).scaled(-1.0));
    let still = WarpedArea { warps: false, ..warped() };
    reject("interior only", some, |k, half| k.estimate(half, &still));
    reject("direct field", some, |k, half| k.estimate(half, &direct()));
    let gaussian = with(Warp { weighting: Weighting::Gaussian, radial_exponent: 1.0, ..Warp::default() });
    reject("Gaussian weights", some, |k, half| k.estimate(half, &gaussian));
    for rays in [2, 4] {
        let few = with(Warp { debias: Debias::Consistent { rays }, ..Warp::default() });
        reject(&format!("{rays} rays as they are"), some, |k, half| k.estimate(half, &few));
    }
}
