//! Bounds on derivatives of a grid, from differences of its nodes.

use glam::DVec3;

use super::{Interpolation, control, place};

/// Bounds on |∇φ|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SlopeBounds {
    /// Bound where φ > 0.
    pub(super) outside: f64,
    /// Including the inside.
    pub(super) everywhere: f64,
}

/// The bounds stated in [`Grid`](super::Grid): the largest √(Σ_axis max(d₊², d₋²)) over all nodes, with d₊
/// and d₋ the differences to the two neighbours along the axis, divided by the spacing, and 0 at the border.
/// `outside` is over nodes that share the support of some point with a positive node and, for a cubic spline,
/// at most the bound of its [control vectors](control).
pub(super) fn slope_bounds(
    nodes: &[f64],
    size: [usize; 3],
    spacing: DVec3,
    interpolation: Interpolation,
) -> SlopeBounds {
    let mut outside: Vec<f64> = vec![0.0; nodes.len()];
    let is_outside = near_positive(nodes, size, interpolation.reach());
    let steps = [1, size[0], size[0] * size[1]];
    let (mut most_outside, mut most) = (0.0_f64, 0.0_f64);
    for (index, (&value, near)) in nodes.iter().zip(is_outside).enumerate() {
        let mut square = 0.0;
        for axis in 0..3 {
            let at = index / steps[axis] % size[axis];
            let back = if at > 0 { value - nodes[index - steps[axis]] } else { 0.0 };
            let ahead = if at + 1 < size[axis] { nodes[index + steps[axis]] - value } else { 0.0 };
            let slope = back.abs().max(ahead.abs()) / spacing[axis];
            square += slope * slope;
        }
        most = most.max(square);
        if near {
            outside[index] = square.sqrt();
            most_outside = most_outside.max(outside[index]);
        }
    }
    if interpolation == Interpolation::Cubic {
        most_outside = most_outside.min(control::slope(nodes, size, spacing.recip().to_array(), &outside));
    }
    SlopeBounds { outside: most_outside, everywhere: most.sqrt() }
}

/// The bound on second derivatives stated in [`Grid`](super::Grid), where φ > 0. Beyond the border nodes are
/// repeated.
pub(super) fn bend_bound(
    nodes: &[f64],
    size: [usize; 3],
    spacing: DVec3,
    interpolation: Interpolation,
) -> f64 {
    if interpolation == Interpolation::Trilinear {
        return f64::INFINITY;
    }
    let outside = near_positive(nodes, size, interpolation.reach());
    let steps = [1, size[0], size[0] * size[1]];
    let (mut own, mut mixed) = ([0.0_f64; 3], [0.0_f64; 3]);
    for (index, _) in outside.iter().enumerate().filter(|(_, near)| **near) {
        let at = place(index, size);
        let ahead = |axis: usize| if at[axis] + 1 < size[axis] { steps[axis] } else { 0 };
        let value = nodes[index];
        for axis in 0..3 {
            let back = if at[axis] > 0 { steps[axis] } else { 0 };
            let bend = nodes[index + ahead(axis)] - 2.0 * value + nodes[index - back];
            own[axis] = own[axis].max((bend / (spacing[axis] * spacing[axis])).abs());
            let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
            let (to_a, to_b) = (ahead(a), ahead(b));
            let twist = nodes[index + to_a + to_b] - nodes[index + to_a] - nodes[index + to_b] + value;
            mixed[axis] = mixed[axis].max((twist / (spacing[a] * spacing[b])).abs());
        }
    }
    let square = |bounds: [f64; 3]| bounds.iter().map(|b| b * b).sum::<f64>();
    (square(own) + 2.0 * square(mixed)).sqrt()
}

/// For every node, whether a positive one is at most `reach` nodes away along every axis.
fn near_positive(nodes: &[f64], size: [usize; 3], reach: usize) -> Vec<bool> {
    let mut near: Vec<bool> = nodes.iter().map(|&value| value > 0.0).collect();
    let mut step = 1;
    for count in size {
        let before = near.clone();
        for (index, found) in near.iter_mut().enumerate().filter(|(_, found)| !**found) {
            let at = index / step % count;
            let (back, ahead) = (at.min(reach), (count - 1 - at).min(reach));
            *found = (index - back * step..=index + ahead * step).step_by(step).any(|i| before[i]);
        }
        step *= count;
    }
    near
}
