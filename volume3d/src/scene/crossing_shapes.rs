//! Queries for shapes that cross, overlap, or touch in edges.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Scene;
use super::edge_contact::SAME;
use super::triangle::barycentric;

/// Two shapes, or one with itself, that cross.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrossingCount {
    /// Indices of the shapes.
    pub shapes: [usize; 2],
    /// Number of segments, each of one pair of triangles.
    pub segments: usize,
}

/// Two shapes, or one with itself, with overlapping coplanar triangles or coincident edges. Rounding decides
/// which of them is visible there, and the derivative by a motion that separates them is undefined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// Indices of the shapes.
    pub shapes: [usize; 2],
    /// Number of pairs of triangles.
    pub pairs: usize,
    /// One pair, by indices among the triangles of each shape.
    pub example: [usize; 2],
}

impl Scene {
    /// Pairs of shapes that cross, with the number of segments. Their curves are followed like edges; they
    /// are found on the first call, as on the first geometric gradient.
    #[must_use]
    pub fn crossing_shapes(&self) -> Vec<CrossingCount> {
        let mut counts = BTreeMap::<[u32; 2], usize>::new();
        for crossing in self.crossings().all() {
            *counts.entry(crossing.shapes(&self.triangles)).or_default() += 1;
        }
        let count = |(shapes, segments): ([u32; 2], usize)| CrossingCount {
            shapes: shapes.map(|s| s as usize),
            segments,
        };
        counts.into_iter().map(count).collect()
    }

    /// Pairs of shapes with overlapping coplanar triangles.
    #[must_use]
    pub fn overlapping_shapes(&self) -> Vec<Overlap> {
        self.overlaps(|_| true)
    }

    /// Overlapping pairs that a motion of positions separates or rotates out of their common plane:
    /// visibility there depends on rounding before and after, and no derivative exists.
    #[must_use]
    pub fn parted_shapes(&self, velocities: &[DVec3]) -> Vec<Overlap> {
        self.overlaps(|pair| {
            let triangles = pair.map(|t| self.triangles[t as usize].positions);
            let [plane, other] = triangles.map(|t| t.map(|i| self.positions[i as usize]));
            let normal = (plane[1] - plane[0]).cross(plane[2] - plane[0]).normalize_or_zero();
            let [under, over] = triangles.map(|t| t.map(|i| velocities[i as usize]));
            (0..3).any(|k| {
                let weights = barycentric(&plane, other[k]);
                let below: DVec3 = (0..3).map(|i| weights[i] * under[i]).sum();
                let size =
                    over[k].length() + (0..3).map(|i| weights[i].abs() * under[i].length()).sum::<f64>();
                normal.dot(over[k] - below).abs() > SAME * size
            })
        })
    }

    /// Pairs of shapes, or of parts of one, with edges (borders, folds or creases) that coincide along a
    /// stretch without being the same edge.
    #[must_use]
    pub fn coinciding_edges(&self) -> Vec<Overlap> {
        self.by_shapes(self.crossings().contacts().iter().map(|c| c.triangles))
    }

    /// Coincident edges that a motion of positions separates: one visible edge becomes two, for either sign
    /// of the motion, and where both are visible no derivative exists. Edges that slide along themselves are
    /// not separated.
    #[must_use]
    pub fn parted_edges(&self, velocities: &[DVec3]) -> Vec<Overlap> {
        let parted = self.crossings().contacts().iter().filter(|c| c.is_parted(self.tables(), velocities));
        self.by_shapes(parted.map(|c| c.triangles))
    }

    /// Pairs of shapes, or of parts of one, with an edge of one on a face of the other.
    #[must_use]
    pub fn standing_shapes(&self) -> Vec<Overlap> {
        self.by_shapes(self.crossings().standing().iter().map(|c| c.triangles))
    }

    /// Edges on faces that a motion of positions lifts off: for one sign of the motion a gap opens, for the
    /// other the surfaces cross. The two one-sided derivatives differ, and no derivative exists. Edges that
    /// slide over a face are not lifted.
    #[must_use]
    pub fn lifted_edges(&self, velocities: &[DVec3]) -> Vec<Overlap> {
        let parted = self.crossings().standing().iter().filter(|c| c.is_parted(self.tables(), velocities));
        self.by_shapes(parted.map(|c| c.triangles))
    }

    fn overlaps(&self, counts: impl Fn([u32; 2]) -> bool) -> Vec<Overlap> {
        self.by_shapes(self.crossings().overlaps().iter().copied().filter(|pair| counts(*pair)))
    }

    /// Pairs of triangles, counted by their shapes.
    fn by_shapes(&self, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<Overlap> {
        let mut overlaps = BTreeMap::<[u32; 2], Overlap>::new();
        for mut pair in pairs {
            pair.sort_unstable();
            let shapes = pair.map(|t| self.triangles[t as usize].shape);
            let local = |k: usize| (pair[k] - self.first_triangle[shapes[k] as usize]) as usize;
            let none =
                Overlap { shapes: shapes.map(|s| s as usize), pairs: 0, example: [local(0), local(1)] };
            overlaps.entry(shapes).or_insert(none).pairs += 1;
        }
        overlaps.into_values().collect()
    }
}
