//! The built-in shapes with flat faces: a square and a cube.

use glam::{DVec2, DVec3};

use super::mesh::{Attribute, Mesh};

impl Mesh {
    /// The square [−1, 1]² in the plane z = 0, facing +z, with texture coordinates [0, 1]².
    #[must_use]
    pub fn rectangle() -> Self {
        let corners = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];
        let triangles = vec![[0, 1, 2], [0, 2, 3]];
        let positions = corners.iter().map(|&(x, y)| DVec3::new(x, y, 0.0)).collect();
        let values = corners.iter().map(|&(x, y)| 0.5 * DVec2::new(x + 1.0, y + 1.0)).collect();
        flat(positions, triangles.clone(), Attribute { values, triangles })
    }

    /// The cube [−1, 1]³, facing outwards, with texture coordinates [0, 1]² on each face, as Mitsuba's has
    /// them: mirrored as seen from outside.
    #[must_use]
    pub fn cube() -> Self {
        let corner = |i: u32| {
            let side = |bit: u32| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
            DVec3::new(side(0), side(1), side(2))
        };
        // Corners of each face, counter-clockwise from outside.
        let faces: [[u32; 4]; 6] =
            [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
        let triangles = faces.iter().flat_map(|f| [[f[0], f[1], f[2]], [f[0], f[2], f[3]]]).collect();
        // Which of the values below the first corner of each face has.
        let first = [0, 1, 0, 2, 3, 0];
        let corners = |first: u32| [[0, 1, 2], [0, 2, 3]].map(|t: [u32; 3]| t.map(|k| (first + k) % 4));
        let uvs = Attribute {
            values: vec![DVec2::ZERO, DVec2::Y, DVec2::ONE, DVec2::X],
            triangles: first.into_iter().flat_map(corners).collect(),
        };
        flat((0..8).map(corner).collect(), triangles, uvs)
    }
}

fn flat(positions: Vec<DVec3>, triangles: Vec<[u32; 3]>, uvs: Attribute<DVec2>) -> Mesh {
    let mesh = Mesh::new(positions, triangles).and_then(|mesh| mesh.with_uvs(uvs));
    mesh.expect("indices are in range, and all numbers finite")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cube_and_rectangle_face_outwards() {
        let cube = Mesh::cube();
        for t in cube.triangles() {
            let [a, b, c] = t.map(|i| cube.positions()[i as usize]);
            assert!((b - a).cross(c - a).dot(a + b + c) > 0.0, "{t:?}");
        }
        let square = Mesh::rectangle();
        let [a, b, c] = square.triangles()[1].map(|i| square.positions()[i as usize]);
        assert!((b - a).cross(c - a).z > 0.0);
    }

    /// What Mitsuba 3.9 has at some corners: of each face two of one diagonal.
    #[test]
    fn texture_coordinates_of_the_cube() {
        let cube = Mesh::cube();
        let at = |normal: DVec3, corner: [f64; 3]| {
            let uvs = cube.uvs().unwrap();
            let found = cube.triangles().iter().zip(&uvs.triangles).find_map(|(t, uv)| {
                let [a, b, c] = t.map(|i| cube.positions()[i as usize]);
                let k = [a, b, c].iter().position(|p| *p == DVec3::from_array(corner))?;
                ((b - a).cross(c - a).dot(normal) > 0.0).then(|| uvs.values[uv[k] as usize])
            });
            found.unwrap().to_array()
        };
        let cases = [
            (DVec3::NEG_Y, [1.0, -1.0, -1.0], [-1.0, -1.0, 1.0]),
            (DVec3::Y, [1.0, 1.0, -1.0], [-1.0, 1.0, 1.0]),
            (DVec3::X, [1.0, -1.0, -1.0], [1.0, 1.0, 1.0]),
            (DVec3::Z, [1.0, -1.0, 1.0], [-1.0, 1.0, 1.0]),
            (DVec3::NEG_X, [-1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]),
            (DVec3::NEG_Z, [1.0, 1.0, -1.0], [-1.0, -1.0, -1.0]),
        ];
        for (normal, first, third) in cases {
            assert_eq!((at(normal, first), at(normal, third)), ([0.0, 1.0], [1.0, 0.0]), "{normal}");
        }
    }
}
