//! Geometry derivative at one mean distance (Vicini et al. 2022).

use super::form::{FieldForm, Tap};
use super::mean::{departing, magnitude, power};
use super::{FieldError, TracedField, check};
use crate::random::Stream;
use crate::sdf::distance::{Jet, SecondOrder};
use crate::sdf::scalar::Scalar;
use crate::sdf::space::{Directions, Space};
use crate::sdf::tracer::{End, TracePoint, View};
use crate::warp::Vector;

/// V(ω) = m P_ω G(x̄)/t̄ at x̄ = o + t̄ω, t̄ = Σ ℓ_i w_i t_i / Σ ℓ_i w_i, with
///
/// ```text
/// w = (ε + |φ| + β (∇φ·ω)²/|∇φ|²)^−γ,   m = max(0, 1 − |φ(x̄)|/(c t̄))
/// ```
///
/// (Vicini et al. 2022, "Differentiable Signed Distance Function Rendering", section 4, and their released
/// code). One evaluation of G serves the whole ray. The multiplier m confines the field to a neighbourhood of
/// the surface, c in radians.
///
/// The ramp of their weight at the bounding box of the grid is omitted, as there is no box here. The ramp at
/// the start of rays that leave a surface is [`departure`](Self::departure).
///
/// For ε > 0 the weights stay finite on the silhouette, t̄ does not reach the silhouette's distance, and V
/// not its velocity: a bias that decreases with ε.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ViciniField {
    /// ε, in units of length, which keeps weights finite.
    pub epsilon: f64,
    /// β, 0.05 in the paper.
    pub grazing: f64,
    /// γ, 3 in the paper.
    pub gamma: f64,
    /// c, 0.01 in the paper; `None` for m = 1.
    pub reach: Option<f64>,
    /// d, in units of length: weights have an additional factor (t/(t + d))^γ. For rays that leave the
    /// surface itself, whose first points are near it and carry no information about its silhouettes, use a
    /// fraction of its size; 0, no factor, in free space.
    pub departure: f64,
}

impl Default for ViciniField {
    fn default() -> Self {
        Self { epsilon: 1e-6, grazing: 0.05, gamma: 3.0, reach: Some(0.01), departure: 0.0 }
    }
}

/// Weighted mean of a ray's points.
#[derive(Clone, Copy, Debug)]
pub struct MeanPoint<V> {
    /// t̄, if any point has a weight.
    pub t: Option<Scalar<V>>,
    /// t of the first point that may have a weight, which is the second of the ray.
    pub first: Option<Scalar<V>>,
    /// t of the last point.
    pub last: f64,
    /// End of the ray.
    pub end: End,
    /// Whether φ was ever less than its [bound](crate::sdf::Sdf::slope_bound) on |∇φ| allows after a step, by
    /// more than rounding: 10⁻⁶ of its previous value and 10⁻¹³ t.
    pub too_steep: bool,
}

/// See [`MeanPoint::too_steep`].
const STEEP: f64 = 1e-6;
const ROUNDING: f64 = 1e-13;

impl ViciniField {
    /// t̄ of the ray in direction ω up to a far limit, in one traversal.
    #[must_use]
    pub fn mean_point<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        direction: D::Vector,
        far: Scalar<D::Vector>,
    ) -> MeanPoint<D::Vector> {
        let zero = Scalar::<D::Vector>::constant(0.0);
        // Σ ℓ w and Σ ℓ w t.
        let (mut whole, mut sum, mut first, mut is_first) = (zero, zero, None, true);
        let (mut last, mut least, mut too_steep) = (view.start, f64::NEG_INFINITY, false);
        let bound = view.sdf.slope_bound();
        let look = |x| {
            let SecondOrder { jet, hessian } = view.sdf.second_order(x);
            (jet, hessian)
        };
        let end = view.walk(direction, far, look, |point, hessian| {
            too_steep |= point.jet.value < least;
            least = point.jet.value * (1.0 - STEEP) - bound * point.step - ROUNDING * point.t;
            last = point.t;
            if std::mem::take(&mut is_first) {
                return;
            }
            let t = Scalar { value: point.t, gradient: point.t_gradient };
            first = first.or(Some(t));
            let weight = self.weight::<D>(direction, point, hessian);
            whole.value += weight.value;
            whole.gradient = whole.gradient + weight.gradient;
            sum.value += weight.value * t.value;
            sum.gradient = sum.gradient + weight.gradient * t.value + t.gradient * weight.value;
        });
        let inverse = whole.value.recip();
        let value = sum.value * inverse;
        let mean = Scalar { value, gradient: (sum.gradient - whole.gradient * value) * inverse };
        MeanPoint { t: (whole.value != 0.0).then_some(mean), first, last, end, too_steep }
    }

    /// ℓ w of a point.
    fn weight<D: Directions>(
        &self,
        direction: D::Vector,
        point: &TracePoint<D::Vector>,
        hessian: <D::Vector as Space>::Matrix,
    ) -> Scalar<D::Vector> {
        let s = self.distance::<D>(direction, point, hessian);
        let inverse = s.value.recip();
        let power = power(inverse, self.gamma);
        let step = magnitude(Scalar { value: point.step, gradient: point.step_gradient });
        let value = step.value * power;
        let gradient = step.gradient * power - s.gradient * (self.gamma * inverse * value);
        let ramp = self.ramp(Scalar { value: point.t, gradient: point.t_gradient });
        Scalar { value: value * ramp.value, gradient: gradient * ramp.value + ramp.gradient * value }
    }

    fn ramp<V: Vector>(&self, t: Scalar<V>) -> Scalar<V> {
        departing(t, self.departure, self.gamma)
    }

    /// ε + |φ| + β (∇φ·ω)²/|∇φ|²
    fn distance<D: Directions>(
        &self,
        direction: D::Vector,
        point: &TracePoint<D::Vector>,
        hessian: <D::Vector as Space>::Matrix,
    ) -> Scalar<D::Vector> {
        let near = magnitude(Scalar { value: point.jet.value, gradient: point.phi_gradient });
        let gradient = point.jet.gradient;
        // r = ∇φ·ω/|∇φ|², or 0 where ∇φ = 0: the term is r ∇φ·ω, whose gradient by x is H q.
        let square = gradient.dot(gradient);
        let along = gradient.dot(direction);
        let ratio = if square > 0.0 { along / square } else { 0.0 };
        let turn = hessian * ((direction - gradient * ratio) * (2.0 * ratio));
        let slope = D::project(direction, gradient * (2.0 * ratio) + turn * point.t)
            + point.t_gradient * turn.dot(direction);
        Scalar {
            value: (self.epsilon + near.value + self.grazing * (ratio * along)).max(f64::MIN_POSITIVE),
            gradient: near.gradient + slope * self.grazing,
        }
    }

    /// m at x̄, from φ and ∇φ there.
    #[must_use]
    pub fn multiplier<D: Directions>(
        &self,
        direction: D::Vector,
        t: Scalar<D::Vector>,
        jet: Jet<D::Vector>,
    ) -> Scalar<D::Vector> {
        let Some(reach) = self.reach else { return Scalar::constant(1.0) };
        let turn = D::project(direction, jet.gradient) * t.value + t.gradient * jet.gradient.dot(direction);
        let near = magnitude(Scalar { value: jet.value, gradient: turn });
        let ratio = near.value / (reach * t.value);
        if ratio >= 1.0 {
            return Scalar::constant(0.0);
        }
        let slope = (near.gradient * (1.0 / reach) - t.gradient * ratio) * (1.0 / t.value);
        Scalar { value: 1.0 - ratio, gradient: -slope }
    }
}

impl<D: Directions> TracedField<D> for ViciniField {
    fn form(&self, view: &View<'_, D::Vector>, direction: D::Vector, _: &mut Stream) -> FieldForm<D> {
        let MeanPoint { t, end, .. } =
            self.mean_point::<D>(view, direction, Scalar::constant(view.tracer.far));
        let tap = t.and_then(|t| {
            let point = view.eye + direction * t.value;
            let there = view.sdf.second_order(point);
            let multiplier = self.multiplier::<D>(direction, t, there.jet);
            (multiplier.value != 0.0).then(|| Tap::of::<D>(point, there, direction, t, multiplier))
        });
        FieldForm::new(direction, tap.into_iter().collect(), end.count())
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
