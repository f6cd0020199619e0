//! The error that every method has after a given time.

use flatland::estimator::{EdgeSampling, FiniteDifference, Method, Rotation, WarpedArea};
use flatland::plane::exact::Arrangement;
use flatland::warp::{Debias, Warp};

use super::debias::{RAYS, Scheme};
use super::study::{Bias, KAPPA, Spread, Study, seed_of};
use crate::context::Context;
use crate::plot::{Color, Palette};

/// Shortest and longest time shown, in seconds of one core per pixel.
pub(super) const TIMES: (f64, f64) = (3e-6, 3.0);

/// How a method is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    Solid,
    Dashed,
    Dotted,
}

/// A method with what decides its error after t seconds: error² = bias² + variance · seconds/t.
pub(super) struct Contender {
    pub(super) name: String,
    pub(super) color: Color,
    pub(super) line: Line,
    /// Whether it needs to be told where edges are.
    pub(super) needs_edges: bool,
    /// None where theory says that there is none.
    pub(super) bias: Option<Bias>,
    pub(super) spread: Spread,
    /// Seconds a sample of one pixel.
    pub(super) seconds: f64,
}

impl Contender {
    /// The relative RMS error after `time` seconds a pixel.
    pub(super) fn error(&self, time: f64) -> f64 {
        let squared = self.bias.map_or(0.0, |bias| bias.squared.max(0.0));
        (squared + self.spread.variance * self.seconds / time).sqrt()
    }

    /// The curve over all times that allow one sample.
    pub(super) fn curve(&self) -> Vec<[f64; 2]> {
        times().filter(|t| *t >= self.seconds).map(|t| [t, self.error(t)]).collect()
    }
}

/// Times, evenly spaced by their logarithms.
pub(super) fn times() -> impl Iterator<Item = f64> {
    let (low, high) = (TIMES.0.ln(), TIMES.1.ln());
    (0..=200).map(move |i| (low + (high - low) * f64::from(i) / 200.0).exp())
}

/// The least error of the methods that need no edges, at every time one of them can be used: the front.
pub(super) fn front(contenders: &[Contender]) -> Vec<(f64, f64, usize)> {
    let able = |time: f64| {
        let fits = move |c: &Contender| !c.needs_edges && c.seconds <= time;
        contenders.iter().enumerate().filter(move |(_, c)| fits(c))
    };
    times()
        .filter_map(|time| {
            let errors = able(time).map(|(i, c)| (time, c.error(time), i));
            errors.min_by(|a, b| a.1.total_cmp(&b.1))
        })
        .collect()
}

/// All methods, measured.
pub(super) fn contenders(
    context: &Context,
    study: &Study,
    schemes: &[Scheme],
) -> anyhow::Result<Vec<Contender>> {
    let mut out = vec![];
    let blues = [Palette::SKY, Palette::BLUE, Palette::BLUE.mix(Color::INK, 0.5)];
    for (rays, color) in [4, 16, 64].into_iter().zip(blues) {
        out.push(consistent(context, study, rays, color)?);
    }
    for (scheme, color, word) in [
        (schemes.iter().find(|s| !s.original && s.debias == Debias::default()), Palette::VERMILION, "multilevel"),
        (
            schemes.iter().find(|s| !s.original && matches!(s.debias, Debias::RussianRoulette { .. })),
            Palette::PURPLE,
            "Russian roulette",
        ),
    ] {
        let Some(scheme) = scheme else { continue };
        let samples = context.spend(600, 4000);
        let warp = Warp { debias: scheme.debias, ..Warp::default() };
        let seed = seed_of(context.seed(), &[5, 5, scheme.debias.expected_rays().to_bits()]);
        let method = WarpedArea { samples, kappa: KAPPA, warp, seed, ..WarpedArea::default() };
        out.push(Contender {
            name: format!("warped area, {word}"),
            color,
            line: Line::Solid,
            needs_edges: false,
            bias: None,
            spread: scheme.spread(),
            seconds: study.seconds(&method, samples)?,
        });
    }
    out.push(rotation(context, study)?);
    for (step, tint) in [(0.5, 0.0), (0.1, 0.3), (0.01, 0.55)] {
        out.push(finite_difference(context, study, step, Palette::GREEN.tint(tint))?);
    }
    out.push(edge_sampling(context, study)?);
    Ok(out)
}

fn consistent(context: &Context, study: &Study, rays: usize, color: Color) -> anyhow::Result<Contender> {
    let (batches, grid, budget) = context.spend((8, 48, 60_000), (32, 128, 2_000_000));
    let warp = Warp { debias: Debias::Consistent { rays }, ..Warp::default() };
    let seed = seed_of(context.seed(), &[5, 6, rays as u64]);
    let samples = budget / (rays + 8);
    let method = WarpedArea { samples, kappa: KAPPA, warp, seed, ..WarpedArea::default() };
    let timed = WarpedArea { samples: 8000 / (rays + 8), ..method };
    Ok(Contender {
        name: format!("warped area, {rays} rays"),
        color,
        line: if rays == RAYS { Line::Solid } else { Line::Dashed },
        needs_edges: false,
        bias: Some(study.bias(warp, KAPPA, batches * 2, grid, seed)),
        spread: study.spread(&method, samples)?,
        seconds: study.seconds(&timed, timed.samples)?,
    })
}

fn rotation(context: &Context, study: &Study) -> anyhow::Result<Contender> {
    let samples = context.spend(2000, 60_000);
    let method = Rotation { samples, kappa: KAPPA, ..Rotation::default() };
    let run = |batch: usize| Rotation { seed: seed_of(context.seed(), &[5, 7, batch as u64]), ..method };
    let timed = Rotation { samples: 500, ..method };
    Ok(Contender {
        name: "rotation".to_owned(),
        color: Palette::ORANGE,
        line: Line::Solid,
        needs_edges: false,
        bias: Some(study.bias_of(8, run)?),
        spread: study.spread(&run(8), samples)?,
        seconds: study.seconds(&timed, timed.samples)?,
    })
}

/// The bias is exact: both displaced images are known.
fn finite_difference(context: &Context, study: &Study, step: f64, color: Color) -> anyhow::Result<Contender> {
    let image = |theta: f64| -> anyhow::Result<Vec<f64>> {
        let scene = study.motion.displace(&study.scene, theta)?;
        let image = Arrangement::new(&scene, &study.film)?.primal(&study.film);
        Ok(image.pixels().iter().map(|pixel| pixel.x).collect())
    };
    let (plus, minus) = (image(step)?, image(-step)?);
    let difference: Vec<f64> = plus.iter().zip(minus).map(|(p, m)| (p - m) / (2.0 * step)).collect();
    let samples = context.spend(8000, 200_000);
    let seed = seed_of(context.seed(), &[5, 8, step.to_bits()]);
    let method = FiniteDifference { samples, step, seed };
    let timed = FiniteDifference { samples: 4000, ..method };
    Ok(Contender {
        name: format!("finite differences, step {step}"),
        color,
        line: Line::Dotted,
        needs_edges: false,
        bias: Some(study.bias_exactly(&difference)),
        spread: study.spread(&method, samples)?,
        seconds: study.seconds(&timed, timed.samples)?,
    })
}

fn edge_sampling(context: &Context, study: &Study) -> anyhow::Result<Contender> {
    let samples = context.spend(4000, 100_000);
    let method = EdgeSampling { samples, seed: seed_of(context.seed(), &[5, 9]) };
    let timed: &dyn Method = &EdgeSampling { samples: 2000, ..method };
    Ok(Contender {
        name: "edge sampling (has the edges)".to_owned(),
        color: Color::INK,
        line: Line::Dashed,
        needs_edges: true,
        bias: None,
        spread: study.spread(&method, samples)?,
        seconds: study.seconds(timed, 2000)?,
    })
}
