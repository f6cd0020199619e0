//! Distance to triangles and generalised winding number, on one tree of boxes.

use std::f64::consts::PI;

use glam::DVec3;

use super::Mesh;

/// Distance and winding-number queries of a mesh. Triangles without area are ignored.
#[derive(Clone, Debug)]
pub struct Proximity {
    /// Two children per node, up to [`LEAF`] triangles per leaf.
    nodes: Vec<Node>,
    triangles: Vec<[DVec3; 3]>,
}

#[derive(Clone, Debug)]
struct Node {
    low: DVec3,
    high: DVec3,
    /// Sum of the triangles' normals, each weighted by its area.
    area: DVec3,
    /// Area-weighted mean of the triangles' centres.
    centre: DVec3,
    /// Bounding radius about the centre.
    radius: f64,
    /// Range of the node's triangles.
    begin: usize,
    end: usize,
    /// Index of the second child, the first being the next node; 0 for a leaf.
    second: usize,
}

const LEAF: usize = 4;

/// Distance, in radii, beyond which a node is approximated by a dipole: the factor of Barill et al. (2018).
const FAR: f64 = 2.0;

impl Proximity {
    /// Builds the tree of a mesh; `None` if it has no triangle with an area.
    #[must_use]
    pub fn new(mesh: &Mesh) -> Option<Self> {
        let corners = mesh.triangles().iter().map(|t| t.map(|i| mesh.positions()[i as usize]));
        let mut triangles: Vec<_> = corners.filter(|[a, b, c]| (b - a).cross(c - a) != DVec3::ZERO).collect();
        let count = triangles.len();
        if count == 0 {
            return None;
        }
        let mut nodes = vec![];
        split(&mut nodes, &mut triangles, 0, count);
        Some(Self { nodes, triangles })
    }

    /// Lower and upper corner of the bounding box of all triangles.
    #[must_use]
    pub fn bounds(&self) -> (DVec3, DVec3) {
        (self.nodes[0].low, self.nodes[0].high)
    }

    /// Distance of a point to the nearest triangle.
    #[must_use]
    pub fn distance(&self, x: DVec3) -> f64 {
        self.distance_squared_below(x, f64::INFINITY).sqrt()
    }

    /// Squared distance to the nearest triangle, if that is below `bound`, else `bound`.
    pub(crate) fn distance_squared_below(&self, x: DVec3, bound: f64) -> f64 {
        let mut nearest = bound;
        self.descend(x, 0, &mut nearest);
        nearest
    }

    fn descend(&self, x: DVec3, index: usize, nearest: &mut f64) {
        let node = &self.nodes[index];
        if node.second == 0 {
            for corners in &self.triangles[node.begin..node.end] {
                *nearest = nearest.min(x.distance_squared(closest_point(x, corners)));
            }
            return;
        }
        let away = |child: usize| self.nodes[child].away(x);
        let [mut first, mut second] = [index + 1, node.second].map(|child| (away(child), child));
        if second.0 < first.0 {
            (first, second) = (second, first);
        }
        for (away, child) in [first, second] {
            if away < *nearest {
                self.descend(x, child, nearest);
            }
        }
    }

    /// Sum of the solid angles of the triangles at x, divided by 4π (Jacobson et al. 2013): 1 inside a closed
    /// mesh that faces outwards, 0 outside, and in between where the mesh has holes. Distant parts are
    /// approximated by dipoles (Barill et al. 2018).
    #[must_use]
    pub fn winding_number(&self, x: DVec3) -> f64 {
        self.solid_angle(x, 0) / (4.0 * PI)
    }

    fn solid_angle(&self, x: DVec3, index: usize) -> f64 {
        let node = &self.nodes[index];
        let to = node.centre - x;
        let square = to.length_squared();
        if square > (FAR * node.radius).powi(2) {
            return node.area.dot(to) / (square * square.sqrt());
        }
        if node.second == 0 {
            return self.triangles[node.begin..node.end].iter().map(|corners| solid_angle(x, corners)).sum();
        }
        self.solid_angle(x, index + 1) + self.solid_angle(x, node.second)
    }
}

impl Node {
    /// Squared distance to the box.
    fn away(&self, x: DVec3) -> f64 {
        x.distance_squared(x.clamp(self.low, self.high))
    }
}

fn split(nodes: &mut Vec<Node>, triangles: &mut [[DVec3; 3]], begin: usize, end: usize) {
    let mine = &mut triangles[begin..end];
    let corners = || mine.iter().flatten().copied();
    let low = corners().fold(DVec3::INFINITY, DVec3::min);
    let high = corners().fold(DVec3::NEG_INFINITY, DVec3::max);
    let (mut area, mut weighted, mut total) = (DVec3::ZERO, DVec3::ZERO, 0.0);
    for [a, b, c] in &*mine {
        let normal = 0.5 * (b - a).cross(c - a);
        let size = normal.length();
        area += normal;
        weighted += size * (a + b + c) / 3.0;
        total += size;
    }
    let centre = if total > 0.0 { weighted / total } else { 0.5 * (low + high) };
    let radius = corners().map(|p| p.distance(centre)).fold(0.0, f64::max);
    let index = nodes.len();
    nodes.push(Node { low, high, area, centre, radius, begin, end, second: 0 });
    if mine.len() <= LEAF {
        return;
    }
    let extent = high - low;
    let axis = extent.max_position();
    let middle = mine.len() / 2;
    let along = |[a, b, c]: &[DVec3; 3]| a[axis] + b[axis] + c[axis];
    mine.select_nth_unstable_by(middle, |s, t| along(s).total_cmp(&along(t)));
    split(nodes, triangles, begin, begin + middle);
    nodes[index].second = nodes.len();
    split(nodes, triangles, begin + middle, end);
}

/// The point of a triangle that is nearest to x (Ericson, Real-Time Collision Detection, 5.1.5).
pub(crate) fn closest_point(x: DVec3, &[a, b, c]: &[DVec3; 3]) -> DVec3 {
    let (ab, ac, ax) = (b - a, c - a, x - a);
    let (d1, d2) = (ab.dot(ax), ac.dot(ax));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let (d3, d4) = (ab.dot(x - b), ac.dot(x - b));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let (d5, d6) = (ab.dot(x - c), ac.dot(x - c));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    a + (ab * vb + ac * vc) / (va + vb + vc)
}

/// Signed solid angle of a triangle (van Oosterom and Strackee 1983), positive if x is behind it.
pub(crate) fn solid_angle(x: DVec3, corners: &[DVec3; 3]) -> f64 {
    let [a, b, c] = corners.map(|p| p - x);
    let [la, lb, lc] = [a, b, c].map(DVec3::length);
    let volume = a.dot(b.cross(c));
    2.0 * volume.atan2(la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb)
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;

    #[test]
    fn the_closest_point_is_closer_than_all_others() {
        let mut rng = stream(3, &[]);
        let mut random = || DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(&mut rng) - 1.0));
        for _ in 0..200 {
            let (p, corners @ [a, b, c]) = (random(), [random(), random(), random()]);
            let least = p.distance(closest_point(p, &corners));
            let others = (0..=40).flat_map(|i| (0..=40 - i).map(move |j| [f64::from(i), f64::from(j)]));
            let point = |[u, v]: [f64; 2]| a + (b - a) * (u / 40.0) + (c - a) * (v / 40.0);
            let nearest = others.map(|uv| p.distance(point(uv))).fold(f64::INFINITY, f64::min);
            assert!(least <= nearest + 1e-12 && nearest < least + 0.1, "{least} {nearest}");
        }
    }

    #[test]
    fn the_tree_finds_what_a_search_of_all_finds() {
        let mut rng = stream(4, &[]);
        let mut random = || DVec3::from_array(std::array::from_fn(|_| 2.0 * open01(&mut rng) - 1.0));
        let positions: Vec<DVec3> = (0..300).map(|_| random()).collect();
        let triangles: Vec<[u32; 3]> = (0..300).collect::<Vec<u32>>().as_chunks::<3>().0.to_vec();
        let mesh = Mesh::new(positions.clone(), triangles.clone()).unwrap();
        let proximity = Proximity::new(&mesh).unwrap();
        for _ in 0..200 {
            let p = 2.0 * random();
            let all =
                triangles.iter().map(|t| p.distance(closest_point(p, &t.map(|i| positions[i as usize]))));
            assert_eq!(proximity.distance(p), all.fold(f64::INFINITY, f64::min));
        }
        let point = Mesh::new(vec![DVec3::ZERO; 3], vec![[0, 1, 2]]).unwrap();
        assert!(Proximity::new(&point).is_none());
        let around = Proximity::new(&Mesh::cube()).unwrap();
        assert!((around.winding_number(DVec3::splat(0.3)) - 1.0).abs() < 1e-12);
        assert!(around.winding_number(DVec3::new(1.5, 0.2, 0.1)).abs() < 1e-12);
        assert_eq!(around.bounds(), (DVec3::NEG_ONE, DVec3::ONE));
    }
}
