//! Bounds on derivatives of a grid, from differences of its nodes.

use glam::DVec3;
use rayon::prelude::*;

use super::{Interpolation, control};

/// Bounds on |∇φ|.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct SlopeBounds {
    /// Bound where φ > 0.
    pub(super) outside: f64,
    /// Including the inside.
    pub(super) everywhere: f64,
}

/// The bounds of [`Grid`](super::Grid) on |∇φ| and on second derivatives.
///
/// The slope bound is the largest √(Σ_axis max(d₊², d₋²)) over all nodes, where d₊ and d₋ are the differences
/// to the two neighbours along the axis divided by the spacing, and 0 at the border. For `outside` only nodes
/// count that have a positive node within the reach of the interpolation along every axis, and a cubic
/// spline's bound is at most the bound by its [control vectors](control). Only one flag is stored per node:
/// grids may be as large as the memory.
pub(super) fn bounds(
    nodes: &[f64],
    size: [usize; 3],
    spacing: DVec3,
    interpolation: Interpolation,
) -> (SlopeBounds, f64) {
    let near = near_positive(nodes, size, interpolation.reach());
    let layers = Layers { nodes, size, spacing, near: &near };
    let all = || (0..size[2]).into_par_iter();
    let most = |a: [f64; 2], b: [f64; 2]| [a[0].max(b[0]), a[1].max(b[1])];
    let [everywhere, mut outside] = all().map(|k| layers.steepest(k)).reduce(|| [0.0; 2], most);
    let mut bend = f64::INFINITY;
    if interpolation == Interpolation::Cubic {
        outside = outside.min(control::slope(nodes, size, spacing.recip().to_array(), &|k| layers.rough(k)));
        let most = |a: [f64; 6], b: [f64; 6]| std::array::from_fn(|i| a[i].max(b[i]));
        let bends = all().map(|k| layers.bends(k)).reduce(|| [0.0; 6], most);
        let square = |bounds: &[f64]| bounds.iter().map(|b| b * b).sum::<f64>();
        bend = (square(&bends[..3]) + 2.0 * square(&bends[3..])).sqrt();
    }
    (SlopeBounds { outside, everywhere: everywhere.sqrt() }, bend)
}

/// The nodes of a grid, processed layer by layer along its last axis.
struct Layers<'n> {
    nodes: &'n [f64],
    size: [usize; 3],
    spacing: DVec3,
    near: &'n [bool],
}

impl Layers<'_> {
    /// Calls `f` with the position of every node in a layer and the square of its bound.
    fn for_each_square(&self, k: usize, mut f: impl FnMut(usize, f64)) {
        let [nx, ny, nz] = self.size;
        let (steps, last) = ([1, nx, nx * ny], [nx - 1, ny - 1, nz - 1]);
        for j in 0..ny {
            for i in 0..nx {
                let (at, index) = ([i, j, k], i + nx * (j + ny * k));
                let (value, mut square) = (self.nodes[index], 0.0);
                for axis in 0..3 {
                    let back = if at[axis] > 0 { value - self.nodes[index - steps[axis]] } else { 0.0 };
                    let ahead =
                        if at[axis] < last[axis] { self.nodes[index + steps[axis]] - value } else { 0.0 };
                    let slope = back.abs().max(ahead.abs()) / self.spacing[axis];
                    square += slope * slope;
                }
                f(i + nx * j, square);
            }
        }
    }

    /// The square of the largest bound of a layer, and the largest bound of nodes near positive ones.
    fn steepest(&self, k: usize) -> [f64; 2] {
        let near = self.near_layer(k);
        let (mut most, mut outside) = (0.0_f64, 0.0_f64);
        self.for_each_square(k, |at, square| {
            most = most.max(square);
            outside = if near[at] { outside.max(square) } else { outside };
        });
        [most, outside.sqrt()]
    }

    /// The bounds of a layer; 0 for nodes that are not near a positive one.
    fn rough(&self, k: usize) -> Vec<f64> {
        let near = self.near_layer(k);
        let mut bounds = vec![0.0; near.len()];
        self.for_each_square(k, |at, square| bounds[at] = if near[at] { square.sqrt() } else { 0.0 });
        bounds
    }

    /// The largest second differences of a layer along each axis, and mixed ones, where φ > 0. Beyond the
    /// border nodes are repeated.
    fn bends(&self, k: usize) -> [f64; 6] {
        let ([nx, ny, nz], nodes, spacing) = (self.size, self.nodes, self.spacing);
        let (steps, last, near) = ([1, nx, nx * ny], [nx - 1, ny - 1, nz - 1], self.near_layer(k));
        let mut most = [0.0_f64; 6];
        for (i, j) in (0..ny).flat_map(|j| (0..nx).map(move |i| (i, j))) {
            if !near[i + nx * j] {
                continue;
            }
            let (at, index) = ([i, j, k], i + nx * (j + ny * k));
            let ahead = |axis: usize| if at[axis] < last[axis] { steps[axis] } else { 0 };
            let value = nodes[index];
            for axis in 0..3 {
                let back = if at[axis] > 0 { steps[axis] } else { 0 };
                let bend = nodes[index + ahead(axis)] - 2.0 * value + nodes[index - back];
                most[axis] = most[axis].max((bend / (spacing[axis] * spacing[axis])).abs());
                let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
                let (to_a, to_b) = (ahead(a), ahead(b));
                let twist = nodes[index + to_a + to_b] - nodes[index + to_a] - nodes[index + to_b] + value;
                most[3 + axis] = most[3 + axis].max((twist / (spacing[a] * spacing[b])).abs());
            }
        }
        most
    }

    fn near_layer(&self, k: usize) -> &[bool] {
        let layer = self.size[0] * self.size[1];
        &self.near[k * layer..(k + 1) * layer]
    }
}

/// Whether a positive node is at most `reach` nodes away along every axis, for every node.
fn near_positive(nodes: &[f64], [nx, ny, nz]: [usize; 3], reach: usize) -> Vec<bool> {
    let around = |at: usize, count: usize| at.saturating_sub(reach)..(at + reach + 1).min(count);
    let mut near = vec![false; nodes.len()];
    near.par_chunks_mut(nx * ny).zip(nodes.par_chunks(nx * ny)).for_each(|(layer, nodes)| {
        let mut rows = vec![false; nx * ny];
        for (row, nodes) in rows.chunks_mut(nx).zip(nodes.chunks(nx)) {
            for (i, _) in nodes.iter().enumerate().filter(|(_, value)| **value > 0.0) {
                row[around(i, nx)].fill(true);
            }
        }
        for (j, row) in layer.chunks_mut(nx).enumerate() {
            around(j, ny).for_each(|other| join(row, &rows[other * nx..(other + 1) * nx]));
        }
    });
    let before = near.clone();
    near.par_chunks_mut(nx * ny).enumerate().for_each(|(k, layer)| {
        let others = around(k, nz).filter(|&other| other != k);
        others.for_each(|other| join(layer, &before[other * nx * ny..(other + 1) * nx * ny]));
    });
    near
}

fn join(flags: &mut [bool], others: &[bool]) {
    flags.iter_mut().zip(others).for_each(|(flag, other)| *flag |= *other);
}
