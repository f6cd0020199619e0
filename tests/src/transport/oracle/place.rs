//! A surface point, the side from which it is seen, and the lines visible from it.

use std::f64::consts::{FRAC_PI_2, PI};

use glam::DVec2;
use num_dual::{Dual64, DualNum};

use super::scene::Scene;
use crate::dual::{Vector, Vector2};

/// A point x of a line with the local frame of one of its sides: n is the normal on that side, b is
/// n turned from +x towards +y by a right angle, and φ ∈ [−π/2, π/2] belongs to cos φ n + sin φ b.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    pub(super) line: usize,
    pub(super) point: Vector2,
    pub(super) normal: Vector2,
    pub(super) side: Vector2,
    /// φ of the direction into which a mirror would reflect the light that leaves towards the viewer.
    pub(super) mirror: Dual64,
}

/// One end of an interval of directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Limit {
    /// Along the surface, at φ = ±π/2.
    Grazing(f64),
    /// Towards a vertex.
    Vertex(usize),
}

/// Directions in which one line, or the environment, is visible.
#[derive(Clone, Copy, Debug)]
pub(super) struct Interval {
    pub(super) from: Limit,
    pub(super) to: Limit,
    pub(super) seen: Option<usize>,
}

/// An [`Interval`] in angles.
#[derive(Clone, Copy, Debug)]
pub(super) struct Angles {
    /// φ at both ends.
    pub(super) ends: [Dual64; 2],
    /// cos φ at both ends, to full relative precision.
    pub(super) cosines: [Dual64; 2],
    /// φ₁ − φ₀, to full relative precision.
    pub(super) width: Dual64,
}

impl Place {
    /// The point of `line` whose position is `point`, seen in the direction `d` from the point `from`.
    pub(super) fn new(scene: &Scene, line: usize, point: Vector2, from: Vector2, d: Vector2) -> Self {
        let [a, b] = scene.ends(line);
        // The height over the line decides, not the direction.
        let height = (b - a).perp_dot(from.value() - a);
        let tangent = scene.lines[line].tangent;
        let side = if height > 0.0 { -tangent } else { tangent };
        let normal = -side.turned();
        // The viewer is in direction −d, and its mirror image has the opposite φ.
        let mirror = Vector([-d.dot(normal), d.dot(side)]).angle();
        Self { line, point, normal, side, mirror }
    }

    /// The vector to a limit, in components along n and b. A vertex's height over the line does not depend on
    /// x.
    fn local(&self, scene: &Scene, limit: Limit) -> Vector2 {
        match limit {
            Limit::Grazing(sign) => Vector([0.0.into(), sign.into()]),
            Limit::Vertex(v) => {
                let foot = scene.vertices[scene.lines[self.line].vertices[0]];
                let to = scene.vertices[v];
                Vector([(to - foot).dot(self.normal), (to - self.point).dot(self.side)])
            }
        }
    }

    /// cos φ n + sin φ b.
    pub(super) fn direction(&self, phi: Dual64) -> Vector2 {
        self.normal * phi.cos() + self.side * phi.sin()
    }

    /// φ of a point at θ = 0, if it lies on this side.
    pub(super) fn angle_of(&self, point: DVec2) -> Option<f64> {
        let d = point - self.point.value();
        let height = d.dot(self.normal.value());
        (height > 0.0).then(|| d.dot(self.side.value()).atan2(height))
    }

    /// All directions of this side, in order, split by the visible line.
    pub(super) fn intervals(&self, scene: &Scene) -> Vec<Interval> {
        let own = scene.lines[self.line].vertices;
        let mut limits = vec![(-FRAC_PI_2, Limit::Grazing(-1.0)), (FRAC_PI_2, Limit::Grazing(1.0))];
        let foot = scene.vertices[own[0]].value();
        let (point, normal, side) = (self.point.value(), self.normal.value(), self.side.value());
        for (v, vertex) in scene.vertices.iter().enumerate().filter(|(v, _)| !own.contains(v)) {
            let height = (vertex.value() - foot).dot(normal);
            if height > 0.0 {
                let angle = (vertex.value() - point).dot(side).atan2(height);
                limits.push((angle, Limit::Vertex(v)));
            }
        }
        limits.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut found: Vec<Interval> = vec![];
        for pair in limits.windows(2) {
            let [(a, from), (b, to)] = [pair[0], pair[1]];
            let (sin, cos) = (0.5 * (a + b)).sin_cos();
            let seen = scene.first(point, cos * normal + sin * side, Some(self.line));
            match found.last_mut() {
                Some(last) if last.seen == seen => last.to = to,
                _ => found.push(Interval { from, to, seen }),
            }
        }
        found
    }

    /// An interval in angles.
    pub(super) fn angles(&self, scene: &Scene, interval: &Interval) -> Angles {
        let limits = [interval.from, interval.to];
        let local = limits.map(|limit| self.local(scene, limit));
        let ends = local.map(Vector2::angle);
        let cosines = local.map(|v| v.0[0] / v.length());
        let width = match limits {
            [Limit::Grazing(_), Limit::Grazing(_)] => PI.into(),
            [Limit::Vertex(i), Limit::Vertex(j)] => {
                // The vector between the vertices, where they are close, is exact.
                let (a, b) = (scene.vertices[i], scene.vertices[j]);
                let (to_a, to_b) = (a - self.point, b - self.point);
                Vector([to_a.dot(to_b), to_a.cross(b - a)]).angle()
            }
            _ => Vector([local[0].dot(local[1]), local[0].cross(local[1])]).angle(),
        };
        Angles { ends, cosines, width }
    }
}
