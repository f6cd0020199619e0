//! Every method on the same derivative at the same number of rays, and the exact one.

use std::time::Instant;

use anyhow::Context as _;
use flatland::estimator::transport::{EdgeSampling, FiniteDifference, GradientImage, Method, WarpedArea};
use flatland::transport::exact::{Exact, Radiosity};
use flatland::transport::fields::Construction;
use flatland::transport::{Paths, Terms};
use flatland::warp::{Debias, Warp};

use super::setting::Setting;
use crate::context::Context;
use crate::figures::common::{Agreement, dot, largest};
use crate::plot::{Color, Palette};
use crate::seeds::seed_of;

/// The number of the figure, for its seeds.
const FIGURE: u64 = 7;
/// The finite difference's step in radians.
pub(super) const STEP: f64 = 0.01;
/// Auxiliary rays without debiasing.
pub(super) const FIXED: usize = 16;
/// Names used for look-up.
pub(super) const WARPED: &str = "warped area";
pub(super) const CONSISTENT: &str = "warped area, 16 rays";
pub(super) const EDGES: &str = "edge sampling";
pub(super) const JUMPS: &str = "mean over jumps";
/// Its reach, in kernel widths.
pub(super) const REACH: f64 = 8.0;
/// Points from which the rotation method chooses the one to follow.
const CANDIDATES: usize = 4;
/// Fineness of the radiosity solution and of its quadrature over the film.
const PARTS: usize = 1;
const TOLERANCE: f64 = 1e-8;
/// Samples a pixel of the pilot that counts the rays of a sample.
const PILOT: usize = 16;

/// Name, appearance and short description of a method.
#[derive(Clone, Copy, Debug)]
pub(super) struct Looks {
    pub(super) name: &'static str,
    pub(super) color: Color,
    pub(super) verdict: &'static str,
}

/// A method and its result.
pub(super) struct Entry {
    pub(super) looks: Looks,
    pub(super) samples: usize,
    pub(super) seconds: f64,
    pub(super) image: GradientImage,
    /// Agreement with the exact derivative.
    pub(super) agreement: Agreement,
}

/// All measurements.
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
    /// Three unbiased methods on light scattered up to twice.
    pub(super) twice: [Entry; 3],
    /// Rays given to every method.
    pub(super) rays: u64,
}

impl Study {
    pub(super) fn new(context: &Context, setting: &Setting) -> anyhow::Result<Self> {
        let (world, camera) = (&setting.world, &setting.camera);
        context.step("the image");
        let samples = context.spend(2000, 100_000);
        let image = |bounces| paths(bounces).image(world, camera, samples, context.seed());
        let images = [image(1)?, image(2)?];
        context.step("the exact derivative");
        let exact = Exact::default();
        let exact_image = exact.image(world, camera)?.pixels;
        let terms = exact.gradient(world, camera, &setting.change)?.pixels;
        let side = |theta: f64| -> anyhow::Result<Vec<f64>> {
            Ok(exact.image(&world.displaced(&setting.change, theta)?, camera)?.pixels)
        };
        let (plus, minus) = (side(STEP)?, side(-STEP)?);
        let quotient: Vec<f64> = plus.iter().zip(&minus).map(|(p, m)| (p - m) / (2.0 * STEP)).collect();
        let total: Vec<f64> = terms.iter().map(|t| t.total()).collect();
        let exact_difference = dot(&quotient, &total) / dot(&total, &total);
        let radiosity = Radiosity { bounces: Some(2), parts: PARTS, tolerance: TOLERANCE };
        let [image_twice, twice_exact] = radiosity.gradient(world, camera, &setting.change)?;
        let radiosity_error = largest(&twice_exact.errors) / largest(&twice_exact.pixels);
        let bench = Bench { setting, rays: context.spend(4_000_000, 400_000_000), seed: context.seed() };
        let mut entries = vec![];
        for (index, (looks, method)) in methods(1).into_iter().enumerate() {
            context.step(looks.name);
            entries.push(bench.run(looks, index as u64, method.as_ref(), &total)?);
        }
        context.step("two bounces");
        let mut all = methods(2).into_iter();
        let mut next = |name: &str, index| {
            let found = all.find(|(looks, _)| looks.name == name);
            let (looks, method) = found.with_context(|| format!("there is no method {name}"))?;
            bench.run(looks, index, method.as_ref(), &twice_exact.pixels)
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

fn paths(bounces: usize) -> Paths {
    Paths { bounces, ..Paths::default() }
}

/// A method for a number of samples and a seed.
type Build = Box<dyn Fn(usize, u64) -> Box<dyn Method>>;

/// All methods, for light scattered at most `bounces` times.
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
    let followed = Construction::Followed { candidates: CANDIDATES };
    let row = |name, color, verdict, method| (Looks { name, color, verdict }, method);
    vec![
        row(WARPED, Palette::VERMILION, "no edges, no bias", warped(Construction::default())),
        row(CONSISTENT, Palette::SKY, "no edges, biased", warped(Construction::Local(consistent))),
        row(JUMPS, Palette::OCHRE, "needs a list of edges", warped(Construction::JumpMean { reach: REACH })),
        row("harmonic field", Palette::PURPLE, "finds all edges", warped(Construction::Harmonic)),
        row(EDGES, Palette::BLUE, "needs a list of edges", edges),
        row("finite differences", Palette::GREEN, "one run a parameter", differences),
        row("rotation", Palette::ORANGE, "one motion per kernel", warped(followed)),
        row("direct field", Palette::GREEN.tint(0.45), "jumps at silhouettes", warped(Construction::Direct)),
        row("interior only", Palette::GREY, "no boundary terms", warped(Construction::Still)),
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
        exact: &[f64],
    ) -> anyhow::Result<Entry> {
        let Setting { world, camera, change } = self.setting;
        // Separate seeds, so that methods can be compared with each other.
        let seed = seed_of(self.seed, &[FIGURE, index]);
        let pilot = method(PILOT, seed).forward(world, camera, change)?;
        let samples = ((PILOT as u64 * self.rays) as f64 / pilot.rays as f64).round().max(2.0) as usize;
        let start = Instant::now();
        let image = method(samples, seed).forward(world, camera, change)?;
        let seconds = start.elapsed().as_secs_f64();
        anyhow::ensure!(image.non_finite.is_empty(), "{} gave samples that are not finite", looks.name);
        let agreement = Agreement::new(&image.total(), &image.standard_error.total, exact);
        Ok(Entry { looks, samples, seconds, image, agreement })
    }
}
