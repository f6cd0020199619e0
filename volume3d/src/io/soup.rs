//! Triangle soup as stored in a file, before equal positions are merged.

use glam::{DVec2, DVec3};

use crate::geometry::{Attribute, Mesh, MeshError, Normals};

/// The index of a missing texture coordinate or normal.
pub(super) const NONE: u32 = u32::MAX;

/// Positions, normals and texture coordinates with the indices of the file.
#[derive(Debug, Default)]
pub(super) struct Soup {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
    pub(super) normals: Option<Attribute<DVec3>>,
    pub(super) uvs: Option<Attribute<DVec2>>,
    /// The index of the texture coordinate (0, 0) of corners without one in the file, which is excluded from
    /// changes of all others.
    pub(super) absent: Option<u32>,
    /// Notes for the user on how the file was read.
    pub(super) notes: Vec<String>,
}

impl Soup {
    /// Reverses the orientation of every triangle and every normal.
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

    /// Replaces v by 1 − v.
    pub(super) fn flip_texture_coordinates(&mut self) {
        let absent = self.absent;
        for (index, uv) in self.uvs.iter_mut().flat_map(|uvs| &mut uvs.values).enumerate() {
            if absent != Some(index as u32) {
                uv.y = 1.0 - uv.y;
            }
        }
    }

    /// Sets texture coordinates by triangles; corners that are [`NONE`] get (0, 0), with a note. None are set
    /// if no corner has any.
    pub(super) fn set_uvs(&mut self, values: Vec<DVec2>, triangles: Vec<[u32; 3]>) {
        let corners = triangles.as_flattened();
        let missing = corners.iter().filter(|&&corner| corner == NONE).count();
        let count = corners.len();
        if missing == count {
            return;
        }
        let mut uvs = Attribute { values, triangles };
        if missing > 0 {
            let absent = uvs.values.len() as u32;
            uvs.values.push(DVec2::ZERO);
            fill(&mut uvs.triangles, |_| absent);
            self.absent = Some(absent);
            self.notes.push(format!(
                "{missing} of {count} corners of triangles have no texture coordinates: theirs are (0, 0), and in Mitsuba they \
                 are undefined"
            ));
        }
        self.uvs = Some(uvs);
    }

    /// Sets normals by triangles; corners that are [`NONE`] get the normal of their triangle, with a note.
    /// None are set if no corner has any.
    pub(super) fn set_normals(&mut self, values: Vec<DVec3>, triangles: Vec<[u32; 3]>) {
        let missing = triangles.as_flattened().iter().filter(|&&corner| corner == NONE).count();
        let count = triangles.as_flattened().len();
        if missing == count {
            return;
        }
        let mut normals = Attribute { values, triangles };
        if missing > 0 {
            let first = normals.values.len() as u32;
            let corner = |k: u32| self.positions[k as usize];
            normals.values.extend(self.triangles.iter().map(|t| {
                let [a, b, c] = t.map(corner);
                (b - a).cross(c - a).normalize_or_zero()
            }));
            fill(&mut normals.triangles, |triangle| first + triangle);
            self.notes.push(format!(
                "{missing} of {count} corners of triangles have no normals: theirs are those of their triangles, and in \
                 Mitsuba they are undefined"
            ));
        }
        self.normals = Some(normals);
    }

    /// Converts to a mesh with face normals, or with the given normals, or, without these, with normals
    /// weighted by angles on the file's own vertices.
    pub(super) fn into_mesh(self, face_normals: bool) -> Result<Mesh, MeshError> {
        let Self { positions, triangles, normals, uvs, absent: _, notes: _ } = self;
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

    /// The triangles of a built-in shape, with face normals.
    pub(super) fn from_faces(mesh: &Mesh) -> Self {
        Self {
            positions: mesh.positions().to_vec(),
            triangles: mesh.triangles().to_vec(),
            normals: None,
            uvs: mesh.uvs().cloned(),
            absent: None,
            notes: vec![],
        }
    }
}

impl From<Mesh> for Soup {
    /// Computed normals are dropped, so that the soup has no given normals.
    fn from(mesh: Mesh) -> Self {
        let normals = match mesh.normals() {
            Normals::Given(normals) => Some(normals.clone()),
            Normals::Face | Normals::AngleWeighted { .. } => None,
        };
        Self { normals, ..Self::from_faces(&mesh) }
    }
}

/// Assigns an index, by triangle, to corners that are [`NONE`].
fn fill(triangles: &mut [[u32; 3]], index: impl Fn(u32) -> u32) {
    for (triangle, corners) in triangles.iter_mut().enumerate() {
        corners
            .iter_mut()
            .filter(|corner| **corner == NONE)
            .for_each(|corner| *corner = index(triangle as u32));
    }
}
