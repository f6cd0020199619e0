//! Bounds on |∇φ| of a grid, from differences of its nodes.

use glam::DVec3;

/// Bounds on |∇φ|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SlopeBounds {
    /// Where φ > 0.
    pub(super) outside: f64,
    /// Inside as well.
    pub(super) everywhere: f64,
}

/// The bounds that [`Grid`](super::Grid) states: the largest √(Σ_axis max(d₊², d₋²)) over all nodes, where d₊ and d₋ are the
/// differences to the two neighbours along the axis, by the spacing, and 0 at the border; for `outside` of nodes with a positive
/// node no more than `reach` nodes away along every axis.
pub(super) fn slope_bounds(nodes: &[f64], size: [usize; 3], spacing: DVec3, reach: usize) -> SlopeBounds {
    let outside = near_positive(nodes, size, reach);
    let steps = [1, size[0], size[0] * size[1]];
    let (mut most_outside, mut most) = (0.0_f64, 0.0_f64);
    for (index, (&value, &near)) in nodes.iter().zip(&outside).enumerate() {
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
            most_outside = most_outside.max(square);
        }
    }
    SlopeBounds { outside: most_outside.sqrt(), everywhere: most.sqrt() }
}

/// Of every node whether a positive one is no more than `reach` nodes away along every axis.
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
