//! Sums over the nodes around a point, one axis after another.

#![allow(clippy::needless_range_loop, reason = "indices name nodes along an axis, of several tables at once")]

use flatland::sdf::shapes::Basis;
use flatland::sdf::{Jet, SecondOrder};
use glam::{DMat3, DVec3};

/// N × N × N nodes around a point: where they are, and their weights.
pub(super) struct Stencil<const N: usize> {
    /// The weights along x, y and z: of the value, the first and the second derivative, by the spacing.
    weights: [[[f64; N]; 3]; 3],
    nodes: Nodes<N>,
}

/// Where the nodes of a stencil are in the list of all nodes.
enum Nodes<const N: usize> {
    /// All within the grid: the first, and how far it is to the next row and to the next layer.
    Inside { first: usize, row: usize, layer: usize },
    /// Beyond the border the outermost nodes are repeated: the places along x, and where rows and layers begin.
    Border { x: [usize; N], y: [usize; N], z: [usize; N] },
}

impl<const N: usize> Stencil<N> {
    /// The nodes around a point in units of the spacing; `per_length` is 1 over the spacing.
    #[inline(always)]
    pub(super) fn new(local: DVec3, per_length: DVec3, size: [usize; 3], basis: fn(f64) -> Basis) -> Self {
        let bases = local.to_array().map(basis);
        let weights = std::array::from_fn(|axis| {
            let scale = per_length[axis];
            let [value, slope, bend]: [[f64; N]; 3] =
                bases[axis].weights.map(|w| std::array::from_fn(|i| w[i]));
            [value, slope.map(|w| w * scale), bend.map(|w| w * scale * scale)]
        });
        let [row, layer] = [size[0], size[0] * size[1]];
        let fits = |axis: usize| {
            let first = usize::try_from(bases[axis].first).ok()?;
            (first < size[axis] && size[axis] - first >= N).then_some(first)
        };
        let nodes = if let (Some(x), Some(y), Some(z)) = (fits(0), fits(1), fits(2)) {
            Nodes::Inside { first: x + y * row + z * layer, row, layer }
        } else {
            let along =
                |axis: usize, step: usize| std::array::from_fn(|i| bases[axis].node(i, size[axis]) * step);
            Nodes::Border { x: along(0, 1), y: along(1, row), z: along(2, layer) }
        };
        Self { weights, nodes }
    }

    /// The values of the N nodes of row j in layer k.
    #[inline(always)]
    fn row(&self, values: &[f64], j: usize, k: usize) -> [f64; N] {
        match &self.nodes {
            Nodes::Inside { first, row, layer } => {
                let begin = first + j * row + k * layer;
                let nodes = &values[begin..begin + N];
                std::array::from_fn(|i| nodes[i])
            }
            Nodes::Border { x, y, z } => x.map(|x| values[x + y[j] + z[k]]),
        }
    }

    /// φ.
    #[inline(always)]
    pub(super) fn value(&self, values: &[f64]) -> f64 {
        let [wx, wy, wz] = &self.weights;
        let mut plain = [0.0; N];
        for j in 0..N {
            let mut a = [0.0; N];
            for k in 0..N {
                add(&mut a, wz[0][k], &self.row(values, j, k));
            }
            add(&mut plain, wy[0][j], &a);
        }
        dot(&wx[0], &plain)
    }

    /// φ and ∇φ.
    #[inline(always)]
    pub(super) fn jet(&self, values: &[f64]) -> Jet<DVec3> {
        let [wx, wy, wz] = &self.weights;
        // Summed over z, then y, then x; names say which derivatives were taken on the way.
        let [mut plain, mut along_y, mut along_z] = [[0.0; N]; 3];
        for j in 0..N {
            let [mut a, mut b] = [[0.0; N]; 2];
            for k in 0..N {
                let row = self.row(values, j, k);
                add(&mut a, wz[0][k], &row);
                add(&mut b, wz[1][k], &row);
            }
            add(&mut plain, wy[0][j], &a);
            add(&mut along_y, wy[1][j], &a);
            add(&mut along_z, wy[0][j], &b);
        }
        let gradient = DVec3::new(dot(&wx[1], &plain), dot(&wx[0], &along_y), dot(&wx[0], &along_z));
        Jet { value: dot(&wx[0], &plain), gradient }
    }

    /// φ, ∇φ and ∇²φ.
    #[inline(always)]
    pub(super) fn second_order(&self, values: &[f64]) -> SecondOrder<DVec3> {
        let [wx, wy, wz] = &self.weights;
        let [mut plain, mut y, mut z, mut yy, mut yz, mut zz] = [[0.0; N]; 6];
        for j in 0..N {
            let [mut a, mut b, mut c] = [[0.0; N]; 3];
            for k in 0..N {
                let row = self.row(values, j, k);
                add(&mut a, wz[0][k], &row);
                add(&mut b, wz[1][k], &row);
                add(&mut c, wz[2][k], &row);
            }
            add(&mut plain, wy[0][j], &a);
            add(&mut y, wy[1][j], &a);
            add(&mut yy, wy[2][j], &a);
            add(&mut z, wy[0][j], &b);
            add(&mut yz, wy[1][j], &b);
            add(&mut zz, wy[0][j], &c);
        }
        let gradient = DVec3::new(dot(&wx[1], &plain), dot(&wx[0], &y), dot(&wx[0], &z));
        let (xy, xz, yz) = (dot(&wx[1], &y), dot(&wx[1], &z), dot(&wx[0], &yz));
        let hessian = DMat3::from_cols(
            DVec3::new(dot(&wx[2], &plain), xy, xz),
            DVec3::new(xy, dot(&wx[0], &yy), yz),
            DVec3::new(xz, yz, dot(&wx[0], &zz)),
        );
        SecondOrder { jet: Jet { value: dot(&wx[0], &plain), gradient }, hessian }
    }

    /// The transpose of [`jet`](Self::jet), added to one number for each node.
    #[inline(always)]
    pub(super) fn add_transpose(&self, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let [wx, wy, wz] = &self.weights;
        let Jet { value: c, gradient: q } = covector;
        for k in 0..N {
            for j in 0..N {
                let still = wy[0][j] * wz[0][k];
                let value = c * still + q.y * wy[1][j] * wz[0][k] + q.z * wy[0][j] * wz[1][k];
                let slope = q.x * still;
                let added: [f64; N] = std::array::from_fn(|i| value * wx[0][i] + slope * wx[1][i]);
                match &self.nodes {
                    Nodes::Inside { first, row, layer } => {
                        let begin = first + j * row + k * layer;
                        gradient[begin..begin + N].iter_mut().zip(added).for_each(|(g, a)| *g += a);
                    }
                    Nodes::Border { x, y, z } => {
                        x.iter().zip(added).for_each(|(x, a)| gradient[x + y[j] + z[k]] += a);
                    }
                }
            }
        }
    }
}

#[inline(always)]
fn add<const N: usize>(sum: &mut [f64; N], weight: f64, row: &[f64; N]) {
    for i in 0..N {
        sum[i] += weight * row[i];
    }
}

#[inline(always)]
fn dot<const N: usize>(a: &[f64; N], b: &[f64; N]) -> f64 {
    let mut sum = 0.0;
    for i in 0..N {
        sum += a[i] * b[i];
    }
    sum
}
