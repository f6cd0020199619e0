//! Triangle meshes with separate topologies for positions, normals and texture coordinates.

use std::collections::HashMap;

use glam::{DAffine3, DMat3, DVec2, DVec3};

/// Values at the corners of triangles: a table, and three indices into it for every triangle.
///
/// A seam is where two triangles share positions but not these indices; the surface itself is continuous
/// there.
#[derive(Clone, Debug, PartialEq)]
pub struct Attribute<T> {
    /// The table.
    pub values: Vec<T>,
    /// Three indices into it for every triangle of the mesh, in the mesh's order.
    pub triangles: Vec<[u32; 3]>,
}

/// Source of a mesh's shading normals.
#[derive(Clone, Debug, PartialEq)]
pub enum Normals {
    /// The geometric normal of each triangle: shading is discontinuous at every edge.
    Face,
    /// Vertex normals: the angle-weighted mean of the normals of the triangles around a vertex (Thürmer and
    /// Wüthrich 1998), interpolated over the triangle. They follow the positions. The vertices are those of
    /// the given topology, so that duplicated vertices make a crease.
    AngleWeighted {
        /// Three normal indices for every triangle.
        triangles: Vec<[u32; 3]>,
        /// Number of normals.
        count: usize,
    },
    /// Given values, interpolated. They rotate with a rigid motion of their shape, and are constant when
    /// single vertices move.
    Given(Attribute<DVec3>),
}

/// Reason for rejecting a mesh.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum MeshError {
    /// A coordinate of a position, normal or texture coordinate is NaN or infinite.
    #[error("{what} {index} is not finite")]
    NotFinite {
        /// "position", "normal" or "texture coordinate".
        what: &'static str,
        /// Its index.
        index: usize,
    },
    /// A triangle refers to an index that does not exist.
    #[error("triangle {triangle} refers to {what} {index}, but there are only {count}")]
    OutOfRange {
        /// "position", "normal" or "texture coordinate".
        what: &'static str,
        /// The triangle.
        triangle: usize,
        /// The index.
        index: u32,
        /// Number of elements.
        count: usize,
    },
    /// An attribute does not have one entry for each triangle.
    #[error("{what} indices are given for {found} triangles, but the mesh has {expected}")]
    Attribute {
        /// "normal" or "texture coordinate".
        what: &'static str,
        /// Number of entries.
        found: usize,
        /// Number of triangles.
        expected: usize,
    },
    /// The number of new positions differs from the number of vertices.
    #[error("{found} positions are given for a mesh of {expected}")]
    Positions {
        /// Number of positions given.
        found: usize,
        /// Number of positions of the mesh.
        expected: usize,
    },
    /// More vertices or triangles than 32-bit indices support.
    #[error("a mesh may have at most 2^32 - 2 vertices and triangles, not {count}")]
    TooLarge {
        /// The number.
        count: usize,
    },
}

/// A triangle mesh.
///
/// Open borders, edges of more than two triangles, unreferenced vertices and triangles of zero area are all
/// valid: a border and a non-manifold edge count as silhouettes from everywhere, and a triangle of zero area
/// is never hit.
///
/// # Guarantees
/// Every position, normal and texture coordinate is finite, every index in range.
#[derive(Clone, Debug, PartialEq)]
pub struct Mesh {
    positions: Vec<DVec3>,
    triangles: Vec<[u32; 3]>,
    normals: Normals,
    uvs: Option<Attribute<DVec2>>,
    sources: Vec<u32>,
}

impl Mesh {
    /// A mesh with face normals.
    ///
    /// Vertices at the same position are merged, so that duplicates in a file for the sake of normals or
    /// texture coordinates do not disconnect the surface; [`sources`](Self::sources) maps given vertices to
    /// merged ones.
    ///
    /// # Errors
    /// [`MeshError`] for coordinates that are not finite and indices out of range.
    pub fn new(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>) -> Result<Self, MeshError> {
        check_count(positions.len().max(triangles.len()))?;
        check_finite("position", positions.iter().map(|p| p.is_finite()))?;
        check_range("position", &triangles, positions.len())?;
        let (positions, sources) = weld(&positions);
        let triangles = triangles.into_iter().map(|t| t.map(|i| sources[i as usize])).collect();
        Ok(Self { positions, triangles, normals: Normals::Face, uvs: None, sources })
    }

    /// Replaces the normals.
    ///
    /// # Errors
    /// [`MeshError`] if they do not fit the triangles.
    pub fn with_normals(mut self, normals: Normals) -> Result<Self, MeshError> {
        match &normals {
            Normals::Face => {}
            Normals::AngleWeighted { triangles, count } => {
                self.check_attribute("normal", triangles, *count)?;
            }
            Normals::Given(normals) => {
                self.check_attribute("normal", &normals.triangles, normals.values.len())?;
                check_finite("normal", normals.values.iter().map(|n| n.is_finite()))?;
            }
        }
        self.normals = normals;
        Ok(self)
    }

    /// Replaces the positions, one for each of [`positions`](Self::positions) in order.
    ///
    /// Triangles, normals and texture coordinates keep their topology. Computed normals follow; given ones
    /// are unchanged. Vertices that come to coincide remain separate.
    ///
    /// # Errors
    /// [`MeshError`] if their number differs, or a coordinate is not finite.
    pub fn with_positions(mut self, positions: Vec<DVec3>) -> Result<Self, MeshError> {
        let (found, expected) = (positions.len(), self.positions.len());
        if found != expected {
            return Err(MeshError::Positions { found, expected });
        }
        check_finite("position", positions.iter().map(|p| p.is_finite()))?;
        self.positions = positions;
        Ok(self)
    }

    /// Sets one interpolated normal per vertex: [`Normals::AngleWeighted`] on the mesh's own topology.
    #[must_use]
    pub fn smooth(mut self) -> Self {
        self.normals =
            Normals::AngleWeighted { triangles: self.triangles.clone(), count: self.positions.len() };
        self
    }

    /// Sets the texture coordinates.
    ///
    /// # Errors
    /// [`MeshError`] if they do not fit the triangles.
    pub fn with_uvs(mut self, uvs: Attribute<DVec2>) -> Result<Self, MeshError> {
        self.check_attribute("texture coordinate", &uvs.triangles, uvs.values.len())?;
        check_finite("texture coordinate", uvs.values.iter().map(|p| p.is_finite()))?;
        self.uvs = Some(uvs);
        Ok(self)
    }

    /// The mesh under an affine map. Given normals are transformed as normals; a reflection reverses
    /// triangles, so that outward faces stay outward.
    #[must_use]
    pub fn transformed(self, map: &DAffine3) -> Self {
        self.transformed_with_normals_of(map, map)
    }

    /// The mesh under an affine map, and its given normals under another.
    pub(crate) fn transformed_with_normals_of(mut self, map: &DAffine3, other: &DAffine3) -> Self {
        let carry = cofactors(&other.matrix3) * 1.0_f64.copysign(other.matrix3.determinant());
        for p in &mut self.positions {
            *p = map.transform_point3(*p);
        }
        let mirrors = map.matrix3.determinant() < 0.0;
        if let Normals::Given(normals) = &mut self.normals {
            for n in &mut normals.values {
                *n = (carry * *n).normalize_or_zero();
            }
        }
        if mirrors {
            self.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            match &mut self.normals {
                Normals::Face => {}
                Normals::AngleWeighted { triangles, .. } => triangles.iter_mut().for_each(|t| t.swap(1, 2)),
                Normals::Given(normals) => normals.triangles.iter_mut().for_each(|t| t.swap(1, 2)),
            }
            if let Some(uvs) = &mut self.uvs {
                uvs.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
        }
        self
    }

    /// The mesh with the normals of its faces as given ones.
    pub(crate) fn with_given_face_normals(mut self) -> Self {
        let mut values: Vec<DVec3> = vec![];
        // Those of one face are one value: another would be a crease.
        let mut known: HashMap<[u64; 3], u32> = HashMap::new();
        let triangles = self.triangles.iter().map(|t| {
            let [a, b, c] = t.map(|i| self.positions[i as usize]);
            let normal = (b - a).cross(c - a).normalize_or_zero();
            let index = *known.entry(normal.to_array().map(f64::to_bits)).or_insert_with(|| {
                values.push(normal);
                values.len() as u32 - 1
            });
            [index; 3]
        });
        let triangles = triangles.collect();
        self.normals = Normals::Given(Attribute { values, triangles });
        self
    }

    /// Moves every position by `step` times its rate.
    pub(crate) fn displace(&mut self, rates: &[DVec3], step: f64) {
        self.positions.iter_mut().zip(rates).for_each(|(p, rate)| *p += step * *rate);
    }

    /// Reverses triangles: their backs become their fronts.
    pub(super) fn turn(&mut self, triangles: &[usize]) {
        let swap = |corners: &mut [[u32; 3]]| triangles.iter().for_each(|&t| corners[t].swap(1, 2));
        swap(&mut self.triangles);
        match &mut self.normals {
            Normals::Face => {}
            Normals::Given(Attribute { triangles, .. }) | Normals::AngleWeighted { triangles, .. } => {
                swap(triangles);
            }
        }
        if let Some(uvs) = &mut self.uvs {
            swap(&mut uvs.triangles);
        }
    }

    /// Whether the topology of triangles, normals and texture coordinates equals another mesh's, and the
    /// texture coordinates do too.
    pub(crate) fn has_topology_of(&self, other: &Self) -> bool {
        let normals = match (&self.normals, &other.normals) {
            (Normals::Given(a), Normals::Given(b)) => {
                a.triangles == b.triangles && a.values.len() == b.values.len()
            }
            (a, b) => a == b,
        };
        let counts = self.positions.len() == other.positions.len();
        counts && normals && self.triangles == other.triangles && self.uvs == other.uvs
    }

    /// Replaces given normals by others of the same topology.
    pub(crate) fn replace_given_normals(&mut self, normals: Attribute<DVec3>) {
        self.normals = Normals::Given(normals);
    }

    /// Positions of the vertices, without duplicates.
    #[must_use]
    pub fn positions(&self) -> &[DVec3] {
        &self.positions
    }

    /// Three positions for every triangle, counter-clockwise as seen from the front.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Source of the shading normals.
    #[must_use]
    pub fn normals(&self) -> &Normals {
        &self.normals
    }

    /// Texture coordinates, if there are any.
    #[must_use]
    pub fn uvs(&self) -> Option<&Attribute<DVec2>> {
        self.uvs.as_ref()
    }

    /// For every vertex given to [`Mesh::new`], the index of its position.
    #[must_use]
    pub fn sources(&self) -> &[u32] {
        &self.sources
    }

    fn check_attribute(
        &self,
        what: &'static str,
        triangles: &[[u32; 3]],
        count: usize,
    ) -> Result<(), MeshError> {
        check_count(count)?;
        let (found, expected) = (triangles.len(), self.triangles.len());
        if found != expected {
            return Err(MeshError::Attribute { what, found, expected });
        }
        check_range(what, triangles, count)
    }
}

/// det(M) M⁻ᵀ, which transforms normals and exists for every M.
fn cofactors(m: &DMat3) -> DMat3 {
    let [a, b, c] = [m.x_axis, m.y_axis, m.z_axis];
    DMat3::from_cols(b.cross(c), c.cross(a), a.cross(b))
}

/// Distinct positions, and the index of each input among them.
fn weld(positions: &[DVec3]) -> (Vec<DVec3>, Vec<u32>) {
    let mut places = HashMap::with_capacity(positions.len());
    let mut welded = Vec::with_capacity(positions.len());
    let sources = positions
        .iter()
        .map(|p| {
            // Adding 0 maps −0 to 0.
            let key = p.to_array().map(|x| (x + 0.0).to_bits());
            *places.entry(key).or_insert_with(|| {
                welded.push(*p);
                welded.len() as u32 - 1
            })
        })
        .collect();
    (welded, sources)
}

fn check_count(count: usize) -> Result<(), MeshError> {
    if count < u32::MAX as usize { Ok(()) } else { Err(MeshError::TooLarge { count }) }
}

fn check_finite(what: &'static str, mut finite: impl Iterator<Item = bool>) -> Result<(), MeshError> {
    finite.position(|f| !f).map_or(Ok(()), |index| Err(MeshError::NotFinite { what, index }))
}

fn check_range(what: &'static str, triangles: &[[u32; 3]], count: usize) -> Result<(), MeshError> {
    for (triangle, corners) in triangles.iter().enumerate() {
        if let Some(&index) = corners.iter().find(|&&i| i as usize >= count) {
            return Err(MeshError::OutOfRange { what, triangle, index, count });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mirror_keeps_the_outside_outside() {
        let mirrored = Mesh::cube().transformed(&DAffine3::from_scale(DVec3::new(-1.0, 2.0, 3.0)));
        for t in mirrored.triangles() {
            let [a, b, c] = t.map(|i| mirrored.positions()[i as usize]);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{t:?}");
        }
    }

    #[test]
    fn duplicated_vertices_become_one() {
        let p = DVec3::new(1.0, -0.0, 0.0);
        let q = DVec3::new(1.0, 0.0, 0.0);
        let mesh = Mesh::new(vec![p, DVec3::Y, q, DVec3::Z], vec![[0, 1, 3], [2, 3, 1]]).unwrap();
        assert_eq!(mesh.positions().len(), 3);
        assert_eq!(mesh.sources(), [0, 1, 0, 2]);
        assert_eq!(mesh.triangles(), [[0, 1, 2], [0, 2, 1]]);
    }

    #[test]
    fn bad_meshes_are_refused_by_name() {
        let nan = Mesh::new(vec![DVec3::ZERO, DVec3::NAN], vec![]);
        assert_eq!(nan, Err(MeshError::NotFinite { what: "position", index: 1 }));
        let range = Mesh::new(vec![DVec3::ZERO], vec![[0, 0, 7]]);
        assert!(matches!(range, Err(MeshError::OutOfRange { triangle: 0, index: 7, count: 1, .. })));
        let few = Mesh::cube().with_uvs(Attribute { values: vec![DVec2::ZERO], triangles: vec![] });
        assert!(matches!(few, Err(MeshError::Attribute { found: 0, expected: 12, .. })));
    }
}
