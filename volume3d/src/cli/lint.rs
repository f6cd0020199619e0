//! What may surprise in a mesh.

use volume3d::geometry::{Edges, Mesh};

/// Counts of what is legal, but often not meant.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Lint {
    /// Edges of one triangle: silhouettes from everywhere.
    pub(super) borders: usize,
    /// Edges of more than two triangles.
    pub(super) non_manifold: usize,
    /// Edges whose two triangles face opposite ways.
    pub(super) turned: usize,
    /// Triangles without area, which are never hit.
    pub(super) zero_area: usize,
    /// Vertices of the file at the place of an earlier one. They have been made one.
    pub(super) duplicated: usize,
    /// Places without a triangle: their gradient is zero.
    pub(super) unused: usize,
}

impl Lint {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let (positions, sources) = (mesh.positions(), mesh.sources());
        let mut lint = Self { duplicated: sources.len().saturating_sub(positions.len()), ..Self::default() };
        let mut used = vec![false; positions.len()];
        // A triangle without area bounds nothing, so its edges do not count.
        let mut bounding = vec![];
        for &corners in mesh.triangles() {
            corners.iter().for_each(|&i| used[i as usize] = true);
            let [a, b, c] = corners.map(|i| positions[i as usize]);
            if (b - a).cross(c - a).length_squared() == 0.0 {
                lint.zero_area += 1;
            } else {
                bounding.push(corners);
            }
        }
        lint.unused = used.iter().filter(|u| !**u).count();
        for sides in Edges::of(bounding.into_iter()).iter() {
            match sides {
                [_] => lint.borders += 1,
                [a, b] if a.ascending == b.ascending => lint.turned += 1,
                [_, _] => {}
                _ => lint.non_manifold += 1,
            }
        }
        lint
    }

    /// Everything found, in words; nothing if there is nothing.
    pub(super) fn findings(&self) -> Vec<String> {
        let all = [
            (self.borders, "border edges (silhouettes from everywhere)"),
            (self.non_manifold, "edges of more than two triangles (silhouettes from everywhere)"),
            (self.turned, "edges between triangles that face opposite ways"),
            (self.zero_area, "triangles of zero area (never hit)"),
            (self.duplicated, "vertices at the place of others (made one)"),
            (self.unused, "vertices without a triangle (zero gradient)"),
        ];
        all.into_iter()
            .filter(|(count, _)| *count > 0)
            .map(|(count, what)| format!("{count} {what}"))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_closed_cube_is_clean() {
        assert_eq!(Lint::of(&Mesh::cube()), Lint::default());
    }

    #[test]
    fn every_finding_is_counted() {
        let [a, b, c, d, e] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let positions = vec![a, b, c, d, e, a, DVec3::splat(9.0)];
        // ab three times, bc twice the same way round, and one triangle along a line.
        let triangles = vec![[0, 1, 2], [5, 1, 3], [1, 0, 4], [1, 2, 3], [0, 0, 1]];
        let lint = Lint::of(&Mesh::new(positions, triangles).unwrap());
        assert_eq!(
            lint,
            Lint { borders: 5, non_manifold: 1, turned: 1, zero_area: 1, duplicated: 1, unused: 1 }
        );
    }
}
