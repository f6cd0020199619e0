//! Local silhouette density, which sets the kernel's radius.
//!
//! A wider kernel lowers |∇·V| ~ v/R between a silhouette and the cap's rim, but not where other silhouettes
//! are nearer than R: V turns between their velocities in any case. In dense regions a smaller R therefore
//! costs hardly any variance, and fewer edges are searched and integrated.

use flatland::random::{open01, stream};
use glam::DVec3;

use super::arc::AngularSupport;
use super::edge::Cone;
use super::tree::Tree;

/// Smallest factor by which a reach is reduced. With 0.35 for lights, three dense scenes took 0.95 to 0.99 of
/// the time at 1.00 to 1.02 times the variance, too little for a separate rule.
const LEAST: f64 = 0.5;

/// Number of silhouettes within reach above which it is reduced. A closed box has fewer, a blob of 122,888
/// edges 1.2 to 3, and 2,000 leaves 13 to 30. At 1.0 instead of 0.7 the blob has no gain in variance × time.
const CROWD: f64 = 0.7;

/// Number of viewpoints on edges, and the angle, in radians, within which silhouettes are counted.
const VIEWERS: usize = 256;
const PROBE: f64 = 0.1;

/// Mean density of silhouettes, per radian of angle within which they count.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Crowding(f64);

impl Crowding {
    /// Mean over edges and directions.
    pub(super) fn of(tree: &Tree, rounding: f64) -> Self {
        let mut rng = stream(0, &[VIEWERS as u64]);
        let mut number = || 2.0 * open01(&mut rng) - 1.0;
        let viewers = tree.slots().step_by(tree.len().div_ceil(VIEWERS).max(1));
        let (mut found, mut looked) = (0, 0);
        for edge in viewers.map(|slot| tree.edge(slot)) {
            let up: DVec3 = edge.normals.iter().sum();
            let axis = DVec3::new(number(), number(), number()).normalize_or(DVec3::X);
            let axis = if axis.dot(up) < 0.0 { -axis } else { axis };
            let origin = 0.5 * (edge.places[0] + edge.places[1]);
            let cone = Cone { origin, axis, reach: AngularSupport::new(PROBE), planes: &[], rounding };
            tree.visit(&cone, true, |_| found += 1);
            looked += 1;
        }
        Self(f64::from(found) / f64::from(looked.max(1)) / PROBE)
    }

    /// The reach, in radians, reduced where silhouettes are dense.
    pub(super) fn within(self, reach: f64) -> f64 {
        let Self(density) = self;
        reach * (CROWD / (density * reach)).clamp(LEAST, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gradient::warp::jump_mean::edge::Edge;
    use crate::gradient::warp::jump_mean::tree::Layout;
    use crate::scene::{NONE, Span};

    /// Borders of random triangles in a cube.
    fn crowding(triangles: usize) -> Crowding {
        let mut rng = stream(4, &[]);
        let mut point = || DVec3::from_array([(); 3].map(|()| open01(&mut rng)));
        let sides = (0..triangles).flat_map(|_| {
            let middle = point();
            let [a, b, c] = [(); 3].map(|()| middle + 0.2 * point());
            [[a, b], [b, c], [c, a]]
        });
        let span = Span::Edge([0, 1]);
        let edge = |places| Edge {
            span,
            places,
            normals: [DVec3::ZERO; 2],
            faces: [NONE; 2],
            owners: [NONE; 2],
            seam: false,
        };
        Crowding::of(&Layout::new(sides.map(edge).collect(), vec![]).finish(), 1e-13)
    }

    #[test]
    fn reaches_are_halved_in_a_crowd_and_stay_where_there_is_none() {
        assert_eq!(crowding(0).within(0.1), 0.1);
        let (few, many) = (crowding(8), crowding(2000));
        println!("{few:?} {many:?}");
        assert_eq!(few.within(0.05), 0.05);
        assert_eq!(many.within(0.05), 0.025);
        assert!((many.0 / crowding(1000).0 - 2.0).abs() < 0.3);
        // The reduced reach is monotonic in the reach.
        let reaches = [0.0, 0.01, 0.02, 0.05, 0.1, 0.5, 1.2].map(|reach| crowding(30).within(reach));
        assert!(reaches.is_sorted() && reaches[0] == 0.0, "{reaches:?}");
    }
}
