//! Exact test: watertight ray–triangle intersection in double precision.
//!
//! Woop, Benthin and Wald, *Watertight Ray/Triangle Intersection* (JCGT 2013): the axes are permuted so that
//! the ray's largest component is z, and vertices are sheared until the ray is the z axis. The rest is a test
//! of the origin against a triangle in the plane. A sheared vertex depends on the ray and the vertex alone,
//! so a mesh stays a mesh in the plane, and the edge functions of the two triangles at an edge are exact
//! negatives of each other. Rust never fuses a product into a sum by itself, which would break that.
//!
//! A deviation from the paper: if an edge function cancels it is recomputed from error-free products, so its
//! sign is that of the exact value, zero only if that is zero, and its relative error is bounded. An accepted
//! hit is therefore a hit of the triangle with its vertices moved by a few 2⁻⁵³ |vertex − origin|, even if
//! the triangle is seen edge-on.

use glam::DVec3;

use crate::lanes::{Half, Lanes, WIDTH};

/// A ray in the form of the test.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shear {
    /// Indices of the axes that become x, y and z; the direction is longest along z.
    pub(super) axes: [usize; 3],
    /// Origin, axes permuted.
    origin: [f64; 3],
    /// d_x/d_z, d_y/d_z and 1/d_z.
    pub(super) slopes: [f64; 3],
}

/// Intersection of a ray with a triangle's plane, inside the triangle.
#[derive(Clone, Copy, Debug)]
pub(super) struct Crossing {
    pub(super) distance: f64,
    /// Edge functions: unnormalised barycentric coordinates, all of one sign.
    pub(super) edges: [f64; 3],
}

impl Crossing {
    /// Weights of the three vertices, nonnegative, with sum 1 up to rounding.
    #[inline]
    pub(super) fn barycentric(&self) -> [f64; 3] {
        let [u, v, w] = self.edges;
        let scale = 1.0 / (u + v + w);
        [u * scale, v * scale, w * scale]
    }
}

/// Ratio to its products below which an edge function is recomputed. Above it the relative error of an edge
/// function p − q is at most 2⁻⁵² / 2⁻¹² = 2⁻⁴⁰ (each product is rounded by 2⁻⁵³); about one ray in a
/// thousand incurs the exact products.
const CANCELLATION: f64 = 1.0 / 4096.0;

/// c_x b_y − c_y b_x, the exact negative of itself with b and c exchanged.
#[inline(always)]
fn edge(c: [f64; 3], b: [f64; 3]) -> f64 {
    let (difference, cancels) = rounded_edge([c[0], c[1]], [b[0], b[1]]);
    if cancels { exact_edge(c, b) } else { difference }
}

/// [`edge`] by two rounded products, and whether it cancels.
#[inline(always)]
fn rounded_edge(c: [f64; 2], b: [f64; 2]) -> (f64, bool) {
    let (p, q) = (c[0] * b[1], c[1] * b[0]);
    let difference = p - q;
    let enough = difference.abs() > CANCELLATION * (p.abs() + q.abs());
    (difference, !enough)
}

/// [`edge`] for p ≈ q: p − q is exact (Sterbenz), and so are both products' rounding errors.
#[cold]
fn exact_edge(c: [f64; 3], b: [f64; 3]) -> f64 {
    let (p, q) = (c[0] * b[1], c[1] * b[0]);
    (p - q) + (c[0].mul_add(b[1], -p) - c[1].mul_add(b[0], -q))
}

/// The axes that become x, y and z, by the longest one.
pub(super) const PERMUTATIONS: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// Branchless, as branches would be unpredictable.
#[inline(always)]
pub(super) fn longest_axis(direction: DVec3) -> usize {
    let size = direction.abs();
    let yx = usize::from(size.y > size.x);
    if size.z > size.x.max(size.y) { 2 } else { yx }
}

/// d_x/d_z, d_y/d_z and 1/d_z.
#[inline(always)]
fn slopes(direction: DVec3, [x, y, z]: [usize; 3]) -> [f64; 3] {
    let d = direction.to_array();
    let inverse = 1.0 / d[z];
    [d[x] * inverse, d[y] * inverse, inverse]
}

#[inline(always)]
fn is_finite([x, y, inverse]: &[f64; 3]) -> bool {
    inverse.is_finite() & (x + y).is_finite()
}

#[inline(always)]
fn permuted(p: DVec3, [x, y, z]: [usize; 3]) -> [f64; 3] {
    let p = p.to_array();
    [p[x], p[y], p[z]]
}

/// Corners relative to an origin, axes permuted.
#[inline(always)]
pub(super) fn relative(
    corners: [&[f64; 3]; 3],
    [x, y, z]: [usize; 3],
    [ox, oy, oz]: [f64; 3],
) -> [[f64; 3]; 3] {
    let [a, b, c] = corners;
    [[a[x] - ox, a[y] - oy, a[z] - oz], [b[x] - ox, b[y] - oy, b[z] - oz], [c[x] - ox, c[y] - oy, c[z] - oz]]
}

/// One instruction, unlike `f64::min`, which handles NaN.
#[inline(always)]
pub(super) fn smaller(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(super) fn larger(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

impl Shear {
    /// `None` for a direction that is zero or not finite.
    #[inline(always)]
    pub(super) fn new(origin: DVec3, direction: DVec3) -> Option<Self> {
        let axes = PERMUTATIONS[longest_axis(direction)];
        let slopes = slopes(direction, axes);
        (is_finite(&slopes) && origin.is_finite()).then_some(Self {
            axes,
            origin: permuted(origin, axes),
            slopes,
        })
    }

    /// The crossing of the whole line with a triangle; points on edges and vertices belong to all their
    /// triangles. A triangle seen exactly edge-on is not crossed. The distance may be NaN if products of
    /// coordinates overflow.
    #[inline(always)]
    pub(super) fn intersect(&self, corners: [&[f64; 3]; 3]) -> Option<Crossing> {
        let [a, b, c] = &relative(corners, self.axes, self.origin);
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

/// Up to sixteen rays with one origin, one longest axis and sign: two rows of lanes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shears {
    pub(super) axes: [usize; 3],
    /// Axes permuted.
    pub(super) origin: [f64; 3],
    pub(super) rows: [ShearRow; ROWS],
    /// Bit mask of lanes with a ray; the others repeat one of them.
    pub(super) members: u32,
}

/// Rows of a packet.
pub(super) const ROWS: usize = 2;

/// Rays of a packet.
pub(super) const PACKET: usize = ROWS * WIDTH;

/// [`Shear::slopes`] of a row of rays.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShearRow {
    pub(super) x: [f64; WIDTH],
    pub(super) y: [f64; WIDTH],
    pub(super) inverse: [f64; WIDTH],
}

/// Crossings of a row of lines with a triangle.
pub(super) struct Crossings {
    /// Bit mask of lanes with a crossing.
    pub(super) lanes: u32,
    /// NaN if the triangle is seen edge-on.
    pub(super) distance: [f64; WIDTH],
    /// Edge functions of each lane.
    pub(super) edges: [[f64; WIDTH]; 3],
}

impl Shears {
    /// The rays of the mask `members`, with the longest axis `along`.
    #[inline(always)]
    pub(super) fn new(origin: DVec3, directions: &[DVec3], members: u32, along: usize) -> Self {
        let axes = PERMUTATIONS[along];
        let first = members.trailing_zeros() as usize;
        let mut rows = [ShearRow { x: [0.0; WIDTH], y: [0.0; WIDTH], inverse: [0.0; WIDTH] }; ROWS];
        for (index, row) in rows.iter_mut().enumerate() {
            for lane in 0..WIDTH {
                let ray = index * WIDTH + lane;
                let direction = directions[if members >> ray & 1 == 1 { ray } else { first }].to_array();
                row.x[lane] = direction[axes[0]];
                row.y[lane] = direction[axes[1]];
                row.inverse[lane] = direction[axes[2]];
            }
            // As in `slopes`, in a form that vectorises.
            for lane in 0..WIDTH {
                let inverse = 1.0 / row.inverse[lane];
                (row.x[lane], row.y[lane]) = (row.x[lane] * inverse, row.y[lane] * inverse);
                row.inverse[lane] = inverse;
            }
        }
        Self { axes, origin: permuted(origin, axes), rows, members }
    }

    /// From directions by coordinate, without a common origin.
    #[inline(always)]
    pub(super) fn of_lanes(directions: &[[f64; PACKET]; 3], members: u32, along: usize) -> Self {
        let axes = PERMUTATIONS[along];
        let first = members.trailing_zeros() as usize % PACKET;
        let [x, y, z] = axes.map(|axis| &directions[axis]);
        let mut rows = [ShearRow { x: [0.0; WIDTH], y: [0.0; WIDTH], inverse: [0.0; WIDTH] }; ROWS];
        for (index, row) in rows.iter_mut().enumerate() {
            for lane in 0..WIDTH {
                let at = index * WIDTH + lane;
                let member = members >> at & 1 == 1;
                let inverse = 1.0 / if member { z[at] } else { z[first] };
                row.x[lane] = if member { x[at] } else { x[first] } * inverse;
                row.y[lane] = if member { y[at] } else { y[first] } * inverse;
                row.inverse[lane] = inverse;
            }
        }
        Self { axes, origin: [0.0; 3], rows, members }
    }

    /// Whether all directions are finite and have slopes.
    #[inline(always)]
    pub(super) fn are_finite(&self) -> bool {
        let mut finite = true;
        for row in &self.rows {
            for lane in 0..WIDTH {
                finite &= is_finite(&[row.x[lane], row.y[lane], row.inverse[lane]]);
            }
        }
        finite
    }

    /// Slopes of all rays along the first axis.
    #[inline(always)]
    pub(super) fn x(&self) -> [f64; PACKET] {
        joined(&self.rows[0].x, &self.rows[1].x)
    }

    /// Slopes of all rays along the second axis.
    #[inline(always)]
    pub(super) fn y(&self) -> [f64; PACKET] {
        joined(&self.rows[0].y, &self.rows[1].y)
    }

    /// Least and greatest slopes.
    #[inline(always)]
    pub(super) fn extremes(&self) -> [[f64; 2]; 2] {
        let [low, high] = &self.rows;
        let [x, y] = [extremes(&low.x, &high.x), extremes(&low.y, &high.y)];
        [[x[0], y[0]], [x[1], y[1]]]
    }
}

#[inline(always)]
fn joined(low: &[f64; WIDTH], high: &[f64; WIDTH]) -> [f64; PACKET] {
    let mut all = [0.0; PACKET];
    all[..WIDTH].copy_from_slice(low);
    all[WIDTH..].copy_from_slice(high);
    all
}

/// Least and greatest of two rows, by halves, in a form that vectorises.
#[inline(always)]
fn extremes(a: &[f64; WIDTH], b: &[f64; WIDTH]) -> [f64; 2] {
    let (mut least, mut greatest) = (*a, *a);
    for lane in 0..WIDTH {
        least[lane] = smaller(a[lane], b[lane]);
        greatest[lane] = larger(a[lane], b[lane]);
    }
    for half in [4, 2, 1] {
        for lane in 0..half {
            least[lane] = smaller(least[lane], least[lane + half]);
            greatest[lane] = larger(greatest[lane], greatest[lane + half]);
        }
    }
    [least[0], greatest[0]]
}

impl ShearRow {
    /// [`Shear::intersect`] for every lane, with the same roundings.
    #[inline(always)]
    pub(super) fn cross<L: Lanes>(&self, lanes: L, relative: &[[f64; 3]; 3]) -> Crossings {
        let mut crossings = Crossings { lanes: 0, distance: [0.0; WIDTH], edges: [[0.0; WIDTH]; 3] };
        let (x, y, inverse) = (halves(&self.x), halves(&self.y), halves(&self.inverse));
        for half in 0..2 {
            let slopes = [lanes.load_double(&x[half]), lanes.load_double(&y[half])];
            let [a, b, c] = relative;
            let [[ax, ay], [bx, by], [cx, cy]] =
                [sheared(lanes, slopes, a), sheared(lanes, slopes, b), sheared(lanes, slopes, c)];
            let mut enough = u32::MAX;
            let mut edges = [
                rounded_edges(lanes, [cx, cy], [bx, by], &mut enough),
                rounded_edges(lanes, [ax, ay], [cx, cy], &mut enough),
                rounded_edges(lanes, [bx, by], [ax, ay], &mut enough),
            ];
            if enough & ALL != ALL {
                let [u, v, w] = exact_edges(&x[half], &y[half], relative);
                edges = [lanes.load_double(&u), lanes.load_double(&v), lanes.load_double(&w)];
            }
            let (distance, outside) = distances(lanes, edges, relative, lanes.load_double(&inverse[half]));
            crossings.lanes |= (!outside & ALL) << (half * HALF);
            let place = half * HALF..(half + 1) * HALF;
            crossings.distance[place.clone()].copy_from_slice(&lanes.store_double(distance));
            for (row, edge) in crossings.edges.iter_mut().zip(edges) {
                row[place.clone()].copy_from_slice(&lanes.store_double(edge));
            }
        }
        crossings
    }
}

const HALF: usize = WIDTH / 2;
/// Bit mask of all lanes of half a row.
const ALL: u32 = (1 << HALF) - 1;

#[inline(always)]
fn halves(row: &[f64; WIDTH]) -> [Half; 2] {
    let [a, b, c, d, e, f, g, h] = *row;
    [[a, b, c, d], [e, f, g, h]]
}

#[inline(always)]
fn sheared<L: Lanes>(lanes: L, [x, y]: [L::Double; 2], p: &[f64; 3]) -> [L::Double; 2] {
    let z = lanes.splat_double(p[2]);
    [
        lanes.sub_double(lanes.splat_double(p[0]), lanes.mul_double(x, z)),
        lanes.sub_double(lanes.splat_double(p[1]), lanes.mul_double(y, z)),
    ]
}

/// [`rounded_edge`]; clears the bits of lanes that cancel.
#[inline(always)]
fn rounded_edges<L: Lanes>(lanes: L, c: [L::Double; 2], b: [L::Double; 2], enough: &mut u32) -> L::Double {
    let (p, q) = (lanes.mul_double(c[0], b[1]), lanes.mul_double(c[1], b[0]));
    let difference = lanes.sub_double(p, q);
    let sum = lanes.add_double(lanes.abs_double(p), lanes.abs_double(q));
    let share = lanes.mul_double(lanes.splat_double(CANCELLATION), sum);
    *enough &= lanes.less_double(share, lanes.abs_double(difference));
    difference
}

/// Distances, NaN if all edge functions are zero, and the bit mask of lanes in which these have both signs.
#[inline(always)]
fn distances<L: Lanes>(
    lanes: L,
    [u, v, w]: [L::Double; 3],
    [a, b, c]: &[[f64; 3]; 3],
    inverse: L::Double,
) -> (L::Double, u32) {
    let u_term = lanes.mul_double(u, lanes.splat_double(a[2]));
    let v_term = lanes.mul_double(v, lanes.splat_double(b[2]));
    let w_term = lanes.mul_double(w, lanes.splat_double(c[2]));
    let sum = lanes.add_double(lanes.add_double(u_term, v_term), w_term);
    let determinant = lanes.add_double(lanes.add_double(u, v), w);
    let distance = lanes.mul_double(lanes.div_double(sum, determinant), inverse);
    let least = lanes.min_double(lanes.min_double(u, v), w);
    let greatest = lanes.max_double(lanes.max_double(u, v), w);
    let zero = lanes.splat_double(0.0);
    (distance, lanes.less_double(least, zero) & lanes.less_double(zero, greatest))
}

/// Edge functions where some cancel.
#[cold]
fn exact_edges(x: &Half, y: &Half, relative: &[[f64; 3]; 3]) -> [Half; 3] {
    let mut edges = [[0.0; HALF]; 3];
    for lane in 0..HALF {
        let [a, b, c] = relative.map(|p| [p[0] - x[lane] * p[2], p[1] - y[lane] * p[2], p[2]]);
        (edges[0][lane], edges[1][lane], edges[2][lane]) = (edge(c, b), edge(a, c), edge(b, a));
    }
    edges
}
