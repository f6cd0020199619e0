//! The estimate of (V, ∇·V) as a linear form in the velocities of the auxiliary hits.

use rand::Rng;

use super::adaptive::{Adaptive, Demand};
use super::auxiliary::AuxiliaryPoints;
use super::boundary::BoundaryFunction;
use super::debias::{Debias, Plan, Subset};
use super::domain::{Domain, Draw, Vector};
use super::field::{Field, LinearField};

/// The weight w(u, u').
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Weighting {
    /// w = (D + B)^−γ: continuous and boundary consistent. The method ("attempt 3").
    BoundaryAware {
        /// γ. The larger, the closer V follows what is seen near a boundary, and the more its
        /// variance there. 3/2 is the default with a quadratic B, 3 is the paper's with a linear one.
        gamma: f64,
        /// B.
        boundary: BoundaryFunction,
    },
    /// w = e⁻ˣ, the kernel itself: continuous, not boundary consistent, biased ("attempt 2").
    Gaussian,
}

impl Default for Weighting {
    fn default() -> Self {
        Self::BoundaryAware { gamma: 1.5, boundary: BoundaryFunction::default() }
    }
}

/// Everything that decides an estimate of the warp field but the kernel's concentration, which
/// belongs to the place: the pixel, the lobe, the emitter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Warp {
    /// The weight.
    pub weighting: Weighting,
    /// The pattern of auxiliary points.
    pub points: AuxiliaryPoints,
    /// How they crowd around u: 1 spreads them as the kernel does, as the paper; below, a larger
    /// part comes close, where the weight of a boundary is decided. The field is the same.
    pub radial_exponent: f64,
    /// How many of them, and what is done about the bias.
    pub debias: Debias,
    /// Whether their number depends on what the first ones see. Off, unless asked for: a consistent estimate becomes
    /// more biased.
    pub adaptive: Option<Adaptive>,
}

impl Default for Warp {
    fn default() -> Self {
        Self {
            weighting: Weighting::default(),
            points: AuxiliaryPoints::default(),
            radial_exponent: 0.3,
            debias: Debias::default(),
            adaptive: None,
        }
    }
}

/// Parameters that no estimate can be made with.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum WarpError {
    /// γ must be positive and finite.
    #[error("the exponent γ = {gamma} is not positive and finite")]
    Gamma {
        /// γ.
        gamma: f64,
    },
    /// The boundary function's scale must be positive and finite.
    #[error("the boundary function's scale {scale} is not positive and finite")]
    Scale {
        /// The scale.
        scale: f64,
    },
    /// The concentration κ must be positive and finite.
    #[error("the concentration κ = {kappa} is not positive and finite")]
    Kappa {
        /// κ.
        kappa: f64,
    },
    /// The reach of a mean over jumps must be positive and finite.
    #[error("the reach R = {reach} is not positive and finite")]
    Reach {
        /// R.
        reach: f64,
    },
    /// The radial exponent must be in [0.1, 1]: below, distances underflow.
    #[error("the radial exponent {radial_exponent} is not in [0.1, 1]")]
    RadialExponent {
        /// The radial exponent.
        radial_exponent: f64,
    },
    /// A debiasing scheme with no finite cost or no rays.
    #[error("{what}")]
    Debias {
        /// What is wrong.
        what: &'static str,
    },
}

/// Auxiliary points around u that are yet to be traced.
#[derive(Clone, Debug)]
pub struct Bundle<D: Domain> {
    point: D::Vector,
    plan: Plan,
    draws: Vec<Draw<D::Vector>>,
    /// How many of them were drawn last.
    fresh: usize,
    demand: Option<Demand>,
}

impl<D: Domain> Bundle<D> {
    /// The points, in the order in which their hits are asked for.
    pub fn points(&self) -> impl ExactSizeIterator<Item = D::Vector> + '_ {
        self.draws.iter().map(|draw| draw.point)
    }

    /// So many batches, as if nothing had been asked of the first: what the tests of adaptive rays must reject.
    #[cfg(test)]
    pub(super) fn unasked(self, batches: usize) -> Self {
        let plan = Plan { batches, ..self.plan };
        Self { plan, demand: None, ..self }
    }
}

/// An auxiliary hit, or a jump, with its coefficients in V and ∇·V.
#[derive(Clone, Copy, Debug)]
pub struct Term<V, H> {
    /// What the auxiliary ray hit, or what moves the jump.
    pub hit: H,
    /// Ω_i: the coefficient of V_i in V, before projection.
    pub weight: f64,
    /// M_i: the covector whose product with V_i enters ∇·V.
    pub divergence: V,
}

/// V = P_u Σ Ω_i V_i and ∇·V = Σ M_i·V_i at one point u, of velocities V_i of auxiliary hits or of jumps.
#[derive(Clone, Debug)]
pub struct Stencil<D: Domain, H> {
    point: D::Vector,
    terms: Vec<Term<D::Vector, H>>,
}

impl<D: Domain, H> Stencil<D, H> {
    pub(super) fn new(point: D::Vector, terms: Vec<Term<D::Vector, H>>) -> Self {
        Self { point, terms }
    }

    /// The hits or jumps, and their coefficients.
    #[must_use]
    pub fn terms(&self) -> &[Term<D::Vector, H>] {
        &self.terms
    }
}

impl<D: Domain, H> LinearField for Stencil<D, H> {
    type Vector = D::Vector;
    type Source = H;
    type Rate = D::Vector;

    fn field(&self, mut velocity: impl FnMut(&H) -> D::Vector) -> Field<D::Vector> {
        let mut sum = Field::<D::Vector>::ZERO;
        for term in &self.terms {
            let v = velocity(&term.hit);
            sum.value = sum.value + v * term.weight;
            sum.divergence += term.divergence.dot(v);
        }
        Field { value: D::project(self.point, sum.value), ..sum }
    }

    /// c_i = Ω_i P_u a + b M_i.
    fn scatter(&self, a: D::Vector, b: f64, mut add: impl FnMut(&H, D::Vector)) {
        let a = D::project(self.point, a);
        for term in &self.terms {
            add(&term.hit, a * term.weight + term.divergence * b);
        }
    }
}

impl Warp {
    /// The original's estimate, γ = 3 and points spread as the kernel, with a linear B in units of
    /// the kernel's width (the original's is blind to it) and a fixed number of rays.
    #[must_use]
    pub fn original(rays: usize) -> Self {
        Self {
            weighting: Weighting::BoundaryAware {
                gamma: 3.0,
                boundary: BoundaryFunction::KernelScaled { scale: 0.6 },
            },
            points: AuxiliaryPoints::Antithetic,
            radial_exponent: 1.0,
            debias: Debias::Consistent { rays },
            adaptive: None,
        }
    }

    /// What had the least variance × rays on the line and the circle, for shadows and reflections in a
    /// few worlds: strata fill one dimension evenly, so that larger blocks need fewer levels, and γ = 1
    /// with B ~ s², twice its bound for n = 1, makes V the least steep.
    ///
    /// Its variance is *not* known to be finite in light transport: see [`Debias::Multilevel`].
    #[must_use]
    pub fn one_dimensional() -> Self {
        Self {
            weighting: Weighting::BoundaryAware { gamma: 1.0, boundary: BoundaryFunction::default() },
            points: AuxiliaryPoints::Stratified,
            radial_exponent: 0.5,
            debias: Debias::Multilevel { rays: 8, first: 0.15, ratio: 0.3 },
            adaptive: None,
        }
    }

    /// 1 − B at a distance from the end of what was hit: 1 at the end, 0 far from it.
    #[must_use]
    pub fn falloff(&self, distance: f64, kappa: f64) -> f64 {
        match self.weighting {
            Weighting::BoundaryAware { boundary, .. } => 1.0 - boundary.value(distance, kappa),
            Weighting::Gaussian => 1.0,
        }
    }

    /// Checks the parameters once, so that [`stencil`](Self::stencil) need not.
    ///
    /// # Errors
    /// A [`WarpError`] that names the parameter.
    pub fn check(&self, kappa: f64) -> Result<(), WarpError> {
        let positive = |x: f64| x > 0.0 && x.is_finite();
        if !positive(kappa) {
            return Err(WarpError::Kappa { kappa });
        }
        if let Weighting::BoundaryAware { gamma, boundary } = self.weighting {
            if !positive(gamma) {
                return Err(WarpError::Gamma { gamma });
            }
            if !positive(boundary.scale()) {
                return Err(WarpError::Scale { scale: boundary.scale() });
            }
        }
        if !(self.radial_exponent >= 0.1 && self.radial_exponent <= 1.0) {
            return Err(WarpError::RadialExponent { radial_exponent: self.radial_exponent });
        }
        let adaptive = self.adaptive.map_or(Ok(()), Adaptive::check);
        self.debias.check().and(adaptive).map_err(|what| WarpError::Debias { what })
    }

    /// The distance beyond which a boundary no longer matters: what [`stencil`](Self::stencil)'s
    /// `trace` may stop searching at.
    #[must_use]
    pub fn reach(&self, kappa: f64) -> f64 {
        match self.weighting {
            Weighting::BoundaryAware { boundary, .. } => boundary.reach(kappa),
            Weighting::Gaussian => 0.0,
        }
    }

    /// Draws auxiliary points around u and turns them into the coefficients of (V, ∇·V).
    ///
    /// `trace` returns what is hit at a point and its distance to the nearest jump as seen from
    /// there; a miss has infinite distance and velocity 0.
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

    /// Hands over how far each of the points drawn last is from a boundary, and draws more points if these ask for
    /// it. Must be called, until it returns false, before [`stencil_of`](Self::stencil_of).
    ///
    /// The distances may be other than those of B, as long as they depend on the points of one block only: infinite for
    /// boundaries that nothing moves at, of which no more need be known.
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

    /// Turns a traced bundle into the coefficients of (V, ∇·V): [`stencil`](Self::stencil) in two steps.
    ///
    /// # Panics
    /// If there is not one hit, with its distance to the nearest jump, for every draw.
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
        Stencil { point, terms }
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

struct LogWeight<V> {
    weight: f64,
    gradient: V,
}

/// The weights of all points, relative to the largest.
struct Weights<V> {
    logs: Vec<LogWeight<V>>,
    relative: Vec<f64>,
}

impl<V: Vector> Weights<V> {
    fn new(logs: Vec<LogWeight<V>>) -> Self {
        let relative = relative(&logs, 0..logs.len());
        Self { logs, relative }
    }

    /// Adds `coefficient` times the quotient estimate from a subset of the points: ω_i and
    /// ω_i (ℓ_i − ℓ̄).
    fn accumulate<H>(
        &self,
        subset: impl Iterator<Item = usize> + Clone,
        coefficient: f64,
        terms: &mut [Term<V, H>],
    ) {
        let sum: f64 = subset.clone().map(|i| self.relative[i]).sum();
        if sum < f64::MIN_POSITIVE / f64::EPSILON {
            // The subset is so far below the largest that its weights underflow: start anew.
            let indices: Vec<usize> = subset.collect();
            let weights = relative(&self.logs, indices.iter().copied());
            self.add(indices.into_iter().zip(weights), coefficient, terms);
        } else {
            self.add(subset.map(|i| (i, self.relative[i])), coefficient, terms);
        }
    }

    fn add<H>(
        &self,
        weighted: impl Iterator<Item = (usize, f64)> + Clone,
        coefficient: f64,
        terms: &mut [Term<V, H>],
    ) {
        let mut sum = 0.0;
        let mut gradient = V::ZERO;
        for (i, w) in weighted.clone() {
            sum += w;
            gradient = gradient + self.logs[i].gradient * w;
        }
        let (mean, scale) = (gradient * (1.0 / sum), coefficient / sum);
        for (i, w) in weighted {
            let w = w * scale;
            terms[i].weight += w;
            terms[i].divergence = terms[i].divergence + (self.logs[i].gradient - mean) * w;
        }
    }
}

/// The weights of some points, relative to the largest of these.
fn relative<V>(logs: &[LogWeight<V>], indices: impl Iterator<Item = usize> + Clone) -> Vec<f64> {
    let largest = indices.clone().map(|i| logs[i].weight).fold(f64::NEG_INFINITY, f64::max);
    indices.map(|i| (logs[i].weight - largest).exp()).collect()
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;
    use crate::random::{open01, stream};
    use crate::warp::{Circle, Plane, assert_transposed};

    /// A strip of moving material seen from a fixed direction: velocity v inside x < 0, still
    /// background elsewhere.
    fn strip(point: DVec2) -> (DVec2, f64) {
        if point.x < 0.0 { (DVec2::new(1.0, 0.5), -point.x) } else { (DVec2::ZERO, f64::INFINITY) }
    }

    fn warp(debias: Debias) -> Warp {
        Warp { debias, ..Warp::default() }
    }

    #[test]
    fn the_divergence_is_that_of_the_field() {
        // With one auxiliary set kept in place, V(u) is a smooth function of u: compare the
        // stencil's ∇·V with central differences of its V, rebuilt by hand.
        fn check<D: Domain<Vector = DVec2>>(
            u: DVec2,
            moved: impl Fn(f64) -> DVec2,
            exponent: impl Fn(DVec2, DVec2) -> f64,
        ) {
            let kappa = 6.0;
            let velocity = |p: DVec2| DVec2::new(1.0 + p.y, p.x * p.x - 0.3);
            let boundary = |p: DVec2| (p.x * 0.7).abs();
            let warp = warp(Debias::Consistent { rays: 10 });
            let stencil = warp.stencil::<D, _>(u, kappa, &mut stream(1, &[]), |p| (p, boundary(p)));
            // The same draws once more, for their densities.
            let mut draws = vec![];
            warp.points.draw::<D>(u, kappa, warp.radial_exponent, 10, &mut stream(1, &[]), &mut draws);
            let value = |at: DVec2| {
                let scale = 0.4 * kappa.sqrt();
                let (mut z, mut a) = (0.0, DVec2::ZERO);
                for draw in &draws {
                    let p = draw.point;
                    let b = (scale * boundary(p)).powi(2).min(1.0);
                    // w at the new place over the density at the old one.
                    let w = (exponent(at, p).exp_m1() + b).powf(-1.5) / draw.log_density.exp();
                    z += w;
                    a += w * velocity(p);
                }
                D::project(at, a / z)
            };
            let field = stencil.field(|&p| velocity(p));
            assert!((field.value - value(u)).length() < 1e-12);
            let h = 1e-6;
            let tangents: &[f64] = if D::CURVATURE == 0.0 { &[0.0, 1.0] } else { &[0.0] };
            let divergence: f64 = tangents
                .iter()
                .map(|&k| {
                    let (plus, minus) =
                        if k == 0.0 { (moved(h), moved(-h)) } else { (u + h * DVec2::Y, u - h * DVec2::Y) };
                    let tangent = (plus - minus).normalize();
                    (value(plus) - value(minus)).dot(tangent) / (2.0 * h)
                })
                .sum();
            assert!(
                (field.divergence - divergence).abs() < 1e-6 * (1.0 + divergence.abs()),
                "{field:?} {divergence}"
            );
        }
        let u = DVec2::new(0.2, -0.1);
        check::<Plane>(u, |h| u + h * DVec2::X, |a, b| 3.0 * (a - b).length_squared());
        check::<Circle>(
            DVec2::from_angle(1.3),
            |h| DVec2::from_angle(1.3 + h),
            |a, b| 6.0 * (1.0 - a.dot(b)),
        );
    }

    #[test]
    fn scatter_is_the_transpose_of_field() {
        for debias in [
            Debias::Consistent { rays: 7 },
            Debias::RussianRoulette { rays: 4, tail: 1.5 },
            Debias::Multilevel { rays: 4, first: 0.9, ratio: 0.45 },
        ] {
            for seed in 0..50 {
                let mut rng = stream(seed, &[]);
                let u = DVec2::from_angle(6.0 * open01(&mut rng));
                let stencil = warp(debias).stencil::<Circle, _>(u, 9.0, &mut rng, |p| (p, p.x.abs()));
                let velocity = |p: &DVec2| DVec2::new(p.y * 3.0, 1.0 - p.x);
                assert_transposed(&stencil, (DVec2::new(0.3, -1.2), 0.7), velocity, DVec2::dot);
            }
        }
    }

    #[test]
    fn a_common_velocity_is_kept_and_has_no_divergence() {
        for debias in [Debias::Consistent { rays: 16 }, Debias::default()] {
            let stencil =
                warp(debias).stencil::<Plane, _>(DVec2::new(0.3, 0.2), 50.0, &mut stream(1, &[]), strip);
            let field = stencil.field(|_| DVec2::new(2.0, -1.0));
            assert!((field.value - DVec2::new(2.0, -1.0)).length() < 1e-12);
            assert!(field.divergence.abs() < 1e-10);
        }
    }

    #[test]
    fn the_field_reaches_the_boundary_velocity_as_rays_grow() {
        // On the strip's edge V·ν must become 1; at equality of γ and its bound only slowly.
        let value = |rays, gamma| {
            let boundary = BoundaryFunction::KernelScaled { scale: 0.6 };
            let weighting = Weighting::BoundaryAware { gamma, boundary };
            let warp = Warp { weighting, ..warp(Debias::Consistent { rays }) };
            let u = DVec2::new(1e-12, 0.0);
            let at = |seed| {
                let s = warp.stencil::<Plane, _>(u, 100.0, &mut stream(seed, &[]), strip);
                s.field(|&v| v).value.x
            };
            (0..400).map(at).sum::<f64>() / 400.0
        };
        let (few, many) = (value(16, 3.0), value(16_384, 3.0));
        assert!(few < many && many > 0.95, "{few} {many}");
        assert!(value(16_384, 1.0) < 0.9, "γ below its bound must not reach the boundary's velocity");
    }

    #[test]
    fn nothing_overflows_at_the_extremes() {
        for kappa in [1e-6_f64, 1.0, 1e12, 1e200] {
            for gamma in [0.5, 3.0, 40.0] {
                let width = kappa.sqrt().recip();
                for at in [0.0, 1e-15, -1e-15, 1e-3, -3.0] {
                    for rays in [1, 2, 16] {
                        let warp = Warp {
                            weighting: Weighting::BoundaryAware {
                                gamma,
                                boundary: BoundaryFunction::default(),
                            },
                            ..warp(Debias::Consistent { rays })
                        };
                        let u = DVec2::new(at * width, 0.0);
                        let s = warp.stencil::<Plane, _>(u, kappa, &mut stream(rays as u64, &[]), strip);
                        let field = s.field(|&v| v);
                        assert!(
                            field.value.is_finite() && field.divergence.is_finite(),
                            "{kappa} {gamma} {at} {rays}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn bad_parameters_are_refused() {
        let good = Warp::default();
        assert_eq!(good.check(1.0), Ok(()));
        assert!(matches!(good.check(f64::NAN), Err(WarpError::Kappa { .. })));
        let weighting = Weighting::BoundaryAware { gamma: -1.0, boundary: BoundaryFunction::default() };
        assert!(matches!(Warp { weighting, ..good }.check(1.0), Err(WarpError::Gamma { .. })));
        let boundary = BoundaryFunction::SceneScaled { scale: 0.0 };
        let weighting = Weighting::BoundaryAware { gamma: 3.0, boundary };
        assert!(matches!(Warp { weighting, ..good }.check(1.0), Err(WarpError::Scale { .. })));
        let debias = Debias::Consistent { rays: 0 };
        assert!(matches!(Warp { debias, ..good }.check(1.0), Err(WarpError::Debias { .. })));
    }
}
