//! Silhouettes from one viewpoint, looked up once for many directions and tested four at a time.

use glam::DVec3;

use super::edge::{Cone, Edge, Pole};
use super::leaf::{Row, comes_near, dot, is_before, load, splat, sub};
use crate::lanes::{Instructions, Lanes, Task, WIDTH};

/// Silhouettes per group.
const GROUP: usize = WIDTH / 2;
/// Groups tested together: one bit per silhouette.
const TOGETHER: usize = u64::BITS as usize / GROUP;

/// Silhouettes from one viewpoint, with the poles of their great circles.
#[derive(Debug, Default)]
pub(crate) struct Listed {
    edges: Vec<Edge>,
    groups: Vec<Group>,
    instructions: Instructions,
}

/// Data for testing four silhouettes.
#[derive(Debug)]
struct Group {
    /// NaN in unused lanes.
    poles: Row,
    places: [Row; 2],
}

impl Group {
    const NONE: Self = Self { poles: [[f64::NAN; GROUP]; 3], places: [[[0.0; GROUP]; 3]; 2] };

    fn set(&mut self, lane: usize, pole: DVec3, places: [DVec3; 2]) {
        let [first, last] = &mut self.places;
        for (rows, vector) in [(&mut self.poles, pole), (first, places[0]), (last, places[1])] {
            for (row, component) in rows.iter_mut().zip(vector.to_array()) {
                row[lane] = component;
            }
        }
    }

    fn pole(&self, lane: usize) -> Pole {
        Pole(DVec3::from_array(self.poles.map(|row| row[lane])))
    }
}

impl Listed {
    /// Removes all.
    pub(crate) fn clear(&mut self) {
        self.edges.clear();
        self.groups.clear();
    }

    /// Adds one, as seen from a viewpoint.
    pub(crate) fn push(&mut self, edge: &Edge, origin: DVec3) {
        let lane = self.edges.len() % GROUP;
        if lane == 0 {
            self.groups.push(Group::NONE);
        }
        let Pole(pole) = Pole::new(edge.places, origin);
        if let Some(group) = self.groups.last_mut() {
            group.set(lane, pole, edge.places);
        }
        self.edges.push(*edge);
    }

    /// Calls back with every silhouette that may enter a cone in front of all its planes.
    pub(super) fn for_each(&self, cone: &Cone<'_>, mut f: impl FnMut(&Edge, Pole)) {
        let groups = self.groups.chunks(TOGETHER);
        for (groups, edges) in groups.zip(self.edges.chunks(TOGETHER * GROUP)) {
            let mut near = self.instructions.run(Near { groups, cone });
            while near != 0 {
                let index = near.trailing_zeros() as usize;
                near &= near - 1;
                f(&edges[index], groups[index / GROUP].pole(index % GROUP));
            }
        }
    }
}

/// Bit mask of up to 64 silhouettes that may count.
struct Near<'a> {
    groups: &'a [Group],
    cone: &'a Cone<'a>,
}

impl Task for Near<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> u64 {
        let Self { groups, cone } = self;
        let (axis, origin) = (splat(lanes, cone.axis), splat(lanes, cone.origin));
        let sine = lanes.splat_double(cone.reach.sine);
        let mut near = 0;
        for (group, first) in groups.iter().zip((0..).step_by(GROUP)) {
            let pole = load(lanes, &group.poles);
            // |u·p| < sin R: most end here.
            let mut left = lanes.less_double(lanes.abs_double(dot(lanes, axis, pole)), sine);
            if left != 0 {
                let places = [load(lanes, &group.places[0]), load(lanes, &group.places[1])];
                for plane in cone.planes {
                    left &= is_before(lanes, plane, places[0]) | is_before(lanes, plane, places[1]);
                }
                let [first, last] = [sub(lanes, places[0], origin), sub(lanes, places[1], origin)];
                left &= comes_near(lanes, cone, pole, first, last);
            }
            near |= u64::from(left) << first;
        }
        near
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;
    use crate::gradient::warp::jump_mean::arc::{AngularSupport, Arc};
    use crate::gradient::warp::jump_mean::edge::HalfSpace;
    use crate::scene::{NONE, Span};

    /// Exactly those that count are found, in order: their arcs enter the cone, with a part in front of its
    /// planes. An edge seen end-on has no great circle.
    #[test]
    fn those_that_count_are_found_in_order() {
        let mut rng = stream(4, &[]);
        let mut point = || DVec3::from_array([(); 3].map(|()| 2.0 * open01(&mut rng) - 1.0));
        let origin = point();
        let (mut kept, mut refused) = (0, 0);
        for count in [0, 1, 4, 63, 64, 65, 2000] {
            let mut listed = Listed::default();
            let edge = |index: u32, places| Edge {
                span: Span::Edge([index; 2]),
                places,
                normals: [DVec3::ZERO; 2],
                faces: [NONE; 2],
                owners: [NONE; 2],
                seam: false,
            };
            let mut edges: Vec<Edge> = (0..count).map(|i| edge(i, [point(), point()])).collect();
            if let Some(edge) = edges.get_mut(3) {
                edge.places = [origin, origin + DVec3::X];
            }
            edges.iter().for_each(|edge| listed.push(edge, origin));
            for planes in [0, 1] {
                let (axis, reach) = (point().normalize(), AngularSupport::new(0.3));
                let plane = [HalfSpace { normal: point().normalize(), point: point(), slack: 0.01 }];
                let cone = Cone { origin, axis, reach, planes: &plane[..planes], rounding: 0.0 };
                let mut found = vec![];
                listed.for_each(&cone, |edge, pole| {
                    assert_eq!(pole.0, Pole::new(edge.places, origin).0);
                    found.push(edge.span);
                });
                let counts = |edge: &&Edge| {
                    let ends = edge.places.map(|end| (end - origin).normalize());
                    let Pole(pole) = Pole::new(edge.places, origin);
                    let is_before = |plane: &HalfSpace| edge.places.iter().any(|&p| plane.height(p) > 0.0);
                    let is_near = axis.dot(pole).abs() < reach.sine;
                    is_near
                        && Arc { ends, pole }.moments(axis, reach).is_some()
                        && cone.planes.iter().all(is_before)
                };
                let expected: Vec<Span> = edges.iter().filter(counts).map(|e| e.span).collect();
                assert_eq!(found, expected, "{count}");
                kept += found.len();
                refused += edges.len() - found.len();
            }
        }
        assert!(kept > 300 && refused > 1000, "{kept} {refused}");
    }
}
