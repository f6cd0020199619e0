//! Bias against N' and the cost of every scheme.

use flatland::estimator::transport::{EdgeSampling, Method, WarpedArea};
use flatland::transport::Paths;
use flatland::transport::fields::Construction;
use flatland::warp::{Debias, Warp};

use super::worlds::{PIXELS, Setting};
use crate::context::Context;
use crate::figures::common::{KNOWN, SETTLED, dot, median};
use crate::figures::trade::bias::{Curve, Series};
use crate::figures::trade::debias::name;
use crate::figures::trade::regression::{Bias, regress};
use crate::plot::{Color, Marker, Palette};
use crate::ratio::Ratio;
use crate::seeds::seed_of;

/// Independent runs of every estimate.
pub(super) const RUNS: usize = 8;
/// Rays of the consistent estimates among the schemes.
pub(super) const RAYS: usize = 16;

/// The multilevel scheme of the original's weight: P(L ≥ 1), and P(L ≥ l + 1)/P(L ≥ l).
pub(super) const LEVELS: f64 = 0.35;
/// Reach of the mean over discontinuities, in kernel widths.
pub(super) const REACH: f64 = 8.0;
/// The tail of Russian roulette.
pub(super) const TAIL: f64 = 1.5;
/// Tolerated ratio of the variance over all runs together to that of a typical run. Rare large samples are
/// missing from most runs, so that more samples find more variance.
pub(super) const GROWTH: f64 = 1.25;

/// Construction of a scheme's field.
#[derive(Clone, Copy)]
pub(super) enum Field {
    Original(Debias),
    Default(Debias),
    JumpMean,
    Harmonic,
    Edges,
}

/// Mean and variance of one estimate.
#[derive(Clone, Copy)]
pub(super) struct Measured {
    pub(super) samples: usize,
    pub(super) bias: Bias,
    /// Σ over pixels of the variance of a sample, over Σ reference²; its standard error from the runs.
    pub(super) variance: Ratio,
    /// The median of that variance over the runs.
    pub(super) typical: f64,
    /// Rays per sample.
    pub(super) rays: f64,
}

impl Measured {
    /// Variance × rays.
    pub(super) fn cost(&self) -> Ratio {
        self.variance.scaled(self.rays)
    }

    /// Ratio of the variance over all runs together to that of a typical run.
    pub(super) fn growth(&self) -> f64 {
        self.variance.value / self.typical
    }
}

/// A scheme with its measurements.
pub(super) struct Scheme {
    pub(super) field: Field,
    pub(super) measured: Measured,
}

impl Scheme {
    /// Whether nothing in the run contradicts its variance: its error is small, more samples do not find
    /// more, and an unbiased mean agrees with the reference.
    pub(super) fn is_settled(&self) -> bool {
        let Measured { bias, variance, .. } = &self.measured;
        let on_target = !self.field.is_unbiased() || bias.missing.value.abs() < SETTLED * bias.missing.error;
        variance.error < KNOWN * variance.value && self.measured.growth() < GROWTH && on_target
    }

    /// Whether the variance is a lower bound only. That of a debiased scheme always is, as no run can tell
    /// that it has met the rarest samples, the largest ones.
    pub(super) fn is_bound(&self) -> bool {
        self.field.is_debiased() || !self.is_settled()
    }
}

/// All measurements in one world.
pub(super) struct Study {
    pub(super) setting: Setting,
    pub(super) curves: Vec<Curve>,
    pub(super) schemes: Vec<Scheme>,
}

impl Field {
    fn all() -> [Self; 9] {
        let fixed = Debias::Consistent { rays: RAYS };
        let roulette = |rays| Debias::RussianRoulette { rays, tail: TAIL };
        [
            Self::Original(fixed),
            Self::Original(Debias::Multilevel { rays: RAYS, first: LEVELS, ratio: LEVELS }),
            Self::Original(roulette(RAYS)),
            Self::Default(fixed),
            Self::Default(Warp::one_dimensional().debias),
            Self::Default(roulette(4)),
            Self::JumpMean,
            Self::Harmonic,
            Self::Edges,
        ]
    }

    /// Its name, its weight and its colour.
    fn looks(self) -> (String, &'static str, Color) {
        match self {
            Self::Original(debias) => (name(debias), "original", Palette::BLUE),
            Self::Default(debias) => (name(debias), "default", Palette::VERMILION),
            Self::JumpMean => ("mean over jumps".to_owned(), "none", Palette::OCHRE),
            Self::Harmonic => ("harmonic field".to_owned(), "none", Palette::GREEN),
            Self::Edges => ("edge sampling".to_owned(), "none", Color::INK),
        }
    }

    pub(super) fn name(self) -> String {
        self.looks().0
    }

    pub(super) fn weight(self) -> &'static str {
        self.looks().1
    }

    pub(super) fn color(self) -> Color {
        self.looks().2
    }

    /// Markers: squares are unbiased.
    pub(super) fn marker(self) -> Marker {
        match self {
            _ if self.is_unbiased() => Marker::Square,
            Self::Original(_) => Marker::Circle,
            _ => Marker::Diamond,
        }
    }

    fn debias(self) -> Option<Debias> {
        match self {
            Self::Original(debias) | Self::Default(debias) => Some(debias),
            Self::JumpMean | Self::Harmonic | Self::Edges => None,
        }
    }

    /// Auxiliary rays of one estimate of the field, where it has any.
    pub(super) fn auxiliary_rays(self) -> Option<f64> {
        self.debias().map(Debias::expected_rays)
    }

    /// Whether it is unbiased in theory.
    pub(super) fn is_unbiased(self) -> bool {
        self.debias().is_none_or(Debias::is_unbiased)
    }

    /// Whether a random number of auxiliary rays removes its bias.
    pub(super) fn is_debiased(self) -> bool {
        self.debias().is_some_and(Debias::is_unbiased)
    }

    /// Its share of rays. Heavy tails need all available rays, and the others converge with few.
    fn effort(self) -> f64 {
        match self {
            Self::Edges => 0.2,
            field if field.is_debiased() => 1.8,
            _ => 0.3,
        }
    }

    /// One run of it; edge sampling has no field.
    fn method(self, samples: usize, paths: Paths, seed: u64) -> Box<dyn Method> {
        let construction = match self {
            Self::Original(debias) => Construction::Auxiliary(Warp { debias, ..Warp::original(RAYS) }),
            Self::Default(debias) => Construction::Local(Warp { debias, ..Warp::one_dimensional() }),
            Self::JumpMean => Construction::JumpMean { reach: REACH },
            Self::Harmonic => Construction::Harmonic,
            Self::Edges => return Box::new(EdgeSampling { samples, paths, seed, ..EdgeSampling::default() }),
        };
        Box::new(WarpedArea { samples, paths, construction, seed, ..WarpedArea::default() })
    }
}

fn weights() -> [Series; 2] {
    let series = |name, color, marker, warp| Series { name, color, marker, warp };
    [
        series("original: linear B, γ = 3", Palette::BLUE, Marker::Circle, Warp::original(1)),
        series("default: B ~ s², γ = 1, local", Palette::VERMILION, Marker::Diamond, Warp::one_dimensional()),
    ]
}

impl Study {
    pub(super) fn new(context: &Context, setting: Setting, world: u64) -> anyhow::Result<Self> {
        // More in the long run, where the noise allows it.
        let counts = context.spend(&[2, 4, 8, 16, 32][..], &[1, 2, 4, 8, 16, 32, 64, 128]);
        let mut curves = vec![];
        for (index, series) in weights().into_iter().enumerate() {
            let mut points = vec![];
            for &rays in counts {
                let debias = Debias::Consistent { rays };
                let field = if index == 0 { Field::Original(debias) } else { Field::Default(debias) };
                // Few rays cost little and vary little.
                let effort = if rays < 8 { 0.3 } else { 0.6 };
                let seed = seed_of(context.seed(), &[10, 1, world, index as u64, rays as u64]);
                points.push((rays as f64, measure(context, &setting, field, effort, seed)?.bias));
            }
            curves.push(Curve { series, points });
        }
        let mut schemes = vec![];
        for (index, field) in Field::all().into_iter().enumerate() {
            let seed = seed_of(context.seed(), &[10, 2, world, index as u64]);
            schemes
                .push(Scheme { field, measured: measure(context, &setting, field, field.effort(), seed)? });
        }
        Ok(Self { setting, curves, schemes })
    }
}

/// All runs of a scheme, with as many samples as its share of rays allows.
fn measure(
    context: &Context,
    setting: &Setting,
    field: Field,
    effort: f64,
    seed: u64,
) -> anyhow::Result<Measured> {
    let auxiliary = match field {
        // It traces a ray to every vertex.
        Field::Harmonic => setting.world.vertex_count() as f64,
        // One ray determines the visible surface.
        _ => field.auxiliary_rays().unwrap_or(1.0),
    };
    // One field on the film, and about one at every surface; edge sampling takes about eight rays.
    let fields = (auxiliary + 2.0) * (1 + setting.paths.bounces) as f64;
    let rays = if matches!(field, Field::Edges) { 8.0 } else { fields };
    let samples = ((effort * context.spend(1.5e5, 6e6) / rays / RUNS as f64) as usize).max(2);
    let norm = dot(&setting.reference, &setting.reference);
    let (mut means, mut variances, mut rays) = (vec![], vec![], 0);
    for run in 0..RUNS {
        let method = field.method(samples, setting.paths, seed_of(seed, &[run as u64]));
        let image = method.forward(&setting.world, &setting.camera, &setting.change)?;
        variances.push(dot(&image.standard_error.total, &image.standard_error.total) * samples as f64 / norm);
        rays += image.rays;
        means.push(image.total());
    }
    Ok(Measured {
        samples: samples * RUNS,
        bias: regress(&setting.reference, &means),
        variance: Ratio::of_runs(&variances),
        typical: median(&variances),
        rays: rays as f64 / (RUNS * samples * PIXELS) as f64,
    })
}
