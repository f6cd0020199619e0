//! The planes that triangles lie in, and points of them, as functions of θ.

use anyhow::{Result, bail};
use num_dual::{Dual64, DualNum};

use crate::dual::Vector3;

/// Rounding tolerance on distances from a plane, relative to the size of the compared numbers: some 10⁵ times
/// the rounding of a few operations, and met by a fraction of 10⁻¹⁰ of random scenes.
const ON: f64 = 1e-11;
/// Rounding tolerance on rates of such distances, relative to the speeds.
const ALONG: f64 = 1e-9;

/// A corner of a piece, by its construction.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) enum Corner {
    /// A vertex of the mesh.
    Vertex(usize),
    /// An edge, from the vertex of the smaller number, pierced by a plane.
    Edge([usize; 2], usize),
    /// The intersection of three planes, sorted.
    Planes([usize; 3]),
}

/// A plane through a moving point, normal to a moving unit vector.
#[derive(Clone, Copy, Debug)]
pub(super) struct Plane {
    pub(super) point: Vector3,
    pub(super) normal: Vector3,
}

impl Plane {
    fn of(corners: [Vector3; 3]) -> Self {
        let [a, b, c] = corners;
        Self { point: a, normal: (b - a).cross(c - a).unit() }
    }

    /// Signed distance along the normal.
    pub(super) fn distance(&self, p: Vector3) -> Dual64 {
        self.normal.dot(p - self.point)
    }
}

/// The planes of a mesh; triangles that lie in one plane at θ = 0 share it.
pub(super) struct Planes<'a> {
    triangles: &'a [[usize; 3]],
    points: Vec<Vector3>,
    planes: Vec<Plane>,
    /// The plane of each triangle.
    of: Vec<usize>,
    /// Whether a plane's triangles leave it as θ changes.
    bends: Vec<bool>,
}

impl<'a> Planes<'a> {
    pub(super) fn new(triangles: &'a [[usize; 3]], points: Vec<Vector3>) -> Self {
        let mut this = Self { triangles, points, planes: vec![], of: vec![], bends: vec![] };
        for &triangle in triangles {
            let corners = triangle.map(|v| this.points[v]);
            let lies_in = |plane: &Plane| {
                let tolerance = ON * reach(plane, corners);
                corners.iter().all(|c| plane.distance(*c).re.abs() <= tolerance)
            };
            if let Some(plane) = this.planes.iter().position(lies_in) {
                let of = this.planes[plane];
                let speeds = corners.iter().map(|c| (*c - of.point).rate().length());
                let turning = of.normal.rate().length() * reach(&of, corners);
                let tolerance = ALONG * speeds.fold(turning, f64::max);
                this.bends[plane] |= corners.iter().any(|c| of.distance(*c).eps.abs() > tolerance);
                this.of.push(plane);
            } else {
                this.of.push(this.planes.len());
                this.planes.push(Plane::of(corners));
                this.bends.push(false);
            }
        }
        this
    }

    /// The number of a triangle's plane.
    pub(super) fn plane_of(&self, triangle: usize) -> usize {
        self.of[triangle]
    }

    /// The plane of a triangle.
    pub(super) fn of(&self, triangle: usize) -> &Plane {
        &self.planes[self.of[triangle]]
    }

    /// Whether θ bends the plane of a triangle.
    pub(super) fn bends(&self, triangle: usize) -> bool {
        self.bends[self.of[triangle]]
    }

    pub(super) fn corners(&self, triangle: usize) -> [usize; 3] {
        self.triangles[triangle]
    }

    /// The position and velocity of a corner.
    pub(super) fn place(&self, corner: Corner) -> Vector3 {
        match corner {
            Corner::Vertex(v) => self.points[v],
            Corner::Edge([u, v], plane) => {
                let [p, q] = [self.points[u], self.points[v]];
                let [a, b] = [p, q].map(|x| self.planes[plane].distance(x));
                p.lerp(q, a / (a - b))
            }
            Corner::Planes(planes) => {
                // Σ (n_i·p_i) n_j × n_k / (n_1·(n_2 × n_3)), relative to a nearby point.
                let [a, b, c] = planes.map(|k| self.planes[k]);
                let from = Vector3::still(a.point.value());
                let offset = |plane: &Plane| plane.normal.dot(plane.point - from);
                let [ab, bc, ca] =
                    [(a, b), (b, c), (c, a)].map(|(p, q): (Plane, Plane)| p.normal.cross(q.normal));
                let sum = bc * offset(&a) + ca * offset(&b) + ab * offset(&c);
                from + sum * a.normal.dot(bc).recip()
            }
        }
    }

    /// The side of a plane on which a corner of a triangle lies: 0 if it is on the plane by construction.
    pub(super) fn side(&self, triangle: usize, corner: Corner, plane: usize) -> Result<f64> {
        let is_on = match corner {
            Corner::Vertex(v) => self.has(plane, v),
            Corner::Edge([u, v], by) => by == plane || (self.has(plane, u) && self.has(plane, v)),
            Corner::Planes(planes) => planes.contains(&plane),
        };
        if is_on {
            return Ok(0.0);
        }
        let distance = self.planes[plane].distance(self.place(corner)).re;
        let size = reach(&self.planes[plane], self.triangles[triangle].map(|v| self.points[v]));
        // Not "distance ≤ …": NaN is on no side either.
        if distance.abs() > ON * size {
            return Ok(distance);
        }
        let plane = self.of.iter().position(|&of| of == plane).unwrap_or_default();
        bail!("a corner of triangle {triangle} touches the plane of triangle {plane}")
    }

    /// Whether a vertex belongs to a plane's triangles.
    fn has(&self, plane: usize, vertex: usize) -> bool {
        let mut triangles = self.triangles.iter().zip(&self.of);
        triangles.any(|(t, &of)| of == plane && t.contains(&vertex))
    }
}

/// The largest distance of corners from a plane's point.
fn reach(plane: &Plane, corners: [Vector3; 3]) -> f64 {
    corners.iter().map(|c| (*c - plane.point).value().length()).fold(0.0, f64::max)
}
