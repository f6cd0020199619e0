//! Scenes, with queries for visibility, velocity, and the distance to the nearest discontinuity.

mod error;

use std::ops::Range;

use glam::{DMat2, DVec2, DVec3};

use super::box_tree::{Aabb, BoxTree, part_boxes};
use super::hit::{Hit, MaterialPoint};
use super::segments::distance_squared;
use super::shade::{Attachment, Shade};
use super::{Polygon, orient};
use crate::calculus::{Dual, Number};

pub use error::SceneError;

/// A polygon with its shade.
#[derive(Clone, Debug)]
pub struct Shape {
    polygon: Polygon,
    shade: Shade,
}

impl Shape {
    /// A polygon with a shade.
    #[must_use]
    pub fn new(polygon: Polygon, shade: Shade) -> Self {
        Self { polygon, shade }
    }

    /// Its outline.
    #[must_use]
    pub fn polygon(&self) -> &Polygon {
        &self.polygon
    }

    /// Its colour.
    #[must_use]
    pub fn shade(&self) -> &Shade {
        &self.shade
    }
}

/// Opaque polygons in painter's order (the last is on top) over a constant background.
#[derive(Clone, Debug)]
pub struct Scene {
    background: DVec3,
    shapes: Vec<Shape>,
    vertices: Vec<DVec2>,
    /// Material coordinates: positions when the shade was attached, the `vertices` before any displacement.
    material: Vec<DVec2>,
    is_displaced: bool,
    ranges: Vec<Range<usize>>,
    /// (shape, vertices), in painter's order, so that the largest index is on top.
    triangles: Vec<(u32, [u32; 3])>,
    /// Over boxes of parts of triangles; `tree_triangles` has the triangle of each part.
    triangle_tree: BoxTree,
    tree_triangles: Vec<u32>,
    outlines: Vec<Outline>,
}

/// The edges of one shape, for the distance to its own boundary.
#[derive(Clone, Debug)]
struct Outline {
    edges: Vec<[u32; 2]>,
    tree: BoxTree,
}

impl Scene {
    /// Builds the scene and its accelerators, in time O(n log n) in the number of edges.
    ///
    /// # Errors
    /// [`SceneError::Shade`] or [`SceneError::Background`] for a colour that is not finite.
    pub fn new(background: DVec3, shapes: Vec<Shape>) -> Result<Self, SceneError> {
        if !background.is_finite() {
            return Err(SceneError::Background);
        }
        for (shape, s) in shapes.iter().enumerate() {
            s.shade.check().map_err(|source| SceneError::Shade { shape, source })?;
        }
        let vertices: Vec<_> = shapes.iter().flat_map(|s| s.polygon.vertices().iter().copied()).collect();
        Ok(Self::assemble(background, shapes, vertices.clone()))
    }

    fn assemble(background: DVec3, shapes: Vec<Shape>, material: Vec<DVec2>) -> Self {
        let mut vertices: Vec<DVec2> = vec![];
        let mut ranges = vec![];
        let mut triangles = vec![];
        let mut outlines = vec![];
        for (shape, s) in (0_u32..).zip(&shapes) {
            let start = vertices.len();
            let base = u32::try_from(start).expect("fewer than 2³² vertices");
            vertices.extend_from_slice(s.polygon.vertices());
            ranges.push(start..vertices.len());
            triangles.extend(s.polygon.triangles().iter().map(|t| (shape, t.map(|v| v + base))));
            let edges: Vec<_> = s.polygon.edges().map(|e| e.map(|v| v as u32 + base)).collect();
            let boxes: Vec<_> = edges.iter().map(|e| Aabb::of(e.map(|v| vertices[v as usize]))).collect();
            outlines.push(Outline { edges, tree: BoxTree::build(&boxes) });
        }
        let mut boxes = vec![];
        let mut tree_triangles = vec![];
        for (i, (_, t)) in (0_u32..).zip(&triangles) {
            for part in part_boxes(t.map(|v| vertices[v as usize])) {
                boxes.push(part);
                tree_triangles.push(i);
            }
        }
        let triangle_tree = BoxTree::build(&boxes);
        let is_displaced = material != vertices;
        Self {
            background,
            shapes,
            vertices,
            material,
            is_displaced,
            ranges,
            triangles,
            triangle_tree,
            tree_triangles,
            outlines,
        }
    }

    /// Replaces the positions of all vertices; material shades are carried along.
    ///
    /// # Errors
    /// [`SceneError::Polygon`] if a triangle turns over.
    ///
    /// # Panics
    /// If there is not one position per vertex of the scene.
    pub fn displaced(&self, vertices: &[DVec2]) -> Result<Self, SceneError> {
        assert_eq!(vertices.len(), self.vertices.len(), "one position per vertex");
        let shapes = self.shapes.iter().zip(&self.ranges).enumerate();
        let shapes = shapes
            .map(|(shape, (s, range))| {
                let polygon = s
                    .polygon
                    .displaced(vertices[range.clone()].to_vec())
                    .map_err(|source| SceneError::Polygon { shape, source })?;
                Ok(Shape { polygon, shade: s.shade.clone() })
            })
            .collect::<Result<_, _>>()?;
        Ok(Self::assemble(self.background, shapes, self.material.clone()))
    }

    /// Colour outside all polygons.
    #[must_use]
    pub fn background(&self) -> DVec3 {
        self.background
    }

    /// The shapes in painter's order.
    #[must_use]
    pub fn shapes(&self) -> &[Shape] {
        &self.shapes
    }

    /// All vertices, shape by shape.
    #[must_use]
    pub fn vertices(&self) -> &[DVec2] {
        &self.vertices
    }

    /// Range of a shape in [`vertices`](Self::vertices).
    ///
    /// # Panics
    /// If there is no such shape.
    #[must_use]
    pub fn vertex_range(&self, shape: usize) -> Range<usize> {
        self.ranges[shape].clone()
    }

    /// Every edge as (shape, the two vertices by index in the whole scene).
    pub fn edges(&self) -> impl Iterator<Item = (usize, [usize; 2])> {
        self.outlines
            .iter()
            .enumerate()
            .flat_map(|(shape, o)| o.edges.iter().map(move |e| (shape, e.map(|v| v as usize))))
    }

    /// Triangles of all shapes, as vertex indices in the whole scene.
    pub(crate) fn triangles(&self) -> impl Iterator<Item = [usize; 3]> {
        self.triangles.iter().map(|(_, t)| t.map(|v| v as usize))
    }

    /// The visible point at u: the topmost closed polygon; `None` for the background.
    #[must_use]
    pub fn hit(&self, u: DVec2) -> Option<Hit> {
        self.hit_below(u, usize::MAX)
    }

    /// The visible point at u without shape `limit` and all shapes above it.
    #[must_use]
    pub fn hit_below(&self, u: DVec2, limit: usize) -> Option<Hit> {
        let test = |part: usize| {
            let i = self.tree_triangles[part] as usize;
            let (shape, vertices) = self.triangles[i];
            if shape as usize >= limit {
                return None;
            }
            let weights = self.barycentric(i, u)?;
            Some(Hit { shape, triangle: i as u32, point: MaterialPoint { vertices, weights } })
        };
        self.triangle_tree.last_at(u, test).map(|(_, hit)| hit)
    }

    /// The material point of one shape at u, visible or not. If rounding puts u just outside the shape, the
    /// nearest triangle is extended.
    pub(crate) fn nearest_hit(&self, u: DVec2, shape: usize) -> Option<Hit> {
        let to_triangle = |part: usize| {
            let i = self.tree_triangles[part] as usize;
            if self.triangles[i].0 as usize != shape {
                return f64::INFINITY;
            }
            let [a, b, c] = self.corners(i);
            if self.barycentric(i, u).is_some() {
                return 0.0;
            }
            let sides = [(a, b), (b, c), (c, a)].map(|(p, q)| distance_squared(u, p, q));
            sides.into_iter().fold(f64::INFINITY, f64::min)
        };
        let (part, _) = self.triangle_tree.nearest(u, f64::INFINITY, to_triangle)?;
        Some(self.extended_hit(self.tree_triangles[part] as usize, u))
    }

    /// The hit at another point in the same triangle, or in its extension.
    pub(crate) fn move_hit(&self, hit: &Hit, u: DVec2) -> Hit {
        self.extended_hit(hit.triangle as usize, u)
    }

    fn extended_hit(&self, triangle: usize, u: DVec2) -> Hit {
        let (shape, vertices) = self.triangles[triangle];
        let point = MaterialPoint { vertices, weights: self.weights(triangle, u) };
        Hit { shape, triangle: triangle as u32, point }
    }

    /// Whether any shape above `shape` covers u.
    #[must_use]
    pub fn is_covered(&self, u: DVec2, shape: usize) -> bool {
        self.hit(u).is_some_and(|hit| hit.shape() > shape)
    }

    fn corners(&self, triangle: usize) -> [DVec2; 3] {
        self.triangles[triangle].1.map(|v| self.vertices[v as usize])
    }

    /// Barycentric coordinates by exact predicates: no point falls between two triangles.
    fn barycentric(&self, triangle: usize, u: DVec2) -> Option<[f64; 3]> {
        let weights = self.weights(triangle, u);
        weights.iter().all(|&w| w >= 0.0).then_some(weights)
    }

    fn weights(&self, triangle: usize, u: DVec2) -> [f64; 3] {
        let [a, b, c] = self.corners(triangle);
        let w = [orient(b, c, u), orient(c, a, u), orient(a, b, u)];
        let sum: f64 = w.iter().sum();
        w.map(|w| w / sum)
    }

    /// f(u) of a hit at u.
    #[must_use]
    pub fn value(&self, hit: Option<&Hit>, u: DVec2) -> DVec3 {
        hit.map_or(self.background, |hit| {
            let shade = &self.shapes[hit.shape()].shade;
            shade.value(self.shade_point(shade, hit, u))
        })
    }

    /// f(u) of a shape at u, visible or not.
    pub(crate) fn shape_value(&self, shape: usize, u: DVec2) -> DVec3 {
        let shade = &self.shapes[shape].shade;
        if shade.is_carried() && self.is_displaced {
            return self.value(self.nearest_hit(u, shape).as_ref(), u);
        }
        shade.value(u)
    }

    /// f of a hit at u along a path through the shade's own coordinates.
    pub(crate) fn value_dual(&self, hit: Option<&Hit>, u: DVec2, path: [Dual<1>; 2]) -> [Dual<1>; 3] {
        let Some(hit) = hit else { return self.background.to_array().map(Dual::constant) };
        let shade = &self.shapes[hit.shape()].shade;
        if shade.is_carried() && self.is_displaced {
            let slope = self.material_jacobian(hit) * DVec2::new(path[0].slope(), path[1].slope());
            return shade.value_dual(Dual::path(self.shade_point(shade, hit, u), slope));
        }
        shade.value_dual(path)
    }

    /// ∇f(u) of a hit at u, one row per channel.
    #[must_use]
    pub fn gradient(&self, hit: Option<&Hit>, u: DVec2) -> [DVec2; 3] {
        let Some(hit) = hit else { return [DVec2::ZERO; 3] };
        let shade = &self.shapes[hit.shape()].shade;
        let gradient = shade.gradient(self.shade_point(shade, hit, u));
        if !(shade.is_carried() && self.is_displaced) {
            return gradient;
        }
        let jacobian = self.material_jacobian(hit);
        gradient.map(|g| jacobian.transpose() * g)
    }

    /// ∂X/∂u, with X the material coordinates: constant in a triangle.
    fn material_jacobian(&self, hit: &Hit) -> DMat2 {
        let edges = |p: &[DVec2]| {
            let [a, b, c] = hit.point.vertices().map(|v| p[v]);
            DMat2::from_cols(b - a, c - a)
        };
        edges(&self.material) * edges(&self.vertices).inverse()
    }

    /// ∂f/∂θ at fixed u: −∇f·v if the shade is carried by the material, else 0.
    #[must_use]
    pub(crate) fn theta_derivative(&self, hit: Option<&Hit>, u: DVec2, velocities: &[DVec2]) -> DVec3 {
        self.material_gradient(hit, u).map_or(DVec3::ZERO, |g| {
            let v = hit.map_or(DVec2::ZERO, |hit| hit.velocity(velocities));
            -DVec3::from(g.map(|g| g.dot(v)))
        })
    }

    /// ∇f(u) if the shade is carried by the material and not constant.
    #[must_use]
    pub fn material_gradient(&self, hit: Option<&Hit>, u: DVec2) -> Option<[DVec2; 3]> {
        let carried = self.shapes[hit?.shape()].shade.is_carried();
        carried.then(|| self.gradient(hit, u))
    }

    /// Distance from u to the boundary of the polygon visible there, or `limit` if that is smaller; `limit`
    /// on the background, which has no boundary of its own.
    #[must_use]
    pub fn boundary_distance(&self, hit: Option<&Hit>, u: DVec2, limit: f64) -> f64 {
        let Some(hit) = hit else { return limit };
        let outline = &self.outlines[hit.shape()];
        let to_edge = |i: usize| {
            let [a, b] = outline.edges[i].map(|v| self.vertices[v as usize]);
            distance_squared(u, a, b)
        };
        outline.tree.nearest(u, limit * limit, to_edge).map_or(limit, |(_, d)| d.sqrt())
    }

    /// Parts, inside one triangle of a shape, of the lines on which its shade is not smooth.
    pub(crate) fn shade_creases(&self, shape: usize, triangle: [usize; 3]) -> Vec<[DVec2; 2]> {
        let shade = &self.shapes[shape].shade;
        let carried = shade.attachment() == Attachment::Material;
        let material = if carried { &self.material } else { &self.vertices };
        let mut creases = vec![];
        for (point, normal) in shade.creases() {
            // Intersections of the line with the triangle's sides, in material coordinates.
            let side = triangle.map(|v| normal.dot(material[v] - point));
            let mut ends = (0..3).filter_map(|k| {
                let (a, b) = (k, (k + 1) % 3);
                let cuts = (side[a] < 0.0) != (side[b] < 0.0);
                let t = side[a] / (side[a] - side[b]);
                cuts.then(|| self.vertices[triangle[a]].lerp(self.vertices[triangle[b]], t))
            });
            if let (Some(p), Some(q)) = (ends.next(), ends.next())
                && p != q
            {
                creases.push([p, q]);
            }
        }
        creases
    }

    /// Smallest and largest corner of the bounding box of all polygons; `None` without any.
    #[must_use]
    pub fn bounds(&self) -> Option<(DVec2, DVec2)> {
        let b = Aabb::of(self.vertices.iter().copied());
        (!self.vertices.is_empty()).then_some((b.min, b.max))
    }

    /// ∇b_j in the triangle of a hit: ∇·v = Σ ∇b_j·ṗ_j is the divergence of the material's velocity.
    #[must_use]
    pub(crate) fn barycentric_gradients(&self, hit: &Hit) -> [DVec2; 3] {
        let [a, b, c] = self.corners(hit.triangle as usize);
        let twice_area = orient(a, b, c);
        [b - c, c - a, a - b].map(|side| -side.perp() / twice_area)
    }

    fn shade_point(&self, shade: &Shade, hit: &Hit, u: DVec2) -> DVec2 {
        match shade.attachment() {
            Attachment::Image => u,
            // u plus the material's displacement, so that zero displacement leaves u unchanged.
            Attachment::Material => {
                let offset = hit.point.vertices().map(|v| self.material[v] - self.vertices[v]);
                let [a, b, c] = hit.point.weights;
                u + a * offset[0] + b * offset[1] + c * offset[2]
            }
        }
    }
}

#[cfg(test)]
mod tests;
