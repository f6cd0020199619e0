//! Estimation of (V, ∇·V) from auxiliary points.

#[cfg(test)]
mod tests;
mod weights;

use rand::Rng;

use self::weights::{LogWeight, Weights};
use super::adaptive::Demand;
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
    /// Number of points drawn last.
    fresh: usize,
    demand: Option<Demand>,
}

impl<D: Domain> Bundle<D> {
    /// The points, in the order in which their hits are expected.
    pub fn points(&self) -> impl ExactSizeIterator<Item = D::Vector> + '_ {
        self.draws.iter().map(|draw| draw.point)
    }

    /// A fixed number of batches, independent of the first one: a negative control for tests of adaptive
    /// rays.
    #[cfg(test)]
    pub(super) fn unasked(self, batches: usize) -> Self {
        let plan = Plan { batches, ..self.plan };
        Self { plan, demand: None, ..self }
    }
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
        let mut bundle = self.bundle::<D>(u, kappa, rng);
        let mut hits: Vec<(H, f64)> = Vec::with_capacity(bundle.draws.len());
        loop {
            let known = hits.len();
            hits.extend(bundle.draws[known..].iter().map(|draw| trace(draw.point)));
            let distances = hits[known..].iter().map(|(_, distance)| *distance);
            if !self.grow(&mut bundle, kappa, distances, rng) {
                return self.stencil_of(bundle, kappa, hits);
            }
        }
    }

    /// Draws auxiliary points around u, to be traced together; all of them, unless rays are
    /// [`adaptive`](Self::adaptive).
    pub fn bundle<D: Domain>(&self, u: D::Vector, kappa: f64, rng: &mut impl Rng) -> Bundle<D> {
        // Weights without boundaries have no reach.
        let adaptive = self.adaptive.filter(|_| self.reach(kappa) > 0.0);
        let demand = adaptive.and_then(|adaptive| Demand::new(adaptive, self.debias));
        let plan = demand.as_ref().map_or_else(|| self.debias.plan(rng), Demand::pilot);
        let mut draws = Vec::with_capacity(plan.rays * plan.batches);
        for _ in 0..plan.batches {
            self.points.draw::<D>(u, kappa, self.radial_exponent, plan.rays, rng, &mut draws);
        }
        Bundle { point: u, plan, fresh: draws.len(), draws, demand }
    }

    /// Takes the distance of each of the points drawn last to a boundary, and draws more points if these
    /// request it. Must be called, until it returns false, before [`stencil_of`](Self::stencil_of).
    ///
    /// The distances may differ from those of B, as long as they depend only on the points of one block: for
    /// example infinite for static boundaries, at which no more rays are needed.
    ///
    /// # Panics
    /// If there is not one distance for every new point.
    pub fn grow<D: Domain>(
        &self,
        bundle: &mut Bundle<D>,
        kappa: f64,
        distances: impl IntoIterator<Item = f64>,
        rng: &mut impl Rng,
    ) -> bool {
        let Some(demand) = &mut bundle.demand else { return false };
        let reach = self.reach(kappa);
        let relative: Vec<f64> = distances.into_iter().map(|distance| distance / reach).collect();
        assert_eq!(relative.len(), bundle.fresh, "one distance for every new point");
        let Some(more) = demand.hear(&relative, rng) else { return false };
        for _ in 0..more.batches {
            self.points.draw::<D>(
                bundle.point,
                kappa,
                self.radial_exponent,
                more.rays,
                rng,
                &mut bundle.draws,
            );
        }
        bundle.fresh = more.rays * more.batches;
        true
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
        mut hits: Vec<(H, f64)>,
    ) -> Stencil<D, H> {
        let Bundle { point, plan, mut draws, demand, .. } = bundle;
        assert_eq!(draws.len(), hits.len(), "one hit for every draw");
        if let Some(demand) = &demand {
            demand.settle(&mut draws);
            demand.settle(&mut hits);
        }
        let mut logs = Vec::with_capacity(draws.len());
        let mut terms = Vec::with_capacity(draws.len());
        for (draw, (hit, distance)) in draws.iter().zip(hits) {
            logs.push(self.weigh::<D>(draw, kappa, distance));
            terms.push(Term { hit, weight: 0.0, divergence: D::Vector::ZERO });
        }
        let weights = Weights::new(logs);
        let unit = self.points.unit(plan.rays);
        let count = terms.len();
        let add = |subset: Subset, coefficient| {
            weights.accumulate(subset.indices(), coefficient, &mut terms);
        };
        match demand {
            Some(demand) => demand.combine(unit, count, add),
            None => self.debias.combine(plan, unit, add),
        }
        // −c u·V of the projected field, as part of the covectors.
        for term in &mut terms {
            term.divergence = term.divergence - point * (D::CURVATURE * term.weight);
        }
        Stencil::new(point, terms)
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
