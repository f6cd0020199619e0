//! Every method on the same derivative at the same number of rays, and the exact one.

use std::time::Instant;

use flatland::estimator::transport::{EdgeSampling, FiniteDifference, GradientImage, Method, WarpedArea};
use flatland::transport::exact::{Exact, Radiosity};
use flatland::transport::fields::Construction;
use flatland::transport::{Paths, Terms};
use flatland::warp::{Debias, Warp};

use super::setting::Setting;
use crate::context::Context;
use crate::figures::common::{largest, seed_of};
use crate::plot::{Color, Palette};

/// The number of the figure, for its seeds.
const FIGURE: u64 = 7;
/// The finite difference's step in radians.
pub(super) const STEP: f64 = 0.01;
/// Auxiliary rays without debiasing.
pub(super) const FIXED: usize = 16;
/// Names that are asked for.
pub(super) const WARPED: &str = "warped area";
pub(super) const CONSISTENT: &str = "warped area, 16 rays";
pub(super) const EDGES: &str = "edge sampling";
pub(super) const JUMPS: &str = "mean over jumps";
/// Its reach, in kernel widths.
pub(super) const REACH: f64 = 8.0;
/// Points from which the rotation method chooses what it follows.
const CANDIDATES: usize = 4;
/// Fineness of the radiosity solution and of its quadrature over the film.
const PARTS: usize = 1;
const TOLERANCE: f64 = 1e-8;
/// Samples a pixel from which the rays of a sample are counted.
const PILOT: usize = 16;

/// What a method is called, how it is drawn, and what is known of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looks {
    pub(super) name: &'static str,
    pub(super) color: Color,
    /// In a few words, under its name.
    pub(super) verdict: &'static str,
}

/// A method and its result.
pub(super) struct Entry {
    pub(super) looks: Looks,
    pub(super) samples: usize,
    pub(super) seconds: f64,
    pub(super) image: GradientImage,
}

/// How an estimate compares with the exact derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Comparison {
    /// The slope of the regression of the estimate on the exact derivative, and its standard error.
    pub(super) slope: [f64; 2],
    /// ‖standard error‖/‖exact‖.
    pub(super) noise: f64,
    /// ‖estimate − exact‖/‖exact‖.
    pub(super) error: f64,
}

/// Everything measured.
pub(super) struct Study {
    /// Mean and standard error of every pixel's radiance with one and with two bounces.
    pub(super) images: [Vec<[f64; 2]>; 2],
    pub(super) exact_image: Vec<f64>,
    pub(super) exact: Vec<Terms<f64>>,
    /// The image and its derivative with two bounces.
    pub(super) exact_image_twice: Vec<f64>,
    pub(super) exact_twice: Vec<f64>,
    /// The largest measured error of the latter, relative to its largest value.
    pub(super) radiosity_error: f64,
    /// The slope of the exact images' central difference on the exact derivative: the bias of the step alone.
    pub(super) exact_difference: f64,
    pub(super) entries: Vec<Entry>,
    /// Three unbiased methods on light that is scattered up to twice.
    pub(super) twice: [Entry; 3],
    /// Rays that every method was given.
    pub(super) rays: u64,
}

impl Study {
    pub(super) fn new(context: &Context, setting: &Setting) -> anyhow::Result<Self> {
        let (world, camera) = (&setting.world, &setting.camera);
        context.step("7 flat transport: the image");
        let samples = context.spend(2000, 100_000);
        let image = |bounces| paths(bounces).image(world, camera, samples, context.seed());
        let images = [image(1)?, image(2)?];
        context.step("7 flat transport: the exact derivative");
        let exact = Exact::default();
        let exact_image = exact.image(world, camera)?.pixels;
        let terms = exact.gradient(world, camera, &setting.change)?.pixels;
        let sides = [STEP, -STEP].map(|theta| -> anyhow::Result<Vec<f64>> {
            Ok(exact.image(&world.displaced(&setting.change, theta)?, camera)?.pixels)
        });
        let [plus, minus] = sides;
        let (plus, minus) = (plus?, minus?);
        let quotient: Vec<f64> = plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * STEP)).collect();
        let total: Vec<f64> = terms.iter().map(|t| t.total()).collect();
        let exact_difference = slope(&quotient, &total);
        let radiosity = Radiosity { bounces: Some(2), parts: PARTS, tolerance: TOLERANCE };
        let [image_twice, twice_exact] = radiosity.gradient(world, camera, &setting.change)?;
        let radiosity_error = largest(&twice_exact.errors) / largest(&twice_exact.pixels);
        let bench = Bench { setting, rays: context.spend(4_000_000, 400_000_000), seed: context.seed() };
        let mut entries = vec![];
        for (index, (looks, method)) in methods(1).into_iter().enumerate() {
            context.step(&format!("7 flat transport: {}", looks.name));
            entries.push(bench.run(looks, index as u64, method.as_ref())?);
        }
        context.step("7 flat transport: two bounces");
        let mut all = methods(2).into_iter();
        let mut next = |name: &str, index| {
            let (looks, method) = all
                .find(|(looks, _)| looks.name == name)
                .ok_or_else(|| anyhow::anyhow!("there is no method {name}"))?;
            bench.run(looks, index, method.as_ref())
        };
        let twice = [next(WARPED, 100)?, next(JUMPS, 102)?, next(EDGES, 101)?];
        Ok(Self {
            images,
            exact_image,
            exact: terms,
            exact_image_twice: image_twice.pixels,
            exact_twice: twice_exact.pixels,
            radiosity_error,
            exact_difference,
            entries,
            twice,
            rays: bench.rays,
        })
    }

    /// The exact derivative of every pixel.
    pub(super) fn total(&self) -> Vec<f64> {
        self.exact.iter().map(|t| t.total()).collect()
    }

    /// The entry of a method.
    pub(super) fn entry(&self, name: &str) -> Option<&Entry> {
        self.entries.iter().find(|e| e.looks.name == name)
    }
}

impl Comparison {
    /// Of a method that was not run.
    pub(super) const NONE: Self = Self { slope: [f64::NAN; 2], noise: f64::NAN, error: f64::NAN };

    pub(super) fn new(image: &GradientImage, exact: &[f64]) -> Self {
        let norm: f64 = exact.iter().map(|e| e * e).sum();
        let estimate = image.total();
        let errors = &image.standard_error;
        let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let spread: f64 = exact.iter().zip(errors).map(|(e, s)| (e * s).powi(2)).sum();
        let off: Vec<f64> = estimate.iter().zip(exact).map(|(a, e)| a - e).collect();
        Self {
            slope: [slope(&estimate, exact), spread.sqrt() / norm],
            noise: (product(errors, errors) / norm).sqrt(),
            error: (product(&off, &off) / norm).sqrt(),
        }
    }
}

/// ⟨estimate, exact⟩/⟨exact, exact⟩
fn slope(estimate: &[f64], exact: &[f64]) -> f64 {
    let product = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    product(estimate, exact) / product(exact, exact)
}

fn paths(bounces: usize) -> Paths {
    Paths { bounces, ..Paths::default() }
}

/// A method for a number of samples and a seed.
type Build = Box<dyn Fn(usize, u64) -> Box<dyn Method>>;

/// All methods, for light that is scattered at most `bounces` times.
fn methods(bounces: usize) -> Vec<(Looks, Build)> {
    let paths = paths(bounces);
    let warped = move |construction| -> Build {
        Box::new(move |samples, seed| {
            Box::new(WarpedArea { samples, paths, construction, seed, ..WarpedArea::default() })
        })
    };
    let edges: Build = Box::new(move |samples, seed| {
        Box::new(EdgeSampling { samples, paths, seed, ..EdgeSampling::default() })
    });
    let differences: Build =
        Box::new(move |samples, seed| Box::new(FiniteDifference { samples, paths, step: STEP, seed }));
    let consistent = Warp { debias: Debias::Consistent { rays: FIXED }, ..Warp::one_dimensional() };
    let looks = |name, color, verdict| Looks { name, color, verdict };
    vec![
        (looks(WARPED, Palette::VERMILION, "no edges, no bias"), warped(Construction::default())),
        (looks(CONSISTENT, Palette::SKY, "no edges, biased"), warped(Construction::Local(consistent))),
        (
            looks(JUMPS, Palette::OCHRE, "needs a list of edges"),
            warped(Construction::JumpMean { reach: REACH }),
        ),
        (looks("harmonic field", Palette::PURPLE, "finds all edges"), warped(Construction::Harmonic)),
        (looks(EDGES, Palette::BLUE, "needs a list of edges"), edges),
        (looks("finite differences", Palette::GREEN, "one run a parameter"), differences),
        (
            looks("rotation", Palette::ORANGE, "one motion per kernel"),
            warped(Construction::Followed { candidates: CANDIDATES }),
        ),
        (
            looks("direct field", Palette::GREEN.tint(0.45), "jumps at silhouettes"),
            warped(Construction::Direct),
        ),
        (looks("interior only", Palette::GREY, "no boundary terms"), warped(Construction::Still)),
    ]
}

struct Bench<'a> {
    setting: &'a Setting,
    rays: u64,
    seed: u64,
}

impl Bench<'_> {
    /// A run with as many samples as the rays allow.
    fn run(
        &self,
        looks: Looks,
        index: u64,
        method: &dyn Fn(usize, u64) -> Box<dyn Method>,
    ) -> anyhow::Result<Entry> {
        let Setting { world, camera, change } = self.setting;
        // Seeds of their own, so that methods can be compared with each other.
        let seed = seed_of(self.seed, &[FIGURE, index]);
        let pilot = method(PILOT, seed).forward(world, camera, change)?;
        let samples = ((PILOT as u64 * self.rays) as f64 / pilot.rays as f64).round().max(2.0) as usize;
        let start = Instant::now();
        let image = method(samples, seed).forward(world, camera, change)?;
        let seconds = start.elapsed().as_secs_f64();
        anyhow::ensure!(image.non_finite.is_empty(), "{} gave samples that are not finite", looks.name);
        Ok(Entry { looks, samples, seconds, image })
    }
}
