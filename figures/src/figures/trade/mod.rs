//! Bias, variance and time: the bias of a fixed number of auxiliary rays, the cost of removing it,
//! and the best method at equal time.

pub(super) mod bias;
pub(super) mod debias;
mod front;
mod page;
pub(super) mod regression;
mod stratified;
mod target;

use self::bias::{BOUND, Curve, GammaPoint, RAYS_OF_GAMMA, RAYS_OF_KAPPA};
use self::debias::{RAYS, Scheme, name};
use self::front::{Contender, EDGES, JUMPS, MULTILEVEL, REACH, front};
use self::regression::Bias;
use self::target::{KAPPA, Target, VERTICES};
use crate::context::Context;
use crate::figures::common::{crossovers, listed, percent, times};
use crate::gallery::Section;
use crate::output::{Cell, Table};
use crate::plot::number;
use crate::prose::Prose;
use crate::ratio::Ratio;

/// Measures, draws and explains.
pub(crate) fn draw(context: &Context) -> anyhow::Result<Section> {
    let image = Target::image()?;

    context.step("bias against N′");
    let rays = bias::against_rays(context, &image);

    context.step("bias against κ");
    let kappa = bias::against_kappa(context, &image);

    context.step("bias and variance against γ");
    let gamma = bias::against_gamma(context, &image)?;
    context.png("trade_bias.png", &page::bias_page(&image, &rays, &kappa, &gamma))?;

    context.step("debiasing schemes");
    let schemes = debias::schemes(context, &image)?;

    context.step("error at equal time");
    let forward = front::contenders(context, &image)?;
    let reverse = front::contenders(context, &Target::vertices()?)?;
    context.png("trade.png", &page::trade_page(&schemes, &forward, &reverse))?;
    let results = Results { rays, kappa, gamma, schemes, forward, reverse };
    let data = results.write(context)?;
    let mut section = results.prose()?.section("trade", data, results.methods())?;
    let priced = |all: &[Contender]| all.iter().map(Contender::priced).collect::<Vec<_>>();
    let (forward, reverse) = (priced(&results.forward), priced(&results.reverse));
    section.values.push(("times".to_owned(), times(&forward)));
    section.values.push(("times_reverse".to_owned(), times(&reverse)));
    if let Some(multilevel) = forward.iter().find(|method| method.name == MULTILEVEL) {
        section.values.push(("crossovers".to_owned(), crossovers(&forward, multilevel)));
    }
    Ok(section)
}

/// All measurements.
struct Results {
    rays: Vec<Curve>,
    kappa: Vec<Curve>,
    gamma: Vec<GammaPoint>,
    schemes: Vec<Scheme>,
    forward: Vec<Contender>,
    reverse: Vec<Contender>,
}

/// The missing part in percent.
fn missing(bias: &Bias) -> String {
    bias.missing.scaled(100.0).shown() + " %"
}

fn exponent(rate: Option<Ratio>) -> String {
    rate.map_or_else(
        || "too little to measure".to_owned(),
        |r| format!("as N′<sup>{:.2} ± {:.2}</sup>", r.value, r.error).replace('-', "−"),
    )
}

/// The missing part with `rays` rays.
fn at(curve: &Curve, rays: usize) -> String {
    let found = curve.points.iter().find(|(n, _)| *n == rays as f64);
    found.map_or_else(String::new, |(_, bias)| missing(bias))
}

/// The missing part at the least κ and at the largest.
fn ends(curve: &Curve) -> String {
    let [from, to] = [0, curve.points.len() - 1].map(|i| {
        let (kappa, bias) = &curve.points[i];
        format!("{} at κ = {}", missing(bias), number(*kappa))
    });
    format!("from {from} to {to}")
}

impl Results {
    /// The text on bias, variance and time.
    fn prose(&self) -> anyhow::Result<Prose> {
        let [original, default, gaussian] = [0, 2, 5].map(|i| &self.rays[i]);
        let [few, _, many] = RAYS_OF_GAMMA;
        let gamma = |gamma: f64, rays: usize| {
            let found = self.gamma.iter().find(|p| p.gamma == gamma && p.rays == rays);
            found.map_or_else(String::new, |p| missing(&p.bias))
        };
        let worst =
            self.rays.iter().flat_map(|c| &c.points).map(|(_, b)| b.missing.error).fold(0.0, f64::max);
        Prose::new(
            include_str!("trade.md"),
            &[
                ("original_16", &at(original, 16)),
                ("original_rate", &exponent(original.rate())),
                ("default_16", &at(default, 16)),
                ("default_rate", &exponent(default.rate())),
                ("gaussian_256", &at(gaussian, 256)),
                ("kappa_original", &ends(&self.kappa[0])),
                ("kappa_20", &ends(&self.kappa[3])),
                ("kappa_2", &ends(&self.kappa[2])),
                ("rays_of_kappa", &RAYS_OF_KAPPA),
                ("bound", &BOUND),
                ("few", &few),
                ("many", &many),
                ("gamma_1_many", &gamma(1.0, many)),
                ("gamma_1_few", &gamma(1.0, few)),
                ("gamma_2_many", &gamma(2.0, many)),
                ("gamma_2_few", &gamma(2.0, few)),
                ("rays", &RAYS),
                ("schemes", &self.prices()),
                ("best_forward", &succession(&self.forward)),
                ("coordinates", &(2 * VERTICES)),
                ("best_reverse", &succession(&self.reverse)),
                ("reach", &number(REACH)),
                ("jumps_forward", &cost(&self.forward, JUMPS, MULTILEVEL)),
                ("jumps_reverse", &cost(&self.reverse, JUMPS, MULTILEVEL)),
                ("edges_forward", &cost(&self.forward, EDGES, JUMPS)),
                ("edges_reverse", &cost(&self.reverse, EDGES, JUMPS)),
                ("worst", &percent(worst)),
            ],
        )
    }

    /// Writes all data and returns the names of the files.
    fn write(&self, context: &Context) -> anyhow::Result<Vec<String>> {
        Ok(vec![
            context.csv("trade_bias.csv", &self.biases())?,
            context.csv("trade_debiasing.csv", &self.debiasing())?,
            context.csv("trade_methods.csv", &self.methods())?,
        ])
    }

    fn biases(&self) -> Table {
        // The varied parameter, a weight, its rays, κ, and γ if it is not the weight's own; bias, and
        // variance if known.
        type Row<'a> = (&'a str, &'a str, [f64; 2], Option<f64>, &'a Bias, Option<f64>);
        let mut rows: Vec<Row<'_>> = vec![];
        for curve in &self.rays {
            let row = |(x, bias)| ("rays", curve.series.name, [x, KAPPA], None, bias, None);
            rows.extend(curve.points.iter().map(|(x, bias)| row((*x, bias))));
        }
        for curve in &self.kappa {
            let row = |(x, bias)| ("kappa", curve.series.name, [RAYS_OF_KAPPA as f64, x], None, bias, None);
            rows.extend(curve.points.iter().map(|(x, bias)| row((*x, bias))));
        }
        rows.extend(self.gamma.iter().map(|point| {
            let GammaPoint { rays, gamma, bias, spread } = point;
            let weight = "linear B, radial exponent 0.3";
            ("gamma", weight, [*rays as f64, KAPPA], Some(*gamma), bias, Some(spread.variance))
        }));
        let known = |value: Option<f64>| value.map_or_else(|| "".into(), Cell::from);
        Table::of(
            rows,
            &[
                ("varied", &|row| row.0.into()),
                ("weight", &|row| row.1.into()),
                ("auxiliary rays", &|row| row.2[0].into()),
                ("kappa", &|row| row.2[1].into()),
                ("gamma", &|row| known(row.3)),
                ("missing part", &|row| row.4.missing.value.into()),
                ("its standard error", &|row| row.4.missing.error.into()),
                ("squared relative bias", &|row| row.4.squared.into()),
                ("variance of a sample", &|row| known(row.5)),
            ],
        )
    }

    fn debiasing(&self) -> Table {
        let relative = |scheme: &Scheme, original: bool| {
            let reference = self.schemes.iter().find(|s| s.original == original);
            reference.map_or(Ratio { value: f64::NAN, error: f64::NAN }, |one| scheme.cost.over(one.cost))
        };
        Table::of(
            &self.schemes,
            &[
                ("scheme", &|s| name(s.debias).into()),
                ("weight", &|s| if s.original { "original" } else { "default" }.into()),
                ("variance × rays", &|s| s.cost.value.into()),
                ("its standard error", &|s| s.cost.error.into()),
                ("median of batches", &|s| s.median.into()),
                ("relative to 16 rays of the same weight", &|s| relative(s, s.original).value.into()),
                ("its standard error", &|s| relative(s, s.original).error.into()),
                ("relative to 16 rays of the original's weight", &|s| relative(s, true).value.into()),
                ("its standard error", &|s| relative(s, true).error.into()),
            ],
        )
    }

    /// Every method of the second picture.
    fn methods(&self) -> Table {
        let forward = self.forward.iter().map(|contender| ("image", contender));
        Table::of(
            forward.chain(self.reverse.iter().map(|contender| ("vertices", contender))),
            &[
                ("derivative", &|(derivative, _)| (*derivative).into()),
                ("method", &|(_, c)| c.name.clone().into()),
                ("missing part", &|(_, c)| c.bias.missing.value.into()),
                ("± error", &|(_, c)| c.bias.missing.error.into()),
                ("bias², relative", &|(_, c)| c.bias.squared.into()),
                ("variance of a sample", &|(_, c)| c.spread.variance.into()),
                ("rays a sample", &|(_, c)| c.spread.rays.into()),
                ("µs a sample", &|(_, c)| (1e6 * c.seconds).into()),
            ],
        )
    }

    /// Cost of every unbiased scheme.
    fn prices(&self) -> String {
        let reference = |original: bool| self.schemes.iter().find(|s| s.original == original);
        let (Some(original), Some(own)) = (reference(true), reference(false)) else { return String::new() };
        let unbiased = self.schemes.iter().filter(|s| s.debias.is_unbiased() && !s.original);
        let price = |s: &Scheme| {
            let [a, b] = [own, original].map(|one| s.cost.over(one.cost).shown());
            format!("{}: {a} times ({b} times the original’s weight’s)", name(s.debias))
        };
        listed(unbiased.map(price))
    }
}

/// "4.3 %": the variance × time of one method in those of another.
fn cost(contenders: &[Contender], one: &str, other: &str) -> String {
    let of = |name| contenders.iter().find(|c| c.name == name).map_or(f64::NAN, Contender::cost);
    percent(of(one) / of(other))
}

/// "A up to 3 ms, then B, then C": the methods on the front.
fn succession(contenders: &[Contender]) -> String {
    let mut parts: Vec<(usize, f64)> = vec![];
    for (time, _, index) in front(contenders) {
        match parts.last_mut() {
            Some(last) if last.0 == index => last.1 = time,
            _ => parts.push((index, time)),
        }
    }
    let count = parts.len();
    let words = parts.iter().enumerate().map(|(i, (index, until))| {
        let name = &contenders[*index].name;
        let span =
            if i + 1 < count { format!(" up to {} ms a pixel", number(1e3 * until)) } else { String::new() };
        format!("{name}{span}")
    });
    words.collect::<Vec<_>>().join(", then ")
}
