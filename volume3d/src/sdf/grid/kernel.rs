//! Separable sums over the nodes around a point, with the nodes along x in SIMD lanes.
//!
//! Code is generated for an instruction set only where it is inlined, see [`Lanes`]: there are no closures.
//! Nothing is fused, so that bits do not depend on the machine.

#![allow(clippy::needless_range_loop, reason = "indices name nodes along an axis, of several tables at once")]

use flatland::sdf::{Jet, SecondOrder};
use glam::{DMat3, DVec3};

use crate::lanes::{Half, Lanes};

/// Nodes loaded along x: the number of lanes.
const ROW: usize = 4;
/// Weights of a single node.
const ONE: [Half; 3] = [[1.0, 0.0, 0.0, 0.0], [0.0; 4], [0.0; 4]];

/// Positions and weights of the N × N × N nodes around a point.
pub(super) struct Stencil<L: Lanes, const N: usize> {
    lanes: L,
    /// Weights along x, in lanes: of the value and of the first and second derivative, including the spacing.
    /// Weights beyond N are 0.
    x: [L::Double; 3],
    /// Weights along y and z.
    y: [Half; 3],
    z: [Half; 3],
    nodes: Nodes,
}

/// Node weights along an axis: polynomials of a point's position in its cell, from 0 to 1.
pub(super) struct Weights {
    /// Coefficients by power, in lanes for the nodes.
    powers: [Half; 4],
    /// Number of nodes before the cell's first.
    before: i64,
}

impl Weights {
    /// Linear interpolation.
    pub(super) const LINEAR: Self =
        Self { powers: [[1.0, 0.0, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0], [0.0; 4], [0.0; 4]], before: 0 };

    /// The uniform cubic B-spline.
    pub(super) const CUBIC: Self = Self {
        powers: [
            [1.0 / 6.0, 2.0 / 3.0, 1.0 / 6.0, 0.0],
            [-0.5, 0.0, 0.5, 0.0],
            [0.5, -1.0, 0.5, 0.0],
            [-1.0 / 6.0, 0.5, -0.5, 1.0 / 6.0],
        ],
        before: 1,
    };

    /// Weights of the value and of the first and second derivative by length.
    #[inline(always)]
    fn at<L: Lanes>(&self, lanes: L, s: f64, per_length: f64) -> [L::Double; 3] {
        let Self { powers: [a, b, c, d], .. } = self;
        let [a, b] = [lanes.load_double(a), lanes.load_double(b)];
        let [c, d] = [lanes.load_double(c), lanes.load_double(d)];
        let once = lanes.add_double(a, lanes.mul_double(b, lanes.splat_double(s)));
        let more = lanes.add_double(c, lanes.mul_double(d, lanes.splat_double(s)));
        let value = lanes.add_double(once, lanes.mul_double(more, lanes.splat_double(s * s)));
        let first = lanes.mul_double(b, lanes.splat_double(per_length));
        let second = lanes.mul_double(c, lanes.splat_double(2.0 * s * per_length));
        let third = lanes.mul_double(d, lanes.splat_double(3.0 * (s * s) * per_length));
        let slope = lanes.add_double(lanes.add_double(first, second), third);
        let twice = 2.0 * per_length * per_length;
        let second = lanes.mul_double(c, lanes.splat_double(twice));
        let third = lanes.mul_double(d, lanes.splat_double(3.0 * s * twice));
        [value, slope, lanes.add_double(second, third)]
    }
}

/// Indices of a stencil's nodes.
enum Nodes {
    /// All within the grid: the first index, and the strides of rows and layers.
    Inside { first: usize, row: usize, layer: usize },
    /// Beyond the border the outermost nodes are repeated: indices along x, and starts of rows and layers.
    Border { x: Places, y: Places, z: Places },
}

/// Indices of nodes along an axis, some of them beyond the border.
#[derive(Clone, Copy)]
struct Places {
    at: [usize; ROW],
    /// Number of nodes: one if all are equal.
    count: usize,
    /// Whether all nodes are within the grid.
    fits: bool,
}

impl Places {
    /// Indices of `count` nodes from `first` on along an axis of `size` nodes, `step` apart in the list.
    #[inline(always)]
    fn new(first: i64, count: usize, size: usize, step: usize) -> Self {
        let last = size as i64 - 1;
        let end = first.saturating_add(count as i64 - 1);
        let mut at = [0; ROW];
        for i in 0..count {
            at[i] = first.saturating_add(i as i64).clamp(0, last) as usize * step;
        }
        let is_flat = end <= 0 || first >= last;
        Self { at, count: if is_flat { 1 } else { count }, fits: first >= 0 && end <= last }
    }
}

impl<L: Lanes, const N: usize> Stencil<L, N> {
    /// Stencil of a point in units of the spacing; `per_length` is 1/spacing.
    #[inline(always)]
    pub(super) fn new(
        lanes: L,
        local: DVec3,
        per_length: DVec3,
        size: [usize; 3],
        weights: &Weights,
    ) -> Self {
        let cell = DVec3::new(local.x.floor(), local.y.floor(), local.z.floor());
        let within = local - cell;
        let x = weights.at(lanes, within.x, per_length.x);
        let y = weights.at(lanes, within.y, per_length.y);
        let z = weights.at(lanes, within.z, per_length.z);
        let mut y = [lanes.store_double(y[0]), lanes.store_double(y[1]), lanes.store_double(y[2])];
        let mut z = [lanes.store_double(z[0]), lanes.store_double(z[1]), lanes.store_double(z[2])];
        let [row, layer] = [size[0], size[0] * size[1]];
        let mut first = [0; 3];
        let mut fits = true;
        for axis in 0..3 {
            first[axis] = (cell[axis] as i64).saturating_sub(weights.before);
            let count = if axis == 0 { ROW } else { N };
            fits &= first[axis] >= 0 && first[axis] <= size[axis] as i64 - count as i64;
        }
        let nodes = if fits {
            let [x, y, z] = [first[0] as usize, first[1] as usize, first[2] as usize];
            Nodes::Inside { first: x + y * row + z * layer, row, layer }
        } else {
            let along_x = Places::new(first[0], N, size[0], 1);
            let along_y = Places::new(first[1], N, size[1], row);
            let along_z = Places::new(first[2], N, size[2], layer);
            // If all nodes along an axis are equal, φ is constant along it.
            if along_y.count == 1 {
                y = ONE;
            }
            if along_z.count == 1 {
                z = ONE;
            }
            Nodes::Border { x: along_x, y: along_y, z: along_z }
        };
        Self { lanes, x, y, z, nodes }
    }

    /// Values of the nodes of row j in layer k.
    #[inline(always)]
    fn row(&self, values: &[f64], j: usize, k: usize) -> L::Double {
        let mut found = [0.0; ROW];
        match &self.nodes {
            Nodes::Inside { first, row, layer } => {
                let begin = first + j * row + k * layer;
                found.copy_from_slice(&values[begin..begin + ROW]);
            }
            Nodes::Border { x, y, z } => {
                let begin = y.at[j] + z.at[k];
                if x.fits && N == ROW {
                    let begin = begin + x.at[0];
                    found.copy_from_slice(&values[begin..begin + ROW]);
                } else {
                    for i in 0..N {
                        found[i] = values[begin + x.at[i]];
                    }
                }
            }
        }
        self.lanes.load_double(&found)
    }

    /// Numbers of rows and layers.
    #[inline(always)]
    fn counts(&self) -> (usize, usize) {
        match &self.nodes {
            Nodes::Inside { .. } => (N, N),
            Nodes::Border { y, z, .. } => (y.count, z.count),
        }
    }

    /// sum + weight · row.
    #[inline(always)]
    fn add(&self, sum: L::Double, weight: f64, row: L::Double) -> L::Double {
        let lanes = self.lanes;
        lanes.add_double(sum, lanes.mul_double(lanes.splat_double(weight), row))
    }

    /// Σ over x.
    #[inline(always)]
    fn dot(&self, a: L::Double, b: L::Double) -> f64 {
        let [p, q, r, s] = self.lanes.store_double(self.lanes.mul_double(a, b));
        (p + q) + (r + s)
    }

    /// φ.
    #[inline(always)]
    pub(super) fn value(&self, values: &[f64]) -> f64 {
        match self.counts() {
            // Compile-time constants, so that loops are unrolled.
            (rows, layers) if rows == N && layers == N => self.value_of(values, (N, N)),
            counts => self.value_of(values, counts),
        }
    }

    #[inline(always)]
    fn value_of(&self, values: &[f64], (rows, layers): (usize, usize)) -> f64 {
        let Self { lanes, x, y, z, .. } = self;
        let mut plain = lanes.splat_double(0.0);
        for j in 0..rows {
            let mut a = lanes.splat_double(0.0);
            for k in 0..layers {
                a = self.add(a, z[0][k], self.row(values, j, k));
            }
            plain = self.add(plain, y[0][j], a);
        }
        self.dot(x[0], plain)
    }

    /// φ and ∇φ.
    #[inline(always)]
    pub(super) fn jet(&self, values: &[f64]) -> Jet<DVec3> {
        match self.counts() {
            // Compile-time constants, so that loops are unrolled.
            (rows, layers) if rows == N && layers == N => self.jet_of(values, (N, N)),
            counts => self.jet_of(values, counts),
        }
    }

    #[inline(always)]
    fn jet_of(&self, values: &[f64], (rows, layers): (usize, usize)) -> Jet<DVec3> {
        let Self { lanes, x, y, z, .. } = self;
        // Summed over z, then y, then x; names state which derivatives have been taken.
        let zero = lanes.splat_double(0.0);
        let [mut plain, mut along_y, mut along_z] = [zero; 3];
        for j in 0..rows {
            let [mut a, mut b] = [zero; 2];
            for k in 0..layers {
                let row = self.row(values, j, k);
                a = self.add(a, z[0][k], row);
                b = self.add(b, z[1][k], row);
            }
            plain = self.add(plain, y[0][j], a);
            along_y = self.add(along_y, y[1][j], a);
            along_z = self.add(along_z, y[0][j], b);
        }
        let gradient = DVec3::new(self.dot(x[1], plain), self.dot(x[0], along_y), self.dot(x[0], along_z));
        Jet { value: self.dot(x[0], plain), gradient }
    }

    /// φ, ∇φ and ∇²φ.
    #[inline(always)]
    pub(super) fn second_order(&self, values: &[f64]) -> SecondOrder<DVec3> {
        match self.counts() {
            // Compile-time constants, so that loops are unrolled.
            (rows, layers) if rows == N && layers == N => self.second_order_of(values, (N, N)),
            counts => self.second_order_of(values, counts),
        }
    }

    #[inline(always)]
    fn second_order_of(&self, values: &[f64], (rows, layers): (usize, usize)) -> SecondOrder<DVec3> {
        let Self { lanes, x, y, z, .. } = self;
        let zero = lanes.splat_double(0.0);
        let [mut plain, mut to_y, mut to_z, mut yy, mut yz, mut zz] = [zero; 6];
        for j in 0..rows {
            let [mut a, mut b, mut c] = [zero; 3];
            for k in 0..layers {
                let row = self.row(values, j, k);
                a = self.add(a, z[0][k], row);
                b = self.add(b, z[1][k], row);
                c = self.add(c, z[2][k], row);
            }
            plain = self.add(plain, y[0][j], a);
            to_y = self.add(to_y, y[1][j], a);
            yy = self.add(yy, y[2][j], a);
            to_z = self.add(to_z, y[0][j], b);
            yz = self.add(yz, y[1][j], b);
            zz = self.add(zz, y[0][j], c);
        }
        let gradient = DVec3::new(self.dot(x[1], plain), self.dot(x[0], to_y), self.dot(x[0], to_z));
        let (xy, xz, yz) = (self.dot(x[1], to_y), self.dot(x[1], to_z), self.dot(x[0], yz));
        let hessian = DMat3::from_cols(
            DVec3::new(self.dot(x[2], plain), xy, xz),
            DVec3::new(xy, self.dot(x[0], yy), yz),
            DVec3::new(xz, yz, self.dot(x[0], zz)),
        );
        SecondOrder { jet: Jet { value: self.dot(x[0], plain), gradient }, hessian }
    }

    /// Transpose of [`jet`](Self::jet), added to one number per node.
    #[inline(always)]
    pub(super) fn add_transpose(&self, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let Self { lanes, x, y, z, .. } = self;
        let Jet { value: c, gradient: q } = covector;
        let (rows, layers) = self.counts();
        for k in 0..layers {
            for j in 0..rows {
                let still = y[0][j] * z[0][k];
                let value = c * still + q.y * y[1][j] * z[0][k] + q.z * y[0][j] * z[1][k];
                let added = lanes.mul_double(lanes.splat_double(value), x[0]);
                let added = self.add(added, q.x * still, x[1]);
                match &self.nodes {
                    Nodes::Inside { first, row, layer } => {
                        let begin = first + j * row + k * layer;
                        let there = &mut gradient[begin..begin + ROW];
                        let mut before = [0.0; ROW];
                        before.copy_from_slice(there);
                        let sum = lanes.add_double(lanes.load_double(&before), added);
                        there.copy_from_slice(&lanes.store_double(sum));
                    }
                    Nodes::Border { x, y, z } => {
                        let added = lanes.store_double(added);
                        for i in 0..N {
                            gradient[x.at[i] + y.at[j] + z.at[k]] += added[i];
                        }
                    }
                }
            }
        }
    }
}
