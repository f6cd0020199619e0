//! Bias of a fixed number of auxiliary rays, against the parameters that determine it.

use flatland::warp::{BoundaryFunction, Debias, Warp, Weighting};

use super::debias::warped;
use super::regression::Bias;
use super::stratified::Kernel;
use super::target::{KAPPA, Spread, Target};
use crate::context::Context;
use crate::plot::{Color, Marker, Palette};
use crate::ratio::Ratio;
use crate::seeds::seed_of;

/// Auxiliary rays N' of the first study.
const RAYS: [usize; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];
/// Number of rays from which the bias is expected to follow a power of N'.
pub(in crate::figures) const SETTLED: usize = 8;
/// Auxiliary rays of the study of κ.
pub(super) const RAYS_OF_KAPPA: usize = 16;
/// Auxiliary rays of the study of γ.
pub(super) const RAYS_OF_GAMMA: [usize; 3] = [8, 32, 128];
/// The least γ for which a linear B is boundary consistent in two dimensions: 1/p + 1/2, p = 1.
pub(super) const BOUND: f64 = 1.5;

/// A weight with its appearance.
pub(in crate::figures) struct Series {
    pub(in crate::figures) name: &'static str,
    pub(in crate::figures) color: Color,
    pub(in crate::figures) marker: Marker,
    pub(in crate::figures) warp: Warp,
}

/// A series with its bias along some axis.
pub(in crate::figures) struct Curve {
    pub(in crate::figures) series: Series,
    /// (parameter, bias).
    pub(in crate::figures) points: Vec<(f64, Bias)>,
}

/// Bias and variance of one γ and N'.
pub(super) struct GammaPoint {
    pub(super) rays: usize,
    pub(super) gamma: f64,
    pub(super) bias: Bias,
    pub(super) spread: Spread,
}

fn with(boundary: BoundaryFunction, gamma: f64, warp: Warp) -> Warp {
    Warp { weighting: Weighting::BoundaryAware { gamma, boundary }, ..warp }
}

/// The weight with a fixed number of rays.
fn consistent(rays: usize, warp: Warp) -> Warp {
    Warp { debias: Debias::Consistent { rays }, ..warp }
}

/// Six weights, from the original to one that is biased for any number of rays.
fn weights() -> Vec<Series> {
    let original = Warp::original(1);
    let steeper = Warp { radial_exponent: 0.3, ..original };
    let blind = with(BoundaryFunction::SceneScaled { scale: 2.0 }, 3.0, original);
    let grazing = with(BoundaryFunction::Grazing { scale: 2.0 }, 3.0, original);
    let gaussian = Warp { weighting: Weighting::Gaussian, ..original };
    let series = |name, color, marker, warp| Series { name, color, marker, warp };
    vec![
        series("original: linear B, γ = 3", Palette::BLUE, Marker::Circle, original),
        series("the same, radial exponent 0.3", Palette::SKY, Marker::Square, steeper),
        series("default: B ~ s², γ = 3/2", Palette::VERMILION, Marker::Diamond, Warp::default()),
        series("B = 2s, blind to κ", Palette::GREEN, Marker::TriangleUp, blind),
        series("grazing: B ~ √s, γ = 3", Palette::PURPLE, Marker::TriangleDown, grazing),
        series("Gaussian: no B", Palette::GREY, Marker::Cross, gaussian),
    ]
}

/// Boundary functions that depend on the kernel's width, and two that do not.
fn boundaries() -> Vec<Series> {
    let mut list: Vec<Series> =
        weights().into_iter().enumerate().filter(|(i, _)| [0, 2, 3].contains(i)).map(|(_, s)| s).collect();
    let warp = with(BoundaryFunction::SceneScaled { scale: 20.0 }, 3.0, Warp::original(1));
    let (name, color) = ("B = 20s, blind to κ", Palette::OCHRE);
    list.push(Series { name, color, marker: Marker::TriangleDown, warp });
    list
}

/// Bias against N'.
pub(super) fn against_rays(context: &Context, target: &Target) -> Vec<Curve> {
    along(weights(), &RAYS.map(|rays| rays as f64), |index, warp, x| {
        let rays = x as usize;
        // Few rays have low cost and high variance.
        let batches = context.spend(8, 96) * (32 / rays).clamp(1, 6);
        let seed = seed_of(context.seed(), &[5, 1, index, rays as u64]);
        target.bias(Kernel { warp: consistent(rays, warp), kappa: KAPPA }, batches, seed)
    })
}

/// Bias against κ at a fixed number of rays.
pub(super) fn against_kappa(context: &Context, target: &Target) -> Vec<Curve> {
    let kappas: Vec<f64> = (0..9).map(|i| 10.0 * 10f64.powf(f64::from(i) * 0.3125)).collect();
    along(boundaries(), &kappas, |index, warp, kappa| {
        let seed = seed_of(context.seed(), &[5, 2, index, kappa.to_bits()]);
        target.bias(Kernel { warp: consistent(RAYS_OF_KAPPA, warp), kappa }, context.spend(8, 96), seed)
    })
}

fn along(all: Vec<Series>, places: &[f64], bias: impl Fn(u64, Warp, f64) -> Bias) -> Vec<Curve> {
    let curve = |(index, series): (u64, Series)| {
        let points = places.iter().map(|&x| (x, bias(index, series.warp, x))).collect();
        Curve { series, points }
    };
    (0..).zip(all).map(curve).collect()
}

/// Bias and variance against γ, with the linear boundary function of the original.
pub(super) fn against_gamma(context: &Context, target: &Target) -> anyhow::Result<Vec<GammaPoint>> {
    let (batches, budget) = context.spend((8, 40_000), (96, 1_000_000));
    let mut out = vec![];
    for rays in RAYS_OF_GAMMA {
        for gamma in [0.5, 0.75, 1.0, 1.25, BOUND, 2.0, 3.0, 4.0, 6.0] {
            let warp = Warp { radial_exponent: 0.3, ..Warp::original(rays) };
            let warp = with(BoundaryFunction::KernelScaled { scale: 0.6 }, gamma, warp);
            let seed = seed_of(context.seed(), &[5, 3, rays as u64, gamma.to_bits()]);
            let bias = target.bias(Kernel { warp, kappa: KAPPA }, batches, seed);
            let samples = (budget / (rays + 8)).max(600);
            let (_, spread) = target.measure(1, samples, |_| warped(warp, samples, seed))?;
            out.push(GammaPoint { rays, gamma, bias, spread });
        }
    }
    Ok(out)
}

impl Curve {
    /// The exponent of N' in the bias: the log–log slope by weighted least squares, over the settled points
    /// that exceed the noise by three standard errors; `None` if those are fewer than three.
    pub(in crate::figures) fn rate(&self) -> Option<Ratio> {
        let fitted: Vec<[f64; 3]> = self
            .points
            .iter()
            .map(|(rays, bias)| (*rays, bias.missing))
            .filter(|(rays, missing)| *rays >= SETTLED as f64 && missing.value > 3.0 * missing.error)
            .map(|(rays, missing)| [rays.ln(), missing.value.ln(), (missing.value / missing.error).powi(2)])
            .collect();
        if fitted.len() < 3 {
            return None;
        }
        let total: f64 = fitted.iter().map(|[.., w]| w).sum();
        let mean = |k: usize| fitted.iter().map(|point| point[2] * point[k]).sum::<f64>() / total;
        let (x, y) = (mean(0), mean(1));
        let (mut xx, mut xy) = (0.0, 0.0);
        for [a, b, w] in &fitted {
            xx += w * (a - x) * (a - x);
            xy += w * (a - x) * (b - y);
        }
        Some(Ratio { value: xy / xx, error: xx.sqrt().recip() })
    }
}
