//! Properties of a mesh that are legal, but often not intended.

use crate::geometry::{Edges, Mesh, Normals};

/// The number of occurrences, and the first one.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Fault {
    pub(super) count: usize,
    pub(super) example: Option<String>,
}

impl Fault {
    fn add(&mut self, example: impl FnOnce() -> String) {
        self.count += 1;
        self.example.get_or_insert_with(example);
    }
}

/// The faults of a mesh. Triangles and vertices count from 0; vertices are numbered as in the file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct MeshFaults {
    /// Edges of one triangle: silhouettes from everywhere.
    pub(super) borders: Fault,
    /// Edges of more than two triangles.
    pub(super) non_manifold: Fault,
    /// Edges whose two triangles have opposite orientations.
    pub(super) turned: Fault,
    /// Triangles of zero area, which rays never hit.
    pub(super) zero_area: Fault,
    /// Vertices of the file at the position of an earlier one, with which they have been merged.
    pub(super) duplicated: Fault,
    /// Vertices without a triangle; their gradient is zero.
    pub(super) unused: Fault,
    /// Edges at which flat shading is discontinuous.
    pub(super) creases: Fault,
}

/// Unit normals that differ by at most this count as equal, as in the library.
const FLAT: f64 = 1e-5;

impl MeshFaults {
    pub(super) fn of(mesh: &Mesh) -> Self {
        let (positions, sources) = (mesh.positions(), mesh.sources());
        let mut faults = Self::default();
        let mut first = vec![None; positions.len()];
        for (vertex, &place) in sources.iter().enumerate() {
            match first[place as usize] {
                None => first[place as usize] = Some(vertex),
                Some(earlier) => {
                    faults.duplicated.add(|| format!("vertex {vertex} at that of vertex {earlier}"));
                }
            }
        }
        let vertex = |place: u32| first[place as usize].unwrap_or(place as usize);
        let cross = |corners: [u32; 3]| {
            let [a, b, c] = corners.map(|i| positions[i as usize]);
            (b - a).cross(c - a)
        };
        let mut used = vec![false; positions.len()];
        // The edges of a triangle of zero area do not count.
        let (mut bounding, mut numbers) = (vec![], vec![]);
        for (number, &corners) in mesh.triangles().iter().enumerate() {
            corners.iter().for_each(|&i| used[i as usize] = true);
            if cross(corners).length_squared() == 0.0 {
                faults.zero_area.add(|| format!("triangle {number}"));
            } else {
                bounding.push(corners);
                numbers.push(number);
            }
        }
        for (place, _) in used.iter().enumerate().filter(|(_, used)| !**used) {
            faults.unused.add(|| format!("vertex {}", vertex(place as u32)));
        }
        let is_flat = *mesh.normals() == Normals::Face;
        for sides in Edges::of(bounding.iter().copied()).iter() {
            let fault = match sides {
                [_] => &mut faults.borders,
                [a, b] if a.ascending == b.ascending => &mut faults.turned,
                [a, b] => {
                    let [m, n] = [a, b].map(|s| cross(bounding[s.triangle as usize]).normalize_or_zero());
                    if !is_flat || (m - n).length() <= FLAT {
                        continue;
                    }
                    &mut faults.creases
                }
                _ => &mut faults.non_manifold,
            };
            fault.add(|| {
                let [a, b] = sides[0].ends.map(vertex);
                format!(
                    "the edge of vertices {a} and {b} of triangle {}",
                    numbers[sides[0].triangle as usize]
                )
            });
        }
        faults
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;

    #[test]
    fn a_closed_cube_has_nothing_but_creases() {
        let MeshFaults { creases, .. } = MeshFaults::of(&Mesh::cube());
        assert_eq!(creases.count, 12);
        assert_eq!(MeshFaults::of(&Mesh::cube()), MeshFaults { creases, ..MeshFaults::default() });
        assert_eq!(MeshFaults::of(&Mesh::cube().smooth()), MeshFaults::default());
    }

    #[test]
    fn every_fault_is_counted_with_a_place() {
        let [a, b, c, d, e] = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z, DVec3::ONE];
        let positions = vec![a, b, c, d, e, a, DVec3::splat(9.0)];
        // ab three times, bc twice the same way round, and one triangle along a line.
        let triangles = vec![[0, 1, 2], [5, 1, 3], [1, 0, 4], [1, 2, 3], [0, 0, 1]];
        let faults = MeshFaults::of(&Mesh::new(positions, triangles).unwrap());
        let found = [
            &faults.borders,
            &faults.non_manifold,
            &faults.turned,
            &faults.zero_area,
            &faults.duplicated,
            &faults.unused,
        ];
        assert_eq!(found.map(|f| f.count), [5, 1, 1, 1, 1, 1]);
        let place = |fault: &Fault| fault.example.clone().unwrap();
        assert_eq!(place(&faults.zero_area), "triangle 4");
        assert_eq!(place(&faults.duplicated), "vertex 5 at that of vertex 0");
        assert_eq!(place(&faults.unused), "vertex 6");
        assert_eq!(place(&faults.non_manifold), "the edge of vertices 0 and 1 of triangle 0");
        assert_eq!(place(&faults.turned), "the edge of vertices 1 and 2 of triangle 0");
    }
}
