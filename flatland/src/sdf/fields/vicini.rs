//! The geometry derivative at one mean distance (Vicini et al. 2022).

use super::form::{FieldForm, Tap};
use super::mean::{magnitude, normalise, slope_along};
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
/// Left out are the ramps of their weight at the bounding box of the grid, for there is none here,
/// and at the start of rays that leave a surface, for these leave an eye.
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
}

impl Default for ViciniField {
    fn default() -> Self {
        Self { epsilon: 1e-6, grazing: 0.05, gamma: 3.0, reach: Some(0.01) }
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
                let power = (s.value / least).powf(-self.gamma);
                let step = magnitude(Scalar { value: point.step, gradient: point.step_gradient });
                let slope = -self.gamma * power / s.value * step.value;
                Scalar { value: step.value * power, gradient: step.gradient * power + s.gradient * slope }
            })
            .collect();
        normalise(&mut weights);
        weights
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
        let hessian = view.sdf.second_order(point.position).hessian * gradient;
        let half = D::project(direction, hessian) * point.t + point.t_gradient * hessian.dot(direction);
        let along = slope_along::<D>(view, direction, point);
        let relative = along.value * along.value * inverse;
        let slope = along.gradient * (2.0 * along.value * inverse) - half * (2.0 * relative * inverse);
        Scalar {
            value: (self.epsilon + near.value + self.grazing * relative).max(f64::MIN_POSITIVE),
            gradient: near.gradient + slope * self.grazing,
        }
    }

    /// m at x̄.
    fn multiplier<D: Directions>(
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
        let weights = self.scalars::<D>(view, trace);
        let direction = trace.direction;
        if weights.is_empty() {
            return FieldForm::new(direction, vec![], trace.count());
        }
        let mut t = Scalar::constant(0.0);
        for (point, weight) in trace.points.iter().skip(1).zip(weights) {
            t.value += weight.value * point.t;
            t.gradient = t.gradient + weight.gradient * point.t + point.t_gradient * weight.value;
        }
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
        check("γ", self.gamma, "positive and finite", self.gamma > 0.0)?;
        let reach = self.reach.unwrap_or(1.0);
        check("c", reach, "positive and finite", reach > 0.0)
    }
}
