//! Leaves of the edge hierarchy: four edges tested together in double precision.
//!
//! The tests for silhouettes and planes have the same bits as for single edges. The test for entering a cone
//! has margins above rounding.

use glam::DVec3;

use super::edge::{Cone, Edge, HalfSpace, Rest};
use crate::lanes::{Half, Lanes, WIDTH};

/// Edges per leaf.
pub(super) const LEAF: usize = WIDTH / 2;

/// Rounding margin for the sine of an angle to a great circle, and the cosine of an angle to a point.
const MARGIN: f64 = 1e-14;

pub(super) type Row = [Half; 3];

/// Up to four edges.
#[derive(Clone, Debug)]
pub(super) struct Leaf {
    places: [Row; 2],
    normals: [Row; 2],
    /// Bit mask of occupied lanes: the first ones.
    lanes: u32,
}

impl Leaf {
    pub(super) fn new(edges: &[Edge]) -> Self {
        let rows = |of: fn(&Edge) -> [DVec3; 2]| {
            [0, 1].map(|end| {
                [0, 1, 2].map(|k| std::array::from_fn(|lane| edges.get(lane).map_or(0.0, |e| of(e)[end][k])))
            })
        };
        let lanes = (1 << edges.len()) - 1;
        Self { places: rows(|e| e.places), normals: rows(|e| e.normals), lanes }
    }

    /// Number of edges.
    pub(super) fn len(&self) -> usize {
        self.lanes.count_ones() as usize
    }

    /// The edge in a lane, with what the leaf does not hold of it.
    #[inline(always)]
    pub(super) fn edge(&self, lane: usize, rest: Rest) -> Edge {
        let vector = |rows: &Row| DVec3::from_array(rows.map(|row| row[lane]));
        rest.with(
            [vector(&self.places[0]), vector(&self.places[1])],
            [vector(&self.normals[0]), vector(&self.normals[1])],
        )
    }

    /// Bit mask of the edges that may enter a cone in front of its planes and that are silhouettes from its
    /// origin, or that are none.
    #[inline(always)]
    pub(super) fn entering<L: Lanes>(&self, l: L, cone: &Cone<'_>, silhouettes: bool) -> u32 {
        let zero = l.splat_double(0.0);
        let places = [load(l, &self.places[0]), load(l, &self.places[1])];
        let origin = splat(l, cone.origin);
        let way = sub(l, places[0], origin);
        let (a, b) = (dot(l, load(l, &self.normals[0]), way), dot(l, load(l, &self.normals[1]), way));
        let away = l.min_double(l.abs_double(a), l.abs_double(b));
        // Both faces show the same side.
        let alike =
            l.less_double(zero, l.mul_double(a, b)) & l.less_double(l.splat_double(cone.rounding), away);
        let mut left = self.lanes & if silhouettes { !alike } else { alike };
        for plane in cone.planes {
            left &= is_before(l, plane, places[0]) | is_before(l, plane, places[1]);
        }
        if left == 0 {
            return 0;
        }
        // The great circle comes no nearer than its pole indicates.
        let axis = splat(l, cone.axis);
        let pole = cross(l, way, sub(l, places[1], places[0]));
        let across = dot(l, axis, pole);
        let reach = l.splat_double((cone.reach.sine + MARGIN).powi(2));
        left &= !l.less_double(l.mul_double(reach, dot(l, pole, pole)), l.mul_double(across, across));
        left & comes_near(l, cone, pole, way, sub(l, places[1], origin))
    }
}

/// Whether arcs may enter a cone, given vectors to their ends and along their poles: unless its nearest point
/// is between the ends, an arc comes no nearer than its ends.
#[inline(always)]
pub(super) fn comes_near<L: Lanes>(
    l: L,
    cone: &Cone<'_>,
    pole: Vector<L>,
    first: Vector<L>,
    last: Vector<L>,
) -> u32 {
    let (axis, zero) = (splat(l, cone.axis), l.splat_double(0.0));
    let along = cross(l, pole, axis);
    let between = l.less_double(dot(l, along, first), zero) & l.less_double(zero, dot(l, along, last));
    between | !(is_out(l, cone, axis, first) & is_out(l, cone, axis, last))
}

pub(super) type Vector<L> = [<L as Lanes>::Double; 3];

/// Whether points are in front of a plane.
#[inline(always)]
pub(super) fn is_before<L: Lanes>(l: L, plane: &HalfSpace, place: Vector<L>) -> u32 {
    let height = dot(l, splat(l, plane.normal), sub(l, place, splat(l, plane.point)));
    l.less_double(l.splat_double(0.0), l.add_double(height, l.splat_double(plane.slack)))
}

/// Whether points are outside a cone.
#[inline(always)]
fn is_out<L: Lanes>(l: L, cone: &Cone<'_>, axis: Vector<L>, way: Vector<L>) -> u32 {
    let along = dot(l, axis, way);
    let least = l.mul_double(l.splat_double((cone.reach.cosine - MARGIN).powi(2)), dot(l, way, way));
    l.less_double(along, l.splat_double(0.0)) | l.less_double(l.mul_double(along, along), least)
}

#[inline(always)]
pub(super) fn load<L: Lanes>(l: L, [x, y, z]: &Row) -> Vector<L> {
    [l.load_double(x), l.load_double(y), l.load_double(z)]
}

#[inline(always)]
pub(super) fn splat<L: Lanes>(l: L, v: DVec3) -> Vector<L> {
    [l.splat_double(v.x), l.splat_double(v.y), l.splat_double(v.z)]
}

#[inline(always)]
pub(super) fn sub<L: Lanes>(l: L, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [l.sub_double(a[0], b[0]), l.sub_double(a[1], b[1]), l.sub_double(a[2], b[2])]
}

#[inline(always)]
pub(super) fn dot<L: Lanes>(l: L, a: Vector<L>, b: Vector<L>) -> L::Double {
    let two = l.add_double(l.mul_double(a[0], b[0]), l.mul_double(a[1], b[1]));
    l.add_double(two, l.mul_double(a[2], b[2]))
}

#[inline(always)]
fn cross<L: Lanes>(l: L, a: Vector<L>, b: Vector<L>) -> Vector<L> {
    [minor(l, a, b, 1, 2), minor(l, a, b, 2, 0), minor(l, a, b, 0, 1)]
}

#[inline(always)]
fn minor<L: Lanes>(l: L, a: Vector<L>, b: Vector<L>, i: usize, j: usize) -> L::Double {
    l.sub_double(l.mul_double(a[i], b[j]), l.mul_double(a[j], b[i]))
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;
    use crate::gradient::warp::jump_mean::arc::{AngularSupport, Arc};
    use crate::gradient::warp::jump_mean::edge::Pole;
    use crate::lanes::{Instructions, Task};
    use crate::scene::{NONE, Span};

    struct Entering<'a>(&'a Leaf, &'a Cone<'a>, bool);

    impl Task for Entering<'_> {
        type Output = u32;

        #[inline(always)]
        fn run<L: Lanes>(self, lanes: L) -> u32 {
            self.0.entering(lanes, self.1, self.2)
        }
    }

    /// A rejected edge is no silhouette, or has no part in front of all planes, or its arc does not enter the
    /// cap.
    #[test]
    fn nothing_that_counts_is_refused() {
        let mut rng = stream(9, &[]);
        let mut point = || DVec3::from_array([(); 3].map(|()| 2.0 * open01(&mut rng) - 1.0));
        let (mut kept, mut refused) = (0, 0);
        for trial in 0..20_000 {
            let size = [0.02, 0.3, 1.0][trial % 3];
            let edges: Vec<Edge> = (0..1 + trial % LEAF)
                .map(|_| {
                    let middle = point();
                    let normals = [(); 2].map(|()| point().normalize());
                    Edge {
                        span: Span::Edge([0, 1]),
                        places: [(); 2].map(|()| middle + size * point()),
                        normals: if trial % 5 == 0 { [DVec3::ZERO; 2] } else { normals },
                        faces: [NONE; 2],
                        owners: [NONE; 2],
                        seam: false,
                    }
                })
                .collect();
            let leaf = Leaf::new(&edges);
            let origin = 2.0 * point();
            let axis = (edges[0].places[trial % 2] - origin + 0.2 * point()).normalize();
            let planes = [(); 2].map(|()| HalfSpace { normal: point(), point: point(), slack: 0.01 });
            let reach = AngularSupport::new([1.1, 0.2, 0.01][trial / 3 % 3]);
            let cone = Cone { origin, axis, reach, planes: &planes[..trial % 3], rounding: 1e-13 };
            for silhouettes in [true, false] {
                let entering = Instructions::detect().run(Entering(&leaf, &cone, silhouettes));
                assert_eq!(entering >> edges.len(), 0);
                for (lane, edge) in edges.iter().enumerate() {
                    let [a, b] = edge.places;
                    let Pole(pole) = Pole::new(edge.places, origin);
                    let ends = [a, b].map(|end| (end - origin).normalize());
                    let enters = Arc { ends, pole }.moments(axis, reach).is_some();
                    let is_behind = |plane: &HalfSpace| plane.height(a) <= 0.0 && plane.height(b) <= 0.0;
                    let counts = enters
                        && edge.is_silhouette(&cone) == silhouettes
                        && !cone.planes.iter().any(is_behind);
                    assert_eq!(entering >> lane & 1 == 1, counts, "trial {trial}, edge {lane}");
                    kept += usize::from(counts);
                    refused += usize::from(!counts);
                }
            }
        }
        println!("{kept} kept, {refused} refused");
        assert!(kept > 1_000 && refused > 50_000, "{kept} {refused}");
    }
}
