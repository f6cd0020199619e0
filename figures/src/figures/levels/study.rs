//! Estimates of every field for a known derivative.

use std::time::Instant;

use flatland::random::{Stream, open01, stream};
use flatland::sdf::fields::{AuxiliaryField, BangaruField, SilhouetteDistance, TracedField, ViciniField};
use flatland::sdf::{End, Tracer, near_misses};
use flatland::warp::{Debias, LinearField as _, Warp};
use glam::DVec3;
use rayon::prelude::*;
use volume3d::Sphere;
use volume3d::scene::SPHERE_TRACING;

use super::outputs::Outputs;
use super::shapes::{Arc, FAR, Subject};
use crate::ratio::Ratio;

/// Auxiliary rays of the field made of them, and its kernel's concentration in radians⁻².
pub(super) const RAYS: usize = 16;
const KAPPA: f64 = 600.0;
/// The width of the band, in units of length.
pub(super) const BAND: f64 = 0.02;
/// Runs of which the fastest is timed.
const RUNS: usize = 3;
/// Samples that one thread draws in a row.
const BLOCK: usize = 1 << 12;

/// Method for the boundary's part of a derivative.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Method {
    Vicini(ViciniField),
    Bangaru(BangaruField),
    Auxiliary,
    Band,
}

/// The tracer of scenes.
pub(super) fn tracer() -> Tracer {
    Tracer { far: FAR, ..SPHERE_TRACING }
}

/// The default field of scenes.
pub(super) fn vicini() -> ViciniField {
    ViciniField { reach: Some(0.1), ..ViciniField::default() }
}

impl Method {
    pub(super) fn all() -> [Self; 4] {
        [Self::Vicini(vicini()), Self::Bangaru(BangaruField::default()), Self::Auxiliary, Self::Band]
    }

    pub(super) fn name(self) -> &'static str {
        match self {
            Self::Vicini(_) => "Vicini et al.",
            Self::Bangaru(_) => "Bangaru et al.",
            Self::Auxiliary => "auxiliary rays",
            Self::Band => "band (Wang et al.)",
        }
    }

    /// The method's share of samples: the two that are biased for other reasons than tolerance need fewer.
    fn effort(self) -> f64 {
        match self {
            Self::Vicini(_) | Self::Bangaru(_) => 1.0,
            Self::Auxiliary => 0.03,
            Self::Band => 0.1,
        }
    }

    /// (V, ∇·V) in a direction; `None` for the band.
    pub(super) fn field(
        self,
        subject: &Subject,
        tracer: Tracer,
        omega: DVec3,
        dice: &mut Stream,
    ) -> Option<(DVec3, f64)> {
        let view = subject.view(tracer);
        let auxiliary = || AuxiliaryField {
            warp: Warp { debias: Debias::Consistent { rays: RAYS }, ..Warp::default() },
            kappa: KAPPA,
            distance: SilhouetteDistance::Curvature,
        };
        let form = match self {
            Self::Vicini(field) => TracedField::<Sphere>::form(&field, &view, omega, dice),
            Self::Bangaru(field) => TracedField::<Sphere>::form(&field, &view, omega, dice),
            Self::Auxiliary => TracedField::<Sphere>::form(&auxiliary(), &view, omega, dice),
            Self::Band => return None,
        };
        let found = form.field(|x| subject.sdf.rate(*x, &subject.direction));
        Some((found.value, found.divergence))
    }
}

/// A shape, its integrals, and the exact derivatives of a white shape before black.
pub(super) struct Target<'a> {
    pub(super) subject: &'a Subject,
    pub(super) outputs: Outputs,
    exact: Vec<f64>,
}

/// Regression of a method on the exact derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Found {
    /// The slope of the regression on the exact derivative: 1 without bias.
    pub(super) slope: Ratio,
    /// The standard deviation of one sample of the slope.
    pub(super) deviation: f64,
    /// Nanoseconds per sample on one thread, with its ray.
    pub(super) nanoseconds: f64,
    /// The part of rays that ran out of steps.
    pub(super) lost: f64,
}

/// Sums over samples.
#[derive(Clone, Copy, Default)]
struct Sums {
    count: f64,
    sum: f64,
    squares: f64,
    lost: f64,
}

impl<'a> Target<'a> {
    pub(super) fn new(subject: &'a Subject, outputs: Outputs, outline: &[Arc]) -> Self {
        let mut exact = vec![0.0; outputs.count()];
        for arc in outline {
            for (p, h, _) in outputs.weights(arc.direction) {
                exact[p] += h * arc.flux;
            }
        }
        Self { subject, outputs, exact }
    }

    fn norm(&self) -> f64 {
        self.exact.iter().map(|e| e * e).sum()
    }

    /// Σ e_p x_p/Σ e_p² for x = h, and for x = ∇h.
    fn regressed(&self, omega: DVec3) -> (f64, DVec3) {
        let (mut h, mut turn) = (0.0, DVec3::ZERO);
        for (p, value, gradient) in self.outputs.weights(omega) {
            h += self.exact[p] * value;
            turn += self.exact[p] * gradient;
        }
        (h / self.norm(), turn / self.norm())
    }

    /// Measures a method with about `samples` samples.
    pub(super) fn measure(&self, method: Method, tracer: Tracer, samples: usize, seed: u64) -> Found {
        let blocks = ((samples as f64 * method.effort()) as usize).div_ceil(BLOCK);
        let parts: Vec<Sums> =
            (0..blocks).into_par_iter().map(|block| self.block(method, tracer, seed, block)).collect();
        let all = parts.iter().fold(Sums::default(), |a, b| Sums {
            count: a.count + b.count,
            sum: a.sum + b.sum,
            squares: a.squares + b.squares,
            lost: a.lost + b.lost,
        });
        let mean = all.sum / all.count;
        let deviation = (all.squares / all.count - mean * mean).sqrt();
        // Other programs can only slow one down.
        let time = |run: usize| {
            let start = Instant::now();
            self.block(method, tracer, seed, blocks + run);
            start.elapsed().as_nanos() as f64 / BLOCK as f64
        };
        let nanoseconds = (0..RUNS).map(time).fold(f64::INFINITY, f64::min);
        let slope = Ratio { value: mean, error: deviation / all.count.sqrt() };
        Found { slope, deviation, nanoseconds, lost: all.lost / all.count }
    }

    fn block(&self, method: Method, tracer: Tracer, seed: u64, block: usize) -> Sums {
        let mut sums = Sums::default();
        for index in BLOCK * block..BLOCK * (block + 1) {
            let (value, end) = self.sample(method, tracer, &mut stream(seed, &[index as u64]));
            sums.count += 1.0;
            sums.sum += value;
            sums.squares += value * value;
            sums.lost += f64::from(u8::from(end == End::OutOfSteps));
        }
        sums
    }

    /// A sample whose mean is 1. Only the outline changes: L is 1 on the shape and 0 beside it.
    fn sample(&self, method: Method, tracer: Tracer, dice: &mut Stream) -> (f64, End) {
        let (omega, area) = self.outputs.draw([open01(dice), open01(dice)]);
        let subject = self.subject;
        let view = subject.view(tracer);
        let trace = view.trace(omega);
        let radiance = f64::from(u8::from(trace.hit().is_some()));
        let (h, turn) = self.regressed(omega);
        let value = match method.field(subject, tracer, omega, dice) {
            // ∇·(V h L); ∫ ∇·(V h) = 0, so that any constant may be taken from L.
            Some((v, divergence)) => (turn.dot(v) + h * divergence) * (radiance - 0.5),
            None => {
                let passed = near_misses(&view, &trace, BAND);
                let rate = |x: &DVec3| subject.sdf.rate(*x, &subject.direction).value;
                -h * (1.0 - radiance) * passed.iter().map(rate).sum::<f64>() / BAND
            }
        };
        (value * area, trace.end)
    }

    /// The slope without noise, for a field that is differentiable wherever rays hit, and an outline that is
    /// a circle: the area integral of ∇·(V h) over the rays that hit is the flux of V h through the last of
    /// them.
    pub(super) fn at_last_hits(&self, method: Method, tracer: Tracer, arcs: u32) -> f64 {
        let hits = self.subject.last_hits(tracer, arcs);
        let part = |(omega, outward, length): (DVec3, DVec3, f64)| {
            let v = method
                .field(self.subject, tracer, omega, &mut stream(0, &[]))
                .map_or(DVec3::ZERO, |(v, _)| v);
            self.regressed(omega).0 * v.dot(outward) * length
        };
        hits.into_par_iter().map(part).sum()
    }
}
