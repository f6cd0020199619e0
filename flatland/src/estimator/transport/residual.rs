//! What a field leaves to the boundary at a vertex (Theory 7): of a softened mean over jumps a part,
//! of no field all of it, which is edge sampling.
//!
//! In one dimension jumps are points. Where V⁻ and V⁺ are the limits of the field on the two sides of one that moves with v,
//!
//! ```text
//! Σ L⁻ (v − V⁻) − L⁺ (v − V⁺)
//! ```
//!
//! is left, with f cos φ before it over the directions at a surface, and with h over the film, where L is the light beyond the level of
//! the control variate. A side on which V = v is not looked at. Which vertex is drawn, and which sides are looked at, depends on where
//! things are and not on how they move: forward and reverse mode are one linear map and its transpose.

use glam::DVec2;

use super::fault::Fault;
use super::record::Job;
use crate::random::Stream;
use crate::transport::fields::is_silhouette_from;
use crate::transport::{Bounce, Hit, Origin, Paths, both_sides};

/// Light that comes from beside a jump and that the field of its integral does not follow there.
#[derive(Clone, Copy, Debug)]
pub(super) struct Left {
    /// L on the side before the jump, as angles grow, and −L on that after it: an unbiased estimate.
    pub(super) light: f64,
    /// What is seen on that side.
    pub(super) seen: Option<Hit>,
    /// The concentration of the field's kernel.
    pub(super) kappa: f64,
}

/// What the fields over the directions at a surface leave to the boundary at a vertex, and the number of rays; `None` if the
/// vertex is hidden. `rest` is how paths go on from there.
pub(super) fn left_around<T>(
    job: &Job<'_>,
    rest: &Paths,
    at: &Bounce<T>,
    vertex: usize,
    rng: &mut Stream,
) -> Option<(Vec<Left>, u64)> {
    let world = job.world;
    let direction = (world.vertex(vertex) - at.origin.point).normalize();
    let sides = both_sides(world, at.origin, vertex)?;
    // One more ray found out that the vertex is visible.
    let (mut left, mut rays) = (vec![], 1);
    for (sign, seen) in [1.0, -1.0].into_iter().zip(sides) {
        let is_left = |kappa| {
            !job.is_followed(seen, vertex, |i| job.construction.follows_ends(world, at.origin, kappa, i))
        };
        let mut push = |light: f64, kappa| {
            if light != 0.0 {
                left.push(Left { light: sign * light, seen, kappa });
            }
        };
        // The light of an emitter is an integral of its own.
        let emitter = seen.map(|hit| hit.segment).filter(|&i| world.material(i).emission > 0.0);
        let emission = emitter.map_or(0.0, |i| world.material(i).emission);
        if let Some(kappa) = emitter.map(|i| job.kappa(at, Some(i))).filter(|&kappa| is_left(kappa)) {
            push(emission, kappa);
        }
        let kappa = job.kappa(at, None);
        if is_left(kappa) {
            let (radiance, more) = rest.still_radiance(world, at.origin, direction, seen, rng);
            rays += more;
            push(radiance - emission, kappa);
        }
    }
    Some((left, rays))
}

/// What the field over the film leaves to the boundary at a vertex, in the same way, of the light beyond a level.
pub(super) fn left_on_film(
    job: &Job<'_>,
    vertex: usize,
    level: f64,
    rng: &mut Stream,
) -> Option<(Vec<Left>, u64)> {
    let Job { world, camera, paths, construction, .. } = *job;
    let (origin, kappa) = (Origin::free(camera.position), job.kernels.film);
    let direction = (world.vertex(vertex) - origin.point).normalize();
    let sides = both_sides(world, origin, vertex)?;
    let (mut left, mut rays) = (vec![], 1);
    for (sign, seen) in [1.0, -1.0].into_iter().zip(sides) {
        if !job.is_followed(seen, vertex, |i| construction.follows_ends_on_film(world, camera, kappa, i)) {
            let (radiance, more) = paths.still_radiance(world, origin, direction, seen, rng);
            rays += more;
            left.push(Left { light: sign * (radiance - level), seen, kappa });
        }
    }
    Some((left, rays))
}

impl Job<'_> {
    /// Whether V is the velocity of a vertex on a side of it: where a segment is seen that ends there, and whose ends are followed.
    fn is_followed(&self, seen: Option<Hit>, vertex: usize, follows_ends: impl Fn(usize) -> bool) -> bool {
        let ending =
            seen.map(|hit| hit.segment).filter(|&i| self.world.segments()[i].vertices.contains(&vertex));
        ending.is_some_and(|i| self.fault == Some(Fault::OneSided) || follows_ends(i))
    }

    /// Whether anything may be left at a vertex as seen from a point: if it is a silhouette, beside which V is not its velocity, or
    /// an end of a segment whose ends are not followed.
    fn may_leave(&self, vertex: usize, from: DVec2, follows_ends: impl Fn(usize) -> bool) -> bool {
        self.world.segments_at(vertex).any(|i| !follows_ends(i))
            || is_silhouette_from(self.world, vertex, from)
    }

    /// The same over the directions at a surface.
    pub(super) fn may_leave_around<T>(&self, at: &Bounce<T>, vertex: usize) -> bool {
        let Self { world, construction, .. } = *self;
        self.may_leave(vertex, at.origin.point, |i| {
            let emitter = (world.material(i).emission > 0.0).then_some(i);
            [None, emitter]
                .into_iter()
                .all(|emitter| construction.follows_ends(world, at.origin, self.kappa(at, emitter), i))
        })
    }

    /// The same over the film.
    pub(super) fn may_leave_on_film(&self, vertex: usize) -> bool {
        let Self { world, camera, construction, kernels, .. } = *self;
        self.may_leave(vertex, camera.position, |i| {
            construction.follows_ends_on_film(world, camera, kernels.film, i)
        })
    }
}
