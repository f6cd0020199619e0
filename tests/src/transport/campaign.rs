//! Statistical comparison of estimated with exact values over many flat worlds, one number per world, by the
//! [`Verdict`](crate::campaign::Verdict) of the plane's campaigns.

use flatland::estimator::transport::{EdgeSampling, FiniteDifference, GradientImage, Method, WarpedArea};
use flatland::transport::Paths;
use rayon::prelude::*;

use super::oracle;
use super::worlds::{Case, Kind, Knobs, Moving};
use crate::campaign::{Reference, Target, focused};
use crate::comparison::Estimate;

/// A path-sampling method, all of whose paths follow from its seed.
pub trait Sampler: Method + Sync {
    /// A copy of the method with other paths and another seed.
    fn on(&self, paths: Paths, seed: u64) -> Self;
}

macro_rules! sampler {
    ($($method:ty),*) => {
        $(impl Sampler for $method {
            fn on(&self, paths: Paths, seed: u64) -> Self {
                Self { paths, seed, ..*self }
            }
        })*
    };
}

sampler!(WarpedArea, EdgeSampling, FiniteDifference);

/// A world with its exact derivative, reduced to one number by fixed random weights.
#[derive(Clone, Debug)]
pub struct Known {
    /// The world, its camera and its change.
    pub case: Case,
    /// The maximum number of scattering events.
    pub bounces: usize,
    /// One weight per pixel.
    pub weights: Vec<f64>,
    /// Σ |weight| (|dI/dθ| of every term + I): the scale of errors where [`exact`](Self::exact) is nearly 0.
    pub scale: f64,
    /// Σ weight · dI/dθ.
    pub exact: f64,
    /// The estimated error of [`exact`](Self::exact): rounding for up to one scattering event, and for more
    /// the error of the oracle's quadrature. Standard errors must be well above it.
    pub error: f64,
}

impl Known {
    /// The case with its derivative by the oracle; see [`oracle::image`] for its cost.
    pub fn new(case: Case, bounces: usize) -> Self {
        let pixels = oracle::image(&case.world, &case.camera, &case.change, bounces);
        let derivative: Vec<f64> = pixels.iter().map(|p| p.derivative).collect();
        let weights = focused(&derivative);
        let sum = |f: fn(&oracle::PixelOracle) -> f64| -> f64 {
            weights.iter().zip(&pixels).map(|(w, p)| w.abs() * f(p)).sum()
        };
        let exact = weights.iter().zip(&derivative).map(|(w, d)| w * d).sum();
        let (error, scale) = (sum(|p| 1e-12 * p.absolute + p.error), sum(|p| p.absolute + p.value));
        Self { case, bounces, weights, scale, exact, error }
    }

    /// The weighted sum of pixels with their standard errors, which are independent.
    pub fn estimate(&self, mean: &[f64], standard_error: &[f64]) -> Estimate {
        assert_eq!(mean.len(), self.weights.len(), "one mean per pixel");
        assert_eq!(standard_error.len(), self.weights.len(), "one standard error per pixel");
        let weighted =
            |values: &[f64]| self.weights.iter().zip(values).map(|(w, v)| w * v).collect::<Vec<_>>();
        let variance: f64 = weighted(standard_error).iter().map(|e| e * e).sum();
        Estimate { mean: weighted(mean).iter().sum(), standard_error: variance.sqrt() }
    }

    /// The scattering of light in this case.
    pub fn paths(&self) -> Paths {
        Paths { bounces: self.bounces, ..Paths::default() }
    }

    /// The gradient image of a method on this world's paths with a seed.
    pub fn run(&self, seed: u64, method: &impl Sampler) -> GradientImage {
        let Case { world, camera, change, label } = &self.case;
        let found = method.on(self.paths(), seed).forward(world, camera, change);
        let found = found.unwrap_or_else(|e| panic!("{e}\n{label}"));
        assert!(found.non_finite.is_empty(), "{:?} {label}", found.non_finite);
        found
    }

    /// The weighted estimate of a method; the reference's own error must be negligible relative to its
    /// standard error.
    pub fn total(&self, seed: u64, method: &impl Sampler) -> Estimate {
        let found = self.run(seed, method);
        let estimate = self.estimate(&found.total(), &found.standard_error.total);
        let least = (1e-6 * self.exact.abs()).max(1e-9 * self.scale);
        assert!(self.error <= 0.2 * estimate.standard_error.max(least), "{:e} {estimate:?}", self.error);
        estimate
    }

    /// The covector ∂L/∂I of the loss L = Σ weight · I, one per pixel: the input of reverse mode.
    pub fn adjoint(&self) -> &[f64] {
        &self.weights
    }
}

impl Reference for Known {
    fn target(&self) -> Target<'_> {
        Target { exact: self.exact, scale: self.scale, label: &self.case.label }
    }
}

/// `per_kind` worlds of each of some kinds, each with a change by one of `movings`, for light scattered at
/// most `bounces` times.
pub fn known(kinds: &[Kind], movings: &[Moving], per_kind: u64, bounces: usize) -> Vec<Known> {
    assert!(!movings.is_empty(), "nothing moves");
    let drawn = |&kind: &Kind| {
        (0..per_kind).map(move |i| {
            let moving = movings[i as usize % movings.len()];
            let knobs = Knobs { moving, ..Knobs::random(50_000 + i, kind) };
            // Light scattered twice costs a second for a small world.
            if bounces < 2 { knobs } else { Knobs { shapes: knobs.shapes.min(1), pixels: 4, ..knobs } }
        })
    };
    let knobs: Vec<Knobs> = kinds.iter().flat_map(drawn).collect();
    knobs.into_par_iter().map(|k| Known::new(k.build(), bounces)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::campaign::{Limits, Verdict};

    /// A method with noise but no bias passes, and a biased one does not.
    #[test]
    fn a_campaign_tells_right_from_wrong() {
        let known = known(&Kind::GENERIC, &Moving::GEOMETRIC, 14, 1);
        assert!(known.len() > 60, "{} worlds", known.len());
        assert!(known.iter().all(|k| k.error < 1e-9 * k.exact.abs().max(1.0)), "the oracle is not exact");
        let noisy = |factor: f64| {
            Verdict::of(&known, move |k: &Known, seed| {
                let noise = 0.01 * k.exact * (seed as f64 - 0.5);
                Estimate { mean: factor * k.exact + noise, standard_error: 0.01 * k.exact.abs() }
            })
        };
        let limits = Limits::both(5.0);
        assert!(noisy(1.0).passes(limits));
        assert!([0.9, -1.0, 0.0].into_iter().all(|factor| !noisy(factor).passes(limits)));
    }

    #[test]
    fn light_scattered_twice_is_known_to_its_stated_error() {
        let known = known(&[Kind::Room, Kind::Glossy], &Moving::ALL, 2, 2);
        for k in &known {
            println!("{}: {:e} ± {:.1e}", k.case.label, k.exact, k.error);
            assert!(k.error < 1e-5 * k.exact.abs().max(1.0), "{}", k.case.label);
        }
    }
}
