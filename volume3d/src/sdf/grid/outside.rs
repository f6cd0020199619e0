//! φ beyond the border of a grid.

use flatland::sdf::{Jet, Sdf as _, SecondOrder};
use glam::{DMat3, DVec3};

use super::{Grid, GridError, Interpolation, place};

/// Position of a point relative to the box within which nodes have an effect: beyond it the interpolation is
/// constant across the border.
#[derive(Clone, Copy)]
pub(super) struct Outside {
    /// Vector from the nearest point of the box, 0 along axes along which the point is not outside.
    way: DVec3,
    /// 1 for axes along which it is outside.
    axes: DVec3,
}

impl Grid {
    /// Moves inside nodes on the border (two layers for a cubic spline) to half a spacing outside. A surface
    /// that reaches the border has no [bounds](flatland::sdf::Sdf::bounds), and rays search for it
    /// everywhere. A grid with bounds is unchanged.
    ///
    /// # Errors
    /// [`GridError::OneSign`] if no other node was inside.
    pub fn closed(self) -> Result<Self, GridError> {
        if self.bounds().is_some() {
            return Ok(self);
        }
        let (mut nodes, size, layers) = (self.nodes, self.size, self.interpolation.border());
        let outside = 0.5 * self.spacing.min_element();
        for (index, node) in nodes.iter_mut().enumerate() {
            let place = place(index, size);
            let is_border = (0..3).any(|axis| place[axis] < layers || place[axis] + layers >= size[axis]);
            if is_border && *node <= 0.0 {
                *node = outside;
            }
        }
        Self::new(self.interpolation, self.low, self.spacing, size, nodes)
    }

    /// Position of a point relative to the box; `None` inside, and for a surface that reaches the border,
    /// which has no outside.
    #[inline]
    pub(super) fn outside(&self, x: DVec3) -> Option<Outside> {
        if !self.closed {
            return None;
        }
        let (low, high) = self.inner;
        let way = x - x.clamp(low, high);
        if way == DVec3::ZERO {
            return None;
        }
        let axis = |v: f64| f64::from(u8::from(v != 0.0));
        Some(Outside { way, axes: DVec3::new(axis(way.x), axis(way.y), axis(way.z)) })
    }

    /// The box within which nodes have an effect: one node beyond the last for the cubic spline.
    pub(super) fn inner(&self) -> (DVec3, DVec3) {
        let margin = match self.interpolation {
            Interpolation::Trilinear => DVec3::ZERO,
            Interpolation::Cubic => self.spacing,
        };
        (self.low - margin, self.high() + margin)
    }
}

impl Outside {
    /// √(φ² + d²).
    pub(super) fn value(self, value: f64) -> f64 {
        (value * value + self.way.length_squared()).sqrt()
    }

    /// √(φ² + d²) from φ at the border and the distance d to it: at most the distance of the surface, as the
    /// box is convex, and continuously differentiable, as φ is constant across the border.
    pub(super) fn jet(self, Jet { value, gradient }: Jet<DVec3>) -> Jet<DVec3> {
        let whole = self.value(value);
        Jet { value: whole, gradient: (gradient * value + self.way) / whole }
    }

    /// [`jet`](Self::jet) to second order.
    pub(super) fn second_order(self, SecondOrder { jet, hessian }: SecondOrder<DVec3>) -> SecondOrder<DVec3> {
        let there = self.jet(jet);
        let outer = |a: DVec3| DMat3::from_cols(a * a.x, a * a.y, a * a.z);
        let bent = outer(jet.gradient) + hessian * jet.value + DMat3::from_diagonal(self.axes);
        SecondOrder { jet: there, hessian: (bent - outer(there.gradient)) * there.value.recip() }
    }

    /// Rate of √(φ² + d²), from the rate at the border: φ φ̇/√(φ² + d²).
    pub(super) fn rate(self, border: Jet<DVec3>, rate: Jet<DVec3>) -> Jet<DVec3> {
        let there = self.jet(border);
        let value = border.value * rate.value / there.value;
        let gradient = border.gradient * rate.value + rate.gradient * border.value - there.gradient * value;
        Jet { value, gradient: gradient / there.value }
    }

    /// Transpose of [`rate`](Self::rate): the covector of the rates at the border.
    pub(super) fn covector(self, border: Jet<DVec3>, covector: Jet<DVec3>) -> Jet<DVec3> {
        let there = self.jet(border);
        let (part, q) = (border.value / there.value, covector.gradient / there.value);
        let value = part * (covector.value - q.dot(there.gradient)) + q.dot(border.gradient);
        Jet { value, gradient: q * border.value }
    }
}
