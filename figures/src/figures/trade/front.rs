//! Error of every method after a given time.

use flatland::estimator::{Construction, EdgeSampling, FiniteDifference, Method, Rotation, WarpedArea};
use flatland::plane::Motion;
use flatland::plane::exact::Arrangement;
use flatland::warp::{Debias, Warp};
use glam::DVec2;
use rayon::prelude::*;

use super::debias::warped;
use super::regression::{Bias, regress_exactly};
use super::stratified::Kernel;
use super::target::{Ask, KAPPA, Spread, Target};
use crate::context::Context;
use crate::figures::common::Priced;
use crate::plot::{Color, Palette, Style};
use crate::seeds::seed_of;

/// Shortest and longest time shown, in seconds of one core per pixel.
pub(super) const TIMES: (f64, f64) = (1e-5, 10.0);
/// Independent runs of every method.
const RUNS: usize = 8;

/// Reach of the mean over discontinuities, in pixels.
pub(super) const REACH: f64 = 0.6;
/// Names used for look-up.
pub(super) const MULTILEVEL: &str = "warped area, multilevel";
pub(super) const JUMPS: &str = "mean over jumps";
pub(super) const EDGES: &str = "edge sampling";

/// A method with the parameters of its error after t seconds: error² = bias² + variance · seconds/t.
pub(super) struct Contender {
    pub(super) name: String,
    pub(super) style: Style,
    /// Whether it needs explicit edges.
    pub(super) needs_edges: bool,
    /// Whether it is unbiased in theory.
    pub(super) unbiased: bool,
    pub(super) bias: Bias,
    pub(super) spread: Spread,
    /// Seconds per sample of one pixel.
    pub(super) seconds: f64,
}

impl Contender {
    /// Variance × time of a sample: the time that a given precision takes.
    pub(super) fn cost(&self) -> f64 {
        self.spread.variance * self.seconds
    }

    /// Its bias, unless theory says that there is none, and its cost.
    pub(super) fn priced(&self) -> Priced {
        let bias = if self.unbiased { 0.0 } else { self.bias.squared.max(0.0).sqrt() };
        Priced { name: self.name.clone(), bias, cost: self.cost() }
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

/// The front: at every time the least error of the methods that need no edges, with that method.
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
    let (mode, few) = match target.ask {
        Ask::Pixels { .. } => (0, 4000),
        Ask::Vertices { .. } => (1, 100),
    };
    let bench = Bench { target, seed: seed_of(context.seed(), &[5, 5, mode]), effort: context.spend(1, 40) };
    let consistent = |rays| Debias::Consistent { rays };
    let mut out = vec![];
    for (name, color, debias) in [
        ("warped area, 4 rays", Palette::SKY, consistent(4)),
        ("warped area, 16 rays", Palette::BLUE, consistent(16)),
        ("warped area, 64 rays", Palette::BLUE.mix(Color::INK, 0.55), consistent(64)),
        (MULTILEVEL, Palette::VERMILION, Debias::default()),
        ("warped area, roulette", Palette::PURPLE, Debias::RussianRoulette { rays: 4, tail: 1.5 }),
    ] {
        out.push(bench.warped(name, Style::new(color), debias)?);
    }
    let style = Style::new(Palette::ORANGE).dashed();
    out.push(bench.contender("rotation", style, 2000, |samples, seed| {
        Box::new(Rotation { samples, kappa: KAPPA, seed, ..Rotation::default() })
    })?);
    for (step, color) in [(0.02, Palette::GREEN.tint(0.45)), (0.002, Palette::GREEN)] {
        let style = Style::new(color).dotted();
        let differences =
            bench.contender(&format!("differences, step {step}"), style, few, |samples, seed| {
                Box::new(FiniteDifference { samples, step, seed })
            })?;
        // The bias is exact: the displaced images are known.
        let bias = regress_exactly(&target.exact, &bench.exact_difference(step)?);
        out.push(Contender { bias, ..differences });
    }
    let style = Style::new(Palette::VERMILION.mix(Color::INK, 0.45)).dashed();
    let jumps = bench.contender(JUMPS, style, 2000, |samples, seed| {
        let construction = Construction::JumpMean { reach: REACH };
        Box::new(WarpedArea { samples, construction, seed, ..WarpedArea::default() })
    })?;
    let style = Style::new(Color::INK).dashed();
    let edges =
        bench.contender(EDGES, style, 2000, |samples, seed| Box::new(EdgeSampling { samples, seed }))?;
    out.extend([jumps, edges].map(|one| Contender { needs_edges: true, unbiased: true, ..one }));
    Ok(out)
}

/// Measures methods.
struct Bench<'a> {
    target: &'a Target,
    seed: u64,
    effort: usize,
}

impl Bench<'_> {
    fn contender(
        &self,
        name: &str,
        style: Style,
        samples: usize,
        method: impl Fn(usize, u64) -> Box<dyn Method>,
    ) -> anyhow::Result<Contender> {
        let many = samples * self.effort;
        let seed = |run: usize| seed_of(self.seed, &[run as u64]);
        let (bias, spread) = self.target.measure(RUNS, many, |run| method(many, seed(run)))?;
        let seconds = self.target.seconds(samples / 2, &*method(samples / 2, seed(RUNS)))?;
        let name = name.to_owned();
        Ok(Contender { name, style, needs_edges: false, unbiased: false, bias, spread, seconds })
    }

    /// The bias of a fixed number of rays is measured separately, by stratification.
    fn warped(&self, name: &str, style: Style, debias: Debias) -> anyhow::Result<Contender> {
        let unbiased = debias.is_unbiased();
        // Heavy tails need many samples before the variance is visible.
        let budget = if unbiased { 16_000.0 } else { 8_000.0 };
        let samples = (budget / (debias.expected_rays() + 4.0)) as usize;
        let warp = Warp { debias, ..Warp::default() };
        let method = |samples, seed| warped(warp, samples, seed);
        let mut contender = Contender { unbiased, ..self.contender(name, style, samples, method)? };
        if !unbiased {
            let kernel = Kernel { warp, kappa: KAPPA };
            contender.bias = self.target.bias(kernel, RUNS * self.effort.min(8), self.seed);
        }
        Ok(contender)
    }

    /// The mean of finite differences.
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
}
