//! Sums over the nodes around a point, one axis after another, with the nodes along x side by side.
//!
//! Code is generated for an instruction set only where it is inlined, see [`Lanes`]: so there are no closures. Nothing is fused, so that bits do not depend
//! on the machine.

#![allow(clippy::needless_range_loop, reason = "indices name nodes along an axis, of several tables at once")]

use flatland::sdf::shapes::Basis;
use flatland::sdf::{Jet, SecondOrder};
use glam::{DMat3, DVec3};

use crate::lanes::{Half, Lanes};

/// The nodes along x that are looked at, if there are so many: as many as there are lanes.
const ROW: usize = 4;

/// N × N × N nodes around a point: where they are, and their weights.
pub(super) struct Stencil<L: Lanes, const N: usize> {
    lanes: L,
    /// The weights along x, side by side: of the value, the first and the second derivative, by the spacing. Those beyond N
    /// are 0.
    x: [L::Double; 3],
    /// Those along y and z.
    y: [Half; 3],
    z: [Half; 3],
    nodes: Nodes,
}

/// Where the nodes of a stencil are in the list of all nodes.
enum Nodes {
    /// All within the grid: the first, and how far it is to the next row and to the next layer.
    Inside { first: usize, row: usize, layer: usize },
    /// Beyond the border the outermost nodes are repeated: the places along x, and where rows and layers begin.
    Border { x: [usize; ROW], y: [usize; ROW], z: [usize; ROW] },
}

impl<L: Lanes, const N: usize> Stencil<L, N> {
    /// The nodes around a point in units of the spacing; `per_length` is 1 over the spacing.
    #[inline(always)]
    pub(super) fn new(
        lanes: L,
        local: DVec3,
        per_length: DVec3,
        size: [usize; 3],
        basis: fn(f64) -> Basis,
    ) -> Self {
        let bases = [basis(local.x), basis(local.y), basis(local.z)];
        let mut weights = [[[0.0; ROW]; 3]; 3];
        for axis in 0..3 {
            let scale = per_length[axis];
            let [value, slope, bend] = &bases[axis].weights;
            for i in 0..N {
                weights[axis][0][i] = value[i];
                weights[axis][1][i] = slope[i] * scale;
                weights[axis][2][i] = bend[i] * scale * scale;
            }
        }
        let [along_x, y, z] = weights;
        let x =
            [lanes.load_double(&along_x[0]), lanes.load_double(&along_x[1]), lanes.load_double(&along_x[2])];
        let [row, layer] = [size[0], size[0] * size[1]];
        let fits = |axis: usize, count: usize| {
            let first = bases[axis].first;
            first >= 0 && first <= size[axis] as i64 - count as i64
        };
        let nodes = if fits(0, ROW) && fits(1, N) && fits(2, N) {
            let [x, y, z] = [bases[0].first as usize, bases[1].first as usize, bases[2].first as usize];
            Nodes::Inside { first: x + y * row + z * layer, row, layer }
        } else {
            let mut places = [[0; ROW]; 3];
            for (axis, step) in [1, row, layer].into_iter().enumerate() {
                for i in 0..N {
                    places[axis][i] = bases[axis].node(i, size[axis]) * step;
                }
            }
            let [x, y, z] = places;
            Nodes::Border { x, y, z }
        };
        Self { lanes, x, y, z, nodes }
    }

    /// The values of the nodes of row j in layer k.
    #[inline(always)]
    fn row(&self, values: &[f64], j: usize, k: usize) -> L::Double {
        let mut found = [0.0; ROW];
        match &self.nodes {
            Nodes::Inside { first, row, layer } => {
                let begin = first + j * row + k * layer;
                found.copy_from_slice(&values[begin..begin + ROW]);
            }
            Nodes::Border { x, y, z } => {
                for i in 0..N {
                    found[i] = values[x[i] + y[j] + z[k]];
                }
            }
        }
        self.lanes.load_double(&found)
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
        p + q + r + s
    }

    /// φ.
    #[inline(always)]
    pub(super) fn value(&self, values: &[f64]) -> f64 {
        let Self { lanes, x, y, z, .. } = self;
        let mut plain = lanes.splat_double(0.0);
        for j in 0..N {
            let mut a = lanes.splat_double(0.0);
            for k in 0..N {
                a = self.add(a, z[0][k], self.row(values, j, k));
            }
            plain = self.add(plain, y[0][j], a);
        }
        self.dot(x[0], plain)
    }

    /// φ and ∇φ.
    #[inline(always)]
    pub(super) fn jet(&self, values: &[f64]) -> Jet<DVec3> {
        let Self { lanes, x, y, z, .. } = self;
        // Summed over z, then y, then x; names say which derivatives were taken on the way.
        let zero = lanes.splat_double(0.0);
        let [mut plain, mut along_y, mut along_z] = [zero; 3];
        for j in 0..N {
            let [mut a, mut b] = [zero; 2];
            for k in 0..N {
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
        let Self { lanes, x, y, z, .. } = self;
        let zero = lanes.splat_double(0.0);
        let [mut plain, mut to_y, mut to_z, mut yy, mut yz, mut zz] = [zero; 6];
        for j in 0..N {
            let [mut a, mut b, mut c] = [zero; 3];
            for k in 0..N {
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

    /// The transpose of [`jet`](Self::jet), added to one number for each node.
    #[inline(always)]
    pub(super) fn add_transpose(&self, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let Self { lanes, x, y, z, .. } = self;
        let Jet { value: c, gradient: q } = covector;
        for k in 0..N {
            for j in 0..N {
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
                            gradient[x[i] + y[j] + z[k]] += added[i];
                        }
                    }
                }
            }
        }
    }
}
