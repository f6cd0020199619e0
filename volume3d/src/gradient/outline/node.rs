//! Nodes of the hierarchy of edges: eight boxes with cones of normals, refused in single precision.
//!
//! A node only ever decides what need not be looked at, so that its margins cost time and nothing else.

use glam::DVec3;

use super::tree::{Cone, Edge};

/// Children of a node.
pub(super) const WIDTH: usize = 8;

type Row = [f32; WIDTH];

/// A box around edges, with a cone around the normals of their triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    centre: DVec3,
    /// Half the box's extent.
    half: DVec3,
    axis: DVec3,
    /// Sine of the cone's half angle; nothing if it is wider than a quarter turn, or a border is among the edges.
    sine: Option<f64>,
}

impl Bounds {
    pub(super) fn around(edges: &[Edge]) -> Self {
        let places = || edges.iter().flat_map(|e| e.places);
        let low = places().fold(DVec3::INFINITY, DVec3::min);
        let high = places().fold(DVec3::NEG_INFINITY, DVec3::max);
        let normals = || edges.iter().flat_map(|e| e.normals);
        let axis = normals().sum::<DVec3>().normalize_or_zero();
        // A border's normals are zero, and so is its cosine.
        let cosine = normals().map(|n| n.dot(axis)).fold(1.0, f64::min);
        let sine = (cosine > MARGIN).then(|| (1.0 - cosine * cosine).max(0.0).sqrt());
        Self { centre: 0.5 * (low + high), half: 0.5 * (high - low), axis, sine }
    }
}

/// The bounds of eight children, and where these are.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// In double precision, as what counts is how far away they are.
    centre: [[f64; WIDTH]; 3],
    half: [Row; 3],
    radius: Row,
    axis: [Row; 3],
    cosine: Row,
    sine: Row,
    /// A node, or the first edge of a leaf.
    pub(super) first: [u32; WIDTH],
    /// Edges of a leaf; 0 for a node.
    pub(super) count: [u32; WIDTH],
    children: u32,
}

impl Node {
    pub(super) fn new(bounds: impl Iterator<Item = Bounds>) -> Self {
        let row = [0.0; WIDTH];
        let mut node = Self {
            centre: [[0.0; WIDTH]; 3],
            half: [row; 3],
            radius: row,
            axis: [row; 3],
            cosine: row,
            sine: row,
            first: [0; WIDTH],
            count: [0; WIDTH],
            children: 0,
        };
        for (lane, b) in bounds.enumerate() {
            for k in 0..3 {
                node.centre[k][lane] = b.centre[k];
                node.half[k][lane] = b.half[k] as f32;
                node.axis[k][lane] = b.axis[k] as f32;
            }
            node.radius[lane] = b.half.length() as f32;
            // With a right angle nothing is ever left out.
            let sine = b.sine.unwrap_or(1.0);
            (node.cosine[lane], node.sine[lane]) = ((1.0 - sine * sine).sqrt() as f32, sine as f32);
            node.children |= 1 << lane;
        }
        node
    }
}

/// A cone as nodes are compared with it.
pub(super) struct Query {
    origin: [f64; 3],
    axis: [f32; 3],
    sine: f32,
    cosine: f32,
    /// Normals, and heights of the origin.
    planes: [([f32; 3], f32); PLANES],
    count: usize,
}

/// The most planes that are compared: those left out refuse nothing.
const PLANES: usize = 2;

/// What rounding to single precision, and a few operations after it, may be off by, relative to lengths that enter.
const MARGIN: f64 = 2e-6;

impl Query {
    pub(super) fn new(cone: &Cone<'_>) -> Self {
        let mut planes = [([0.0; 3], 0.0); PLANES];
        for (place, plane) in planes.iter_mut().zip(cone.planes) {
            let height = plane.height(cone.origin);
            // Rounded up.
            let height = (height + MARGIN * height.abs()) as f32;
            *place = (single(plane.normal), height);
        }
        let reach = cone.reach;
        Self {
            origin: cone.origin.to_array(),
            axis: single(cone.axis),
            sine: reach.sine as f32,
            cosine: reach.cosine as f32,
            planes,
            count: cone.planes.len().min(PLANES),
        }
    }

    /// The children that may have a silhouette within the cone and before its planes, as bits. Written for the compiler
    /// to vectorise.
    pub(super) fn entered(&self, node: &Node) -> u32 {
        let margin = MARGIN as f32;
        let mut way = [[0.0_f32; WIDTH]; 3];
        for (k, way) in way.iter_mut().enumerate() {
            for (way, centre) in way.iter_mut().zip(node.centre[k]) {
                *way = (centre - self.origin[k]) as f32;
            }
        }
        let [x, y, z] = &way;
        let [hx, hy, hz] = &node.half;
        let mut distance = [0.0_f32; WIDTH];
        // By how much a child is outside of something: it is left out if that is above zero.
        let mut outside = [0.0_f32; WIDTH];
        let [ax, ay, az] = self.axis;
        for l in 0..WIDTH {
            // A plane that touches the cone on the side of the box, with a normal n ∝ across cos R/|across| − axis sin R.
            let along = x[l] * ax + y[l] * ay + z[l] * az;
            let (vx, vy, vz) = (x[l] - along * ax, y[l] - along * ay, z[l] - along * az);
            let apart = (vx * vx + vy * vy + vz * vz).sqrt() + f32::MIN_POSITIVE;
            distance[l] = (x[l] * x[l] + y[l] * y[l] + z[l] * z[l]).sqrt();
            let scale = self.cosine / apart;
            let (nx, ny, nz) =
                (vx * scale - ax * self.sine, vy * scale - ay * self.sine, vz * scale - az * self.sine);
            let height = nx * x[l] + ny * y[l] + nz * z[l];
            let support = hx[l] * nx.abs() + hy[l] * ny.abs() + hz[l] * nz.abs();
            // What is across is off by the rounding of the way, which turns n by that over |across|.
            let slack = margin * distance[l] * (1.0 + distance[l] / apart);
            outside[l] = height - support * (1.0 + margin) - slack;
        }
        for ([nx, ny, nz], level) in &self.planes[..self.count] {
            for l in 0..WIDTH {
                let height = level + nx * x[l] + ny * y[l] + nz * z[l];
                let support = hx[l] * nx.abs() + hy[l] * ny.abs() + hz[l] * nz.abs();
                let behind = -height - support * (1.0 + margin) - margin * distance[l];
                outside[l] = if behind > outside[l] { behind } else { outside[l] };
            }
        }
        let [nx, ny, nz] = &node.axis;
        let mut bits = [0_u32; WIDTH];
        for l in 0..WIDTH {
            // β, the half angle of the box's ball as seen from the origin, and θ, that of the cone of normals: every
            // triangle shows its front, or every one its back, unless the angle of way and axis is within θ + β of a
            // right one.
            let sine = node.radius[l] * (1.0 + margin) / (distance[l] + f32::MIN_POSITIVE);
            let cosine = (1.0 - sine * sine).max(0.0).sqrt();
            let across = (x[l] * nx[l] + y[l] * ny[l] + z[l] * nz[l]).abs();
            let limit = node.sine[l] * cosine + node.cosine[l] * sine + 4.0 * margin;
            let within_quarter = node.cosine[l] * cosine > node.sine[l] * sine;
            let one_sided = (sine < 1.0) & within_quarter & (across > limit * distance[l]);
            bits[l] = if (outside[l] > 0.0) | one_sided { 0 } else { 1 << l };
        }
        bits.into_iter().fold(0, |all, bit| all | bit) & node.children
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}
