//! Hierarchy of all edges of a scene, for methods that list them.

use std::collections::HashSet;

use glam::DVec2;

use super::box_tree::{Aabb, BoxTree};
use super::segments::clip_segment;
use super::{FilterCell, Scene};

/// A hierarchy over the edges of all shapes, visible or not.
#[derive(Clone, Debug)]
pub(crate) struct EdgeTree {
    edges: Vec<Edge>,
    tree: BoxTree,
}

/// An edge of a shape.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Edge {
    pub(crate) shape: usize,
    /// Its vertices, by index in the whole scene.
    pub(crate) vertices: [usize; 2],
    /// Outward unit normal of the shape.
    pub(crate) outward: DVec2,
    /// Its length.
    pub(crate) length: f64,
}

impl EdgeTree {
    pub(crate) fn new(scene: &Scene) -> Self {
        let triangles: HashSet<[usize; 2]> =
            scene.triangles().flat_map(|t| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]]).collect();
        let edges: Vec<_> = scene
            .edges()
            .map(|(shape, vertices)| {
                let [p, q] = vertices.map(|v| scene.vertices()[v]);
                // Triangles are positively oriented: the shape is to the left of an edge they contain.
                let side = if triangles.contains(&vertices) { -1.0 } else { 1.0 };
                let length = (q - p).length();
                Edge { shape, vertices, outward: side * (q - p).perp() / length, length }
            })
            .collect();
        let boxes: Vec<_> = edges.iter().map(|e| Aabb::of(e.vertices.map(|v| scene.vertices()[v]))).collect();
        Self { tree: BoxTree::build(&boxes), edges }
    }

    /// Calls `visit` with every edge whose box is within reach of u.
    pub(crate) fn near(&self, u: DVec2, reach: f64, mut visit: impl FnMut(&Edge)) {
        self.tree.visit(|b| b.distance_squared(u) < reach * reach, |i| visit(&self.edges[i]));
    }

    /// Calls `visit` with every edge that intersects a rectangle, and the part of it inside as parameters
    /// along the edge.
    pub(crate) fn inside(
        &self,
        scene: &Scene,
        (min, max): (DVec2, DVec2),
        mut visit: impl FnMut(&Edge, (f64, f64)),
    ) {
        let cell = FilterCell { min, max };
        self.tree.visit(
            |b| b.overlaps(&Aabb { min, max }),
            |i| {
                let [p, q] = self.edges[i].vertices.map(|v| scene.vertices()[v]);
                if let Some(range) = clip_segment(p, q, &cell) {
                    visit(&self.edges[i], range);
                }
            },
        );
    }
}
