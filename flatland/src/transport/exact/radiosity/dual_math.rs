//! More functions of dual numbers.

use std::ops::{Div, Neg};

use glam::DVec2;

use crate::dual::Dual;

impl Div for Dual {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let value = self.value / other.value;
        Self { value, slope: (self.slope - value * other.slope) / other.value }
    }
}

impl Neg for Dual {
    type Output = Self;
    fn neg(self) -> Self {
        self * -1.0
    }
}

impl Dual {
    pub(super) fn sin_cos(self) -> (Self, Self) {
        let (sin, cos) = self.value.sin_cos();
        (Self { value: sin, slope: cos * self.slope }, Self { value: cos, slope: -sin * self.slope })
    }
}

/// A vector and its derivative.
#[derive(Clone, Copy, Debug)]
pub(super) struct DualVector {
    pub(super) x: Dual,
    pub(super) y: Dual,
}

impl DualVector {
    pub(super) fn new(value: DVec2, slope: DVec2) -> Self {
        let [x, y] = Dual::path(value, slope);
        Self { x, y }
    }

    pub(super) fn perp_dot(self, other: Self) -> Dual {
        self.x * other.y - self.y * other.x
    }
}
