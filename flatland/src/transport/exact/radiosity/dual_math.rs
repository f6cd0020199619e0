//! More functions of dual numbers.

use glam::DVec2;

use crate::calculus::{Dual, Number};

/// Sine and cosine.
pub(super) fn sin_cos(angle: Dual<1>) -> (Dual<1>, Dual<1>) {
    let (sin, cos) = angle.value.sin_cos();
    (angle.chain(sin, cos), angle.chain(cos, -sin))
}

/// A vector and its derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct DualVector {
    pub(super) x: Dual<1>,
    pub(super) y: Dual<1>,
}

impl DualVector {
    pub(super) fn new(value: DVec2, slope: DVec2) -> Self {
        let [x, y] = Dual::path(value, slope);
        Self { x, y }
    }

    pub(super) fn perp_dot(self, other: Self) -> Dual<1> {
        self.x * other.y - self.y * other.x
    }
}
