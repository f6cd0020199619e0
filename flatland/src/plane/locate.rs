//! Point location in a polygon of many edges, in about logarithmic time.
//!
//! A polygon whose outline is densely sampled has triangles that are long slivers across it; boxes
//! around them overlap everywhere, and a hierarchy of such boxes is no help. Its edges are short.
//! So the edges decide by the parity of a ray whether u is inside, the nearest edge says where to
//! start, and a straight walk from there to u, which the polygon contains because no edge is nearer,
//! crosses few triangles: they run across the polygon as the walk does.

use std::collections::HashMap;

use glam::DVec2;

use super::orient;
use super::scene::Outline;
use super::triangulate::{OUTSIDE, undirected};

/// The triangles of one shape with their neighbours.
#[derive(Clone, Debug)]
pub(crate) struct Locator {
    triangles: Vec<[u32; 3]>,
    /// The triangle across the edge from corner k to corner k + 1, or [`OUTSIDE`].
    neighbours: Vec<[u32; 3]>,
    /// For each edge of the outline, its triangle and which of its edges it is.
    starts: Vec<(u32, usize)>,
}

impl Locator {
    pub(crate) fn new(triangles: Vec<[u32; 3]>, outline: &[[u32; 2]]) -> Self {
        let mut sides: HashMap<[u32; 2], [(u32, usize); 2]> = HashMap::new();
        let edge = |t: &[u32; 3], k: usize| undirected([t[k], t[(k + 1) % 3]]);
        for (i, t) in (0_u32..).zip(&triangles) {
            for k in 0..3 {
                let both = sides.entry(edge(t, k)).or_insert([(OUTSIDE, 0); 2]);
                both[usize::from(both[0].0 != OUTSIDE)] = (i, k);
            }
        }
        let neighbours = (0_u32..).zip(&triangles).map(|(i, t)| {
            [0, 1, 2].map(|k| {
                let [a, b] = sides[&edge(t, k)];
                if a.0 == i { b.0 } else { a.0 }
            })
        });
        let neighbours = neighbours.collect();
        let starts = outline.iter().map(|&e| sides[&undirected(e)][0]).collect();
        Self { triangles, neighbours, starts }
    }

    /// The triangle, counted in its shape, that contains u; `Err` if rounding led the walk astray,
    /// which says nothing about u but that it is inside.
    pub(crate) fn locate(
        &self,
        vertices: &[DVec2],
        outline: &Outline,
        u: DVec2,
    ) -> Option<Result<usize, Astray>> {
        outline.contains(vertices, u).then(|| self.walk(vertices, outline, u))
    }

    fn walk(&self, vertices: &[DVec2], outline: &Outline, u: DVec2) -> Result<usize, Astray> {
        let point = |v: u32| vertices[v as usize];
        let (edge, _) = outline.nearest(vertices, u, f64::INFINITY).ok_or(Astray)?;
        let [p, q] = outline.edges[edge].map(point);
        let along = ((u - p).dot(q - p) / (q - p).length_squared()).clamp(0.0, 1.0);
        let from = p.lerp(q, along);
        let (mut t, mut k) = self.starts[edge];
        for _ in 0..self.triangles.len() {
            let corners = self.triangles[t as usize];
            let [a, b, c] = [0, 1, 2].map(|j| point(corners[(k + j) % 3]));
            let (right, left) = (orient(b, c, u), orient(c, a, u));
            if right >= 0.0 && left >= 0.0 {
                return if orient(a, b, u) >= 0.0 { Ok(t as usize) } else { Err(Astray) };
            }
            // Leave to the right of c if c is to the left of the way.
            let exit = if orient(from, u, c) >= 0.0 { k + 1 } else { k + 2 } % 3;
            let next = self.neighbours[t as usize][exit];
            if next == OUTSIDE {
                return Err(Astray);
            }
            let entered = undirected([corners[exit], corners[(exit + 1) % 3]]);
            let corners = self.triangles[next as usize];
            k = (0..3).find(|&j| undirected([corners[j], corners[(j + 1) % 3]]) == entered).ok_or(Astray)?;
            t = next;
        }
        Err(Astray)
    }
}

/// The walk left the polygon, by a rounding error of where it started.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Astray;
