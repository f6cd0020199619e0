//! Unbiasedness along whole paths, against exact derivatives, with the controls that must be rejected
//! on the same worlds.
//!
//! Worlds without any discontinuity come first: only cosines, distances and lobes change there. Then
//! those whose film sees no jump (`Kind::Direct`), then all others. Seeds are fixed, and the false-alarm rate is that of the whole suite.

use std::sync::LazyLock;

use flatland::estimator::transport::{
    EdgeChoice, EdgeSampling, Fault, FiniteDifference, GradientImage, Method, WarpedArea,
};
use flatland::plane::Filter;
use flatland::transport::exact::Exact;
use flatland::transport::fields::Construction;
use flatland::transport::{Camera, CameraTangent, Film, Material, Paths, Shape, Tangent, World};
use flatland::warp::{AuxiliaryPoints, Debias, Warp, Weighting};
use glam::DVec2;
use rayon::prelude::*;
use tests::campaign::{Limits, Reference, Target, Verdict, focused};
use tests::comparison::{Comparison, Estimate};
use tests::effort::pick;
use tests::power::Power;
use tests::statistics::suite_threshold;
use tests::transport::campaign::{Known, known};
use tests::transport::constants::constants;
use tests::transport::worlds::{Case, Kind, Moving};

/// Light scattered once.
static ONCE: LazyLock<Vec<Known>> = LazyLock::new(|| known(&Kind::GENERIC, &Moving::ALL, pick(10, 24), 1));

/// As many for the harmonic field, whose slope between two jumps is one over their distance: where they nearly coincide
/// no affordable number of samples tells a zero. More samples of few worlds say more.
static FEW: LazyLock<Vec<Known>> = LazyLock::new(|| known(&Kind::GENERIC, &Moving::ALL, 10, 1));

/// Others of them, for what is far off.
static SOME: LazyLock<Vec<Known>> = LazyLock::new(|| known(&Kind::GENERIC, &Moving::ALL, pick(3, 12), 1));

/// The same, without a jump over the film; the light's ends are jumps over directions.
static UNBROKEN: LazyLock<Vec<Known>> =
    LazyLock::new(|| known(&[Kind::Direct], &Moving::ALL, pick(20, 30), 1));

/// Without any jump at all: a tilted glossy floor alone under a sky, beyond the view on both sides.
static SMOOTH: LazyLock<Vec<Known>> = LazyLock::new(|| {
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let mut all = vec![];
    for (width, filter) in [(0.3, Filter::Tent), (0.6, Filter::Gaussian), (1.0, Filter::Box)] {
        let floor = Material { reflectance: 0.2, ..Material::glossy(0.7, width) };
        let world = World::new(1.3, vec![Shape::open([p(-9.0, -0.6), p(8.0, 0.5)], floor)]);
        let world = world.expect("a world");
        let film = Film { pixels: 4, filter };
        let camera = Camera { position: p(-1.0, 0.7), angle: -0.5, field_of_view: 0.5, film };
        let moves = CameraTangent { position: p(0.3, 0.8), ..CameraTangent::default() };
        let turns = CameraTangent { angle: 1.0, field_of_view: 0.3, ..CameraTangent::default() };
        let changes = [
            Tangent::rotate(&world, [0], p(0.0, 0.0)),
            Tangent::moving(&world, [0], |p| DVec2::new(0.0, 0.1 * p.x + 0.5)),
            Tangent::of_camera(&world, moves),
            Tangent::of_camera(&world, turns),
        ];
        for (i, change) in changes.into_iter().enumerate() {
            let label = format!("floor alone, lobe {width}, {filter:?}, change {i}");
            all.push(Known::new(Case { world: world.clone(), camera, change, label }, 1));
        }
    }
    all
});

/// Light scattered twice.
static TWICE: LazyLock<Vec<Known>> =
    LazyLock::new(|| known(&[Kind::Room, Kind::Glossy, Kind::Shadows], &Moving::GEOMETRIC, pick(8, 14), 2));

fn limits() -> Limits {
    Limits::both(suite_threshold())
}

fn run(k: &Known, method: &impl Method) -> GradientImage {
    let case = &k.case;
    let found = method.forward(&case.world, &case.camera, &case.change);
    let found = found.unwrap_or_else(|e| panic!("{e}\n{}", case.label));
    assert!(found.non_finite.is_empty(), "{:?} {}", found.non_finite, case.label);
    found
}

fn total(k: &Known, method: &impl Method) -> Estimate {
    let found = run(k, method);
    let estimate = k.estimate(&found.total(), &found.standard_error);
    // The reference's own error must not count.
    let least = (1e-6 * k.exact.abs()).max(1e-9 * k.scale);
    assert!(k.error <= 0.2 * estimate.standard_error.max(least), "{:e} {estimate:?}", k.error);
    estimate
}

fn accept<M: Method>(
    power: &mut Power,
    name: &str,
    known: &[Known],
    method: impl Fn(u64, Paths) -> M + Sync,
) {
    Verdict::of(known, |k, seed| total(k, &method(seed, paths(k)))).accept(power, name, limits());
}

fn reject(name: &str, known: &[Known], estimate: impl Fn(&Known, u64) -> Estimate + Sync) {
    Verdict::of(known, estimate).reject(name, limits());
}

fn paths(k: &Known) -> Paths {
    Paths { bounces: k.bounces, ..Paths::default() }
}

/// Paths a pixel, in each of two halves.
const SAMPLES: usize = 512;

fn warped(seed: u64, paths: Paths) -> WarpedArea {
    WarpedArea { samples: SAMPLES, paths, seed, ..WarpedArea::default() }
}

fn with(warp: Warp) -> impl Fn(u64, Paths) -> WarpedArea + Sync {
    let samples = pick(SAMPLES / 2, SAMPLES);
    move |seed, paths| WarpedArea {
        samples,
        construction: Construction::Auxiliary(warp),
        ..warped(seed, paths)
    }
}

#[test]
fn worlds_without_a_jump() {
    let mut power = Power::of("transport_unbiased::worlds_without_a_jump");
    let constructed = |construction| {
        move |seed, paths| WarpedArea { samples: 8 * SAMPLES, construction, ..warped(seed, paths) }
    };
    // Here every field is right: none at all, one that would jump at silhouettes, and the method's.
    accept(&mut power, "no jump, no warp", &SMOOTH, constructed(Construction::Still));
    // Auxiliary rays are noisy, and so are velocities that do not fade.
    let long = |construction| {
        move |seed, paths| WarpedArea { samples: 32 * SAMPLES, ..constructed(construction)(seed, paths) }
    };
    accept(&mut power, "no jump, direct field", &SMOOTH, long(Construction::Direct));
    accept(&mut power, "no jump, warped area", &SMOOTH, long(Construction::default()));
    reject("no jump, attached density", &SMOOTH, |k, seed| {
        let fault = Some(Fault::AttachedDensity);
        total(k, &WarpedArea { fault, ..constructed(Construction::Still)(seed, paths(k)) })
    });
}

#[test]
fn worlds_without_a_jump_over_the_film() {
    let mut power = Power::of("transport_unbiased::worlds_without_a_jump_over_the_film");
    accept(&mut power, "film without a jump, warped area", &UNBROKEN, warped);
    accept(&mut power, "film without a jump, harmonic field", &UNBROKEN, |seed, paths| WarpedArea {
        construction: Construction::Harmonic,
        ..warped(seed, paths)
    });
    accept(&mut power, "film without a jump, edge sampling", &UNBROKEN, |seed, paths| EdgeSampling {
        samples: SAMPLES,
        paths,
        seed,
        ..EdgeSampling::default()
    });
}

/// What is 0, or known without computing anything: furnaces, a floor that slides under itself, all
/// things and the camera moved as one. Noise is measured by what cancels: the terms and the image.
#[test]
fn what_is_known_by_an_argument() {
    let mut power = Power::of("transport_unbiased::what_is_known_by_an_argument");
    let mut worst = [0.0_f64; 3];
    for bounces in [1, 2] {
        let paths = Paths { bounces, ..Paths::default() };
        let filters = [Filter::Tent, Filter::Box];
        for constant in constants(&filters[..pick(1, 2)], bounces).into_iter().step_by(pick(2, 1)) {
            let Case { world, camera, change, label } = &constant.case;
            let image: f64 =
                paths.image(world, camera, SAMPLES, 4).expect("valid").iter().map(|p| p[0]).sum();
            let methods: [(&str, Sampled<'_>); 3] = [
                ("warped area", &|samples| {
                    let method = WarpedArea { samples, ..warped(3, paths) };
                    method.forward(world, camera, change).expect("valid")
                }),
                ("harmonic field", &|samples| {
                    let construction = Construction::Harmonic;
                    let method = WarpedArea { samples, construction, ..warped(3, paths) };
                    method.forward(world, camera, change).expect("valid")
                }),
                ("edge sampling", &|samples| {
                    let method = EdgeSampling { samples, paths, seed: 3, ..EdgeSampling::default() };
                    method.forward(world, camera, change).expect("valid")
                }),
            ];
            for ((name, method), worst) in methods.into_iter().zip(&mut worst) {
                // Longer where noise would hide everything: what decides is the noise alone.
                let (mut samples, mut found) = (SAMPLES, method(SAMPLES));
                let (mut error, mut scale) = noise(&found, image);
                while suite_threshold() * error > 0.13 * scale && samples < 1000 * SAMPLES {
                    samples *= 4;
                    found = method(samples);
                    (error, scale) = noise(&found, image);
                }
                let total = found.total();
                let off = total.iter().sum::<f64>() - total.len() as f64 * constant.derivative;
                // Rounding where samples do not differ.
                let z = off / error.max(1e-9);
                assert!(z.abs() < suite_threshold(), "{name}: off by {off} ± {error}, {label}");
                *worst = worst.max(z.abs());
                power.add(format!("{name}, {bounces} bounces, {label}"), suite_threshold() * error, scale);
            }
        }
    }
    println!("known by an argument: worst |z| {worst:.2?}");
}

/// A method by how many paths a pixel it is given.
type Sampled<'a> = &'a dyn Fn(usize) -> GradientImage;

/// The standard error of the sum of all pixels, and what it is measured by: the image and the terms that cancel.
fn noise(found: &GradientImage, image: f64) -> (f64, f64) {
    let terms: f64 = found.mean.iter().flat_map(|t| t.to_array()).map(f64::abs).sum();
    (found.standard_error.iter().map(|e| e * e).sum::<f64>().sqrt(), image + terms)
}

/// Doubling the paths must halve the square of a standard error (theory, section 11): so it does, to a
/// factor of 2, in nearly all worlds for the harmonic field and edge sampling. The default makes no
/// such promise: in penumbras its variance is not finite.
#[test]
fn standard_errors_settle() {
    let settled = |name: &str, method: &(dyn Fn(&Known, usize) -> Estimate + Sync)| {
        let ratio = |k: &Known| {
            let [once, twice] = [1, 2].map(|times| method(k, times * SAMPLES).standard_error.powi(2));
            2.0 * twice / once
        };
        let moving: Vec<&Known> =
            ONCE.iter().filter(|k| k.case.change.is_geometric()).step_by(pick(3, 1)).collect();
        let within = moving.iter().filter(|k| (0.5..2.0).contains(&ratio(k))).count();
        println!("{name}: {within} of {} standard errors settle", moving.len());
        within as f64 / moving.len() as f64
    };
    let constructed = |construction| {
        move |k: &Known, samples| total(k, &WarpedArea { samples, construction, ..warped(7, paths(k)) })
    };
    let harmonic = settled("harmonic field", &constructed(Construction::Harmonic));
    let edges = settled("edge sampling", &|k, samples| {
        total(k, &EdgeSampling { samples, paths: paths(k), seed: 7, ..EdgeSampling::default() })
    });
    assert!(harmonic > 0.85 && edges > 0.85, "{harmonic} {edges}");
}

/// The largest |z| belongs to a glowing world in which two jumps nearly coincide: its standard error has
/// not settled even with hundreds of times as many paths, so that its z is not normal.
#[test]
fn warped_area_with_multilevel_debiasing() {
    let mut power = Power::of("transport_unbiased::warped_area_with_multilevel_debiasing");
    accept(&mut power, "warped area", &ONCE, warped);
    accept(&mut power, "warped area, two bounces", &TWICE, warped);
}

#[test]
fn warped_area_with_other_warps() {
    let mut power = Power::of("transport_unbiased::warped_area_with_other_warps");
    let warp = Warp::one_dimensional();
    accept(&mut power, "velocities that do not fade", &ONCE, with(warp));
    let points = AuxiliaryPoints::Antithetic;
    accept(&mut power, "antithetic points", &ONCE, with(Warp { points, ..warp }));
    accept(&mut power, "the plane's default", &ONCE, with(Warp::default()));
}

/// Russian roulette has infinite variance, so that no single world's error is normal: where two jumps
/// nearly coincide, |z| of a world exceeds the limit. What is tested is the regression over all worlds.
#[test]
fn russian_roulette() {
    let debias = Debias::RussianRoulette { rays: 8, tail: 1.5 };
    let method = with(Warp { debias, ..Warp::one_dimensional() });
    let v = Verdict::of(&ONCE, |k, seed| total(k, &method(seed, paths(k))));
    let mut power = Power::of("transport_unbiased::russian_roulette");
    v.accept(&mut power, "Russian roulette", limits().slope_alone());
}

#[test]
fn the_harmonic_field() {
    let mut power = Power::of("transport_unbiased::the_harmonic_field");
    let harmonic = |seed, paths| WarpedArea {
        samples: pick(1, 4) * SAMPLES,
        construction: Construction::Harmonic,
        ..warped(seed, paths)
    };
    accept(&mut power, "harmonic field", &FEW, harmonic);
    accept(&mut power, "harmonic field, two bounces", &TWICE, harmonic);
}

#[test]
fn the_mean_over_jumps() {
    let mut power = Power::of("transport_unbiased::the_mean_over_jumps");
    let mean = |seed, paths| WarpedArea {
        construction: Construction::JumpMean { reach: 8.0 },
        ..warped(seed, paths)
    };
    accept(&mut power, "film without a jump, mean over jumps", &UNBROKEN, mean);
    accept(&mut power, "mean over jumps", &ONCE, mean);
    accept(&mut power, "mean over jumps, two bounces", &TWICE, mean);
}

#[test]
fn edge_sampling() {
    let mut power = Power::of("transport_unbiased::edge_sampling");
    for choice in [EdgeChoice::Uniform, EdgeChoice::Importance] {
        let edges = |seed, paths| EdgeSampling { samples: SAMPLES, paths, choice, seed };
        accept(&mut power, &format!("edge sampling, {choice:?}"), &ONCE, edges);
        accept(&mut power, &format!("edge sampling, {choice:?}, two bounces"), &TWICE, edges);
    }
}

/// One term of a world.
struct Term<'k> {
    known: &'k Known,
    weights: Vec<f64>,
    which: usize,
    exact: f64,
    label: String,
}

impl Reference for Term<'_> {
    fn target(&self) -> Target<'_> {
        Target { exact: self.exact, scale: self.known.scale, label: &self.label }
    }
}

const TERMS: [&str; 3] = ["interior", "primary", "secondary"];

/// What the exact engine says of every term.
fn terms(known: &Known) -> [Term<'_>; 3] {
    let Case { world, camera, change, label } = &known.case;
    let exact = Exact::default().gradient(world, camera, change).expect("differentiable");
    [0, 1, 2].map(|which| {
        let exact: Vec<f64> = exact.pixels.iter().map(|t| t.to_array()[which]).collect();
        let weights = focused(&exact);
        let exact = weights.iter().zip(&exact).map(|(w, e)| w * e).sum();
        Term { known, weights, which, exact, label: format!("{} term, {label}", TERMS[which]) }
    })
}

impl Term<'_> {
    fn estimate(&self, found: &GradientImage) -> Estimate {
        let own = |terms: &[flatland::transport::Terms<f64>]| -> Vec<f64> {
            terms.iter().zip(&self.weights).map(|(t, w)| t.to_array()[self.which] * w).collect()
        };
        let variance: f64 = own(&found.term_error).iter().map(|e| e * e).sum();
        Estimate { mean: own(&found.mean).iter().sum(), standard_error: variance.sqrt() }
    }
}

/// Each term has one value, whatever the method: what the exact engine says.
#[test]
fn terms_are_those_of_the_exact_engine() {
    let mut power = Power::of("transport_unbiased::terms_are_those_of_the_exact_engine");
    let all: Vec<[Term<'_>; 3]> = ONCE.par_iter().map(terms).collect();
    // Both halves of what a method finds, term by term.
    let found = |method: &(dyn Fn(&Known, u64) -> GradientImage + Sync)| -> Vec<[[Estimate; 2]; 3]> {
        let of = |terms: &[Term<'_>; 3]| {
            let halves = [0, 1].map(|seed| method(terms[0].known, seed));
            terms.each_ref().map(|term| halves.each_ref().map(|found| term.estimate(found)))
        };
        all.par_iter().map(of).collect()
    };
    let harmonic = found(&|k, seed| {
        run(k, &WarpedArea { construction: Construction::Harmonic, ..warped(seed, paths(k)) })
    });
    let edges = found(&|k, seed| {
        run(k, &EdgeSampling { samples: SAMPLES, paths: paths(k), seed, ..EdgeSampling::default() })
    });
    for (which, name) in TERMS.into_iter().enumerate() {
        let on = |halves: &[[[Estimate; 2]; 3]], counts: &dyn Fn(&Term<'_>) -> bool| {
            let pairs = all.iter().zip(halves).map(|(terms, halves)| (&terms[which], &halves[which]));
            Verdict::on(pairs.filter(|(term, _)| counts(term)))
        };
        // Where nothing moves but what the camera sees, the harmonic field's primary term is noise that cancels.
        let harmonic = on(&harmonic, &|term| term.exact != 0.0);
        harmonic.accept(&mut power, &format!("{name} term, harmonic field"), limits());
        on(&edges, &|_| true).accept(&mut power, &format!("{name} term, edge sampling"), limits());
    }
}

#[test]
fn controls_are_rejected() {
    let interior = |seed, paths| WarpedArea { construction: Construction::Still, ..warped(seed, paths) };
    reject("sign flipped", &SOME, |k, seed| total(k, &warped(seed, paths(k))).scaled(-1.0));
    reject("interior only", &SOME, |k, seed| total(k, &interior(seed, paths(k))));
    reject("primary only", &SOME, |k, seed| {
        let found = run(k, &warped(seed, paths(k)));
        let [sum, error] = [&found.mean, &found.term_error]
            .map(|terms| terms.iter().map(|t| t.primary).collect::<Vec<f64>>());
        k.estimate(&sum, &error)
    });
    reject("no secondary term", &SOME, |k, seed| {
        let found = run(k, &warped(seed, paths(k)));
        let sum: Vec<f64> = found.mean.iter().map(|t| t.interior + t.primary).collect();
        let error: Vec<f64> = found.term_error.iter().map(|t| t.interior.hypot(t.primary)).collect();
        k.estimate(&sum, &error)
    });
    let constructed = |construction| {
        move |k: &Known, seed| total(k, &WarpedArea { construction, ..warped(seed, paths(k)) })
    };
    reject("direct field", &SOME, constructed(Construction::Direct));
    reject("rotation", &SOME, constructed(Construction::Followed { candidates: 4 }));
    let gaussian = Warp { weighting: Weighting::Gaussian, radial_exponent: 1.0, ..Warp::one_dimensional() };
    reject("Gaussian field", &SOME, constructed(Construction::Auxiliary(gaussian)));
    let few = Warp { debias: Debias::Consistent { rays: 2 }, ..Warp::one_dimensional() };
    reject("2 rays as they are", &SOME, constructed(Construction::Local(few)));
}

/// A floor that sees no light but a wall's, and a block that shades the wall: all that moves on the
/// film is a shadow two surfaces away.
#[test]
fn a_shadow_seen_by_reflection() {
    let mut power = Power::of("transport_unbiased::a_shadow_seen_by_reflection");
    let p = |x: f64, y: f64| DVec2::new(x, y);
    let block = [p(2.1, 1.8), p(2.7, 2.3), p(2.0, 2.6)];
    let shapes = vec![
        Shape::open([p(-1.0, 0.0), p(2.0, 0.1)], Material::diffuse(0.9)),
        Shape::open([p(3.0, 0.5), p(3.2, 3.0)], Material::diffuse(0.9)),
        Shape::open([p(0.8, 3.2), p(1.2, 3.6)], Material::emitter(8.0)),
        Shape::open([p(-0.5, 2.2), p(1.5, 2.1)], Material::default()),
        Shape::closed(block, Material::default()),
    ];
    let world = World::new(0.0, shapes).expect("a world");
    let film = Film { pixels: 1, filter: Filter::Tent };
    let camera = Camera { position: p(0.4, 1.6), angle: -0.87, field_of_view: 0.3, film };
    let change = Tangent::scale(&world, [4], p(2.3, 2.25));
    let case = Case { world, camera, change, label: "a shadow seen by reflection".to_owned() };
    let known = [Known::new(case, 2)];
    assert!(known[0].error < 1e-3 * known[0].exact.abs(), "{:e}", known[0].error);
    let many = |seed, paths| WarpedArea {
        samples: 400_000,
        construction: Construction::Harmonic,
        ..warped(seed, paths)
    };
    accept(&mut power, "second bounce, harmonic field", &known, many);
    reject("no warp at the second bounce", &known, |k, seed| {
        let fault = Some(Fault::NoWarpFrom { surface: 1 });
        total(k, &WarpedArea { fault, ..many(seed, paths(k)) })
    });
}

/// Central differences are biased by h² and noisy by 1/h: of a world that they can manage.
#[test]
fn finite_differences() {
    let rooms = |k: &&Known| k.case.label.contains("Room") && k.exact.abs() > 0.1 * k.scale;
    let k = ONCE.iter().find(rooms).expect("a room in which something moves");
    let found = total(k, &FiniteDifference { samples: 250_000, paths: paths(k), step: 3e-3, seed: 1 });
    let (reference, slack) = (Estimate::exact(k.exact), 1e-3 * k.exact.abs());
    let mut power = Power::of("transport_unbiased::finite_differences");
    let compared = Comparison { found, reference, limit: suite_threshold(), slack };
    compared.accept(&mut power, "a room", k.exact);
}
