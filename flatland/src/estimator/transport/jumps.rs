//! Selection of vertices at which light is discontinuous.

use glam::DVec2;

use crate::calculus::Vec2;
use crate::random::{Stream, open01};
use crate::transport::{Origin, Scattering, World};

/// Selection of a vertex at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeChoice {
    /// Uniform.
    Uniform,
    /// In proportion to f cos φ/r towards it, at a cost proportional to the number of vertices.
    #[default]
    Importance,
}

impl EdgeChoice {
    /// Selects one of the admissible vertices, with its probability. The ends of the surface itself lie on
    /// its horizon, where nothing is scattered.
    pub(super) fn pick(
        self,
        world: &World,
        origin: Origin,
        scattering: &Scattering<f64>,
        counts: impl Fn(usize) -> bool,
        rng: &mut Stream,
    ) -> Option<(usize, f64)> {
        let own = origin.segment.map_or([usize::MAX; 2], |i| world.segments()[i].vertices);
        let count = world.vertex_count();
        if self == Self::Uniform {
            let picked = ((open01(rng) * count as f64) as usize).min(count - 1);
            let is_possible = !own.contains(&picked) && counts(picked);
            return is_possible.then_some((picked, 1.0 / count as f64));
        }
        let weight = |(v, p): (usize, DVec2)| {
            let d = p - origin.point;
            let value = || scattering.value(Vec2::constant(d.normalize()));
            if own.contains(&v) || !counts(v) { 0.0 } else { value() / d.length() }
        };
        let weights: Vec<f64> = world.vertices().enumerate().map(weight).collect();
        let sum: f64 = weights.iter().sum();
        let mut rest = open01(rng) * sum;
        let mut picked = None;
        for (v, &weight) in weights.iter().enumerate().filter(|(_, w)| **w > 0.0) {
            picked = Some((v, weight / sum));
            if rest < weight {
                break;
            }
            rest -= weight;
        }
        picked
    }
}
