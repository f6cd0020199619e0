//! Convex pieces of triangles, cut by planes.

use anyhow::Result;

use super::plane::{Corner, Planes};

/// The line that contains a side of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Side {
    /// An edge of the mesh, from the vertex of the smaller number.
    Edge([usize; 2]),
    /// The line of intersection of the triangle's own plane and this one.
    Plane(usize),
}

/// A convex piece of a triangle: its corners in order, each with the side to the next.
#[derive(Clone, Debug)]
pub(super) struct Piece {
    pub(super) triangle: usize,
    corners: Vec<(Corner, Side)>,
}

impl Piece {
    /// The whole triangle.
    pub(super) fn new(triangle: usize, vertices: [usize; 3]) -> Self {
        let corner = |k: usize| {
            let (u, v) = (vertices[k], vertices[(k + 1) % 3]);
            (Corner::Vertex(u), Side::Edge([u.min(v), u.max(v)]))
        };
        Self { triangle, corners: (0..3).map(corner).collect() }
    }

    pub(super) fn corners(&self) -> impl Iterator<Item = Corner> {
        self.corners.iter().map(|(corner, _)| *corner)
    }

    /// The parts on either side of a plane: two pieces, or this one.
    pub(super) fn cut(&self, planes: &Planes, plane: usize) -> Result<Vec<Self>> {
        let sides = self.corners().map(|c| planes.side(self.triangle, c, plane));
        let sides = sides.collect::<Result<Vec<_>, _>>()?;
        let along =
            |sign: f64| Self { triangle: self.triangle, corners: self.part(planes, plane, &sides, sign) };
        let divides = sides.iter().any(|s| *s > 0.0) && sides.iter().any(|s| *s < 0.0);
        Ok(if divides { vec![along(1.0), along(-1.0)] } else { vec![self.clone()] })
    }

    /// The corners of the part on the side `sign` (Sutherland and Hodgman 1974).
    fn part(&self, planes: &Planes, plane: usize, sides: &[f64], sign: f64) -> Vec<(Corner, Side)> {
        let mut kept = vec![];
        for (k, &(corner, side)) in self.corners.iter().enumerate() {
            let (here, next) = (sign * sides[k], sign * sides[(k + 1) % sides.len()]);
            // At the exit from the part, the next side runs along the plane.
            let leaves = next < 0.0;
            if here > 0.0 {
                kept.push((corner, side));
            } else if here == 0.0 {
                kept.push((corner, if leaves { Side::Plane(plane) } else { side }));
            }
            if here * next < 0.0 {
                let new = match side {
                    Side::Edge(edge) => Corner::Edge(edge, plane),
                    Side::Plane(other) => {
                        let mut three = [planes.plane_of(self.triangle), other, plane];
                        three.sort_unstable();
                        Corner::Planes(three)
                    }
                };
                kept.push((new, if leaves { Side::Plane(plane) } else { side }));
            }
        }
        kept
    }
}
