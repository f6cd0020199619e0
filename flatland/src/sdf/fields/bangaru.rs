//! Mean of geometry derivatives over the points of a ray (Bangaru et al. 2022).

use super::form::{FieldForm, Tap};
use super::mean::{departing, magnitude, normalise, power, product, quotient, slope_along};
use super::{FieldError, TracedField, check};
use crate::random::Stream;
use crate::sdf::distance::SecondOrder;
use crate::sdf::scalar::Scalar;
use crate::sdf::space::{Directions, Space};
use crate::sdf::tracer::{Trace, TracePoint, View};
use crate::warp::Vector;

/// V(ω) = P_ω Σ ℓ_i w_i G(x_i)/t_i / Σ ℓ_i w_i over the points of the primary ray itself, with
///
/// ```text
/// w_i = S_i^−γ − S_(k)^−γ (at least 0),   S = |φ| + λ |∇φ·ω|
/// ```
///
/// (Bangaru et al. 2022, "Differentiable Rendering of Neural SDFs through Reparameterization", section 4),
/// where S_(k) is the k-th smallest. At the offset δ outside a smooth silhouette (Theory 10),
///
/// ```text
/// |V − v| ~ δ for γ > 2,   δ log(1/δ) for γ = 2,   δ^{γ−1} for 1 < γ < 2,
/// ```
///
/// and inside the square roots of these: the variance of ∇·V diverges logarithmically there. At corners,
/// where ∇φ turns within a distance δ, the weights stay bounded: see [the module](super).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BangaruField {
    /// γ; 3 in the paper; values of 6 and more are unstable.
    pub gamma: f64,
    /// λ, a length, about 0.1 of the size of the shape. Smaller values average over longer pieces of the ray.
    pub lambda: f64,
    /// k, the number of points with the smallest S that contribute; `None` for all. The k-th weight is
    /// subtracted so that points enter and leave with weight 0.
    pub keep: Option<usize>,
    /// d, in units of length: weights have an additional factor (t/(t + d))^γ. For rays that leave the
    /// surface itself, whose first points are near it and carry no information about its silhouettes, use a
    /// fraction of its size; 0, no factor, in free space.
    pub departure: f64,
}

/// Kernel of a point of a ray.
#[derive(Clone, Copy, Debug)]
pub struct PointKernel<V: Space> {
    /// κ.
    pub kernel: Scalar<V>,
    /// φ there, to second order.
    pub there: SecondOrder<V>,
}

impl Default for BangaruField {
    fn default() -> Self {
        Self { gamma: 3.0, lambda: 0.1, keep: None, departure: 0.0 }
    }
}

impl BangaruField {
    /// The contributing points and their normalised weights ℓ_i w_i / Σ ℓ_j w_j, of which the field is the
    /// mean. The eye itself, where G/t has no limit, does not contribute.
    #[must_use]
    pub fn weights<D: Directions>(&self, view: &View<'_, D::Vector>, trace: &Trace<D::Vector>) -> Vec<f64> {
        self.scalars::<D>(view, trace).into_iter().map(|w| w.value).collect()
    }

    /// Like [`weights`](Self::weights), one for each point of the trace except the first.
    fn scalars<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        trace: &Trace<D::Vector>,
    ) -> Vec<Scalar<D::Vector>> {
        let points = trace.points.get(1..).unwrap_or_default();
        let distances: Vec<_> = points.iter().map(|p| self.distance::<D>(view, trace.direction, p)).collect();
        let least = distances.iter().map(|s| s.value).fold(f64::INFINITY, f64::min);
        let kept = self.threshold(&distances).map(|s| self.power(s, least));
        let mut weights: Vec<_> = points
            .iter()
            .zip(&distances)
            .map(|(point, &s)| product(step_weight(point, self.power(s, least), kept), self.ramp(point)))
            .collect();
        normalise(&mut weights);
        weights
    }

    /// Unnormalised weights, in angles, of each point of the trace except the first:
    ///
    /// ```text
    /// κ_i = (ℓ_i/t_i) ((S_i/t_i)^−γ − (S/t)_(k)^−γ)₊ (t_i/(t_i + d))^γ.
    /// ```
    ///
    /// Their sum diverges at the silhouettes of this shape, and is finite elsewhere: together with kernels of
    /// other silhouettes they form a mean that equals the velocity of the silhouette at ω.
    #[must_use]
    pub fn kernels<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        trace: &Trace<D::Vector>,
    ) -> Vec<PointKernel<D::Vector>> {
        let points = trace.points.get(1..).unwrap_or_default();
        let looked = points.iter().map(|point| {
            let there = view.sdf.second_order(point.position);
            let s = self.distance_there::<D>(trace.direction, point, there.hessian);
            (quotient(s, along(point)), there)
        });
        let (angles, there): (Vec<_>, Vec<_>) = looked.unzip();
        let kept = self.threshold(&angles).map(|s| self.power(s, 1.0));
        let weights = points.iter().zip(angles).map(|(point, s)| {
            let weight = quotient(step_weight(point, self.power(s, 1.0), kept), along(point));
            product(weight, self.ramp(point))
        });
        weights.zip(there).map(|(kernel, there)| PointKernel { kernel, there }).collect()
    }

    /// S. Never 0, so that its power stays finite relative to the smallest.
    fn distance<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        direction: D::Vector,
        point: &TracePoint<D::Vector>,
    ) -> Scalar<D::Vector> {
        self.distance_there::<D>(direction, point, view.sdf.second_order(point.position).hessian)
    }

    /// [`distance`](Self::distance) with known ∇²φ.
    fn distance_there<D: Directions>(
        &self,
        direction: D::Vector,
        point: &TracePoint<D::Vector>,
        hessian: <D::Vector as Space>::Matrix,
    ) -> Scalar<D::Vector> {
        let near = magnitude(Scalar { value: point.jet.value, gradient: point.phi_gradient });
        let grazing = magnitude(slope_along::<D>(direction, point, hessian));
        Scalar {
            value: (near.value + self.lambda * grazing.value).max(f64::MIN_POSITIVE),
            gradient: near.gradient + grazing.gradient * self.lambda,
        }
    }

    /// (S/S_min)^−γ. The dependence of S_min on ω cancels in the quotient.
    fn power<V: Vector>(&self, s: Scalar<V>, least: f64) -> Scalar<V> {
        let value = power(least / s.value, self.gamma);
        Scalar { value, gradient: s.gradient * (-self.gamma * value / s.value) }
    }

    fn ramp<V: Vector>(&self, point: &TracePoint<V>) -> Scalar<V> {
        departing(along(point), self.departure, self.gamma)
    }

    /// S_(k), if there are enough points.
    fn threshold<V: Vector>(&self, distances: &[Scalar<V>]) -> Option<Scalar<V>> {
        let rank = self.keep?.checked_sub(1)?;
        let mut order: Vec<usize> = (0..distances.len()).collect();
        order.sort_by(|&a, &b| distances[a].value.total_cmp(&distances[b].value));
        order.get(rank).map(|&index| distances[index])
    }

    /// The form for a given traced ray.
    #[must_use]
    pub fn form_of<D: Directions>(
        &self,
        view: &View<'_, D::Vector>,
        trace: &Trace<D::Vector>,
    ) -> FieldForm<D> {
        let weights = self.scalars::<D>(view, trace);
        let taps = trace.points.iter().skip(1).zip(weights).filter(|(_, w)| w.value != 0.0);
        let taps = taps.map(|(point, weight)| Tap::new::<D>(view, trace.direction, along(point), weight));
        FieldForm::new(trace.direction, taps.collect(), trace.count())
    }
}

/// t.
fn along<V: Vector>(point: &TracePoint<V>) -> Scalar<V> {
    Scalar { value: point.t, gradient: point.t_gradient }
}

/// |ℓ| (w − w_(k))₊
fn step_weight<V: Vector>(point: &TracePoint<V>, power: Scalar<V>, kept: Option<Scalar<V>>) -> Scalar<V> {
    let kept = kept.unwrap_or(Scalar::constant(0.0));
    let excess = power.value - kept.value;
    if excess <= 0.0 {
        return Scalar::constant(0.0);
    }
    let step = magnitude(Scalar { value: point.step, gradient: point.step_gradient });
    Scalar {
        value: step.value * excess,
        gradient: step.gradient * excess + (power.gradient - kept.gradient) * step.value,
    }
}

impl<D: Directions> TracedField<D> for BangaruField {
    fn form(&self, view: &View<'_, D::Vector>, direction: D::Vector, _: &mut Stream) -> FieldForm<D> {
        self.form_of(view, &view.trace(direction))
    }

    fn check(&self) -> Result<(), FieldError> {
        check("γ", self.gamma, "positive and finite", self.gamma > 0.0)?;
        check("λ", self.lambda, "finite and not negative", self.lambda >= 0.0)?;
        check("d", self.departure, "finite and not negative", self.departure >= 0.0)?;
        let keep = self.keep.unwrap_or(2);
        check("k", keep as f64, "at least 2", keep >= 2)
    }
}
