//! A sphere of any number of triangles.

use std::collections::HashMap;

use glam::DVec3;

/// The unit sphere: an icosahedron, each face split in four so many times; all faces outwards.
pub(crate) fn icosphere(levels: usize) -> (Vec<DVec3>, Vec<[u32; 3]>) {
    let golden = 0.5 * (1.0 + 5.0_f64.sqrt());
    let mut positions: Vec<DVec3> = [(-1.0, golden), (1.0, golden), (-1.0, -golden), (1.0, -golden)]
        .into_iter()
        .flat_map(|(a, b)| [DVec3::new(a, b, 0.0), DVec3::new(0.0, a, b), DVec3::new(b, 0.0, a)])
        .map(DVec3::normalize)
        .collect();
    // Faces join corners at the edge length 1.05; the next distance is 1.7.
    let adjacent = |a: u32, b: u32| positions[a as usize].distance(positions[b as usize]) < 1.1;
    let mut triangles: Vec<[u32; 3]> = (0..12)
        .flat_map(|a| (a + 1..12).flat_map(move |b| (b + 1..12).map(move |c| [a, b, c])))
        .filter(|&[a, b, c]| adjacent(a, b) && adjacent(b, c) && adjacent(c, a))
        .collect();
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
    for [a, b, c] in &mut triangles {
        let [p, q, r] = [*a, *b, *c].map(|i| positions[i as usize]);
        if (q - p).cross(r - p).dot(p) < 0.0 {
            std::mem::swap(b, c);
        }
    }
    (positions, triangles)
}
