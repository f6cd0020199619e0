//! SDF grids: signed distances sampled on a grid.

mod control;
mod error;
mod kernel;
mod outside;
mod prefilter;
mod slope;
mod subdivide;
#[cfg(test)]
mod tests;
mod visit;

use flatland::sdf::shapes::{Parametric, ShapeError};
use flatland::sdf::{Jet, Sdf, SecondOrder};
use glam::DVec3;
use rayon::prelude::*;

pub use error::GridError;
use outside::Outside;
use slope::{SlopeBounds, bounds};
use visit::{Instructions, Visit};

/// Interpolation between nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Interpolation {
    /// Trilinear. Only continuous: ∇φ is discontinuous between cells, and fields of tracer points are biased,
    /// whatever the resolution. For reading grids that were made for it.
    Trilinear,
    /// The uniform cubic B-spline with the node values as coefficients, 64 nodes per point: twice
    /// continuously differentiable, as warp fields require. It smooths and does not interpolate its nodes:
    /// for a distance, its surface lies about h² (κ₁ + κ₂) / 6 inside the sampled one, with h the spacing and
    /// κ the curvatures, positive if convex; [`Grid::prefiltered`] corrects that.
    Cubic,
}

/// φ from node values on a regular grid of nx × ny × nz nodes, x fastest, φ > 0 outside. Parameters: the node
/// values.
///
/// The first node is at the low corner, the next along an axis one spacing farther. Beyond the border the
/// outermost nodes are repeated, and with the distance d to them φ is √(φ² + d²): at most the distance of the
/// surface, and continuously differentiable. If the surface reaches the border, φ is instead constant across
/// it. The surface should be inside, with a margin of two nodes for [`Interpolation::Cubic`].
///
/// # The slope bound
///
/// [`slope_bound`](Sdf::slope_bound) is the largest √(Σ_axis max(d₊², d₋²)), with d₊ and d₋ the differences
/// of a node to its two neighbours along an axis, divided by the spacing. For trilinear interpolation, ∂φ/∂x
/// at a point of a cell is Σ_jk w_j w_k d_jk over its four edges along x. As Σ_i w_i = 1 this is Σ_ijk w_i
/// w_j w_k d_jk, and likewise for y and z: ∇φ is a convex combination, with the same weights for all three
/// components, of the eight vectors of differences along the edges that meet at a corner, none of which is
/// longer than the bound. For the cubic spline, ∂φ/∂x = Σ Q_i B_j B_k d_ijk with the quadratic weights Q of
/// the edges along x, and B_i = α_i Q_i + (1 − α_{i−1}) Q_{i−1} with α in [0, 1] (Cox–de Boor). So Q_i is the
/// sum of α_i Q_i and (1 − α_i) Q_i, assigned to the two ends of edge i: again a convex combination, of the
/// same vectors at the corners of 27 cells.
///
/// The largest is taken over the nodes that count where φ > 0, where rays are: such a point has a positive
/// node among its 8 or 64. Inside, where distances have ridges, it would be up to √3 unnecessarily;
/// [`slope_bound_everywhere`](Sdf::slope_bound_everywhere) includes the inside, for complements. Ridges
/// outside count: around a bunny in 64 cells the bound would be 1.54, where no slope of the spline exceeds
/// 1.01. In cells where it is above 1.1, the longest control vector of ∇φ in Bézier form is used instead,
/// which is a bound too, 1.03 there.
///
/// # The bound on second derivatives
///
/// [`second_derivative_bound`](Sdf::second_derivative_bound) of the cubic spline is the Frobenius norm of the
/// largest second differences of each kind among the same nodes: ∂²φ/∂x² = Σ L_i B_j B_k
/// (c_{i+1} − 2c_i + c_{i−1})_jk with the linear weights L, and ∂²φ/∂x∂y = Σ Q_i Q_j B_k d_ijk with the mixed
/// differences d over squares are convex combinations.
#[derive(Clone, Debug, PartialEq)]
pub struct Grid {
    interpolation: Interpolation,
    low: DVec3,
    spacing: DVec3,
    size: [usize; 3],
    nodes: Vec<f64>,
    slopes: SlopeBounds,
    /// Bound on second derivatives.
    bend: f64,
    /// Whether the surface stays away from the border.
    closed: bool,
    /// 1 over the spacing.
    per_length: DVec3,
    /// The box within which nodes have an effect.
    inner: (DVec3, DVec3),
    instructions: Instructions,
}

impl Grid {
    /// A grid whose first node is at `low`, and whose node (i, j, k) has index i + nx (j + ny k).
    ///
    /// # Errors
    /// [`GridError`]: fewer than two nodes along an axis, a number of values that does not match the size,
    /// values or a placement that are not finite, or values of one sign only.
    pub fn new(
        interpolation: Interpolation,
        low: DVec3,
        spacing: DVec3,
        size: [usize; 3],
        nodes: Vec<f64>,
    ) -> Result<Self, GridError> {
        if size.iter().any(|&n| n < 2) {
            return Err(GridError::TooFew { size });
        }
        let found = nodes.len();
        if size.iter().try_fold(1_usize, |count, &n| count.checked_mul(n)) != Some(found) {
            return Err(GridError::Count { size, found });
        }
        if !(low.is_finite() && spacing.is_finite() && spacing.cmpgt(DVec3::ZERO).all()) {
            return Err(GridError::Place { low, spacing });
        }
        if let Some(index) = nodes.iter().position(|value| !value.is_finite()) {
            return Err(GridError::NotFinite { node: place(index, size), value: nodes[index] });
        }
        if nodes.iter().all(|&value| value > 0.0) {
            return Err(GridError::OneSign { sign: "positive" });
        }
        if nodes.iter().all(|&value| value <= 0.0) {
            return Err(GridError::OneSign { sign: "0 or negative" });
        }
        let (slopes, bend) = bounds(&nodes, size, spacing, interpolation);
        let (per_length, instructions) = (spacing.recip(), Instructions::default());
        let inner = (DVec3::ZERO, DVec3::ZERO);
        let grid = Self {
            interpolation,
            low,
            spacing,
            size,
            nodes,
            slopes,
            bend,
            closed: false,
            per_length,
            inner,
            instructions,
        };
        Ok(Self { closed: grid.bounds().is_some(), inner: grid.inner(), ..grid })
    }

    /// Samples a function at the nodes between two corners: `cells` cubes along the longest side, and at
    /// least the box along the others.
    ///
    /// `Grid::sampled(Interpolation::Cubic, bounds, 64, |x| sdf.jet(x).value)?.prefiltered()?` makes a grid
    /// of any shape.
    ///
    /// # Errors
    /// As [`new`](Self::new).
    pub fn sampled(
        interpolation: Interpolation,
        bounds: (DVec3, DVec3),
        cells: usize,
        value: impl Fn(DVec3) -> f64 + Sync,
    ) -> Result<Self, GridError> {
        let together = |points: &[DVec3]| points.par_iter().map(|&x| value(x)).collect();
        Self::sampled_together(interpolation, bounds, cells, together)
    }

    /// [`sampled`](Self::sampled) for a function of many points at once.
    pub(super) fn sampled_together(
        interpolation: Interpolation,
        (low, high): (DVec3, DVec3),
        cells: usize,
        values: impl FnOnce(&[DVec3]) -> Vec<f64>,
    ) -> Result<Self, GridError> {
        let extent = high - low;
        let spacing = extent.max_element() / cells.max(1) as f64;
        if !(low.is_finite() && extent.is_finite() && spacing > 0.0) {
            return Err(GridError::Place { low, spacing: DVec3::splat(spacing) });
        }
        // Whole cells, except for rounding of a quotient of up to 10⁶.
        let size = extent.to_array().map(|length| (length / spacing - 1e-9).ceil().max(1.0) as usize + 1);
        let at = |index: usize| low + spacing * DVec3::from_array(place(index, size).map(|i| i as f64));
        let points: Vec<DVec3> = (0..size.iter().product()).map(at).collect();
        Self::new(interpolation, low, DVec3::splat(spacing), size, values(&points))
    }

    /// Sets the interpolation of the same nodes.
    #[must_use]
    pub fn with_interpolation(mut self, interpolation: Interpolation) -> Self {
        self.interpolation = interpolation;
        (self.slopes, self.bend) = bounds(&self.nodes, self.size, self.spacing, interpolation);
        self.closed = self.bounds().is_some();
        self.inner = self.inner();
        self
    }

    /// Interpolation between the nodes.
    #[must_use]
    pub fn interpolation(&self) -> Interpolation {
        self.interpolation
    }

    /// Position of the first node.
    #[must_use]
    pub fn low(&self) -> DVec3 {
        self.low
    }

    /// Position of the last node.
    #[must_use]
    pub fn high(&self) -> DVec3 {
        self.low + self.spacing * DVec3::from_array(self.size.map(|n| (n - 1) as f64))
    }

    /// Spacing of nodes along each axis.
    #[must_use]
    pub fn spacing(&self) -> DVec3 {
        self.spacing
    }

    /// Nodes along x, y and z.
    #[must_use]
    pub fn size(&self) -> [usize; 3] {
        self.size
    }

    /// The node values, x fastest.
    #[must_use]
    pub fn nodes(&self) -> &[f64] {
        &self.nodes
    }

    /// Position of a node, by its index in [`nodes`](Self::nodes).
    #[must_use]
    pub fn position(&self, index: usize) -> DVec3 {
        self.low + self.spacing * DVec3::from_array(place(index, self.size).map(|i| i as f64))
    }

    #[inline]
    fn visit<'a>(&self, x: DVec3, values: &'a [f64]) -> Visit<'a> {
        let Self { interpolation, size, .. } = *self;
        let per_length = self.per_length;
        Visit { interpolation, local: (x - self.low) * per_length, per_length, size, values }
    }

    #[inline]
    fn interpolate(&self, x: DVec3, values: &[f64]) -> Jet<DVec3> {
        self.instructions.jet(self.visit(x, values))
    }
}

impl Interpolation {
    /// Largest index difference of two nodes that affect the same point.
    fn reach(self) -> usize {
        match self {
            Self::Trilinear => 1,
            Self::Cubic => 3,
        }
    }
}

impl Interpolation {
    /// Number of layers of nodes that affect the border: two for a spline, of which beyond the border only
    /// the outermost remains.
    pub(super) fn border(self) -> usize {
        match self {
            Self::Trilinear => 1,
            Self::Cubic => 2,
        }
    }
}

/// Position of a node along each axis.
fn place(index: usize, [nx, ny, _]: [usize; 3]) -> [usize; 3] {
    [index % nx, index / nx % ny, index / nx / ny]
}

impl Sdf<DVec3> for Grid {
    fn jet(&self, x: DVec3) -> Jet<DVec3> {
        let jet = self.interpolate(x, &self.nodes);
        self.outside(x).map_or(jet, |outside| outside.jet(jet))
    }

    fn value(&self, x: DVec3) -> f64 {
        let value = self.instructions.value(self.visit(x, &self.nodes));
        self.outside(x).map_or(value, |outside| outside.value(value))
    }

    fn second_order(&self, x: DVec3) -> SecondOrder<DVec3> {
        let there = self.instructions.second_order(self.visit(x, &self.nodes));
        self.outside(x).map_or(there, |outside| outside.second_order(there))
    }

    fn slope_bound(&self) -> f64 {
        // Beyond the border of a closed surface the slope is 1.
        if self.closed { self.slopes.outside.max(1.0) } else { self.slopes.outside }
    }

    fn second_derivative_bound(&self) -> f64 {
        self.bend
    }

    fn slope_bound_everywhere(&self) -> f64 {
        self.slopes.everywhere.max(self.slope_bound())
    }

    /// Box from the first node to the last, if all nodes that affect the border and beyond are above the
    /// level; else `None`.
    fn level_bounds(&self, level: f64) -> Option<(DVec3, DVec3)> {
        let layers = self.interpolation.border();
        let [nx, ny, nz] = self.size;
        let beside = |i: usize, count: usize| i < layers || i + layers >= count;
        let above = |&value: &f64| value > level;
        let clear = self.nodes.chunks_exact(nx).enumerate().all(|(number, row)| {
            if beside(number % ny, ny) || beside(number / ny, nz) {
                row.iter().all(above)
            } else {
                row[..layers.min(nx)].iter().chain(&row[nx.saturating_sub(layers)..]).all(above)
            }
        });
        clear.then(|| (self.low, self.high()))
    }

    fn parameter_count(&self) -> usize {
        self.nodes.len()
    }

    fn rate(&self, x: DVec3, direction: &[f64]) -> Jet<DVec3> {
        let rate = self.interpolate(x, direction);
        self.outside(x).map_or(rate, |outside| outside.rate(self.interpolate(x, &self.nodes), rate))
    }

    fn add_parameter_gradient(&self, x: DVec3, covector: Jet<DVec3>, gradient: &mut [f64]) {
        let border = |outside: Outside| outside.covector(self.interpolate(x, &self.nodes), covector);
        let covector = self.outside(x).map_or(covector, border);
        self.instructions.add_transpose(self.visit(x, &self.nodes), covector, gradient);
    }
}

impl Parametric<DVec3> for Grid {
    fn parameters(&self) -> Vec<f64> {
        self.nodes.clone()
    }

    fn with_parameters(&self, parameters: &[f64]) -> Result<Self, ShapeError> {
        Ok(Self::new(self.interpolation, self.low, self.spacing, self.size, parameters.to_vec())?)
    }
}
