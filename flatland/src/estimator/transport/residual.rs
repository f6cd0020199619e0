//! Residual boundary term of a field at a vertex (Theory 7). For a softened mean over discontinuities it
//! covers a part of the motion; for V = 0, which is edge sampling, all of it.
//!
//! In one dimension discontinuities are points. With V⁻ and V⁺ the limits of the field on the two sides of a
//! discontinuity of velocity v,
//!
//! ```text
//! Σ L⁻ (v − V⁻) − L⁺ (v − V⁺)
//! ```
//!
//! is the residual, times f cos φ over the directions at a surface, and times h over the film, where L is the
//! radiance less the control variate. A side with V = v is not evaluated. The choice of vertex and sides
//! depends on positions and not on velocities: forward and reverse mode are a linear map and its transpose.

use glam::DVec2;

use super::fault::Fault;
use super::record::Job;
use crate::random::Stream;
use crate::transport::fields::is_silhouette_from;
use crate::transport::{Bounce, Hit, Origin, Paths, both_sides};

/// Light at one side of a discontinuity that the field does not follow on that side.
#[derive(Clone, Copy, Debug)]
pub(super) struct Left {
    /// L on the side before the discontinuity, in order of increasing angle, and −L on the side after it: an
    /// unbiased estimate.
    pub(super) light: f64,
    /// The hit on that side.
    pub(super) seen: Option<Hit>,
    /// Concentration of the field's kernel.
    pub(super) kappa: f64,
}

/// Residuals at a vertex of the fields over the directions at a surface, and the number of rays; `None` if
/// the vertex is hidden. `rest` describes the continuation of paths from there.
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
    // One more ray tested that the vertex is visible.
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
        // The light of an emitter is a separate integral.
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

/// Residuals at a vertex of the field over the film, with the control variate `level`.
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
    /// Whether V is the velocity of a vertex on one side of it: a segment that ends there is visible, and its
    /// ends are followed.
    fn is_followed(&self, seen: Option<Hit>, vertex: usize, follows_ends: impl Fn(usize) -> bool) -> bool {
        let ending =
            seen.map(|hit| hit.segment).filter(|&i| self.world.segments()[i].vertices.contains(&vertex));
        ending.is_some_and(|i| self.fault == Some(Fault::OneSided) || follows_ends(i))
    }

    /// Whether a vertex seen from a point may have a residual: it is a silhouette whose velocity V does not
    /// match, or the end of a segment whose ends are not followed.
    fn may_leave(&self, vertex: usize, from: DVec2, follows_ends: impl Fn(usize) -> bool) -> bool {
        self.world.segments_at(vertex).any(|i| !follows_ends(i))
            || is_silhouette_from(self.world, vertex, from)
    }

    /// [`may_leave`](Self::may_leave) over the directions at a surface.
    pub(super) fn may_leave_around<T>(&self, at: &Bounce<T>, vertex: usize) -> bool {
        let Self { world, construction, .. } = *self;
        self.may_leave(vertex, at.origin.point, |i| {
            let emitter = (world.material(i).emission > 0.0).then_some(i);
            [None, emitter]
                .into_iter()
                .all(|emitter| construction.follows_ends(world, at.origin, self.kappa(at, emitter), i))
        })
    }

    /// [`may_leave`](Self::may_leave) over the film.
    pub(super) fn may_leave_on_film(&self, vertex: usize) -> bool {
        let Self { world, camera, construction, kernels, .. } = *self;
        self.may_leave(vertex, camera.position, |i| {
            construction.follows_ends_on_film(world, camera, kernels.film, i)
        })
    }
}
