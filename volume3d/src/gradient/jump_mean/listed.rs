//! Silhouettes that are looked up once for many directions, and refused by their great circles many at a time.

use glam::DVec3;

use super::edge::{Edge, Pole};
use crate::lanes::{Half, Instructions, Lanes, Task, WIDTH};

/// Numbers of a group.
const GROUP: usize = WIDTH / 2;
/// Groups that are looked at together: one bit a pole.
const TOGETHER: usize = u64::BITS as usize / GROUP;

/// Silhouettes from one place, with the poles of their great circles.
#[derive(Debug, Default)]
pub(crate) struct Listed {
    edges: Vec<Edge>,
    /// Components of the poles, four by four; NaN where there are no more.
    poles: Vec<[Half; 3]>,
    instructions: Instructions,
}

impl Listed {
    /// None.
    pub(crate) fn clear(&mut self) {
        self.edges.clear();
        self.poles.clear();
    }

    /// One more, as seen from a place.
    pub(crate) fn push(&mut self, edge: &Edge, origin: DVec3) {
        let lane = self.edges.len() % GROUP;
        if lane == 0 {
            self.poles.push([[f64::NAN; GROUP]; 3]);
        }
        let Pole(pole) = Pole::new(edge.places, origin);
        for (row, component) in self.poles.iter_mut().rev().take(1).flatten().zip(pole.to_array()) {
            row[lane] = component;
        }
        self.edges.push(*edge);
    }

    /// Calls with every silhouette whose great circle is within an angle of u.
    pub(super) fn for_each(&self, u: DVec3, sine: f64, mut f: impl FnMut(&Edge, Pole)) {
        let groups = self.poles.chunks(TOGETHER);
        for (groups, edges) in groups.zip(self.edges.chunks(TOGETHER * GROUP)) {
            let mut near = self.instructions.run(Near { groups, u, sine });
            while near != 0 {
                let index = near.trailing_zeros() as usize;
                near &= near - 1;
                let pole = groups[index / GROUP].map(|row| row[index % GROUP]);
                f(&edges[index], Pole(DVec3::from_array(pole)));
            }
        }
    }
}

/// |u·p| < sin R, of up to 64 poles: one bit each.
struct Near<'a> {
    groups: &'a [[Half; 3]],
    u: DVec3,
    sine: f64,
}

impl Task for Near<'_> {
    type Output = u64;

    #[inline(always)]
    fn run<L: Lanes>(self, lanes: L) -> u64 {
        let (x, y, z) =
            (lanes.splat_double(self.u.x), lanes.splat_double(self.u.y), lanes.splat_double(self.u.z));
        let sine = lanes.splat_double(self.sine);
        let mut near = 0;
        let mut first = 0;
        for [px, py, pz] in self.groups {
            let across = lanes.add_double(
                lanes.mul_double(x, lanes.load_double(px)),
                lanes.mul_double(y, lanes.load_double(py)),
            );
            let across = lanes.add_double(across, lanes.mul_double(z, lanes.load_double(pz)));
            near |= u64::from(lanes.less_double(lanes.abs_double(across), sine)) << first;
            first += GROUP;
        }
        near
    }
}

#[cfg(test)]
mod tests {
    use flatland::random::{open01, stream};

    use super::*;
    use crate::scene::{NONE, Span};

    /// Those near, in their order, and no other; an edge seen end-on has no great circle.
    #[test]
    fn those_near_are_found_in_order() {
        let mut rng = stream(4, &[]);
        let mut point = || DVec3::from_array([(); 3].map(|()| 2.0 * open01(&mut rng) - 1.0));
        let origin = point();
        for count in [0, 1, 4, 63, 64, 65, 200] {
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
            let (u, sine) = (point().normalize(), 0.3);
            let mut found = vec![];
            listed.for_each(u, sine, |edge, Pole(pole)| {
                assert!(u.dot(pole).abs() < sine);
                found.push(edge.span);
            });
            let is_near = |e: &&Edge| u.dot(Pole::new(e.places, origin).0).abs() < sine;
            let expected: Vec<Span> = edges.iter().filter(is_near).map(|e| e.span).collect();
            assert_eq!(found, expected, "{count}");
        }
    }
}
