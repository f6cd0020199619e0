//! Estimation of (V, ∇·V) from auxiliary points.

#[cfg(test)]
mod tests;
mod weights;

use std::ops::Range;

use rand::Rng;

use self::weights::{LogWeight, Weights};
use super::debias::{Plan, Subset};
use super::domain::{Domain, Draw, Vector};
use super::parameters::{Warp, Weighting};
use super::stencil::{Stencil, Term};

/// Auxiliary points around u, before tracing.
#[derive(Clone, Debug)]
pub struct Bundle<D: Domain> {
    point: D::Vector,
    plan: Plan,
    draws: Vec<Draw<D::Vector>>,
}

impl<D: Domain> Bundle<D> {
    /// The points, in the order in which their hits are expected.
    pub fn points(&self) -> impl ExactSizeIterator<Item = D::Vector> + '_ {
        self.draws.iter().map(|draw| draw.point)
    }
}

/// A point of a chain.
#[derive(Clone, Copy, Debug)]
pub struct ChainHit<H> {
    /// The hit.
    pub hit: H,
    /// Distance over u to the end of its own object, as seen through the chain.
    pub distance: f64,
    /// Width of a beam of rays there, relative to one that is not focused; 1 or more without a focus. The
    /// hit's velocity is inverse to it.
    pub convergence: f64,
}

impl Warp {
    /// Draws auxiliary points around u and computes the coefficients of (V, ∇·V).
    ///
    /// `trace` returns the hit at a point and its distance to the nearest discontinuity as seen from there; a
    /// miss has infinite distance and velocity 0.
    pub fn stencil<D: Domain, H>(
        &self,
        u: D::Vector,
        kappa: f64,
        rng: &mut impl Rng,
        mut trace: impl FnMut(D::Vector) -> (H, f64),
    ) -> Stencil<D, H> {
        let bundle = self.bundle::<D>(u, kappa, rng);
        let hits = bundle.points().map(&mut trace).collect();
        self.stencil_of(bundle, kappa, hits)
    }

    /// Draws auxiliary points around u, to be traced together.
    pub fn bundle<D: Domain>(&self, u: D::Vector, kappa: f64, rng: &mut impl Rng) -> Bundle<D> {
        let plan = self.debias.plan(rng);
        let mut draws = Vec::with_capacity(plan.rays * plan.batches);
        for _ in 0..plan.batches {
            self.points.draw::<D>(u, kappa, self.radial_exponent, plan.rays, rng, &mut draws);
        }
        Bundle { point: u, plan, draws }
    }

    /// Computes the coefficients of (V, ∇·V) from a traced bundle: [`stencil`](Self::stencil) in two steps.
    ///
    /// # Panics
    /// If there is not one hit, with its distance to the nearest discontinuity, for every draw.
    #[must_use]
    pub fn stencil_of<D: Domain, H>(
        &self,
        bundle: Bundle<D>,
        kappa: f64,
        hits: Vec<(H, f64)>,
    ) -> Stencil<D, H> {
        assert_eq!(bundle.draws.len(), hits.len(), "one hit for every draw");
        let mut logs = Vec::with_capacity(hits.len());
        let mut terms = Vec::with_capacity(hits.len());
        for (draw, (hit, distance)) in bundle.draws.iter().zip(hits) {
            logs.push(self.weigh::<D>(draw, kappa, distance));
            terms.push(Term { hit, weight: 0.0, divergence: D::Vector::ZERO });
        }
        self.combine(&bundle, logs, terms, |i| i..i + 1)
    }

    /// [`stencil_of`](Self::stencil_of) with several hits for every draw, the points of a
    /// [chain](crate::chain). Each has its own weight.
    ///
    /// In the focus of a mirror or lens, a hit's velocity is unbounded. Its weight is therefore multiplied by
    /// the pγ-th power of its [convergence](ChainHit::convergence), for a boundary function B ~ sᵖ.
    ///
    /// # Panics
    /// If there is not at least one hit for every draw.
    #[must_use]
    pub fn chain_stencil<D: Domain, H>(
        &self,
        bundle: &Bundle<D>,
        kappa: f64,
        hits: Vec<Vec<ChainHit<H>>>,
    ) -> Stencil<D, H> {
        assert_eq!(bundle.draws.len(), hits.len(), "hits for every draw");
        let (mut logs, mut terms, mut first) = (vec![], vec![], vec![0]);
        for (draw, hits) in bundle.draws.iter().zip(hits) {
            assert!(!hits.is_empty(), "at least one hit for every draw");
            for ChainHit { hit, distance, convergence } in hits {
                let mut log = self.weigh::<D>(draw, kappa, distance);
                log.weight += self.fading(convergence);
                logs.push(log);
                terms.push(Term { hit, weight: 0.0, divergence: D::Vector::ZERO });
            }
            first.push(logs.len());
        }
        self.combine(bundle, logs, terms, |i| first[i]..first[i + 1])
    }

    /// The coefficients of the hits, given the range of hits of every draw.
    fn combine<D: Domain, H>(
        &self,
        bundle: &Bundle<D>,
        logs: Vec<LogWeight<D::Vector>>,
        mut terms: Vec<Term<D::Vector, H>>,
        hits_of: impl Fn(usize) -> Range<usize> + Clone,
    ) -> Stencil<D, H> {
        let Bundle { point, plan, .. } = *bundle;
        let weights = Weights::new(logs);
        let unit = self.points.unit(plan.rays);
        self.debias.combine(plan, unit, |subset: Subset, coefficient| {
            weights.accumulate(subset.indices().flat_map(hits_of.clone()), coefficient, &mut terms);
        });
        // −c u·V of the projected field, as part of the covectors.
        for term in &mut terms {
            term.divergence = term.divergence - point * (D::CURVATURE * term.weight);
        }
        Stencil::new(point, terms)
    }

    /// ln min(q, 1)^pγ for the convergence q.
    fn fading(&self, convergence: f64) -> f64 {
        match self.weighting {
            Weighting::BoundaryAware { gamma, boundary } => {
                boundary.order() * gamma * convergence.min(1.0).ln()
            }
            Weighting::Gaussian => 0.0,
        }
    }

    /// ln w̃ up to a constant, and ℓ = ∇_u ln w.
    fn weigh<D: Domain>(&self, draw: &Draw<D::Vector>, kappa: f64, distance: f64) -> LogWeight<D::Vector> {
        let x = draw.exponent;
        match self.weighting {
            Weighting::BoundaryAware { gamma, boundary } => {
                let b = boundary.value(distance, kappa);
                let q = b * (-x).exp() - (-x).exp_m1();
                LogWeight {
                    weight: -gamma * (x + q.ln()) - draw.log_density,
                    gradient: draw.tangent * (gamma * kappa / q),
                }
            }
            Weighting::Gaussian => {
                LogWeight { weight: -x - draw.log_density, gradient: draw.tangent * kappa }
            }
        }
    }
}
