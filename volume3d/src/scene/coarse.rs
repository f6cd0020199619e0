//! Detection of meshes whose coordinates are so coarsely rounded that their shape is lost.

use super::adjacency::FLAT;
use super::{Description, Scene};

/// A mesh whose shape is changed by rounding: coordinates too large or edges too short.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CoarseMesh {
    /// Index of the shape.
    pub shape: usize,
    /// Largest coordinate.
    pub coordinate: f64,
    /// Spacing of double-precision numbers of that size.
    pub spacing: f64,
    /// Median length of its edges.
    pub edge: f64,
}

impl Scene {
    /// Meshes with coordinates spaced, in double precision, by more than 10⁻⁵ of the median edge: rounding
    /// rotates their faces by more than the tolerance for coplanarity, and gradients refer to the rounded
    /// shapes.
    #[must_use]
    pub fn coarse_meshes(&self) -> Vec<CoarseMesh> {
        let Description { shapes, .. } = self.description();
        let coarse = |(shape, of): (usize, &super::Shape)| {
            let positions = of.mesh.positions();
            let largest = |triangle: &[u32; 3]| {
                triangle.map(|i| positions[i as usize].abs().max_element()).into_iter().fold(0.0, f64::max)
            };
            let coordinate = of.mesh.triangles().iter().map(largest).fold(0.0, f64::max);
            let spacing = coordinate.next_up() - coordinate;
            let lengths = of.mesh.triangles().iter().flat_map(|t| {
                (0..3).map(|k| positions[t[k] as usize].distance(positions[t[(k + 1) % 3] as usize]))
            });
            let mut lengths: Vec<f64> = lengths.collect();
            if lengths.is_empty() {
                return None;
            }
            let middle = lengths.len() / 2;
            let edge = *lengths.select_nth_unstable_by(middle, f64::total_cmp).1;
            (spacing > FLAT * edge).then_some(CoarseMesh { shape, coordinate, spacing, edge })
        };
        shapes.iter().enumerate().filter_map(coarse).collect()
    }
}

#[cfg(test)]
mod tests {
    use glam::{DAffine3, DVec3};

    use super::*;
    use crate::geometry::Mesh;
    use crate::scene::{Camera, Film, Filter, Material};

    #[test]
    fn a_mesh_is_too_coarse_where_rounding_turns_its_faces() {
        let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, 0.7);
        let film = Film { width: 1, height: 1, crop: None, sample_border: true, filter: Filter::Box };
        let mut d = Description::new(camera, film);
        let white = d.add_material(Material::diffuse("white", DVec3::ONE));
        for far in [0.0, 1e9, 1e12] {
            let place = DAffine3::from_translation(DVec3::new(far, -0.5 * far, 1.0));
            d.add_shape(&format!("{far:e}"), Mesh::cube().transformed(&place), white);
        }
        let found = Scene::new(d).unwrap().coarse_meshes();
        let shapes: Vec<usize> = found.iter().map(|mesh| mesh.shape).collect();
        assert_eq!(shapes, [2]);
        assert_eq!((found[0].spacing, found[0].edge), (2.0_f64.powi(-13), 2.0));
    }
}
