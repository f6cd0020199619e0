//! Subdivision of a grid.

use super::{Grid, GridError, Interpolation};

impl Grid {
    /// The grid of half the spacing, between the same corners: n nodes along an axis become 2n − 1.
    ///
    /// Away from the border it is the same function: a uniform spline is also one of half the spacing, with
    /// the coefficients of Lane and Riesenfeld (1980), along one axis after another
    ///
    /// ```text
    /// cubic:      c′_2i = (c_{i−1} + 6 c_i + c_{i+1})/8,   c′_{2i+1} = (c_i + c_{i+1})/2,
    /// trilinear:  c′_2i = c_i,                             c′_{2i+1} = (c_i + c_{i+1})/2.
    /// ```
    ///
    /// A cubic changes within a cell of the border, beyond which nodes are repeated.
    ///
    /// # Errors
    /// [`GridError::OneSign`] if the inside is thinner than a cell and contains no new node.
    pub fn subdivided(&self) -> Result<Self, GridError> {
        let (mut nodes, mut size) = (self.nodes().to_vec(), self.size());
        for axis in 0..3 {
            nodes = along(axis, &nodes, size, self.interpolation());
            size[axis] = 2 * size[axis] - 1;
        }
        Self::new(self.interpolation(), self.low(), 0.5 * self.spacing(), size, nodes)
    }
}

/// Twice as many cells along one axis.
fn along(axis: usize, nodes: &[f64], size: [usize; 3], interpolation: Interpolation) -> Vec<f64> {
    let step: usize = size[..axis].iter().product();
    let (count, finer) = (size[axis], 2 * size[axis] - 1);
    let mut found = Vec::with_capacity(nodes.len() / count * finer);
    for layer in nodes.chunks_exact(step * count) {
        let row = |i: usize| &layer[i * step..(i + 1) * step];
        for i in 0..finer {
            let (low, high) = (row(i / 2), row(i.div_ceil(2)));
            let (before, after) = (row((i / 2).saturating_sub(1)), row((i / 2 + 1).min(count - 1)));
            let is_node = i % 2 == 0 && interpolation == Interpolation::Cubic;
            found.extend((0..step).map(|j| {
                if is_node { (before[j] + 6.0 * low[j] + after[j]) / 8.0 } else { 0.5 * (low[j] + high[j]) }
            }));
        }
    }
    found
}
