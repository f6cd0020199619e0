//! Distances sampled on a grid.

use glam::{DMat2, DVec2};

use super::ShapeError;
use crate::sdf::distance::{Jet, Sdf, SecondOrder};

/// Interpolation between nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Bilinear, continuous only: ∇φ is discontinuous across the edges of cells, and with it every field of
    /// tracer points, which is therefore biased. Provided to demonstrate that.
    Bilinear,
    /// The uniform cubic B-spline with the node values as coefficients: twice continuously differentiable, so
    /// that ∇·V is continuous, and a convex combination of nodes, so that each component of ∇φ is bounded by
    /// the differences of the nodes. It smooths and does not interpolate the nodes. Catmull–Rom interpolates
    /// them, but is only once differentiable and overshoots.
    Bicubic,
}

/// φ from node values on a regular grid of width × height nodes, row by row. Parameters: the node values.
///
/// Nodes that are distances differ by at most the spacing, which bounds each component of ∇φ by 1 but |∇φ|
/// only by √2, for either interpolation: trace grids with a step scale below 1. 1/√2 is always safe.
///
/// Beyond the border the outermost nodes are repeated: φ becomes constant across the border, which keeps it a
/// bound but makes ∇φ vanish near the corners. Eye and far limit should be inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    interpolation: Interpolation,
    low: DVec2,
    spacing: f64,
    width: usize,
    height: usize,
    nodes: Vec<f64>,
}

/// The weights of up to four neighbouring nodes along one axis, and their first two derivatives.
#[derive(Clone, Copy, Debug)]
pub struct Basis {
    /// Index of the first node, which may be outside the grid.
    pub first: i64,
    /// Weights of the nodes from the first on, and of the first and second derivatives, in units of the
    /// spacing.
    pub weights: [[f64; 4]; 3],
}

impl Basis {
    /// Linear interpolation at a coordinate in units of the spacing, with the first node at 0.
    #[must_use]
    #[inline(always)]
    pub fn linear(coordinate: f64) -> Self {
        let cell = coordinate.floor();
        let s = coordinate - cell;
        Self { first: cell as i64, weights: [[1.0 - s, s, 0.0, 0.0], [-1.0, 1.0, 0.0, 0.0], [0.0; 4]] }
    }

    /// The uniform cubic B-spline.
    #[must_use]
    #[inline(always)]
    pub fn cubic(coordinate: f64) -> Self {
        let cell = coordinate.floor();
        let s = coordinate - cell;
        let r = 1.0 - s;
        let value = [
            r * r * r / 6.0,
            (4.0 - 3.0 * s * s * (2.0 - s)) / 6.0,
            (4.0 - 3.0 * r * r * (2.0 - r)) / 6.0,
            s * s * s / 6.0,
        ];
        let slope = [-0.5 * r * r, 0.5 * s * (3.0 * s - 4.0), 0.5 * r * (4.0 - 3.0 * r), 0.5 * s * s];
        let weights = [value, slope, [r, 3.0 * s - 2.0, 3.0 * r - 2.0, s]];
        Self { first: (cell as i64).saturating_sub(1), weights }
    }

    /// The node of weight i, out of `count`; those beyond the ends are the outermost.
    #[must_use]
    #[inline(always)]
    pub fn node(&self, i: usize, count: usize) -> usize {
        self.first.saturating_add(i as i64).clamp(0, count as i64 - 1) as usize
    }
}

impl Grid {
    /// A grid whose first node is at `low`.
    ///
    /// # Errors
    /// If the number of node values does not match the size, there are fewer than 2 × 2, or a number is not
    /// finite.
    pub fn new(
        interpolation: Interpolation,
        low: DVec2,
        spacing: f64,
        (width, height): (usize, usize),
        nodes: Vec<f64>,
    ) -> Result<Self, ShapeError> {
        let found = nodes.len();
        if width < 2 || height < 2 || width.checked_mul(height) != Some(found) {
            return Err(ShapeError::Nodes { width, height, found });
        }
        ShapeError::check("grid", "spacing", spacing, "positive and finite", spacing > 0.0)?;
        ShapeError::check("grid", "low.x", low.x, "finite", true)?;
        ShapeError::check("grid", "low.y", low.y, "finite", true)?;
        for &node in &nodes {
            ShapeError::check("grid", "node value", node, "finite", true)?;
        }
        Ok(Self { interpolation, low, spacing, width, height, nodes })
    }

    /// Samples a function at the nodes between two corners, with `cells` cells along the wider side.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn sampled(
        interpolation: Interpolation,
        (low, high): (DVec2, DVec2),
        cells: usize,
        value: impl Fn(DVec2) -> f64,
    ) -> Result<Self, ShapeError> {
        let extent = high - low;
        let spacing = extent.max_element() / cells.max(1) as f64;
        let count = |length: f64| (length / spacing).round() as usize + 1;
        let (width, height) = (count(extent.x), count(extent.y));
        let at = |i: usize| low + spacing * DVec2::new((i % width) as f64, (i / width) as f64);
        let nodes = (0..width * height).map(|i| value(at(i))).collect();
        Self::new(interpolation, low, spacing, (width, height), nodes)
    }

    pub(super) fn with_parameters(&self, nodes: &[f64]) -> Result<Self, ShapeError> {
        Self::new(self.interpolation, self.low, self.spacing, (self.width, self.height), nodes.to_vec())
    }

    pub(super) fn parameters(&self) -> Vec<f64> {
        self.nodes.clone()
    }

    fn bases(&self, x: DVec2) -> [Basis; 2] {
        let local = (x - self.low) / self.spacing;
        [local.x, local.y].map(match self.interpolation {
            Interpolation::Bilinear => Basis::linear,
            Interpolation::Bicubic => Basis::cubic,
        })
    }

    /// Calls `visit` with each node near x and its coefficients in (φ, ∂_xφ, ∂_yφ).
    fn visit(&self, x: DVec2, mut visit: impl FnMut(usize, [f64; 3])) {
        let [across, down] = self.bases(x);
        let inverse = self.spacing.recip();
        for j in 0..4 {
            let row = down.node(j, self.height) * self.width;
            let [v, dv, _] = down.weights.map(|w| w[j]);
            for i in 0..4 {
                let [u, du, _] = across.weights.map(|w| w[i]);
                visit(row + across.node(i, self.width), [u * v, du * v * inverse, u * dv * inverse]);
            }
        }
    }

    fn interpolate(&self, x: DVec2, values: &[f64]) -> Jet<DVec2> {
        let mut jet = Jet::ZERO;
        self.visit(x, |node, [value, along_x, along_y]| {
            jet.value += value * values[node];
            jet.gradient += DVec2::new(along_x, along_y) * values[node];
        });
        jet
    }

    fn hessian(&self, x: DVec2) -> DMat2 {
        let [across, down] = self.bases(x);
        let (mut xx, mut xy, mut yy) = (0.0, 0.0, 0.0);
        let inverse = (self.spacing * self.spacing).recip();
        for j in 0..4 {
            let row = down.node(j, self.height) * self.width;
            let [v, dv, ddv] = down.weights.map(|w| w[j]);
            for i in 0..4 {
                let [u, du, ddu] = across.weights.map(|w| w[i]);
                let value = self.nodes[row + across.node(i, self.width)] * inverse;
                xx += ddu * v * value;
                xy += du * dv * value;
                yy += u * ddv * value;
            }
        }
        DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy))
    }
}

impl Sdf<DVec2> for Grid {
    fn jet(&self, x: DVec2) -> Jet<DVec2> {
        self.interpolate(x, &self.nodes)
    }

    fn second_order(&self, x: DVec2) -> SecondOrder<DVec2> {
        SecondOrder { jet: self.jet(x), hessian: self.hessian(x) }
    }

    fn parameter_count(&self) -> usize {
        self.nodes.len()
    }

    fn rate(&self, x: DVec2, direction: &[f64]) -> Jet<DVec2> {
        self.interpolate(x, direction)
    }

    fn add_parameter_gradient(&self, x: DVec2, covector: Jet<DVec2>, gradient: &mut [f64]) {
        self.visit(x, |node, [value, along_x, along_y]| {
            gradient[node] += Jet { value, gradient: DVec2::new(along_x, along_y) }.dot(covector);
        });
    }
}
