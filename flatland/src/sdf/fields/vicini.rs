//! The geometry derivative at one mean distance (Vicini et al. 2022).

use super::form::{FieldForm, Tap};
use super::mean::{departing, inverse_power, magnitude, normalise, slope_along};
use super::{FieldError, TracedField, check};
use crate::random::Stream;
use crate::sdf::scalar::Scalar;
use crate::sdf::space::Directions;
use crate::sdf::tracer::{Trace, TracePoint, View};
use crate::warp::Vector;

/// V(ω) = m P_ω G(x̄)/t̄ at x̄ = o + t̄ω, t̄ = Σ ℓ_i w_i t_i / Σ ℓ_i w_i, with
///
/// ```text
/// w = (ε + |φ| + β (∇φ·ω)²/|∇φ|²)^−γ,   m = max(0, 1 − |φ(x̄)|/(c t̄))
/// ```
///
/// (Vicini et al. 2022, "Differentiable Signed Distance Function Rendering", section 4, and their
/// released code). One evaluation of G serves the whole ray. The multiplier m confines the field to a
/// neighbourhood of the surface, c in radians.
///
/// Left out is the ramp of their weight at the bounding box of the grid, for there is none here. That at the start of
/// rays which leave a surface is [`departure`](Self::departure).
///
/// At ε > 0 the weights stay finite on the silhouette, t̄ does not reach the silhouette's
/// distance, and V not its velocity: a bias that falls with ε.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViciniField {
    /// ε, in units of length: what keeps weights finite.
    pub epsilon: f64,
    /// β, 0.05 in the paper.
    pub grazing: f64,
    /// γ, 3 in the paper.
    pub gamma: f64,
    /// c, 0.01 in the paper; `None` for m = 1.
    pub reach: Option<f64>,
    /// d, in units of length: weights have a factor (t/(t + d))^γ besides. For rays that leave the surface itself, whose first
    /// points are near it and say nothing of its silhouettes, a part of its size; 0, no factor, in free space.
    pub departure: f64,
}

impl Default for ViciniField {
    fn default() -> Self {
        Self { epsilon: 1e-6, grazing: 0.05, gamma: 3.0, reach: Some(0.01), departure: 0.0 }
    }
}

impl ViciniField {
    /// The normalised weights ℓ_i w_i / Σ ℓ_j w_j, one for each point of the trace but the first.
    #[must_use]
    pub fn weights<D: Directions>(&self, view: &View<'_, D::Vector>, trace: &Trace<D::Vector>) -> Vec<f64> {
        self.scalars::<D>(view, trace).into_iter().map(|w| w.value).collect()
    }

    fn scalars<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        trace: &Trace<D::Vector>,
    ) -> Vec<Scalar<D::Vector>> {
        let points = trace.points.get(1..).unwrap_or_default();
        let distances: Vec<_> = points.iter().map(|p| self.distance::<D>(view, trace.direction, p)).collect();
        let least = distances.iter().map(|s| s.value).fold(f64::INFINITY, f64::min);
        let mut weights: Vec<_> = points
            .iter()
            .zip(distances)
            .map(|(point, s)| {
                let power = self.power(s.value / least);
                let step = magnitude(Scalar { value: point.step, gradient: point.step_gradient });
                let slope = -self.gamma * power / s.value * step.value;
                let value = step.value * power;
                let gradient = step.gradient * power + s.gradient * slope;
                let ramp = self.ramp(Scalar { value: point.t, gradient: point.t_gradient });
                Scalar { value: value * ramp.value, gradient: gradient * ramp.value + ramp.gradient * value }
            })
            .collect();
        normalise(&mut weights);
        weights
    }

    fn power(&self, x: f64) -> f64 {
        inverse_power(x, self.gamma)
    }

    fn ramp<V: Vector>(&self, t: Scalar<V>) -> Scalar<V> {
        departing(t, self.departure, self.gamma)
    }

    /// ε + |φ| + β (∇φ·ω)²/|∇φ|²
    fn distance<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        direction: D::Vector,
        point: &TracePoint<D::Vector>,
    ) -> Scalar<D::Vector> {
        let near = magnitude(Scalar { value: point.jet.value, gradient: point.phi_gradient });
        let gradient = point.jet.gradient;
        // 1/|∇φ|², or 0 where ∇φ is, and the gradient of |∇φ|²/2: H∇φ moved along the ray.
        let square = gradient.dot(gradient);
        let inverse = if square > 0.0 { square.recip() } else { 0.0 };
        let hessian = view.sdf.second_order(point.position).hessian;
        let turn = hessian * gradient;
        let half = D::project(direction, turn) * point.t + point.t_gradient * turn.dot(direction);
        let along = slope_along::<D>(direction, point, hessian);
        let relative = along.value * along.value * inverse;
        let slope = along.gradient * (2.0 * along.value * inverse) - half * (2.0 * relative * inverse);
        Scalar {
            value: (self.epsilon + near.value + self.grazing * relative).max(f64::MIN_POSITIVE),
            gradient: near.gradient + slope * self.grazing,
        }
    }

    /// Whether m > 0 at x̄, from values alone: it takes no second derivatives, and most rays are far from all silhouettes.
    #[must_use]
    pub fn is_near<D: Directions>(&self, view: &View<'_, D::Vector>, trace: &Trace<D::Vector>) -> bool {
        let Some(reach) = self.reach else { return true };
        let (mut sum, mut t) = (0.0, 0.0);
        for point in trace.points.get(1..).unwrap_or_default() {
            let gradient = point.jet.gradient;
            let (square, along) = (gradient.dot(gradient), gradient.dot(trace.direction));
            let relative = if square > 0.0 { along * along / square } else { 0.0 };
            let distance =
                (self.epsilon + point.jet.value.abs() + self.grazing * relative).max(f64::MIN_POSITIVE);
            let ramp = self.ramp::<D::Vector>(Scalar::constant(point.t)).value;
            let weight = point.step.abs() * self.power(distance) * ramp;
            (sum, t) = (sum + weight, t + weight * point.t);
        }
        let t = t / sum;
        // Where rounding or overflow decides, the whole form does.
        let far = view.sdf.value(view.eye + trace.direction * t).abs() > 1.000_001 * reach * t;
        sum != 0.0 && !far
    }

    /// t̄, where any point has a weight.
    #[must_use]
    pub fn mean_distance<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        trace: &Trace<D::Vector>,
    ) -> Option<Scalar<D::Vector>> {
        let weights = self.scalars::<D>(view, trace);
        let mut t = Scalar::constant(0.0);
        for (point, weight) in trace.points.iter().skip(1).zip(&weights) {
            t.value += weight.value * point.t;
            t.gradient = t.gradient + weight.gradient * point.t + point.t_gradient * weight.value;
        }
        (!weights.is_empty()).then_some(t)
    }

    /// m at x̄.
    #[must_use]
    pub fn multiplier<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        direction: D::Vector,
        t: Scalar<D::Vector>,
    ) -> Scalar<D::Vector> {
        let Some(reach) = self.reach else { return Scalar::constant(1.0) };
        let jet = view.sdf.jet(view.eye + direction * t.value);
        let turn = D::project(direction, jet.gradient) * t.value + t.gradient * jet.gradient.dot(direction);
        let near = magnitude(Scalar { value: jet.value, gradient: turn });
        let ratio = near.value / (reach * t.value);
        if ratio >= 1.0 {
            return Scalar::constant(0.0);
        }
        let slope = (near.gradient * (1.0 / reach) - t.gradient * ratio) * (1.0 / t.value);
        Scalar { value: 1.0 - ratio, gradient: -slope }
    }

    /// The form over a ray that is traced already.
    #[must_use]
    pub fn form_of<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        trace: &Trace<D::Vector>,
    ) -> FieldForm<D> {
        let direction = trace.direction;
        let Some(t) = self.mean_distance::<D>(view, trace) else {
            return FieldForm::new(direction, vec![], trace.count());
        };
        let multiplier = self.multiplier::<D>(view, direction, t);
        let seen = multiplier.value != 0.0;
        let tap = seen.then(|| Tap::new::<D>(view, direction, t, multiplier));
        FieldForm::new(direction, tap.into_iter().collect(), trace.count())
    }
}

impl<D: Directions> TracedField<D> for ViciniField {
    fn form(&self, view: &View<'_, D::Vector>, direction: D::Vector, _: &mut Stream) -> FieldForm<D> {
        self.form_of(view, &view.trace(direction))
    }

    fn check(&self) -> Result<(), FieldError> {
        check("ε", self.epsilon, "finite and not negative", self.epsilon >= 0.0)?;
        check("β", self.grazing, "finite and not negative", self.grazing >= 0.0)?;
        check("d", self.departure, "finite and not negative", self.departure >= 0.0)?;
        check("γ", self.gamma, "positive and finite", self.gamma > 0.0)?;
        let reach = self.reach.unwrap_or(1.0);
        check("c", reach, "positive and finite", reach > 0.0)
    }
}
