//! Unbiasedness of every method that claims it, with the controls that must be rejected on the same scenes
//! (see CONTRIBUTING.md for the requirements on such tests).
//!
//! The false-alarm rate is shared by the whole suite: fewer than 16 methods, at most 288 scenes and one slope
//! each, and the comparisons in other files. Seeds are fixed.

use std::sync::LazyLock;

use flatland::estimator::{
    AreaIntegral, BoundaryIntegral, Construction, EdgeSampling, Form, GradientImage, Rotation, WarpedArea,
};
use flatland::plane::exact::Arrangement;
use flatland::plane::fields::{DirectField, JumpField, SceneJumps};
use flatland::plane::{Film, Filter, Image, Motion, Polygon, Scene, Shade, Shape};
use flatland::random::Stream;
use flatland::warp::{
    AuxiliaryPoints, BoundaryFunction, Debias, Field, JumpMean, Plane, Warp, WarpField, Weighting,
};
use glam::{DVec2, DVec3};
use tests::campaign::{Known, Limits, Sampler, Verdict, known};
use tests::comparison::Estimate;
use tests::effort::{pick, thorough};
use tests::power::Power;
use tests::scenes::{Case, Kind};
use tests::statistics::suite_threshold;

/// Kinds on which the Monte Carlo methods are tested. On nearly coincident edges that separate, the
/// derivative exists only within their gap; slivers are thinner than the spacing of samples, which miss them:
/// the exact tests cover both, and the tests of edge sampling cover slivers.
const KINDS: [Kind; 11] = [
    Kind::Generic,
    Kind::CoincidentTogether,
    Kind::CoincidentHidden,
    Kind::SharedVertex,
    Kind::TJunction,
    Kind::Touching,
    Kind::EdgeThroughCorner,
    Kind::VertexOnCorner,
    Kind::GridAligned,
    Kind::NestedCopies,
    Kind::FilledHole,
];

static KNOWN: LazyLock<Vec<Known>> = LazyLock::new(|| known(&KINDS, pick(10, 12)));
/// Some of them, for slow fields.
static HALF: LazyLock<Vec<Known>> = LazyLock::new(|| known(&KINDS, pick(5, 12)));
/// Some of them, for large biases.
static SOME: LazyLock<Vec<Known>> = LazyLock::new(|| known(&KINDS, pick(2, 4)));

fn limits() -> Limits {
    Limits::both(suite_threshold())
}

fn accept(power: &mut Power, name: &str, method: &impl Sampler) {
    Verdict::of(&KNOWN, |k, seed| k.run(seed, method)).accept(power, name, limits());
}

fn reject(name: &str, estimate: impl Fn(&Known, u64) -> Estimate + Sync) {
    Verdict::of(&SOME, estimate).reject(name, limits());
}

/// Kinds whose visible edges do not coincide, as edge sampling requires.
const DISTINCT: [Kind; 5] =
    [Kind::Generic, Kind::TJunction, Kind::SharedVertex, Kind::Touching, Kind::VertexOnCorner];

/// Samples per pixel, in each of two halves.
const SAMPLES: usize = 264;

fn warped(construction: impl Into<Construction>) -> WarpedArea {
    WarpedArea { samples: SAMPLES, construction: construction.into(), ..WarpedArea::default() }
}

#[test]
fn warped_area_with_multilevel_debiasing() {
    let mut power = Power::of("unbiased::warped_area_with_multilevel_debiasing");
    accept(&mut power, "warped area, default", &warped(Warp::default()));
}

/// One pixel on a corner of a rigid quadrilateral, and many samples: a bias of one percent is rejected.
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
    let method = WarpedArea { samples: pick(40_000, 80_000), ..warped(Warp::default()) };
    let mut power = Power::of("unbiased::warped_area_in_depth");
    Verdict::of(&deep, |k, seed| k.run(seed, &method)).accept(&mut power, "in depth", limits());
}

#[test]
fn warped_area_at_other_concentrations() {
    let mut power = Power::of("unbiased::warped_area_at_other_concentrations");
    // With narrow kernels, confirming a zero takes long.
    let kappas = [(10.0, SAMPLES), (400.0, 3 * SAMPLES)];
    for &(kappa, samples) in &kappas[..pick(1, 2)] {
        let construction = Construction::Auxiliary { warp: Warp::default(), kappa };
        let method = WarpedArea { samples, ..warped(construction) };
        accept(&mut power, &format!("warped area, κ = {kappa}"), &method);
    }
}

#[test]
fn warped_area_with_other_warps() {
    let mut power = Power::of("unbiased::warped_area_with_other_warps");
    let points = [AuxiliaryPoints::Stratified, AuxiliaryPoints::Independent];
    for &points in &points[..pick(1, 2)] {
        let method = WarpedArea { samples: SAMPLES / 2, ..warped(Warp { points, ..Warp::default() }) };
        accept(&mut power, &format!("warped area, {points:?}"), &method);
    }
    if thorough() {
        let debias = Debias::Multilevel { rays: 8, first: 0.5, ratio: 0.4 };
        let original = Warp { debias, ..Warp::original(8) };
        let method = WarpedArea { samples: 2 * SAMPLES, ..warped(original) };
        accept(&mut power, "warped area, γ = 3, linear B", &method);
        // Its variance is infinite: no single scene's error is normal; the test is the regression over all
        // scenes, and takes longer than all others here.
        let debias = Debias::RussianRoulette { rays: 4, tail: 1.5 };
        let roulette = WarpedArea { samples: 3 * SAMPLES, ..warped(Warp { debias, ..Warp::default() }) };
        let v = Verdict::of(&KNOWN, |k, seed| k.run(seed, &roulette));
        v.accept(&mut power, "Russian roulette", limits().slope_alone());
    }
}

#[test]
fn mean_over_jumps() {
    let mut power = Power::of("unbiased::mean_over_jumps");
    for reach in [0.3, 1.2] {
        let mean = Construction::JumpMean { reach };
        let method = WarpedArea { samples: SAMPLES / 2, ..warped(mean) };
        accept(&mut power, &format!("mean over jumps, R = {reach}"), &method);
    }
}

#[test]
fn edge_sampling() {
    let mut power = Power::of("unbiased::edge_sampling");
    // It does not support scenes whose visible edges coincide.
    let kinds = [
        Kind::Generic,
        Kind::TJunction,
        Kind::SharedVertex,
        Kind::Touching,
        Kind::VertexOnCorner,
        Kind::Sliver,
    ];
    let method = EdgeSampling { samples: 6 * SAMPLES, ..EdgeSampling::default() };
    let v = Verdict::of(&known(&kinds, pick(20, 48)), |k, seed| k.run(seed, &method));
    v.accept(&mut power, "edge sampling", limits());
}

/// A softened mean over discontinuities with its residual, for any softness, from nearly none to more than
/// the reach, where shapes follow only their own border.
#[test]
fn softened_mean_over_jumps() {
    let mut power = Power::of("unbiased::softened_mean_over_jumps");
    let scenes = known(&DISTINCT, 10);
    let softened = |softness| {
        let construction = Construction::Softened { reach: 1.2, softness };
        WarpedArea { samples: SAMPLES / 2, ..warped(construction) }
    };
    for softness in [1e-3, 0.1, 0.4, f64::INFINITY] {
        let v = Verdict::of(&scenes, |k, seed| k.run(seed, &softened(softness)));
        v.accept(&mut power, &format!("softened mean over jumps, ε = {softness}"), limits());
    }
    let alone = |k: &Known, seed: u64| {
        with_field(k, |_, scene, velocities, film| {
            let mean = JumpMean { reach: 1.2 * film.pixel() };
            let jumps = SceneJumps::softened(scene, mean, 0.4 * film.pixel());
            integral(seed)
                .forward(scene, velocities, film, &JumpField { scene, velocities, jumps })
                .expect("samples")
        })
    };
    Verdict::of(&scenes, alone).reject("a softened mean without its residual", limits());
    // With twice the residual it is as wrong in the other direction.
    let twice = |k: &Known, seed| k.run(seed, &softened(0.4)).scaled(2.0).plus(alone(k, !seed).scaled(-1.0));
    Verdict::of(&scenes, twice).reject("a softened mean with twice its residual", limits());
}

/// The area integral of a field defined on the arrangement.
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
    AreaIntegral { samples: SAMPLES / 2, form: Form::Area, control_variate: true, seed }
}

#[test]
fn fields_that_know_all_silhouettes() {
    let mut power = Power::of("unbiased::fields_that_know_all_silhouettes");
    let oracle = Verdict::of(&HALF, |k, seed| {
        with_field(k, |a, scene, v, film| {
            integral(seed).forward(scene, v, film, &a.oracle(v)).expect("samples")
        })
    });
    oracle.accept(&mut power, "oracle field", limits());
    let harmonic = Verdict::of(&HALF, |k, seed| {
        with_field(k, |a, scene, v, film| {
            integral(seed).forward(scene, v, film, &a.harmonic(v, 1e-7 * film.pixel())).expect("samples")
        })
    });
    harmonic.accept(&mut power, "harmonic field", limits());
}

/// A smooth field independent of the scene, V(u) = a + A u: translation, rotation and strain at once.
struct Affine;

impl WarpField<Plane> for Affine {
    fn at(&self, u: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        let value = DVec2::new(0.3 + 0.10 * u.x - 0.05 * u.y, -0.2 + 0.08 * u.x + 0.06 * u.y);
        (Field { value, divergence: 0.16 }, 0)
    }
}

/// V = 0: the residual is the whole boundary term.
struct Still;

impl WarpField<Plane> for Still {
    fn at(&self, _: DVec2, _: &mut Stream) -> (Field<DVec2>, u64) {
        (Field::ZERO, 0)
    }
}

/// The residual theorem: the area integral of *any* continuous field plus the boundary integral of its
/// residual is the derivative; without the residual it is not.
#[test]
fn any_continuous_field_with_its_residual() {
    let mut power = Power::of("unbiased::any_continuous_field_with_its_residual");
    // Edge sampling does not support scenes whose visible edges coincide.
    let some = known(&[Kind::Generic, Kind::TJunction, Kind::SharedVertex, Kind::Touching], pick(12, 16));
    let area = |k: &Known, seed| {
        with_field(k, |_, scene, v, film| {
            AreaIntegral { samples: SAMPLES, ..integral(seed) }
                .forward(scene, v, film, &Affine)
                .expect("samples")
        })
    };
    let whole = Verdict::of(&some, |k, seed| {
        let rest = with_field(k, |_, scene, v, film| {
            BoundaryIntegral { samples: SAMPLES, seed: !seed }
                .forward(scene, v, film, &Affine)
                .expect("samples")
        });
        area(k, seed).plus(rest)
    });
    whole.accept(&mut power, "an affine field and its residual", limits());
    for k in &some {
        // A boundary-consistent field has no residual.
        let Case { scene, motion, film, .. } = &k.case;
        let velocities = &motion.velocities(scene).expect("the motion fits");
        let jumps = SceneJumps::new(scene, JumpMean { reach: film.pixel() });
        let field = JumpField { scene, velocities, jumps };
        let [left, all] = [
            BoundaryIntegral { samples: 64, seed: 1 }.forward(scene, velocities, film, &field),
            BoundaryIntegral { samples: 64, seed: 1 }.forward(scene, velocities, film, &Still),
        ]
        .map(|image| image.expect("samples").mean)
        .map(|mean| mean.dot(&mean).sqrt());
        assert!(left <= 1e-6 * all, "{left} of {all}\n{}", k.case.label);
    }
    Verdict::of(&some, area).reject("an affine field alone", limits());
}

#[test]
fn controls_are_rejected() {
    reject("sign flipped", |k, seed| k.run(seed, &warped(Warp::default())).scaled(-1.0));
    reject("interior only", |k, seed| {
        // The method under test determines the noise.
        let noise = k.run(seed, &warped(Warp::default()));
        let interior = k.run_with(|scene, motion, film| {
            let velocities = motion.velocities(scene).expect("the motion fits");
            let arrangement = Arrangement::new(scene, film).expect("an arrangement");
            GradientImage {
                mean: arrangement.interior(film, &velocities).expect("velocities fit"),
                standard_error: Image::zero(film),
                rays: 0,
                out_of_steps: 0,
                non_finite: vec![],
            }
        });
        Estimate { mean: interior.mean, ..noise }
    });
    let gaussian = Warp {
        weighting: Weighting::Gaussian,
        debias: Debias::Consistent { rays: 16 },
        radial_exponent: 1.0,
        ..Warp::default()
    };
    reject("Gaussian weights", |k, seed| k.run(seed, &warped(gaussian)));
    reject("direct field", |k, seed| {
        with_field(k, |_, scene, velocities, film| {
            let integral = AreaIntegral { control_variate: false, ..integral(seed) };
            integral.forward(scene, velocities, film, &DirectField { scene, velocities }).expect("samples")
        })
    });
    // γ below 1/p + 1/2: debiasing does not make a field boundary consistent.
    let boundary = BoundaryFunction::KernelScaled { scale: 0.6 };
    let weighting = Weighting::BoundaryAware { gamma: 0.75, boundary };
    reject("γ below its bound", |k, seed| k.run(seed, &warped(Warp { weighting, ..Warp::default() })));
    reject("rotation", |k, seed| k.run(seed, &Rotation { samples: SAMPLES, ..Rotation::default() }));
    reject("4 auxiliary rays, taken as they are", |k, seed| k.run(seed, &warped(Warp::original(4))));
}
