//! Cost of one derivative for every method.

use flatland::estimator::transport::{EdgeChoice, EdgeSampling, GradientImage, Method, WarpedArea};
use flatland::transport::fields::Construction;
use flatland::warp::{Debias, Warp};

use super::super::common::{KNOWN, SETTLED, dot, seconds};
use super::scene::{CORNERS, Lighting, PIXELS, Scene};
use crate::context::Context;
use crate::plot::{Color, Marker, Palette};
use crate::ratio::Ratio;
use crate::seeds::seed_of;

/// Half widths of the lobe.
pub(super) const WIDTHS: [f64; 7] = [0.5, 0.15, 0.05, 0.015, 4e-3, 1e-3, 1e-4];
/// Number of segments per side of the object.
pub(super) const PARTS: [usize; 6] = [1, 4, 16, 64, 256, 1024];
/// The lobe's half width in the study of the number of vertices.
pub(super) const WIDTH_OF_PARTS: f64 = 0.1;
/// Auxiliary rays of the biased estimate.
const RAYS: usize = 16;
/// Reach of the mean over discontinuities, in kernel widths.
pub(super) const REACH: f64 = 8.0;
/// Independent runs, whose variances are compared.
const RUNS: u64 = 8;
/// Samples a pixel in a timed run: edge sampling prepares a list of the discontinuities of each pixel for
/// this many.
pub(super) const TIMED: usize = 64;
/// Number of vertex evaluations in a timed run of the harmonic field.
const HARMONIC_LOOKS: usize = 12_000;

/// A method in the comparison.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Racer {
    Uniform,
    Importance,
    Multilevel,
    Consistent,
    JumpMean,
    Harmonic,
}

/// A method's appearance and effort.
pub(super) struct Looks {
    pub(super) name: &'static str,
    pub(super) color: Color,
    pub(super) marker: Marker,
    /// Maximum number of samples a pixel in a run.
    most: usize,
    /// Vertex evaluations allowed to all samples of a pixel, where each evaluates every vertex.
    visits: usize,
}

impl Racer {
    pub(super) const ALL: [Self; 6] =
        [Self::Uniform, Self::Importance, Self::Multilevel, Self::Consistent, Self::JumpMean, Self::Harmonic];

    pub(super) fn looks(self) -> Looks {
        let looks = |name, color, marker, most, visits| Looks { name, color, marker, most, visits };
        match self {
            Self::Uniform => {
                looks("edge sampling, uniform", Palette::ORANGE, Marker::Square, 1000, usize::MAX)
            }
            Self::Importance => {
                looks("edge sampling, importance", Palette::VERMILION, Marker::Diamond, 500, 110_000)
            }
            Self::Multilevel => {
                looks("warped area, unbiased", Palette::BLUE, Marker::Circle, 300, usize::MAX)
            }
            Self::Consistent => {
                looks("warped area, 16 rays", Palette::SKY, Marker::TriangleUp, 200, usize::MAX)
            }
            Self::JumpMean => looks("mean over jumps", Palette::OCHRE, Marker::Cross, 1000, 110_000),
            Self::Harmonic => looks("harmonic field", Palette::GREEN, Marker::TriangleDown, 250, 12_000),
        }
    }

    /// Whether it is unbiased in theory.
    pub(super) fn is_unbiased(self) -> bool {
        self != Self::Consistent
    }

    /// Samples a pixel in a run, for a world with `vertices` vertices: fewer where each costs more.
    fn samples(self, context: &Context, vertices: usize) -> usize {
        let Looks { most, visits, .. } = self.looks();
        (most.min(visits / vertices)).max(2) * context.spend(1, 40)
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

/// Measured cost of one method.
pub(super) struct Run {
    unbiased: bool,
    pub(super) samples: usize,
    /// Σ over pixels of the variance of a sample, over Σ exact²; its standard error from the runs.
    pub(super) variance: Ratio,
    /// Rays per sample.
    pub(super) rays: f64,
    /// Seconds per sample on one thread.
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

    /// Deviation of the mean in standard errors.
    pub(super) fn deviation(&self) -> f64 {
        (self.recovered.value - 1.0) / self.recovered.error
    }

    /// Cost of a given precision in seconds.
    pub(super) fn time_cost(&self) -> f64 {
        self.variance.value * self.seconds
    }

    /// Cost of a given precision in rays.
    pub(super) fn rays_cost(&self) -> f64 {
        self.variance.value * self.rays
    }
}

/// One scene with the runs of every method, in the order of [`Racer::ALL`].
pub(super) struct Place {
    pub(super) lighting: Lighting,
    pub(super) width: f64,
    pub(super) vertices: usize,
    pub(super) runs: Vec<Run>,
}

/// Study of the lobe's width, for both lightings.
pub(super) fn against_width(context: &Context) -> anyhow::Result<Vec<Place>> {
    let cases = Lighting::ALL.into_iter().flat_map(|lighting| WIDTHS.map(|width| (lighting, width)));
    cases.map(|(lighting, width)| place(context, width, 1, lighting)).collect()
}

/// Study of the number of the object's vertices.
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
    let norm = dot(&scene.exact, &scene.exact);
    let (mut variances, mut slopes, mut rays) = (vec![], vec![], 0);
    for run in 0..RUNS {
        let seed = seed_of(context.seed(), &[8, racer as u64, run]);
        let gradient = forward(scene, racer, samples, seed)?;
        let errors = &gradient.standard_error.total;
        variances.push(dot(errors, errors) * samples as f64 / norm);
        slopes.push(dot(&gradient.total(), &scene.exact) / norm);
        rays += gradient.rays;
    }
    Ok(Run {
        unbiased: racer.is_unbiased(),
        samples: samples * RUNS as usize,
        variance: Ratio::of_runs(&variances),
        rays: rays as f64 / (RUNS as usize * samples * PIXELS) as f64,
        seconds: seconds_of(scene, racer)?,
        recovered: Ratio::of_runs(&slopes),
    })
}

fn forward(scene: &Scene, racer: Racer, samples: usize, seed: u64) -> anyhow::Result<GradientImage> {
    Ok(racer.method(samples, seed).forward(&scene.world, &scene.camera, &scene.change)?)
}

/// Seconds per sample on one thread.
fn seconds_of(scene: &Scene, racer: Racer) -> anyhow::Result<f64> {
    let samples = match racer {
        // No per-pixel preparation grows with the scene.
        Racer::Harmonic => (HARMONIC_LOOKS / scene.world.vertex_count()).clamp(4, TIMED),
        Racer::Multilevel | Racer::Consistent => TIMED / 2,
        Racer::Uniform | Racer::Importance | Racer::JumpMean => TIMED,
    };
    Ok(seconds(|| forward(scene, racer, samples, 0))? / (samples * PIXELS) as f64)
}
