//! Orientation of vertex normals relative to faces.

use std::collections::HashMap;

use glam::DVec3;

use super::{Mesh, Normals};

/// Cosine of the angle by which single-precision unit normals may differ from their face.
const PARALLEL: f64 = 1.0 - 1e-5;

impl Mesh {
    /// Number of triangles whose given vertex normals all point to the back of their face.
    #[must_use]
    pub fn turned_normals(&self) -> usize {
        self.contrary().len()
    }

    /// Those triangles.
    fn contrary(&self) -> Vec<usize> {
        let Normals::Given(normals) = self.normals() else { return vec![] };
        let turned = |&t: &usize| {
            let face = self.face(&self.triangles()[t]);
            normals.triangles[t].iter().all(|&i| normals.values[i as usize].dot(face) < 0.0)
        };
        (0..self.triangles().len()).filter(turned).collect()
    }

    /// The same mesh, with those triangles turned, and how many they are: their fronts are then where their
    /// vertex normals point to.
    #[must_use]
    pub fn with_fronts_by_normals(mut self) -> (Self, usize) {
        let turned = self.contrary();
        self.turn(&turned);
        (self, turned.len())
    }

    /// Whether any vertex normals, given or angle-weighted, differ from the normals of their faces.
    #[must_use]
    pub fn has_bent_normals(&self) -> bool {
        let faces = self.triangles().iter().map(|triangle| self.face(triangle));
        match self.normals() {
            Normals::Face => false,
            Normals::Given(normals) => faces.zip(&normals.triangles).any(|(face, corners)| {
                let differs = |n: DVec3| n != DVec3::ZERO && n.normalize().dot(face) < PARALLEL;
                face != DVec3::ZERO && corners.iter().any(|&i| differs(normals.values[i as usize]))
            }),
            Normals::AngleWeighted { triangles, .. } => {
                let mut first: HashMap<u32, DVec3> = HashMap::new();
                faces.zip(triangles).filter(|(face, _)| *face != DVec3::ZERO).any(|(face, corners)| {
                    corners.iter().any(|&i| first.entry(i).or_insert(face).dot(face) < PARALLEL)
                })
            }
        }
    }

    /// The unit normal of a triangle, or 0 if it has no area.
    fn face(&self, triangle: &[u32; 3]) -> DVec3 {
        let [a, b, c] = triangle.map(|i| self.positions()[i as usize]);
        (b - a).cross(c - a).normalize_or_zero()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Attribute;

    fn with(normal: DVec3) -> Mesh {
        let mesh = Mesh::rectangle();
        let triangles = vec![[0; 3]; mesh.triangles().len()];
        mesh.with_normals(Normals::Given(Attribute { values: vec![normal], triangles })).unwrap()
    }

    #[test]
    fn normals_are_compared_with_faces() {
        let found = |mesh: &Mesh| (mesh.turned_normals(), mesh.has_bent_normals());
        assert_eq!(found(&Mesh::rectangle()), (0, false));
        assert_eq!(found(&with(3.0 * DVec3::Z)), (0, false));
        assert_eq!(found(&with(DVec3::NEG_Z)), (2, true));
        let (front, turned) = with(DVec3::NEG_Z).with_fronts_by_normals();
        assert_eq!((turned, found(&front)), (2, (0, false)));
        assert_eq!(with(DVec3::Z).with_fronts_by_normals(), (with(DVec3::Z), 0));
        assert_eq!(found(&with(DVec3::new(0.1, 0.0, 1.0))), (0, true));
        let smooth = |mesh: Mesh| {
            let (triangles, count) = (mesh.triangles().to_vec(), mesh.positions().len());
            mesh.with_normals(Normals::AngleWeighted { triangles, count }).unwrap()
        };
        assert_eq!(found(&smooth(Mesh::rectangle())), (0, false));
        assert_eq!(found(&smooth(Mesh::cube())), (0, true));
    }
}
