//! The error that every method has after a given time.

use flatland::estimator::{Construction, EdgeSampling, FiniteDifference, Method, Rotation, WarpedArea};
use flatland::plane::Motion;
use flatland::plane::exact::Arrangement;
use flatland::warp::{Debias, Warp};
use glam::DVec2;
use rayon::prelude::*;

use super::regression::{Bias, regress_exactly};
use super::stratified::Kernel;
use super::target::{Ask, KAPPA, Spread, Target, seed_of};
use crate::context::Context;
use crate::plot::{Color, Palette};

/// Shortest and longest time shown, in seconds of one core per pixel.
pub(super) const TIMES: (f64, f64) = (1e-5, 10.0);
/// Independent runs of every method.
const RUNS: usize = 8;

/// The reach of the mean over jumps, in pixels.
pub(super) const REACH: f64 = 0.6;
/// Names that are asked for.
pub(super) const MULTILEVEL: &str = "warped area, multilevel";
pub(super) const JUMPS: &str = "mean over jumps";
pub(super) const EDGES: &str = "edge sampling";

/// How a method is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Line {
    Solid,
    Dashed,
    Dotted,
}

/// What a method is called and how it is drawn.
#[derive(Clone, Debug)]
pub(super) struct Looks {
    pub(super) name: String,
    pub(super) color: Color,
    pub(super) line: Line,
}

/// A method with what decides its error after t seconds: error² = bias² + variance · seconds/t.
pub(super) struct Contender {
    pub(super) looks: Looks,
    /// Whether it needs to be told where edges are.
    pub(super) needs_edges: bool,
    /// Whether theory says that it has no bias.
    pub(super) unbiased: bool,
    pub(super) bias: Bias,
    pub(super) spread: Spread,
    /// Seconds a sample of one pixel.
    pub(super) seconds: f64,
}

impl Contender {
    /// Variance × time of a sample: the time that a given precision takes.
    pub(super) fn cost(&self) -> f64 {
        self.spread.variance * self.seconds
    }

    /// The relative RMS error after `time` seconds a pixel.
    pub(super) fn error(&self, time: f64) -> f64 {
        let squared = if self.unbiased { 0.0 } else { self.bias.squared.max(0.0) };
        (squared + self.cost() / time).sqrt()
    }

    /// The curve over all times that allow one sample.
    pub(super) fn curve(&self) -> Vec<[f64; 2]> {
        times().filter(|t| *t >= self.seconds).map(|t| [t, self.error(t)]).collect()
    }
}

/// Times, evenly spaced by their logarithms.
fn times() -> impl Iterator<Item = f64> {
    let (low, high) = (TIMES.0.ln(), TIMES.1.ln());
    (0..=300).map(move |i| (low + (high - low) * f64::from(i) / 300.0).exp())
}

/// The front: at every time the least error of the methods that need no edges, and whose it is.
pub(super) fn front(contenders: &[Contender]) -> Vec<(f64, f64, usize)> {
    times()
        .filter_map(|time| {
            let able = contenders.iter().enumerate().filter(|(_, c)| !c.needs_edges && c.seconds <= time);
            able.map(|(i, c)| (time, c.error(time), i)).min_by(|a, b| a.1.total_cmp(&b.1))
        })
        .collect()
}

/// All methods, measured on one target.
pub(super) fn contenders(context: &Context, target: &Target) -> anyhow::Result<Vec<Contender>> {
    let mode = match target.ask {
        Ask::Pixels { .. } => 0,
        Ask::Vertices { .. } => 1,
    };
    let bench = Bench { target, seed: seed_of(context.seed(), &[5, 5, mode]), effort: context.spend(1, 40) };
    let dark = Palette::BLUE.mix(Color::INK, 0.55);
    let consistent = |rays| Debias::Consistent { rays };
    let look = |name: &str, color, line| Looks { name: name.to_owned(), color, line };
    let mut out = vec![
        bench.warped(look("warped area, 4 rays", Palette::SKY, Line::Solid), consistent(4))?,
        bench.warped(look("warped area, 16 rays", Palette::BLUE, Line::Solid), consistent(16))?,
        bench.warped(look("warped area, 64 rays", dark, Line::Solid), consistent(64))?,
        bench.warped(look(MULTILEVEL, Palette::VERMILION, Line::Solid), Debias::default())?,
        bench.warped(
            look("warped area, roulette", Palette::PURPLE, Line::Solid),
            Debias::RussianRoulette { rays: 4, tail: 1.5 },
        )?,
        bench.rotation(look("rotation", Palette::ORANGE, Line::Dashed))?,
    ];
    for (step, color) in [(0.02, Palette::GREEN.tint(0.45)), (0.002, Palette::GREEN)] {
        let name = format!("differences, step {step}");
        out.push(bench.finite_difference(Looks { name, color, line: Line::Dotted }, step)?);
    }
    out.push(bench.mean_over_jumps(look(JUMPS, Palette::VERMILION.mix(Color::INK, 0.45), Line::Dashed))?);
    out.push(bench.edge_sampling(look(EDGES, Color::INK, Line::Dashed))?);
    Ok(out)
}

/// Measures methods.
struct Bench<'a> {
    target: &'a Target,
    seed: u64,
    effort: usize,
}

impl Bench<'_> {
    fn seed(&self, run: usize) -> u64 {
        seed_of(self.seed, &[run as u64])
    }

    fn contender<M: Method>(
        &self,
        looks: Looks,
        samples: usize,
        method: impl Fn(usize, u64) -> M,
    ) -> anyhow::Result<Contender> {
        let many = samples * self.effort;
        let (bias, spread) = self.target.measure(RUNS, many, |run| method(many, self.seed(run)))?;
        let seconds = self.target.seconds(samples / 2, &method(samples / 2, self.seed(RUNS)))?;
        Ok(Contender { looks, needs_edges: false, unbiased: false, bias, spread, seconds })
    }

    /// The bias of a fixed number of rays is measured apart, by stratification.
    fn warped(&self, looks: Looks, debias: Debias) -> anyhow::Result<Contender> {
        let unbiased = debias.is_unbiased();
        // Heavy tails need many samples before the variance is seen.
        let budget = if unbiased { 16_000.0 } else { 8_000.0 };
        let samples = (budget / (debias.expected_rays() + 4.0)) as usize;
        let warp = Warp { debias, ..Warp::default() };
        let method = |samples, seed| WarpedArea {
            samples,
            construction: Construction::Auxiliary { warp, kappa: KAPPA },
            seed,
            ..WarpedArea::default()
        };
        let mut contender = Contender { unbiased, ..self.contender(looks, samples, method)? };
        if !unbiased {
            let kernel = Kernel { warp, kappa: KAPPA };
            contender.bias = self.target.bias(kernel, RUNS * self.effort.min(8), self.seed);
        }
        Ok(contender)
    }

    fn rotation(&self, looks: Looks) -> anyhow::Result<Contender> {
        self.contender(looks, 2000, |samples, seed| Rotation {
            samples,
            kappa: KAPPA,
            seed,
            ..Rotation::default()
        })
    }

    /// The bias is exact: the displaced images are known.
    fn finite_difference(&self, looks: Looks, step: f64) -> anyhow::Result<Contender> {
        let samples = match self.target.ask {
            Ask::Pixels { .. } => 4000,
            Ask::Vertices { .. } => 100,
        };
        let method = |samples, seed| FiniteDifference { samples, step, seed };
        let contender = self.contender(looks, samples, method)?;
        let difference = self.exact_difference(step)?;
        Ok(Contender { bias: regress_exactly(&self.target.exact, &difference), ..contender })
    }

    /// What finite differences compute in the mean.
    fn exact_difference(&self, step: f64) -> anyhow::Result<Vec<f64>> {
        let Target { scene, film, ask, .. } = self.target;
        let image = |motion: &Motion, theta: f64| -> anyhow::Result<_> {
            let moved = motion.displace(scene, theta)?;
            Ok(Arrangement::new(&moved, film)?.primal(film))
        };
        let difference = |motion: &Motion| -> anyhow::Result<_> {
            Ok(image(motion, step)?.zip(&image(motion, -step)?, |a, b| (a - b) / (2.0 * step)))
        };
        match ask {
            Ask::Pixels { motion, .. } => {
                Ok(difference(motion)?.pixels().iter().map(|pixel| pixel.x).collect())
            }
            Ask::Vertices { adjoint } => (0..2 * scene.vertices().len())
                .into_par_iter()
                .map(|i| Motion::vertex(0, i / 2, DVec2::AXES[i % 2]))
                .map(|motion| Ok(adjoint.dot(&difference(&motion)?)))
                .collect(),
        }
    }

    fn mean_over_jumps(&self, looks: Looks) -> anyhow::Result<Contender> {
        let construction = Construction::JumpMean { reach: REACH };
        let method = |samples, seed| WarpedArea { samples, construction, seed, ..WarpedArea::default() };
        let contender = self.contender(looks, 2000, method)?;
        Ok(Contender { needs_edges: true, unbiased: true, ..contender })
    }

    fn edge_sampling(&self, looks: Looks) -> anyhow::Result<Contender> {
        let contender = self.contender(looks, 2000, |samples, seed| EdgeSampling { samples, seed })?;
        Ok(Contender { needs_edges: true, unbiased: true, ..contender })
    }
}
