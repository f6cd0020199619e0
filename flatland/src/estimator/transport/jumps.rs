//! Vertices at which light jumps: how one is picked, and by how much.

use crate::random::Stream;
use crate::transport::{Origin, Paths, World, both_sides};

/// How a vertex is picked at a surface.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum EdgeChoice {
    /// All alike.
    Uniform,
    /// By f cos φ/r towards it, which takes a look at every vertex.
    #[default]
    Importance,
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
    let [before, after] = sides.map(|seen| {
        let path = paths.follow(world, seen, direction, Default::default(), rng);
        (path.radiance(world), path.rays)
    });
    // One more ray found out that the vertex is visible.
    Some((before.0 - after.0, before.1 + after.1 + 1))
}
