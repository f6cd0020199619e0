//! Triangle meshes of implicit surfaces.

use std::collections::HashMap;

use flatland::sdf::Sdf;
use glam::DVec3;
use rayon::prelude::*;

use crate::geometry::Mesh;

/// Reason why a surface cannot be meshed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum IsosurfaceError {
    /// The box is empty or not finite.
    #[error("the box from {low} to {high} is empty or not finite")]
    Box {
        /// Its low corner.
        low: DVec3,
        /// Its high corner.
        high: DVec3,
    },
    /// The number of cells along the longest side is 0 or too large.
    #[error("{cells} cells along the longest side are not between 1 and 1024")]
    Cells {
        /// Number of cells requested.
        cells: usize,
    },
    /// φ is not finite at a node.
    #[error("φ is {value} at {at}")]
    NotFinite {
        /// φ.
        value: f64,
        /// The point.
        at: DVec3,
    },
    /// No node is inside.
    #[error("no node is inside the surface: it is empty, outside the box, or thinner than a cell")]
    Empty,
    /// The surface meets the faces of the box, where the mesh would be open.
    #[error("the surface leaves the box at {at}; take a larger one")]
    Leaves {
        /// A node inside the surface on a face of the box.
        at: DVec3,
    },
}

/// Node values of a grid of cubes.
struct Nodes {
    low: DVec3,
    spacing: f64,
    size: [usize; 3],
    values: Vec<f64>,
}

/// Tetrahedra of a cube whose corners are numbered by bits (Kuhn 1960): those from corner 0 to 7 along its
/// edges, each positively oriented. Neighbouring cubes agree on their common faces.
const TETRAHEDRA: [[usize; 4]; 6] =
    [[0, 1, 3, 7], [0, 5, 1, 7], [0, 3, 2, 7], [0, 2, 6, 7], [0, 4, 5, 7], [0, 6, 4, 7]];

/// The surface φ = 0 within a box as a closed, flat-shaded mesh with outward triangles, by marching
/// tetrahedra over `cells` cubes along the box's longest side (Doi and Koide 1991). A node is inside if
/// φ < 0.
///
/// Every edge has two triangles, whatever the values. Vertices are on edges of the tetrahedra, where φ = 0 up
/// to rounding. Parts thinner than a cell may be lost, and triangles may be slivers: remesh before fitting.
///
/// # Errors
/// [`IsosurfaceError`].
pub fn isosurface(
    sdf: &dyn Sdf<DVec3>,
    (low, high): (DVec3, DVec3),
    cells: usize,
) -> Result<Mesh, IsosurfaceError> {
    let nodes = Nodes::new(sdf, (low, high), cells)?;
    let mut vertices = Vertices { sdf, nodes: &nodes, numbers: HashMap::new(), positions: vec![] };
    let mut triangles = vec![];
    let [nx, ny, nz] = nodes.size;
    let corners: [usize; 8] = std::array::from_fn(|c| (c & 1) + nx * ((c >> 1 & 1) + ny * (c >> 2)));
    for k in 0..nz - 1 {
        for j in 0..ny - 1 {
            for i in 0..nx - 1 {
                let first = i + nx * (j + ny * k);
                let inside = corners.map(|c| nodes.values[first + c] < 0.0);
                if inside == [false; 8] || inside == [true; 8] {
                    continue;
                }
                for tetrahedron in TETRAHEDRA {
                    for triangle in pieces(tetrahedron, inside) {
                        let numbers = triangle.map(|[a, b]| vertices.number(first, a, b));
                        triangles.push(numbers);
                    }
                }
            }
        }
    }
    let Vertices { positions, .. } = vertices;
    // Indices are in range and positions finite.
    Mesh::new(positions, triangles).map_err(|_| IsosurfaceError::Empty)
}

/// Intersection of the surface with a tetrahedron: triangles of points on its edges, each between two
/// corners.
fn pieces([a, b, c, d]: [usize; 4], inside: [bool; 8]) -> impl Iterator<Item = [[usize; 2]; 3]> {
    // Even permutations, which preserve orientation.
    let orders = [[a, b, c, d], [b, a, d, c], [c, a, b, d], [d, a, c, b]];
    let pairs = [[a, b, c, d], [a, c, d, b], [a, d, b, c], [b, c, a, d], [b, d, c, a], [c, d, a, b]];
    let count = [a, b, c, d].iter().filter(|&&corner| inside[corner]).count();
    let found = match count {
        1 | 3 => orders.into_iter().find(|[i, ..]| inside[*i] == (count == 1)).map(|[i, j, k, l]| {
            let triangle = [[i, j], [i, k], [i, l]];
            let turned = [[i, j], [i, l], [i, k]];
            [Some(if count == 1 { triangle } else { turned }), None]
        }),
        2 => pairs
            .into_iter()
            .find(|[i, j, ..]| inside[*i] && inside[*j])
            .map(|[i, j, k, l]| [Some([[i, k], [i, l], [j, l]]), Some([[i, k], [j, l], [j, k]])]),
        _ => None,
    };
    found.into_iter().flatten().flatten()
}

impl Nodes {
    fn new(sdf: &dyn Sdf<DVec3>, (low, high): (DVec3, DVec3), cells: usize) -> Result<Self, IsosurfaceError> {
        let extent = high - low;
        if !(low.is_finite() && extent.is_finite() && extent.min_element() > 0.0) {
            return Err(IsosurfaceError::Box { low, high });
        }
        if !(1..=1024).contains(&cells) {
            return Err(IsosurfaceError::Cells { cells });
        }
        let spacing = extent.max_element() / cells as f64;
        // Whole cells, except for rounding.
        let size = extent.to_array().map(|length| (length / spacing - 1e-9).ceil().max(1.0) as usize + 1);
        let mut nodes = Self { low, spacing, size, values: vec![] };
        let count = size.iter().product::<usize>();
        nodes.values = (0..count).into_par_iter().map(|index| sdf.jet(nodes.position(index)).value).collect();
        if let Some(index) = nodes.values.iter().position(|value| !value.is_finite()) {
            return Err(IsosurfaceError::NotFinite { value: nodes.values[index], at: nodes.position(index) });
        }
        if nodes.values.iter().all(|&value| value >= 0.0) {
            return Err(IsosurfaceError::Empty);
        }
        let on_face = |index: &usize| {
            let place = nodes.place(*index);
            (0..3).any(|axis| place[axis] == 0 || place[axis] + 1 == size[axis])
        };
        if let Some(index) = (0..count).filter(on_face).find(|&index| nodes.values[index] < 0.0) {
            return Err(IsosurfaceError::Leaves { at: nodes.position(index) });
        }
        Ok(nodes)
    }

    fn place(&self, index: usize) -> [usize; 3] {
        let [nx, ny, _] = self.size;
        [index % nx, index / nx % ny, index / nx / ny]
    }

    fn position(&self, index: usize) -> DVec3 {
        self.low + self.spacing * DVec3::from_array(self.place(index).map(|i| i as f64))
    }
}

/// Vertices of the mesh, each on an edge from a node in one of seven directions.
struct Vertices<'a> {
    sdf: &'a dyn Sdf<DVec3>,
    nodes: &'a Nodes,
    numbers: HashMap<(usize, usize), u32>,
    positions: Vec<DVec3>,
}

impl Vertices<'_> {
    /// Index of the vertex between two corners of the cube whose first node is given.
    fn number(&mut self, first: usize, a: usize, b: usize) -> u32 {
        // One of them has all the bits of the other.
        let (lower, upper) = (a & b, a | b);
        let [nx, ny, _] = self.nodes.size;
        let at = |corner: usize| first + (corner & 1) + nx * ((corner >> 1 & 1) + ny * (corner >> 2));
        let (p, q) = (at(lower), at(upper));
        *self.numbers.entry((p, upper - lower)).or_insert_with(|| {
            let number = self.positions.len() as u32;
            self.positions.push(root(self.sdf, self.nodes, p, q));
            number
        })
    }
}

/// Root of φ between two nodes of which one is inside, by bisection to rounding.
fn root(sdf: &dyn Sdf<DVec3>, nodes: &Nodes, p: usize, q: usize) -> DVec3 {
    let (inside, outside) = if nodes.values[p] < 0.0 { (p, q) } else { (q, p) };
    let (mut low, mut high) = (nodes.position(inside), nodes.position(outside));
    loop {
        let middle = 0.5 * (low + high);
        if middle == low || middle == high {
            return middle;
        }
        if sdf.jet(middle).value < 0.0 { low = middle } else { high = middle }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Edges;
    use crate::sdf::analytic::{Ball, SmoothUnion, Torus};

    const BOX: (DVec3, DVec3) = (DVec3::new(-2.0, -1.9, -2.1), DVec3::splat(2.0));

    #[test]
    fn tetrahedra_fill_the_cube_and_are_positively_oriented() {
        let corner = |c: usize| DVec3::new((c & 1) as f64, (c >> 1 & 1) as f64, (c >> 2) as f64);
        for tetrahedron in TETRAHEDRA {
            let [a, b, c, d] = tetrahedron.map(corner);
            assert_eq!((b - a).cross(c - a).dot(d - a), 1.0, "{tetrahedron:?}");
        }
    }

    /// V − E + F, after checking that every edge has two triangles that traverse it in opposite directions,
    /// and that every vertex is on the surface.
    fn characteristic(sdf: &dyn Sdf<DVec3>, cells: usize) -> i64 {
        let mesh = isosurface(sdf, BOX, cells).expect("a mesh");
        let edges = Edges::of(mesh.triangles().iter().copied());
        for sides in edges.iter() {
            let [a, b] = sides else { panic!("{} triangles", sides.len()) };
            assert_ne!(a.ascending, b.ascending);
        }
        for &p in mesh.positions() {
            assert!(sdf.jet(p).value.abs() < 1e-14, "{p}: {}", sdf.jet(p).value);
        }
        for t in mesh.triangles() {
            let [a, b, c] = t.map(|i| mesh.positions()[i as usize]);
            let normal = (b - a).cross(c - a);
            let outward = sdf.jet((a + b + c) / 3.0).gradient;
            assert!(normal.dot(outward) >= -1e-9 * normal.length(), "{t:?} faces inwards");
        }
        mesh.positions().len() as i64 - edges.iter().count() as i64 + mesh.triangles().len() as i64
    }

    #[test]
    fn surfaces_are_closed_and_of_their_genus() {
        let ball = Ball::new(DVec3::new(0.1, 0.05, -0.02), 1.0).expect("a ball");
        let small = Ball::new(DVec3::new(-0.9, 0.8, 0.9), 0.5).expect("a ball");
        let ring = Torus::new(DVec3::splat(0.03), 1.2, 0.4).expect("a ring");
        for cells in [16, 23, 37] {
            assert_eq!(characteristic(&ball, cells), 2);
            assert_eq!(characteristic(&ring, cells), 0);
        }
        let two = SmoothUnion::new(Ball::new(DVec3::X, 0.6).expect("a ball"), small, 0.1).expect("a union");
        assert_eq!(characteristic(&two, 30), 4, "two bodies");
        // Nodes on the surface count as outside: triangles without area are valid.
        let unit = Ball::new(DVec3::ZERO, 1.0).expect("a ball");
        let mesh = isosurface(&unit, (DVec3::splat(-2.0), DVec3::splat(2.0)), 8).expect("a mesh");
        assert!(Edges::of(mesh.triangles().iter().copied()).iter().all(|sides| sides.len() == 2));
    }

    #[test]
    fn what_has_no_surface_is_refused() {
        let ball = Ball::new(DVec3::ZERO, 1.0).expect("a ball");
        let unit = (DVec3::splat(-1.5), DVec3::splat(1.5));
        let refused = |bounds, cells| isosurface(&ball, bounds, cells).map(|_| ()).expect_err("refused");
        assert!(matches!(refused((DVec3::ONE, DVec3::ZERO), 4), IsosurfaceError::Box { .. }));
        assert!(matches!(refused((DVec3::NAN, DVec3::ONE), 4), IsosurfaceError::Box { .. }));
        assert!(matches!(refused(unit, 0), IsosurfaceError::Cells { cells: 0 }));
        assert!(matches!(refused(unit, 4096), IsosurfaceError::Cells { .. }));
        assert!(matches!(refused((DVec3::splat(2.0), DVec3::splat(3.0)), 4), IsosurfaceError::Empty));
        assert!(matches!(refused((DVec3::ZERO, DVec3::ONE * 2.0), 4), IsosurfaceError::Leaves { .. }));
    }
}
