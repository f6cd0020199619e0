//! "Attempt 1": the velocity of the visible point.

use super::form::{FieldForm, Tap};
use super::{FieldError, TracedField};
use crate::random::Stream;
use crate::sdf::scalar::Scalar;
use crate::sdf::space::Directions;
use crate::sdf::tracer::View;
use crate::warp::Vector;

/// V = P_ω G(x)/t at the hit x, and 0 on a miss. Discontinuous at silhouettes: a negative control.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct DirectField;

impl<D: Directions> TracedField<D> for DirectField {
    fn form(&self, view: &View<'_, D::Vector>, direction: D::Vector, _: &mut Stream) -> FieldForm<D> {
        let trace = view.trace(direction);
        let tap = trace.hit().map(|hit| {
            // φ(o + t(ω) ω) = 0, hence ∇_ω t = −t P_ω ∇φ/(∇φ·ω).
            let gradient = hit.jet.gradient;
            let turn = D::project(direction, gradient) * (-hit.t / gradient.dot(direction));
            Tap::new::<D>(view, direction, Scalar { value: hit.t, gradient: turn }, Scalar::constant(1.0))
        });
        FieldForm::new(direction, tap.into_iter().collect(), trace.count())
    }

    fn check(&self) -> Result<(), FieldError> {
        Ok(())
    }
}
