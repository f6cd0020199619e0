//! What the study found, in words.

use super::bias::{BOUND, Curve, GammaPoint, RAYS_OF_GAMMA, RAYS_OF_KAPPA, Rate};
use super::debias::{RAYS, Ratio, Scheme, name};
use super::front::{Contender, EDGES, JUMPS, MULTILEVEL, REACH, front};
use super::target::VERTICES;
use crate::gallery::{Placement, escape, formula};
use crate::plot::number;

/// Everything measured.
pub(super) struct Results {
    pub(super) rays: Vec<Curve>,
    pub(super) kappa: Vec<Curve>,
    pub(super) gamma: Vec<GammaPoint>,
    pub(super) schemes: Vec<Scheme>,
    pub(super) forward: Vec<Contender>,
    pub(super) reverse: Vec<Contender>,
}

/// The formulas of the figure.
pub(super) fn formulas() -> String {
    formula(
        r"V ≈ \frac{∑_i w_i V_i}{∑_i w_i}, \quad w = (D + B)^{-γ}, \quad \text{error}^2(t) = \text{bias}^2 + \text{variance} · \frac{\text{time of a sample}}{t}",
        Placement::Display,
    )
}

fn inline(source: &str) -> String {
    formula(source, Placement::Inline)
}

fn percent(part: f64) -> String {
    format!("{} %", number(100.0 * part))
}

fn measured(value: f64, error: f64) -> String {
    Ratio { value: 100.0 * value, error: 100.0 * error }.shown().replace('-', "−") + " %"
}

fn exponent(rate: Option<Rate>) -> String {
    rate.map_or_else(
        || "too little to measure".to_owned(),
        |r| format!("as N′<sup>{:.2} ± {:.2}</sup>", r.exponent, r.error).replace('-', "−"),
    )
}

impl Results {
    /// The figure in a few paragraphs.
    pub(super) fn explanation(&self) -> String {
        [self.about_rays(), self.about_kappa_and_gamma(), self.about_debiasing(), self.about_time()].concat()
    }

    fn about_rays(&self) -> String {
        let [original, default, gaussian] = [0, 2, 5].map(|i| &self.rays[i]);
        let at = |curve: &Curve, rays: usize| {
            let found = curve.points.iter().find(|(n, _)| *n == rays as f64);
            found.map_or_else(String::new, |(_, b)| measured(b.missing, b.error))
        };
        format!(
            "<p>The warp field {} is estimated as a quotient of two sums over N′ <em>auxiliary rays</em>. The \
             mean of a quotient is not the quotient of the means, so a fixed N′ gives a biased gradient. It \
             is measured here as the missing part of the gradient: 1 less the slope of the mean gradient \
             image on the exact one. With the original’s weight 16 rays miss {} of the gradient, and \
             the bias falls {}; with the default weight they miss {}, and it falls {}. “Consistent” is \
             the word for this: right in the limit only. The Gaussian weight, which has no <em>boundary \
             function</em> B, still misses {} at 256 rays: no number of rays helps it.</p>",
            inline("V"),
            at(original, 16),
            exponent(original.rate()),
            at(default, 16),
            exponent(default.rate()),
            at(gaussian, 256),
        )
    }

    fn about_kappa_and_gamma(&self) -> String {
        let ends = |curve: &Curve| {
            let end = |point: Option<&(f64, super::regression::Bias)>| {
                point.map_or_else(String::new, |(k, b)| {
                    format!("{} at κ = {}", measured(b.missing, b.error), number(*k))
                })
            };
            format!("from {} to {}", end(curve.points.first()), end(curve.points.last()))
        };
        let gamma = |gamma: f64, rays: usize| {
            let found = self.gamma.iter().find(|p| p.gamma == gamma && p.rays == rays);
            found.map_or_else(String::new, |p| measured(p.bias.missing, p.bias.error))
        };
        let [few, _, many] = RAYS_OF_GAMMA;
        format!(
            "<p>The auxiliary kernel’s concentration κ should not matter, and does not if B is measured in \
             the kernel’s width (original: {}). A B that is blind to κ is at the mercy of the scene’s scale: \
             B = 20s goes {}, because it is 1, and the weight Gaussian, almost up to the silhouette of a wide \
             kernel. That a B = 2s, small over the whole kernel, does harm as well is not found on this scene: it \
             goes {} with {RAYS_OF_KAPPA} rays.</p>\
             <p>With a linear B the exponent must be γ ≥ {BOUND} in two dimensions. At γ = 1, below the bound, \
             going from {few} to {many} rays leaves {} of {}: the field does not meet the silhouette’s \
             velocity. At γ = 2 it leaves {} of {}. A larger γ lets single rays dominate, which costs variance \
             and then bias again.</p>",
            ends(&self.kappa[0]),
            ends(&self.kappa[3]),
            ends(&self.kappa[2]),
            gamma(1.0, many),
            gamma(1.0, few),
            gamma(2.0, many),
            gamma(2.0, few),
        )
    }

    fn about_debiasing(&self) -> String {
        let reference = |original: bool| self.schemes.iter().find(|s| s.original == original);
        let (Some(original), Some(own)) = (reference(true), reference(false)) else { return String::new() };
        let list: Vec<String> = self
            .schemes
            .iter()
            .filter(|s| s.debias.is_unbiased() && !s.original)
            .map(|s| {
                let (a, b) = (s.relative(own).shown(), s.relative(original).shown());
                format!("{}: {a} times ({b} times the original’s weight’s)", escape(&name(s.debias)))
            })
            .collect();
        format!(
            "<p>Two schemes remove the bias exactly by adding, with a random and unbounded number of rays, the \
             differences between estimates from more and more rays. What that costs is variance × rays, here \
             relative to {RAYS} rays of the same weight, which are biased: {}. The tails are heavy: means lie \
             above medians over batches, and the error bars are themselves uncertain.</p>",
            list.join("; "),
        )
    }

    fn about_time(&self) -> String {
        format!(
            "<p>At equal time, a biased method is ahead until its bias shows. Best among the methods that are \
             not told where edges are, for one parameter: {}. For the {} coordinates of a star, all at once in \
             reverse mode: {}. One parameter is the home ground of finite differences: two primal rays a sample, \
             and a bias of the step squared. They pay for every parameter anew; warped area pays once.</p>\
             <p>Two methods are given the edges of a scene that has few. The <em>mean over jumps</em> is warped area too, \
             but its V is a mean over the edges within {} pixels, by their inverse distance: V is exact, no auxiliary ray is \
             traced, and nothing is left to be debiased. In variance × time it costs {} of the multilevel estimate for \
             one parameter and {} for all. Edge sampling costs {} and {} of that; the figure before shows what becomes \
             of it as scenes grow. Times are those of the machine that drew the figure.</p>",
            succession(&self.forward),
            2 * VERTICES,
            succession(&self.reverse),
            number(REACH),
            cost(&self.forward, JUMPS, MULTILEVEL),
            cost(&self.reverse, JUMPS, MULTILEVEL),
            cost(&self.forward, EDGES, JUMPS),
            cost(&self.reverse, EDGES, JUMPS),
        )
    }

    /// What stands under the first picture.
    pub(super) fn bias_caption(&self) -> String {
        let worst = self.rays.iter().flat_map(|c| &c.points).map(|(_, b)| b.error).fold(0.0, f64::max);
        format!(
            "(a) A white quadrilateral moves and turns over black; red pixels gain, blue ones lose. The circle \
             shows the kernel’s width. (b) N′ on the names: the fitted power of N′ from 8 rays on. (c–e) As \
             named. Bars are standard errors, {} at most in (b); points within two of them of zero are left \
             out of log axes.",
            percent(worst),
        )
    }

    /// What stands under the second picture.
    pub(super) fn trade_caption(&self) -> String {
        "(a) How many times as many rays a scheme takes for the same noise; orange: default weight, blue: \
         original’s weight. Multilevel names its rays, P(L ≥ 1) and ratio. (b, c) Root-mean-square error of the \
         gradient relative to its norm, from measured bias, variance and time; the bias of debiased methods, \
         of the mean over jumps and of edge sampling is taken as the zero that theory says (the data hold the measured one)."
            .to_owned()
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
