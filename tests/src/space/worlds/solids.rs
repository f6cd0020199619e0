//! Closed convex meshes, triangles counterclockwise from outside.

use glam::{DMat3, DVec3};

use crate::dice::Dice;
use crate::space::constants::{BOX_FACES, box_corners};

/// Minimum distance, relative to the radius, of a corner behind the plane of every face that it is not on;
/// boxes, whose faces are two triangles, are exempt within a face.
const BEHIND: f64 = 0.02;
/// Amplitude of the random displacement of corners, relative to the radius.
const SHAKEN: f64 = 0.15;

/// Corners and triangles of a solid around 0, of radius about 1.
#[derive(Clone, Debug)]
pub(super) struct Solid {
    pub(super) corners: Vec<DVec3>,
    pub(super) triangles: Vec<[usize; 3]>,
}

impl Solid {
    /// A tetrahedron, octahedron or icosahedron with randomly displaced corners, or a parallelepiped.
    pub(super) fn random(dice: &mut Dice) -> Self {
        let frame = dice.frame();
        match dice.count(0, 3) {
            0 => Self::shaken(dice, &frame, &TETRAHEDRON.map(DVec3::from_array), &TETRAHEDRON_FACES),
            1 => Self::shaken(dice, &frame, &OCTAHEDRON.map(DVec3::from_array), &OCTAHEDRON_FACES),
            2 => Self::shaken(dice, &frame, &icosahedron(), &ICOSAHEDRON_FACES),
            _ => Self::parallelepiped(dice, &frame),
        }
    }

    fn shaken(dice: &mut Dice, frame: &DMat3, corners: &[DVec3], triangles: &[[usize; 3]]) -> Self {
        loop {
            let shaken = corners.iter().map(|c| *frame * (c.normalize() + dice.vector3(SHAKEN)));
            let solid = Self { corners: shaken.collect(), triangles: triangles.to_vec() };
            if solid.is_convex() {
                return solid;
            }
        }
    }

    fn parallelepiped(dice: &mut Dice, frame: &DMat3) -> Self {
        let half = DVec3::from(std::array::from_fn(|_| dice.between(0.35, 0.75)));
        let shear = DMat3::from_cols(
            DVec3::X,
            DVec3::new(dice.between(-0.3, 0.3), 1.0, 0.0),
            DVec3::new(dice.between(-0.3, 0.3), dice.between(-0.3, 0.3), 1.0),
        );
        let corners = box_corners(-half, half).map(|c| *frame * (shear * c)).to_vec();
        let triangles = BOX_FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
        Self { corners, triangles }
    }

    fn is_convex(&self) -> bool {
        self.triangles.iter().all(|t| {
            let [a, b, c] = t.map(|v| self.corners[v]);
            let normal = (b - a).cross(c - a).normalize();
            let others = (0..self.corners.len()).filter(|v| !t.contains(v));
            normal.dot(a) > 0.0 && others.into_iter().all(|v| normal.dot(self.corners[v] - a) < -BEHIND)
        })
    }
}

const TETRAHEDRON: [[f64; 3]; 4] = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]];
const TETRAHEDRON_FACES: [[usize; 3]; 4] = [[1, 3, 2], [0, 2, 3], [0, 3, 1], [0, 1, 2]];
const OCTAHEDRON: [[f64; 3]; 6] =
    [[1., 0., 0.], [-1., 0., 0.], [0., 1., 0.], [0., -1., 0.], [0., 0., 1.], [0., 0., -1.]];
const OCTAHEDRON_FACES: [[usize; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];
const ICOSAHEDRON_FACES: [[usize; 3]; 20] = [
    [0, 11, 5],
    [0, 5, 1],
    [0, 1, 7],
    [0, 7, 10],
    [0, 10, 11],
    [1, 5, 9],
    [5, 11, 4],
    [11, 10, 2],
    [10, 7, 6],
    [7, 1, 8],
    [3, 9, 4],
    [3, 4, 2],
    [3, 2, 6],
    [3, 6, 8],
    [3, 8, 9],
    [4, 9, 5],
    [2, 4, 11],
    [6, 2, 10],
    [8, 6, 7],
    [9, 8, 1],
];

/// (0, ±1, ±g) and its cyclic permutations, g the golden ratio.
fn icosahedron() -> [DVec3; 12] {
    let g = f64::midpoint(1.0, 5.0_f64.sqrt());
    let p = DVec3::new;
    [
        p(-1., g, 0.),
        p(1., g, 0.),
        p(-1., -g, 0.),
        p(1., -g, 0.),
        p(0., -1., g),
        p(0., 1., g),
        p(0., -1., -g),
        p(0., 1., -g),
        p(g, 0., -1.),
        p(g, 0., 1.),
        p(-g, 0., -1.),
        p(-g, 0., 1.),
    ]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn solids_are_closed_and_face_out() {
        for seed in 0..100 {
            let solid = Solid::random(&mut Dice::new(seed, 0));
            let edges: Vec<_> =
                solid.triangles.iter().flat_map(|t| (0..3).map(|k| [t[k], t[(k + 1) % 3]])).collect();
            assert!(edges.iter().all(|&[a, b]| edges.contains(&[b, a])), "seed {seed}");
            // Six times the volume, each face's part positive because 0 is inside.
            for t in &solid.triangles {
                let [a, b, c] = t.map(|v| solid.corners[v]);
                assert!(a.cross(b).dot(c) > 0.0, "seed {seed}");
            }
        }
    }
}
