//! The numbers of `trade.md`.

use super::bias::{BOUND, Curve, GammaPoint, RAYS_OF_GAMMA, RAYS_OF_KAPPA, Rate};
use super::debias::{RAYS, Ratio, Scheme, name};
use super::front::{Contender, EDGES, JUMPS, MULTILEVEL, REACH, front};
use super::regression::Bias;
use super::target::VERTICES;
use crate::figures::common::percent;
use crate::plot::number;
use crate::prose::Prose;

/// Everything measured.
pub(super) struct Results {
    pub(super) rays: Vec<Curve>,
    pub(super) kappa: Vec<Curve>,
    pub(super) gamma: Vec<GammaPoint>,
    pub(super) schemes: Vec<Scheme>,
    pub(super) forward: Vec<Contender>,
    pub(super) reverse: Vec<Contender>,
}

/// The missing part in percent.
fn missing(bias: &Bias) -> String {
    Ratio { value: 100.0 * bias.missing, error: 100.0 * bias.error }.shown() + " %"
}

fn exponent(rate: Option<Rate>) -> String {
    rate.map_or_else(
        || "too little to measure".to_owned(),
        |r| format!("as N′<sup>{:.2} ± {:.2}</sup>", r.exponent, r.error).replace('-', "−"),
    )
}

/// The missing part with so many rays.
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
    pub(super) fn prose(&self) -> anyhow::Result<Prose> {
        let [original, default, gaussian] = [0, 2, 5].map(|i| &self.rays[i]);
        let [few, _, many] = RAYS_OF_GAMMA;
        let gamma = |gamma: f64, rays: usize| {
            let found = self.gamma.iter().find(|p| p.gamma == gamma && p.rays == rays);
            found.map_or_else(String::new, |p| missing(&p.bias))
        };
        let worst = self.rays.iter().flat_map(|c| &c.points).map(|(_, b)| b.error).fold(0.0, f64::max);
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

    /// What every unbiased scheme costs.
    fn prices(&self) -> String {
        let reference = |original: bool| self.schemes.iter().find(|s| s.original == original);
        let (Some(original), Some(own)) = (reference(true), reference(false)) else { return String::new() };
        let unbiased = self.schemes.iter().filter(|s| s.debias.is_unbiased() && !s.original);
        let price = |s: &Scheme| {
            let (a, b) = (s.relative(own).shown(), s.relative(original).shown());
            format!("{}: {a} times ({b} times the original’s weight’s)", name(s.debias))
        };
        unbiased.map(price).collect::<Vec<_>>().join("; ")
    }
}

/// "4.3 %": the variance × time of one method in those of another.
fn cost(contenders: &[Contender], one: &str, other: &str) -> String {
    let of = |name| contenders.iter().find(|c| c.looks.name == name).map_or(f64::NAN, Contender::cost);
    percent(of(one) / of(other))
}

/// "A up to 3 ms, then B, then C": who holds the front.
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
        let name = &contenders[*index].looks.name;
        let span =
            if i + 1 < count { format!(" up to {} ms a pixel", number(1e3 * until)) } else { String::new() };
        format!("{name}{span}")
    });
    words.collect::<Vec<_>>().join(", then ")
}
