//! Spline prefilter: coefficients of a spline that approximates its samples.

use super::{Grid, GridError, Interpolation};

/// Multiple of the cell's diagonal (2 cells along each axis) beyond which nodes do not affect φ = 0 if values
/// are distances.
const REACH: f64 = 2.0;

impl Grid {
    /// The grid whose cubic spline approximates, near the surface, the node values of this one, which are
    /// distances: with the second differences δ² along the axes,
    ///
    /// ```text
    /// c = d − (δ²_x + δ²_y + δ²_z) d/6 where |d| is below twice a cell's diagonal, and c = d elsewhere.
    /// ```
    ///
    /// A spline with coefficients d has at a node the value d + Σδ²d/6 to third order, so that its surface
    /// lies about h² (κ₁ + κ₂)/6 inside. The prefilter makes this error higher order where d is smooth. The
    /// largest distance from the sampled surface, in cells, with 64 cells per side, falls from 0.017 to
    /// 0.000014 for a ball of radius 0.6 in a box of side 2, and from 0.063 to 0.0029 for a trefoil with a
    /// tube of radius 0.1.
    ///
    /// Farther away a higher order is of no use, and would make ridges of the distance, and the slope bound,
    /// steeper by a third. That happens where ridges are next to the surface: for the trefoil in 32 cells,
    /// the bound grows from 1.43 to 2.44. Node values are no longer distances: apply it once, to samples.
    /// Trilinear interpolation passes through its nodes and is unchanged.
    ///
    /// # Errors
    /// If all nodes now have one sign, or are not finite: the surface was thinner than a cell, or values are
    /// near the largest numbers.
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
