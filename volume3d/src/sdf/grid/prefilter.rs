//! Splines that pass close to their samples.

use super::{Grid, GridError, Interpolation};

/// Nodes whose value is larger than this times the diagonal of a cell, 2 cells along each axis, do not count where φ = 0 if values are
/// distances.
const REACH: f64 = 2.0;

impl Grid {
    /// The grid whose cubic spline has, near the surface, the node values of this one, which are distances: with the second differences δ² along the
    /// axes,
    ///
    /// ```text
    /// c = d − (δ²_x + δ²_y + δ²_z) d/6 where |d| is below twice a cell's diagonal, and c = d elsewhere.
    /// ```
    ///
    /// A spline with coefficients d is, at a node, d + Σδ²d/6 to third order, and so its surface lies about h² (κ₁ + κ₂)/6 inside. This takes the error to
    /// higher order, where d is smooth: of the surface's points found, in cells,
    ///
    /// | largest distance from the surface that was sampled | 32 cells | 64 cells | 128 cells |
    /// |---|---|---|---|
    /// | ball of radius 0.6 in a box of side 2 | 0.035 → 0.00011 | 0.017 → 0.000014 | 0.0087 → 0.0000016 |
    /// | trefoil with a tube of radius 0.1 | 0.13 → 0.023 | 0.063 → 0.0029 | 0.031 → 0.00037 |
    ///
    /// Farther away a higher order serves nobody, and ridges of the distance would become steeper by a third, and the slope bound with them.
    /// It does where ridges are next to the surface: for the trefoil in 32 cells, from 1.43 to 2.44. Node values are no longer distances, so use it once, on samples.
    /// Trilinear interpolation passes through its nodes: nothing changes.
    ///
    /// # Errors
    /// If all nodes now have one sign, or are not finite: the surface was thinner than a cell, or values are near the largest numbers.
    pub fn prefiltered(self) -> Result<Self, GridError> {
        if self.interpolation == Interpolation::Trilinear {
            return Ok(self);
        }
        let far = REACH * self.spacing.length();
        let mut nodes = self.nodes.clone();
        let mut step = 1;
        for count in self.size {
            for (index, node) in nodes.iter_mut().enumerate() {
                let (at, d) = (index / step % count, self.nodes[index]);
                // On the border there is no second difference; the spline is constant beyond.
                if d.abs() < far && at > 0 && at + 1 < count {
                    *node -= (self.nodes[index - step] - 2.0 * d + self.nodes[index + step]) / 6.0;
                }
            }
            step *= count;
        }
        Self::new(self.interpolation, self.low, self.spacing, self.size, nodes)
    }
}
