//! Which shapes pass through one another, cover one another, or have edges upon one another.

use std::collections::BTreeMap;

use glam::DVec3;

use super::Scene;
use super::edge_contact::SAME;
use super::triangle::barycentric;

/// Two shapes, or one with itself, that pass through one another.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CrossingCount {
    /// The shapes, by their indices.
    pub shapes: [usize; 2],
    /// In how many segments, each of one pair of triangles.
    pub segments: usize,
}

/// Two shapes, or one with itself, of which triangles cover parts of one plane, or have edges that lie upon one another.
/// Which of them is seen there is for rounding to decide, and how the image changes as they part has no answer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Overlap {
    /// The shapes, by their indices.
    pub shapes: [usize; 2],
    /// How many pairs of triangles.
    pub pairs: usize,
    /// One pair, by indices among the triangles of each shape.
    pub example: [usize; 2],
}

impl Scene {
    /// The pairs of shapes that pass through one another, and in how many segments. Their curves are followed like edges;
    /// the first call looks for them, as the first geometric gradient does.
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

    /// The pairs of shapes of which triangles cover parts of one plane.
    #[must_use]
    pub fn overlapping_shapes(&self) -> Vec<Overlap> {
        self.overlaps(|_| true)
    }

    /// Those that a motion of positions parts, or turns out of their common plane: what is seen there is for rounding to
    /// decide, before and after, and no derivative exists.
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

    /// The pairs of shapes, or of parts of one, of which edges lie upon one another along a stretch without being one:
    /// borders, folds and creases.
    #[must_use]
    pub fn coinciding_edges(&self) -> Vec<Overlap> {
        self.by_shapes(self.crossings().contacts().iter().map(|c| c.triangles))
    }

    /// Those that a motion of positions parts: what is seen there is one edge before and two afterwards, on one side of the
    /// motion as on the other, and where both are seen no derivative exists. Edges that slide along themselves do not part.
    #[must_use]
    pub fn parted_edges(&self, velocities: &[DVec3]) -> Vec<Overlap> {
        let parted = self.crossings().contacts().iter().filter(|c| c.is_parted(self.tables(), velocities));
        self.by_shapes(parted.map(|c| c.triangles))
    }

    /// The pairs of shapes, or of parts of one, of which an edge of one lies upon a face of the other.
    #[must_use]
    pub fn standing_shapes(&self) -> Vec<Overlap> {
        self.by_shapes(self.crossings().standing().iter().map(|c| c.triangles))
    }

    /// Those that a motion of positions parts: a gap opens on one side of the motion, and on the other both
    /// pass through one another. The two one-sided derivatives differ, and no other exists. Edges that slide
    /// over a face do not part from it.
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
