//! Means over the points of a ray, with weights that depend on the direction.

use crate::sdf::scalar::Scalar;
use crate::sdf::space::{Directions, Space};
use crate::sdf::tracer::TracePoint;
use crate::warp::Vector;

/// ∇φ·ω at a point of a ray and its gradient P_ω∇φ + t P_ω Hω + (ω·Hω) ∇_ω t.
pub(super) fn slope_along<D: Directions>(
    direction: D::Vector,
    point: &TracePoint<D::Vector>,
    hessian: <D::Vector as Space>::Matrix,
) -> Scalar<D::Vector> {
    let hessian = hessian * direction;
    let turn = D::project(direction, point.jet.gradient + hessian * point.t);
    Scalar {
        value: point.jet.gradient.dot(direction),
        gradient: turn + point.t_gradient * direction.dot(hessian),
    }
}

/// |s|; its gradient at 0 is taken as 0.
pub(super) fn magnitude<V: Vector>(s: Scalar<V>) -> Scalar<V> {
    let sign = if s.value == 0.0 { 0.0 } else { s.value.signum() };
    Scalar { value: s.value.abs(), gradient: s.gradient * sign }
}

/// x^γ; the cube of γ = 3 is a product.
pub(super) fn power(x: f64, gamma: f64) -> f64 {
    if gamma == 3.0 { x * x * x } else { x.powf(gamma) }
}

/// (t/(t + d))^γ, a factor on the weights of rays that leave a surface, whose first points are near it and
/// carry no information about its silhouettes. 1 if d = 0.
pub(super) fn departing<V: Vector>(t: Scalar<V>, departure: f64, gamma: f64) -> Scalar<V> {
    if departure == 0.0 {
        return Scalar::constant(1.0);
    }
    let value = power(t.value / (t.value + departure), gamma);
    let slope = gamma * value * departure / (t.value * (t.value + departure));
    Scalar { value, gradient: t.gradient * slope }
}

/// a b.
pub(super) fn product<V: Vector>(a: Scalar<V>, b: Scalar<V>) -> Scalar<V> {
    Scalar { value: a.value * b.value, gradient: a.gradient * b.value + b.gradient * a.value }
}

/// a/b.
pub(super) fn quotient<V: Vector>(a: Scalar<V>, b: Scalar<V>) -> Scalar<V> {
    let value = a.value / b.value;
    Scalar { value, gradient: (a.gradient - b.gradient * value) * b.value.recip() }
}

/// q_i/Σq_j and its gradient (∇q_i − (q_i/Σq) Σ∇q)/Σq, in place; empty if all are 0.
///
/// If the sum of the weights is not finite, all become NaN, so that the sample is counted as non-finite.
pub(super) fn normalise<V: Vector>(weights: &mut Vec<Scalar<V>>) {
    let mut sum = Scalar::<V>::constant(0.0);
    for q in weights.iter() {
        sum.value += q.value;
        sum.gradient = sum.gradient + q.gradient;
    }
    if sum.value == 0.0 {
        weights.clear();
        return;
    }
    let inverse = if sum.value.is_finite() { sum.value.recip() } else { f64::NAN };
    for q in weights.iter_mut() {
        let value = q.value * inverse;
        *q = Scalar { value, gradient: (q.gradient - sum.gradient * value) * inverse };
    }
}
