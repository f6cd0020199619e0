//! Test meshes and rays.

use std::collections::HashMap;

use flatland::random::{Stream, open01};
use glam::DVec3;

#[derive(Clone)]
pub(super) struct Mesh {
    pub(super) positions: Vec<DVec3>,
    pub(super) triangles: Vec<[u32; 3]>,
}

impl Mesh {
    pub(super) fn map(&self, f: impl FnMut(&DVec3) -> DVec3) -> Self {
        Self { positions: self.positions.iter().map(f).collect(), triangles: self.triangles.clone() }
    }

    pub(super) fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|vertex| self.positions[vertex as usize])
    }
}

pub(super) fn uniform(rng: &mut Stream) -> f64 {
    2.0 * open01(rng) - 1.0
}

/// A random point in the cube [−1, 1]³.
pub(super) fn in_cube(rng: &mut Stream) -> DVec3 {
    DVec3::new(uniform(rng), uniform(rng), uniform(rng))
}

pub(super) fn direction(rng: &mut Stream) -> DVec3 {
    loop {
        let p = in_cube(rng);
        if (0.01..1.0).contains(&p.length_squared()) {
            return p.normalize();
        }
    }
}

/// The unit sphere from an icosahedron, each triangle split in four `levels` times.
pub(super) fn icosphere(levels: usize) -> Mesh {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut positions = Vec::new();
    for (a, b) in [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)] {
        for p in [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)] {
            positions.push(p.normalize());
        }
    }
    // The faces are the triples of golden rectangle corners at mutual distance 2, the edge length.
    let near = |a: usize, b: usize| (positions[a] - positions[b]).length() < 1.1;
    let mut triangles = Vec::new();
    for a in 0..12_usize {
        for b in a + 1..12 {
            for c in b + 1..12 {
                if near(a, b) && near(b, c) && near(c, a) {
                    triangles.push([a as u32, b as u32, c as u32]);
                }
            }
        }
    }
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: u32, b: u32| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                positions.push((positions[a as usize] + positions[b as usize]).normalize());
                positions.len() as u32 - 1
            })
        };
        triangles = triangles
            .iter()
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]
            })
            .collect();
    }
    Mesh { positions, triangles }
}

/// A sphere with vertices moved radially, still star-shaped around 0.
pub(super) fn rock(levels: usize, rng: &mut Stream) -> Mesh {
    icosphere(levels).map(|p| *p * (0.6 + 0.4 * open01(rng)))
}

/// The cube [−1, 1]³, two triangles per side.
pub(super) fn cube() -> Mesh {
    let positions = (0..8)
        .map(|i| DVec3::from_array([0, 1, 2].map(|axis| f64::from(i >> axis & 1) * 2.0 - 1.0)))
        .collect();
    let sides: [[u32; 4]; 6] =
        [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];
    let triangles = sides.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect();
    Mesh { positions, triangles }
}

/// Triangles of all sizes and shapes: needles, repeated corners, repeated triangles, axis-aligned ones.
pub(super) fn soup(count: usize, rng: &mut Stream) -> Mesh {
    let mut positions: Vec<DVec3> = Vec::new();
    for i in 0..count {
        let p = in_cube(rng);
        let size = 10.0_f64.powf(-3.0 * open01(rng));
        let (a, b) = (size * in_cube(rng), size * in_cube(rng));
        positions.extend(match i % 16 {
            0 => [p, p, p + a],
            1 => [p, p + a, p + 2.0 * a],
            2 => [p, p + a, p + a + 1e-9 * b],
            3 => [p, p + DVec3::X * size, p + DVec3::Y * size],
            4 => [p, p + DVec3::Y * size, p + DVec3::Z * size],
            5 if i > 16 => [positions[3 * i - 3], positions[3 * i - 2], positions[3 * i - 1]],
            6 => [p, p + DVec3::Z, p + DVec3::Z + 1e-3 * b],
            _ => [p, p + a, p + b],
        });
    }
    let triangles = (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    Mesh { positions, triangles }
}
