//! The vertices at which what is seen changes: all that a harmonic field on the circle needs.
//!
//! For n = 1 a field that is harmonic off the jumps and equals their velocities on them is linear in
//! the angle between neighbouring jumps.

use glam::DVec2;

use super::visible::{End, View};
use crate::transport::World;

/// A vertex at which what is seen changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VisibleJump {
    /// φ, from the view's axis, in (−π/2, π/2).
    pub angle: f64,
    /// The unit direction.
    pub direction: DVec2,
    /// The vertex.
    pub vertex: usize,
    /// Its distance.
    pub distance: f64,
    /// What is seen at smaller angles, and at larger; `None` is the environment.
    pub sides: [Option<usize>; 2],
}

impl VisibleJump {
    /// ψ̇ = τ·(v̇ − ẋ)/r, in radians, for the velocities of the vertex and of the view's point.
    #[must_use]
    pub fn turn(&self, vertex: DVec2, point: DVec2) -> f64 {
        self.direction.perp().dot(vertex - point) / self.distance
    }
}

/// The visible jumps of a view, in the order of their angles.
#[must_use]
pub fn visible_jumps(world: &World, view: &View) -> Vec<VisibleJump> {
    let intervals = view.intervals(world);
    let jump = |end: &End, sides: [Option<usize>; 2]| {
        let vertex = end.vertex?;
        Some(VisibleJump {
            angle: end.angle,
            direction: view.direction(end),
            vertex,
            distance: end.distance,
            sides,
        })
    };
    intervals.windows(2).filter_map(|pair| jump(&pair[1].start, [pair[0].seen, pair[1].seen])).collect()
}
