//! The edges of a scene in turned coordinates, their crossings, and the change of state across each edge.

use std::collections::BTreeMap;

use flatland::plane::{Attachment, Scene};
use glam::DVec2;

use super::frame::{Edge, Frame, Point};
use crate::double_double::DoubleDouble;

/// The change of state where an upward column crosses an edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Toggle {
    /// Into or out of a shape.
    Shape(usize),
    /// Into or out of a triangle of the material.
    Triangle(usize),
    /// Transition to the filter column on the left: x decreases along an upward column.
    FilterColumn,
    /// Transition to the next filter row.
    FilterRow,
}

/// Edges and crossings of a scene, independent of pixels.
#[derive(Debug)]
pub(super) struct Sweep {
    pub(super) frame: Frame,
    pub(super) edges: Vec<(Edge, Vec<Toggle>)>,
    /// The vertices of each triangle of a non-constant material shade, in the numbering of the whole scene,
    /// with the index of its shape first.
    pub(super) triangles: Vec<(usize, [usize; 3])>,
    /// Vertices and crossings by x.
    pub(super) events: Vec<Point>,
}

impl Sweep {
    /// Turns all edges and intersects every pair. The ends of edges that share a vertex or overlap are events
    /// already, as vertices.
    pub(super) fn new(scene: &Scene, velocities: &[DVec2], frame: Frame) -> Self {
        let mut triangles = vec![];
        let mut toggles: BTreeMap<[usize; 2], Vec<Toggle>> = BTreeMap::new();
        let key = |a: usize, b: usize| [a.min(b), a.max(b)];
        for (shape, [a, b]) in scene.edges() {
            toggles.entry(key(a, b)).or_default().push(Toggle::Shape(shape));
        }
        for (index, shape) in scene.shapes().iter().enumerate() {
            if shape.shade().attachment() != Attachment::Material || shape.shade().is_constant() {
                continue;
            }
            let start = scene.vertex_range(index).start;
            for t in shape.polygon().triangles() {
                let t = t.map(|v| start + v as usize);
                for k in 0..3 {
                    let toggle = Toggle::Triangle(triangles.len());
                    toggles.entry(key(t[k], t[(k + 1) % 3])).or_default().push(toggle);
                }
                triangles.push((index, t));
            }
        }
        let end = |v: usize| (scene.vertices()[v], velocities[v]);
        let edges: Vec<_> =
            toggles.into_iter().map(|([a, b], t)| (Edge::new(&frame, [end(a), end(b)]), t)).collect();
        let mut events: Vec<_> = scene.vertices().iter().map(|p| frame.turn(*p)).collect();
        for (i, (a, _)) in edges.iter().enumerate() {
            for (b, _) in &edges[..i] {
                events.extend(a.crossing(b).map(|x| Point { x, y: a.height(x) }));
            }
        }
        events.sort_by(|a, b| compare(a.x, b.x));
        Self { frame, edges, triangles, events }
    }
}

/// The order of two finite numbers.
pub(super) fn compare(a: DoubleDouble, b: DoubleDouble) -> std::cmp::Ordering {
    a.partial_cmp(&b).expect("coordinates are finite")
}
