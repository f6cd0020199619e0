//! Vertices at which light jumps: how one is picked, and by how much.

use glam::DVec2;

use crate::calculus::Vec2;
use crate::random::{Stream, open01};
use crate::transport::{Origin, Paths, Scattering, World, both_sides};

/// How a vertex is picked at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeChoice {
    /// All alike.
    Uniform,
    /// By f cos φ/r towards it, which takes a look at every vertex.
    #[default]
    Importance,
}

impl EdgeChoice {
    /// A vertex and its probability. The ends of the surface itself lie on its horizon, where nothing
    /// is scattered.
    pub(super) fn pick(
        self,
        world: &World,
        origin: Origin,
        scattering: &Scattering<f64>,
        rng: &mut Stream,
    ) -> Option<(usize, f64)> {
        let own = origin.segment.map_or([usize::MAX; 2], |i| world.segments()[i].vertices);
        let count = world.vertex_count();
        if self == Self::Uniform {
            let picked = ((open01(rng) * count as f64) as usize).min(count - 1);
            return (!own.contains(&picked)).then_some((picked, 1.0 / count as f64));
        }
        let weight = |(v, p): (usize, DVec2)| {
            let d = p - origin.point;
            let value = || scattering.value(Vec2::constant(d.normalize()));
            if own.contains(&v) { 0.0 } else { value() / d.length() }
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

/// L⁻ − L⁺ across the direction of a vertex: an unbiased estimate; `None` if it is hidden.
pub(super) fn jump_radiance(
    world: &World,
    paths: &Paths,
    origin: Origin,
    vertex: usize,
    rng: &mut Stream,
) -> Option<(f64, u64)> {
    let direction = (world.vertex(vertex) - origin.point).normalize();
    let sides = both_sides(world, origin, vertex)?;
    let [before, after] = sides.map(|seen| paths.still_radiance(world, origin, direction, seen, rng));
    // One more ray found out that the vertex is visible.
    Some((before.0 - after.0, before.1 + after.1 + 1))
}
