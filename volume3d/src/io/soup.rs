//! Triangles as a file has them, before equal places become one.

use glam::{DVec2, DVec3};

use crate::geometry::{Attribute, Mesh, MeshError, Normals};

/// Positions, normals and texture coordinates with the indices of the file.
#[derive(Debug, Default)]
pub(super) struct Soup {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Option<Attribute<DVec3>>,
    pub(super) uvs: Option<Attribute<DVec2>>,
    /// What a user should know of how the file was read.
    pub(super) notes: Vec<String>,
}

impl Soup {
    /// Turns every triangle and every normal round.
    pub(super) fn flip_normals(&mut self) {
        let turn = |triangles: &mut Vec<[u32; 3]>| triangles.iter_mut().for_each(|t| t.swap(1, 2));
        turn(&mut self.triangles);
        if let Some(normals) = &mut self.normals {
            turn(&mut normals.triangles);
            normals.values.iter_mut().for_each(|n| *n = -*n);
        }
        if let Some(uvs) = &mut self.uvs {
            turn(&mut uvs.triangles);
        }
    }

    /// v becomes 1 − v.
    pub(super) fn flip_texture_coordinates(&mut self) {
        for uv in self.uvs.iter_mut().flat_map(|uvs| &mut uvs.values) {
            uv.y = 1.0 - uv.y;
        }
    }

    /// A mesh with the normals of its faces, or with the given normals, or, where there are none, with normals
    /// weighted by angles on the file's own vertices.
    pub(super) fn into_mesh(self, face_normals: bool) -> Result<Mesh, MeshError> {
        let Self { positions, triangles, normals, uvs, notes: _ } = self;
        let count = positions.len();
        let normals = match normals {
            _ if face_normals => Normals::Face,
            Some(normals) => Normals::Given(normals),
            None => Normals::AngleWeighted { triangles: triangles.clone(), count },
        };
        let mesh = Mesh::new(positions, triangles)?.with_normals(normals)?;
        match uvs {
            Some(uvs) => mesh.with_uvs(uvs),
            None => Ok(mesh),
        }
    }

    /// What a built-in shape consists of. Its normals are those of its faces.
    pub(super) fn from_faces(mesh: &Mesh) -> Self {
        Self {
            positions: mesh.positions().to_vec(),
            triangles: mesh.triangles().to_vec(),
            normals: None,
            uvs: mesh.uvs().cloned(),
            notes: vec![],
        }
    }
}

impl From<Mesh> for Soup {
    /// Of computed normals nothing stays but that there are none given.
    fn from(mesh: Mesh) -> Self {
        let normals = match mesh.normals() {
            Normals::Given(normals) => Some(normals.clone()),
            Normals::Face | Normals::AngleWeighted { .. } => None,
        };
        Self { normals, ..Self::from_faces(&mesh) }
    }
}
