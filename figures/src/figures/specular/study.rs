//! What every method pays for one derivative.

use std::time::{Duration, Instant};

use flatland::estimator::transport::{EdgeChoice, EdgeSampling, GradientImage, Method, WarpedArea};
use flatland::transport::fields::Construction;
use flatland::warp::{Debias, Warp};

use super::super::common::{KNOWN, SETTLED, seed_of};
use super::scene::{CORNERS, Lighting, PIXELS, Scene};
use crate::context::Context;
use crate::plot::{Color, Marker, Palette};
use crate::ratio::Ratio;

/// Half widths of the lobe.
pub(super) const WIDTHS: [f64; 7] = [0.5, 0.15, 0.05, 0.015, 4e-3, 1e-3, 1e-4];
/// Segments a side of the object is cut into.
pub(super) const PARTS: [usize; 6] = [1, 4, 16, 64, 256, 1024];
/// The lobe's half width in the study of the number of vertices.
pub(super) const WIDTH_OF_PARTS: f64 = 0.1;
/// Auxiliary rays of the biased estimate.
const RAYS: usize = 16;
/// The reach of the mean over jumps, in kernel widths.
pub(super) const REACH: f64 = 8.0;
/// Independent runs, whose variances are compared.
const RUNS: u64 = 8;
/// Samples a pixel in a timed run: edge sampling prepares a list of the jumps of each pixel for so many.
pub(super) const TIMED: usize = 64;
/// Timed runs at most; the time after which six are enough, and that after which any number is.
const TIMED_RUNS: usize = 12;
const ENOUGH: Duration = Duration::from_millis(15);
const LONG: Duration = Duration::from_millis(200);
/// Looks at vertices in a timed run of the harmonic field.
const HARMONIC_LOOKS: usize = 12_000;

/// A method in the race.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Racer {
    Uniform,
    Importance,
    Multilevel,
    Consistent,
    JumpMean,
    Harmonic,
}

impl Racer {
    pub(super) const ALL: [Self; 6] =
        [Self::Uniform, Self::Importance, Self::Multilevel, Self::Consistent, Self::JumpMean, Self::Harmonic];

    pub(super) fn name(self) -> String {
        match self {
            Self::Uniform => "edge sampling, uniform".to_owned(),
            Self::Importance => "edge sampling, importance".to_owned(),
            Self::Multilevel => "warped area, unbiased".to_owned(),
            Self::Consistent => format!("warped area, {RAYS} rays"),
            Self::JumpMean => "mean over jumps".to_owned(),
            Self::Harmonic => "harmonic field".to_owned(),
        }
    }

    pub(super) fn color(self) -> Color {
        match self {
            Self::Uniform => Palette::ORANGE,
            Self::Importance => Palette::VERMILION,
            Self::Multilevel => Palette::BLUE,
            Self::Consistent => Palette::SKY,
            Self::JumpMean => Palette::OCHRE,
            Self::Harmonic => Palette::GREEN,
        }
    }

    pub(super) fn marker(self) -> Marker {
        match self {
            Self::Uniform => Marker::Square,
            Self::Importance => Marker::Diamond,
            Self::Multilevel => Marker::Circle,
            Self::Consistent => Marker::TriangleUp,
            Self::JumpMean => Marker::Cross,
            Self::Harmonic => Marker::TriangleDown,
        }
    }

    /// Whether theory says that it has no bias.
    pub(super) fn is_unbiased(self) -> bool {
        self != Self::Consistent
    }

    /// Samples a pixel in a run, for a world of so many vertices: fewer where each costs more.
    fn samples(self, context: &Context, vertices: usize) -> usize {
        let (most, looks) = match self {
            Self::Uniform => (1000, usize::MAX),
            Self::Importance => (500, 110_000),
            Self::Multilevel => (300, usize::MAX),
            Self::Consistent => (200, usize::MAX),
            Self::JumpMean => (1000, 110_000),
            Self::Harmonic => (250, 12_000),
        };
        // Each sample of the others looks at every vertex.
        (most.min(looks / vertices)).max(2) * context.spend(1, 40)
    }

    fn method(self, samples: usize, seed: u64) -> Box<dyn Method> {
        let edges = |choice| EdgeSampling { samples, choice, seed, ..EdgeSampling::default() };
        let warped = |construction| WarpedArea { samples, construction, seed, ..WarpedArea::default() };
        let auxiliary = |debias| Construction::Local(Warp { debias, ..Warp::one_dimensional() });
        match self {
            Self::Uniform => Box::new(edges(EdgeChoice::Uniform)),
            Self::Importance => Box::new(edges(EdgeChoice::Importance)),
            Self::Multilevel => Box::new(warped(auxiliary(Warp::one_dimensional().debias))),
            Self::Consistent => Box::new(warped(auxiliary(Debias::Consistent { rays: RAYS }))),
            Self::JumpMean => Box::new(warped(Construction::JumpMean { reach: REACH })),
            Self::Harmonic => Box::new(warped(Construction::Harmonic)),
        }
    }
}

/// What one method paid.
pub(super) struct Run {
    unbiased: bool,
    pub(super) samples: usize,
    /// Σ over pixels of the variance of a sample, over Σ exact²; its standard error from the runs.
    pub(super) variance: Ratio,
    /// Rays a sample.
    pub(super) rays: f64,
    /// Seconds a sample on one thread.
    pub(super) seconds: f64,
    /// ⟨estimate, exact⟩/⟨exact, exact⟩: 1 without bias.
    pub(super) recovered: Ratio,
}

impl Run {
    /// Whether the run was long enough to know its variance.
    pub(super) fn is_known(&self) -> bool {
        let Ratio { value, error } = self.variance;
        value > 0.0 && error < KNOWN * value && self.is_settled()
    }

    /// Whether the mean, if it should be unbiased, agrees with the exact derivative.
    pub(super) fn is_settled(&self) -> bool {
        !self.unbiased || self.deviation().abs() < SETTLED
    }

    /// By how many standard errors the mean is off.
    pub(super) fn deviation(&self) -> f64 {
        (self.recovered.value - 1.0) / self.recovered.error
    }

    /// What a given precision costs in seconds.
    pub(super) fn time_cost(&self) -> f64 {
        self.variance.value * self.seconds
    }

    /// What a given precision costs in rays.
    pub(super) fn rays_cost(&self) -> f64 {
        self.variance.value * self.rays
    }
}

/// One scene with what every method paid for it, in the order of [`Racer::ALL`].
pub(super) struct Place {
    pub(super) lighting: Lighting,
    pub(super) width: f64,
    pub(super) vertices: usize,
    pub(super) runs: Vec<Run>,
}

/// Along the lobe's width, for both lightings.
pub(super) fn against_width(context: &Context) -> anyhow::Result<Vec<Place>> {
    let mut places = vec![];
    for lighting in Lighting::ALL {
        for width in WIDTHS {
            places.push(place(context, width, 1, lighting)?);
        }
    }
    Ok(places)
}

/// Along the number of the object's vertices.
pub(super) fn against_vertices(context: &Context) -> anyhow::Result<Vec<Place>> {
    PARTS.into_iter().map(|parts| place(context, WIDTH_OF_PARTS, parts, Lighting::Sky)).collect()
}

fn place(context: &Context, width: f64, parts: usize, lighting: Lighting) -> anyhow::Result<Place> {
    let scene = Scene::new(width, parts, lighting)?;
    let runs = Racer::ALL.into_iter().map(|racer| measure(context, &scene, racer));
    let runs = runs.collect::<anyhow::Result<_>>()?;
    Ok(Place { lighting, width, vertices: CORNERS * parts, runs })
}

fn measure(context: &Context, scene: &Scene, racer: Racer) -> anyhow::Result<Run> {
    let samples = racer.samples(context, scene.world.vertex_count());
    let norm = scene.norm();
    let (mut variances, mut slopes, mut rays) = (vec![], vec![], 0);
    for run in 0..RUNS {
        let seed = seed_of(context.seed(), &[8, racer as u64, run]);
        let gradient = forward(scene, racer, samples, seed)?;
        let squares: f64 = gradient.standard_error.iter().map(|e| e * e).sum();
        variances.push(squares * samples as f64 / norm);
        let product: f64 = gradient.total().iter().zip(&scene.exact).map(|(a, b)| a * b).sum();
        slopes.push(product / norm);
        rays += gradient.rays;
    }
    Ok(Run {
        unbiased: racer.is_unbiased(),
        samples: samples * RUNS as usize,
        variance: Ratio::of_runs(&variances),
        rays: rays as f64 / (RUNS as usize * samples * PIXELS) as f64,
        seconds: seconds(scene, racer)?,
        recovered: Ratio::of_runs(&slopes),
    })
}

fn forward(scene: &Scene, racer: Racer, samples: usize, seed: u64) -> anyhow::Result<GradientImage> {
    Ok(racer.method(samples, seed).forward(&scene.world, &scene.camera, &scene.change)?)
}

/// Seconds a sample on one thread: the fastest of a few runs, because other programs can only slow it down.
fn seconds(scene: &Scene, racer: Racer) -> anyhow::Result<f64> {
    let samples = match racer {
        // Nothing is prepared for a pixel that would grow with the scene.
        Racer::Harmonic => (HARMONIC_LOOKS / scene.world.vertex_count()).clamp(4, TIMED),
        Racer::Multilevel | Racer::Consistent => TIMED / 2,
        Racer::Uniform | Racer::Importance | Racer::JumpMean => TIMED,
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build()?;
    let start = Instant::now();
    let mut least = f64::INFINITY;
    for run in 0..TIMED_RUNS {
        let before = Instant::now();
        pool.install(|| forward(scene, racer, samples, 0))?;
        least = least.min(before.elapsed().as_secs_f64());
        if start.elapsed() > if run < 5 { LONG } else { ENOUGH } {
            break;
        }
    }
    Ok(least / (samples * PIXELS) as f64)
}
