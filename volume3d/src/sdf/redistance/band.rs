//! The band: nodes that determine the surface.

use crate::sdf::{Grid, Interpolation};

/// For every node, whether it affects a cell in which φ may be 0: whether the coefficients of the cell's
/// Bézier form are neither all positive nor all negative or 0. φ is within their range, and has one sign in
/// all other cells.
pub(in crate::sdf) fn band(grid: &Grid) -> Vec<bool> {
    match grid.interpolation() {
        Interpolation::Trilinear => Cells::<2>::mixed(grid).nodes_where(|_| true),
        Interpolation::Cubic => Cells::<4>::mixed(grid).nodes_where(|values| is_mixed(&bezier(values))),
    }
}

type Block<T, const N: usize> = [[[T; N]; N]; N];

/// Cells whose N × N × N nodes have both signs, including cells beyond the border, where the outermost nodes
/// are repeated.
struct Cells<'a, const N: usize> {
    grid: &'a Grid,
    /// Positions of the first of their nodes, from 1 − N on.
    firsts: Vec<[i64; 3]>,
}

impl<'a, const N: usize> Cells<'a, N> {
    /// Such cells have two neighbours of different signs among their nodes.
    fn mixed(grid: &'a Grid) -> Self {
        let (nodes, size, reach) = (grid.nodes(), grid.size(), N - 1);
        let counts = size.map(|n| n + reach);
        let mut found = vec![false; counts.iter().product()];
        let steps = [1, size[0], size[0] * size[1]];
        let mut index = 0;
        for k in 0..size[2] {
            for j in 0..size[1] {
                for i in 0..size[0] {
                    for (axis, (at, step)) in [i, j, k].into_iter().zip(steps).enumerate() {
                        if at + 1 < size[axis] && (nodes[index] > 0.0) != (nodes[index + step] > 0.0) {
                            // Cells from the one that ends with the next node to the one that begins with
                            // this one.
                            let mut begin = [i, j, k];
                            begin[axis] += 1;
                            for z in begin[2]..=k + reach {
                                for y in begin[1]..=j + reach {
                                    let row = counts[0] * (y + counts[1] * z);
                                    found[row + begin[0]..=row + i + reach].fill(true);
                                }
                            }
                        }
                    }
                    index += 1;
                }
            }
        }
        let place = |cell: usize| {
            [cell % counts[0], cell / counts[0] % counts[1], cell / counts[0] / counts[1]]
                .map(|at| at as i64 - reach as i64)
        };
        let firsts = (0..found.len()).filter(|&cell| found[cell]).map(place).collect();
        Self { grid, firsts }
    }

    /// Nodes of these cells whose values satisfy a condition.
    fn nodes_where(&self, holds: impl Fn(Block<f64, N>) -> bool) -> Vec<bool> {
        let nodes = self.grid.nodes();
        let mut counts = vec![false; nodes.len()];
        for &first in &self.firsts {
            let block: Block<usize, N> = self.block(first);
            if holds(block.map(|layer| layer.map(|row| row.map(|index| nodes[index])))) {
                block.as_flattened().as_flattened().iter().for_each(|&index| counts[index] = true);
            }
        }
        counts
    }

    fn block(&self, first: [i64; 3]) -> Block<usize, N> {
        let size = self.grid.size();
        let [x, y, z]: [[usize; N]; 3] = std::array::from_fn(|axis| {
            std::array::from_fn(|i| (first[axis] + i as i64).clamp(0, size[axis] as i64 - 1) as usize)
        });
        z.map(|z| y.map(|y| x.map(|x| x + size[0] * (y + size[1] * z))))
    }
}

fn is_mixed(values: &Block<f64, 4>) -> bool {
    let mut values = values.as_flattened().as_flattened().iter();
    let Some(first) = values.next() else { return false };
    values.any(|value| (*value > 0.0) != (*first > 0.0))
}

/// The Bézier coefficients of the spline in a cell.
fn bezier(mut values: Block<f64, 4>) -> Block<f64, 4> {
    let along = |[a, b, c, d]: [f64; 4]| {
        [(a + 4.0 * b + c) / 6.0, (2.0 * b + c) / 3.0, (b + 2.0 * c) / 3.0, (b + 4.0 * c + d) / 6.0]
    };
    for layer in &mut values {
        *layer = transposed(layer.map(along));
        *layer = transposed(layer.map(along));
    }
    for j in 0..4 {
        for i in 0..4 {
            let column = along(values.map(|layer| layer[j][i]));
            values.iter_mut().zip(column).for_each(|(layer, value)| layer[j][i] = value);
        }
    }
    values
}

fn transposed(rows: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
    std::array::from_fn(|i| rows.map(|row| row[i]))
}
