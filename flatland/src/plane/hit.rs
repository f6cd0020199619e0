//! Visible points, as points of the material that moves with its vertices.

use glam::DVec2;

/// A point of the material: an affine combination of vertices, which moves with them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaterialPoint {
    pub(super) vertices: [u32; 3],
    pub(super) weights: [f64; 3],
}

impl MaterialPoint {
    /// Vertex `v` itself, by index in the whole scene.
    #[must_use]
    pub fn vertex(v: usize) -> Self {
        Self::on_edge([v, v], 0.0)
    }

    /// The point (1 − s) a + s b of the edge between vertices a and b.
    #[must_use]
    pub(crate) fn on_edge([a, b]: [usize; 2], s: f64) -> Self {
        Self { vertices: [a, b, b].map(|v| v as u32), weights: [1.0 - s, s, 0.0] }
    }

    /// The three vertices, by index in the whole scene.
    #[must_use]
    pub fn vertices(&self) -> [usize; 3] {
        self.vertices.map(|v| v as usize)
    }

    /// Their weights, which sum to 1.
    #[must_use]
    pub fn weights(&self) -> [f64; 3] {
        self.weights
    }

    /// The point's velocity, Σ b_j ṗ_j.
    #[must_use]
    pub fn velocity(&self, velocities: &[DVec2]) -> DVec2 {
        let [a, b, c] = self.vertices().map(|v| velocities[v]);
        // Relative to one vertex, so that a translation is exact despite rounding of b.
        a + self.weights[1] * (b - a) + self.weights[2] * (c - a)
    }

    /// Transpose of [`velocity`](Self::velocity): adds b_j `covector` to each vertex.
    pub fn scatter(&self, covector: DVec2, mut add: impl FnMut(usize, DVec2)) {
        for (v, b) in self.vertices().into_iter().zip(self.weights) {
            add(v, b * covector);
        }
    }
}

/// The hit at a point: a shape and, as barycentric coordinates in one of its triangles, the material point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    pub(super) shape: u32,
    pub(super) triangle: u32,
    pub(super) point: MaterialPoint,
}

impl Hit {
    /// Index of the visible shape.
    #[must_use]
    pub fn shape(&self) -> usize {
        self.shape as usize
    }

    /// The material point.
    #[must_use]
    pub fn point(&self) -> &MaterialPoint {
        &self.point
    }

    /// The velocity of the material point.
    #[must_use]
    pub fn velocity(&self, velocities: &[DVec2]) -> DVec2 {
        self.point.velocity(velocities)
    }
}
