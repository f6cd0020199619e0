//! The test that decides: a ray and a triangle in double precision, without a gap between neighbours.
//!
//! Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection* (JCGT 2013): the axes are permuted so that the
//! ray's largest component is z, and vertices are sheared until the ray is the z axis. The rest is a test of
//! the origin against a triangle in the plane. A sheared vertex depends on the ray and the vertex alone, so
//! a mesh stays a mesh in the plane, and the edge functions of the two triangles at an edge are exact negatives
//! of each other. Rust never fuses a product into a sum by itself, which would break that.
//!
//! A deviation from the paper: where an edge function cancels it is recomputed from error-free products, so its
//! sign is that of the exact value, zero only if that is zero, and its relative error is bounded. An
//! accepted hit is therefore a hit of the triangle with its vertices moved by a few 2⁻⁵³ |vertex − origin|, even
//! if the triangle is seen edge-on.

use glam::DVec3;

/// A ray as the test needs it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    /// Indices of the axes that become x, y and z; the direction is longest along z.
    pub(super) axes: [usize; 3],
    /// Origin, axes permuted.
    origin: [f64; 3],
    /// d_x/d_z, d_y/d_z and 1/d_z.
    pub(super) slopes: [f64; 3],
}

/// Where a ray meets a triangle's plane, inside the triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub(super) distance: f64,
    /// Edge functions: unnormalised barycentric coordinates, all of one sign.
    pub(super) edges: [f64; 3],
}

impl Crossing {
    /// Weights of the three vertices, nonnegative, with sum 1 up to rounding.
    pub(super) fn barycentric(&self) -> [f64; 3] {
        let [u, v, w] = self.edges;
        let scale = 1.0 / (u + v + w);
        [u * scale, v * scale, w * scale]
    }
}

/// Share of its products below which an edge function is recomputed. Without it the relative error of
/// an edge function p − q is at most 2⁻⁵² / 2⁻¹² = 2⁻⁴⁰ (each product is rounded by 2⁻⁵³), and about one
/// ray in a thousand pays for the exact products.
const CANCELLATION: f64 = 1.0 / 4096.0;

/// c_x b_y − c_y b_x, the exact negative of itself with b and c exchanged.
#[inline(always)]
fn edge(c: [f64; 3], b: [f64; 3]) -> f64 {
    let (p, q) = (c[0] * b[1], c[1] * b[0]);
    let difference = p - q;
    if difference.abs() > CANCELLATION * (p.abs() + q.abs()) { difference } else { exact_edge(c, b) }
}

/// The same where p ≈ q: p − q is exact (Sterbenz), and so are both products' rounding errors.
#[cold]
fn exact_edge(c: [f64; 3], b: [f64; 3]) -> f64 {
    let (p, q) = (c[0] * b[1], c[1] * b[0]);
    (p - q) + (c[0].mul_add(b[1], -p) - c[1].mul_add(b[0], -q))
}

impl Shear {
    /// In the place of a ray that is not there.
    pub(super) const IDLE: Self = Self { axes: [0, 1, 2], origin: [0.0; 3], slopes: [0.0, 0.0, 1.0] };

    /// `None` for a direction that is zero or not finite.
    #[inline(always)]
    pub(super) fn new(origin: DVec3, direction: DVec3) -> Option<Self> {
        let d = direction.to_array();
        let size = direction.abs();
        // Without branches, which would be unpredictable.
        let yx = usize::from(size.y > size.x);
        let z = if size.z > size.x.max(size.y) { 2 } else { yx };
        let axes = [[1, 2, 0], [2, 0, 1], [0, 1, 2]][z];
        let inverse = 1.0 / d[z];
        let slopes = [d[axes[0]] * inverse, d[axes[1]] * inverse, inverse];
        let o = origin.to_array();
        let finite = inverse.is_finite() && (slopes[0] + slopes[1]).is_finite() && origin.is_finite();
        finite.then_some(Self { axes, origin: [o[axes[0]], o[axes[1]], o[axes[2]]], slopes })
    }

    /// Whether the ray points down its z axis.
    #[inline(always)]
    pub(super) fn backward(&self) -> bool {
        self.slopes[2] < 0.0
    }

    /// The crossing of the whole line with a triangle; points on edges and vertices belong to all
    /// their triangles. A triangle seen exactly edge-on is not crossed. The distance may be NaN if
    /// products of coordinates overflow.
    #[inline(always)]
    pub(super) fn intersect(&self, corners: [&[f64; 3]; 3]) -> Option<Crossing> {
        self.cross(&self.relative(corners))
    }

    /// Corners relative to the origin, axes permuted.
    #[inline(always)]
    pub(super) fn relative(&self, corners: [&[f64; 3]; 3]) -> [[f64; 3]; 3] {
        let [x, y, z] = self.axes;
        let [ox, oy, oz] = self.origin;
        let [a, b, c] = corners;
        [
            [a[x] - ox, a[y] - oy, a[z] - oz],
            [b[x] - ox, b[y] - oy, b[z] - oz],
            [c[x] - ox, c[y] - oy, c[z] - oz],
        ]
    }

    /// [`Shear::intersect`] for corners [`Shear::relative`] to the origin.
    #[inline(always)]
    pub(super) fn cross(&self, relative: &[[f64; 3]; 3]) -> Option<Crossing> {
        let [a, b, c] = relative;
        let (a, b, c) = (self.sheared(a), self.sheared(b), self.sheared(c));
        let (u, v, w) = (edge(c, b), edge(a, c), edge(b, a));
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let determinant = u + v + w;
        if determinant == 0.0 {
            return None;
        }
        let depth = (u * a[2] + v * b[2] + w * c[2]) / determinant;
        Some(Crossing { distance: depth * self.slopes[2], edges: [u, v, w] })
    }

    #[inline(always)]
    fn sheared(&self, [x, y, z]: &[f64; 3]) -> [f64; 3] {
        [x - self.slopes[0] * z, y - self.slopes[1] * z, *z]
    }
}
