//! Nodes of the edge hierarchy: eight boxes with normal cones, tested in single precision.
//!
//! A node only rejects edges, with margins above its rounding. Lengths are relative to the hierarchy's centre
//! and size, so that squares in single precision neither vanish nor overflow where it matters.

use glam::DVec3;

use super::edge::{Cone, Edge};
use crate::lanes::{Lanes, Row, WIDTH};

/// Bounding box of edges, with a cone around the normals of their triangles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bounds {
    centre: DVec3,
    /// Half the box's extent.
    half: DVec3,
    /// Bounding radius about the centre.
    radius: f64,
    axis: DVec3,
    /// Sine of the cone's half angle; `None` if it exceeds a right angle or a border is among the edges.
    sine: Option<f64>,
    /// Heights along the axis relative to the centre: midpoint and half range.
    level: f64,
    thickness: f64,
}

impl Bounds {
    pub(super) fn around(edges: &[Edge]) -> Self {
        let places = || edges.iter().flat_map(|e| e.places);
        let low = places().fold(DVec3::INFINITY, DVec3::min);
        let high = places().fold(DVec3::NEG_INFINITY, DVec3::max);
        let normals = || edges.iter().flat_map(|e| e.normals);
        let axis = normals().sum::<DVec3>().normalize_or_zero();
        // The normals of a border are zero, and so is the cosine.
        let cosine = normals().map(|n| n.dot(axis)).fold(1.0, f64::min);
        let sine = (cosine > MARGIN).then(|| (1.0 - cosine * cosine).max(0.0).sqrt());
        let (centre, half) = (0.5 * (low + high), 0.5 * (high - low));
        let radius = places().map(|p| p.distance(centre)).fold(0.0, f64::max);
        let heights = || places().map(|p| axis.dot(p - centre));
        let bottom = heights().fold(f64::INFINITY, f64::min);
        let top = heights().fold(f64::NEG_INFINITY, f64::max);
        let (level, thickness) = (0.5 * (bottom + top), 0.5 * (top - bottom));
        Self { centre, half, radius, axis, sine, level, thickness }
    }

    /// Bounds without a normal cone, if silhouettes do not matter.
    pub(super) fn from_everywhere(edges: &[Edge]) -> Self {
        Self { sine: None, ..Self::around(edges) }
    }
}

/// Origin and inverse unit of single-precision lengths: centre and size of the box of all edges.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Frame {
    pub(super) middle: DVec3,
    pub(super) unit: f64,
}

impl Frame {
    /// A point as two numbers per coordinate, the second the rounding error of the first: relative precision
    /// 2⁻⁴⁸.
    fn place(&self, place: DVec3) -> [[f32; 2]; 3] {
        ((place - self.middle) * self.unit).to_array().map(|x| {
            let first = x as f32;
            [first, (x - f64::from(first)) as f32]
        })
    }
}

/// Bounds of eight children, and their indices.
#[derive(Clone, Debug)]
pub(super) struct Node {
    /// In double-single precision, as distances from the viewer matter.
    centre: [[Row; 2]; 3],
    half: [Row; 3],
    radius: Row,
    axis: [Row; 3],
    cosine: Row,
    sine: Row,
    level: Row,
    thickness: Row,
    /// Indices of nodes, or leaves.
    pub(super) child: [u32; WIDTH],
    children: u32,
}

impl Node {
    pub(super) fn new(bounds: impl Iterator<Item = Bounds>, frame: &Frame) -> Self {
        let row = [0.0; WIDTH];
        let mut node = Self {
            centre: [[row; 2]; 3],
            half: [row; 3],
            radius: row,
            axis: [row; 3],
            cosine: row,
            sine: row,
            level: row,
            thickness: row,
            child: [0; WIDTH],
            children: 0,
        };
        let wider = 1.0 + 2.0 * MARGIN;
        for (lane, b) in bounds.enumerate() {
            for (k, [first, rest]) in frame.place(b.centre).into_iter().enumerate() {
                node.centre[k][0][lane] = first;
                node.centre[k][1][lane] = rest;
                node.half[k][lane] = (b.half[k] * frame.unit * wider) as f32;
                node.axis[k][lane] = b.axis[k] as f32;
            }
            node.radius[lane] = (b.radius * frame.unit * wider + LEAST_RADIUS) as f32;
            node.level[lane] = (b.level * frame.unit) as f32;
            node.thickness[lane] = (b.thickness * frame.unit) as f32;
            // A right angle rejects nothing.
            let sine = b.sine.unwrap_or(1.0);
            (node.cosine[lane], node.sine[lane]) = ((1.0 - sine * sine).sqrt() as f32, sine as f32);
            node.children |= 1 << lane;
        }
        node
    }
}

/// A cone in the form in which nodes are tested.
pub(super) struct Query {
    origin: [[f32; 2]; 3],
    axis: [f32; 3],
    sine: f32,
    cosine: f32,
    /// Normals, and heights of the origin.
    planes: [([f32; 3], f32); PLANES],
    count: usize,
    margin: f32,
}

/// Largest number of planes tested: omitted ones reject nothing.
const PLANES: usize = 2;

/// Bound on the rounding of single precision over a few operations, relative to the distance of the farthest
/// point of a box: 33 units of rounding.
const MARGIN: f64 = 2e-6;

/// Least radius of boxes: their margins then exceed 10⁻¹⁴, the error of double-single coordinates.
const LEAST_RADIUS: f64 = 1e-8;

/// Distance whose square is far from overflow; nothing is rejected from farther away.
const FARTHEST: f64 = 1e6;

/// Numbers must exceed this to reject anything.
const ABOVE: f32 = f32::MIN_POSITIVE;

impl Query {
    pub(super) fn new(cone: &Cone<'_>, frame: &Frame) -> Self {
        let mut planes = [([0.0; 3], 0.0); PLANES];
        for (place, plane) in planes.iter_mut().zip(cone.planes) {
            let height = frame.unit * plane.height(cone.origin);
            // Rounded up.
            let height = (height + MARGIN * height.abs()) as f32;
            *place = (single(plane.normal), height);
        }
        let reach = cone.reach;
        let is_far = ((cone.origin - frame.middle) * frame.unit).abs().max_element() > FARTHEST;
        Self {
            origin: frame.place(cone.origin),
            axis: single(cone.axis),
            sine: reach.sine as f32,
            cosine: reach.cosine as f32,
            planes,
            count: cone.planes.len().min(PLANES),
            margin: if is_far { f32::INFINITY } else { MARGIN as f32 },
        }
    }

    /// Bit mask of the children that may have an edge within the cone, in front of its planes, that is or may
    /// be a silhouette.
    #[inline(always)]
    pub(super) fn entered<L: Lanes>(&self, l: L, node: &Node) -> u32 {
        let margin = l.splat(self.margin);
        let axis = splat(l, self.axis);
        let (sine, cosine) = (l.splat(self.sine), l.splat(self.cosine));
        let above = l.splat(ABOVE);
        let [x, y, z] = &node.half;
        let half = [l.load(x), l.load(y), l.load(z)];
        let radius = l.load(&node.radius);
        let way = [self.way(l, node, 0), self.way(l, node, 1), self.way(l, node, 2)];
        // Components along the cone's axis and across it.
        let along = dot(l, axis, way);
        let across = [
            l.mul_sub_from(along, axis[0], way[0]),
            l.mul_sub_from(along, axis[1], way[1]),
            l.mul_sub_from(along, axis[2], way[2]),
        ];
        let apart = l.sqrt(dot(l, across, across));
        // At least the distance of the centre.
        let distance = l.add(l.abs(along), apart);
        let slack = l.mul(margin, l.add(distance, radius));
        // A plane that touches the cone on the side of the box, with normal n = across cos R − axis sin R
        // |across|. `across` has the rounding error of `way`, which rotates n by that over |across|.
        let leaning = l.mul(sine, apart);
        let n = [
            l.mul_sub(across[0], cosine, l.mul(axis[0], leaning)),
            l.mul_sub(across[1], cosine, l.mul(axis[1], leaning)),
            l.mul_sub(across[2], cosine, l.mul(axis[2], leaning)),
        ];
        let outside = l.sub(dot(l, n, way), dot(l, abs(l, n), half));
        let outside = l.mul_sub_from(slack, l.add(apart, distance), outside);
        let mut refused = l.less_equal(above, outside);
        for (n, level) in &self.planes[..self.count] {
            let n = splat(l, *n);
            // Heights over the plane of the highest point, and of the origin.
            let top = l.add(dot(l, n, way), dot(l, abs(l, n), half));
            let top = l.add(l.add(top, l.splat(*level)), slack);
            refused |= l.less_equal(top, l.splat(-ABOVE));
        }
        let [x, y, z] = &node.axis;
        let normal = [l.load(x), l.load(y), l.load(z)];
        let height = dot(l, normal, way);
        // With β the half angle of the box's ball seen from the origin, and θ that of the normal cone: all
        // triangles show their fronts, or all their backs, unless the angle between way and normal is within
        // θ + β of a right angle. Everything is times the distance; the tangent to the ball is cos β.
        let zero = l.splat(0.0);
        let tangent = l.sqrt(l.max(l.mul_sub_from(radius, radius, dot(l, way, way)), zero));
        let (narrow, wide) = (l.load(&node.cosine), l.load(&node.sine));
        let limit = l.mul_add(l.mul(margin, l.splat(4.0)), distance, l.mul(narrow, radius));
        let limit = l.mul_add(wide, tangent, limit);
        let is_wide = l.less_equal(l.mul(narrow, tangent), l.mul(wide, radius));
        refused |= l.less_equal(limit, l.abs(height)) & !is_wide;
        // The cone's height along the normal, on either side, grows with distance: a child is refused if at
        // its distance the cone is above all of it. The last term is multiplied by the slope.
        let slope = dot(l, axis, normal);
        let up = l.abs(slope);
        let flat = l.max(l.mul_sub_from(slope, slope, l.splat(1.0)), zero);
        let steepness = l.sqrt(l.mul_add(margin, l.splat(4.0), flat));
        let rise = l.mul_sub(up, cosine, l.mul(steepness, sine));
        let nearest = l.max(l.sub(l.max(along, apart), radius), zero);
        let thick = l.mul_add(slack, l.splat(2.0), l.load(&node.thickness));
        let over = l.mul(up, l.mul_sub(rise, nearest, thick));
        let over = l.mul_sub_from(slope, l.add(height, l.load(&node.level)), over);
        refused |= l.less_equal(above, over) & l.less_equal(above, rise);
        node.children & !refused
    }

    /// One coordinate of the vectors to the centres.
    #[inline(always)]
    fn way<L: Lanes>(&self, l: L, node: &Node, k: usize) -> L::Float {
        let ([first, rest], origin) = (&node.centre[k], self.origin[k]);
        l.add(l.sub(l.load(first), l.splat(origin[0])), l.sub(l.load(rest), l.splat(origin[1])))
    }
}

type Vector<L> = [<L as Lanes>::Float; 3];

#[inline(always)]
fn splat<L: Lanes>(l: L, [x, y, z]: [f32; 3]) -> Vector<L> {
    [l.splat(x), l.splat(y), l.splat(z)]
}

#[inline(always)]
fn abs<L: Lanes>(l: L, [x, y, z]: Vector<L>) -> Vector<L> {
    [l.abs(x), l.abs(y), l.abs(z)]
}

#[inline(always)]
fn dot<L: Lanes>(l: L, a: Vector<L>, b: Vector<L>) -> L::Float {
    l.mul_add(a[0], b[0], l.mul_add(a[1], b[1], l.mul(a[2], b[2])))
}

fn single(v: DVec3) -> [f32; 3] {
    v.as_vec3().to_array()
}

#[cfg(test)]
mod tests {
    use flatland::random::{Stream, open01, stream};

    use super::*;
    use crate::gradient::warp::jump_mean::arc::AngularSupport;
    use crate::gradient::warp::jump_mean::edge::HalfSpace;
    use crate::lanes::{Instructions, Task};
    use crate::scene::{NONE, Span};

    struct Entered<'a>(&'a Query, &'a Node);

    impl Task for Entered<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> u32 {
            self.0.entered(lanes, self.1)
        }
    }

    fn point(rng: &mut Stream) -> DVec3 {
        DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(rng) - 1.0))
    }

    /// Edges near a point: borders, or with normals that differ by `spread`.
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

    /// Whether some point of the edge is well within the cone and in front of the planes.
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
                let frame = Frame { middle: scale * DVec3::ONE, unit: 1.0 / (6.0 * scale) };
                let node = Node::new(groups.iter().map(|g| Bounds::around(g)), &frame);
                // Near the edges in half of the trials, also within their box.
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
                let entered = Instructions::detect().run(Entered(&Query::new(&cone, &frame), &node));
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
