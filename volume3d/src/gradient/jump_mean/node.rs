//! Nodes of the hierarchy of edges: eight boxes with cones of normals, refused in single precision.
//!
//! A node only ever decides what need not be looked at, with margins above its rounding. Lengths are in units of the
//! scene, so that squares in single precision neither vanish nor overflow where it matters.

use glam::DVec3;

use super::edge::{Cone, Edge};
use crate::lanes::{Instructions, Lanes, Task};

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

    /// The same without a cone: whether edges are silhouettes does not matter.
    pub(super) fn from_everywhere(edges: &[Edge]) -> Self {
        Self { axis: DVec3::ZERO, sine: None, ..Self::around(edges) }
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
    /// Nodes, or leaves.
    pub(super) child: [u32; WIDTH],
    children: u32,
}

impl Node {
    /// `unit` is one over the size of the scene.
    pub(super) fn new(bounds: impl Iterator<Item = Bounds>, unit: f64) -> Self {
        let row = [0.0; WIDTH];
        let mut node = Self {
            centre: [[0.0; WIDTH]; 3],
            half: [row; 3],
            radius: row,
            axis: [row; 3],
            cosine: row,
            sine: row,
            child: [0; WIDTH],
            children: 0,
        };
        for (lane, b) in bounds.enumerate() {
            for k in 0..3 {
                node.centre[k][lane] = b.centre[k];
                node.half[k][lane] = (b.half[k] * unit) as f32;
                node.axis[k][lane] = b.axis[k] as f32;
            }
            node.radius[lane] = (b.half.length() * unit) as f32;
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
    unit: f64,
    axis: [f32; 3],
    sine: f32,
    cosine: f32,
    /// Normals, and heights of the origin.
    planes: [([f32; 3], f32); PLANES],
    count: usize,
}

/// The most planes that are compared: those left out refuse nothing.
const PLANES: usize = 2;

/// What rounding to single precision, and a few operations after it, may be off by, relative to the distance of the
/// farthest point of a box.
const MARGIN: f64 = 2e-6;

impl Query {
    pub(super) fn new(cone: &Cone<'_>, unit: f64) -> Self {
        let mut planes = [([0.0; 3], 0.0); PLANES];
        for (place, plane) in planes.iter_mut().zip(cone.planes) {
            let height = unit * plane.height(cone.origin);
            // Rounded up.
            let height = (height + MARGIN * height.abs()) as f32;
            *place = (single(plane.normal), height);
        }
        let reach = cone.reach;
        Self {
            origin: cone.origin.to_array(),
            unit,
            axis: single(cone.axis),
            sine: reach.sine as f32,
            cosine: reach.cosine as f32,
            planes,
            count: cone.planes.len().min(PLANES),
        }
    }

    /// The children that may have a silhouette within the cone and before its planes, as bits.
    pub(super) fn entered(&self, node: &Node, instructions: Instructions) -> u32 {
        instructions.run(Entered(self, node))
    }

    /// Written for the compiler to vectorise, for the instructions of the machine.
    #[inline(always)]
    fn test(&self, node: &Node) -> u32 {
        let margin = MARGIN as f32;
        let mut way = [[0.0_f32; WIDTH]; 3];
        for (k, way) in way.iter_mut().enumerate() {
            for (way, centre) in way.iter_mut().zip(node.centre[k]) {
                *way = ((centre - self.origin[k]) * self.unit) as f32;
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
            let slack = margin * (distance[l] + node.radius[l]) * (1.0 + distance[l] / apart);
            outside[l] = height - support * (1.0 + margin) - slack;
        }
        for ([nx, ny, nz], level) in &self.planes[..self.count] {
            for l in 0..WIDTH {
                let height = level + nx * x[l] + ny * y[l] + nz * z[l];
                let support = hx[l] * nx.abs() + hy[l] * ny.abs() + hz[l] * nz.abs();
                let behind = -height - support * (1.0 + margin) - margin * (distance[l] + node.radius[l]);
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

struct Entered<'a>(&'a Query, &'a Node);

impl Task for Entered<'_> {
    type Output = u32;

    #[inline(always)]
    fn run<L: Lanes>(self, _: L) -> u32 {
        self.0.test(self.1)
    }
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

#[cfg(test)]
mod tests {
    use flatland::random::{Stream, open01, stream};

    use super::super::arc::AngularSupport;
    use super::super::edge::HalfSpace;
    use super::*;
    use crate::scene::{NONE, Span};

    fn point(rng: &mut Stream) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
    }

    /// Edges near a point; borders, or with normals that differ by `spread`.
    fn edges(rng: &mut Stream, scale: f64, spread: Option<f64>) -> Vec<Edge> {
        let (centre, size) = (3.0 * point(rng), 10_f64.powf(2.0 * open01(rng) - 2.5));
        let normal = point(rng).normalize();
        (0..4)
            .map(|_| {
                let places = [0, 1].map(|_| scale * (centre + size * point(rng)));
                let normals = spread.map_or([DVec3::ZERO; 2], |spread| {
                    [0, 1].map(|_| (normal + spread * point(rng)).normalize())
                });
                Edge {
                    span: Span::Edge([0, 1]),
                    places,
                    normals,
                    faces: [NONE; 2],
                    owners: [NONE; 2],
                    seam: false,
                }
            })
            .collect()
    }

    /// Whether some point of the edge is well within the cone and before the planes.
    fn counts(edge: &Edge, cone: &Cone<'_>) -> bool {
        edge.is_silhouette(cone)
            && (0..=16).any(|i| {
                let p = edge.places[0].lerp(edge.places[1], f64::from(i) / 16.0);
                let way = (p - cone.origin).normalize();
                way.distance(cone.axis) < 2.0 * (0.5 * cone.reach.angle).sin()
                    && cone.planes.iter().all(|plane| plane.height(p) > 0.0)
            })
    }

    #[test]
    fn nothing_that_counts_is_refused() {
        let mut rng = stream(8, &[]);
        for scale in [1.0, 1e-30, 1e30] {
            let (mut counted, mut refused) = (0, 0);
            for trial in 0..20_000 {
                let spread = [None, Some(0.01), Some(0.5)][trial % 3];
                let groups: Vec<Vec<Edge>> = (0..WIDTH).map(|_| edges(&mut rng, scale, spread)).collect();
                let unit = 1.0 / (6.0 * scale);
                let node = Node::new(groups.iter().map(|g| Bounds::around(g)), unit);
                // Near the edges now and then, also within their box.
                let near = groups[0][0].places[0] + 0.01 * scale * point(&mut rng);
                let origin = if trial % 2 == 0 { near } else { scale * 4.0 * point(&mut rng) };
                let towards = groups[trial % WIDTH][1].places[1] - origin;
                let axis = (towards.normalize() + 0.2 * open01(&mut rng) * point(&mut rng)).normalize();
                let plane = HalfSpace {
                    normal: point(&mut rng).normalize(),
                    point: scale * point(&mut rng),
                    slack: 0.0,
                };
                let cone = Cone {
                    origin,
                    axis,
                    reach: AngularSupport::new(10_f64.powf(-4.0 * open01(&mut rng))),
                    planes: &[plane][..trial % 2],
                    rounding: 1e-13 * scale,
                };
                let entered = Query::new(&cone, unit).entered(&node, Instructions::detect());
                for (lane, group) in groups.iter().enumerate() {
                    let needed = group.iter().any(|edge| counts(edge, &cone));
                    let kept = entered >> lane & 1 == 1;
                    assert!(kept || !needed, "scale {scale:e}, trial {trial}, child {lane}");
                    counted += usize::from(needed);
                    refused += usize::from(!kept);
                }
            }
            println!("scale {scale:e}: {counted} count, {refused} refused");
            assert!(counted > 3_000 && refused > 50_000, "{counted} {refused}");
        }
    }
}
