//! Sampled discontinuities of a pixel.

use super::record::Job;
use super::residual::{Left, left_on_film};
use super::sweep::Sweep;
use crate::plane::MaterialPoint;
use crate::random::open01;
use crate::transport::CameraTangent;
use crate::transport::fields::{Jump, jumps_on_film};

/// Discontinuities under a pixel's filter.
pub(super) struct FilmJumps {
    pixel: usize,
    jumps: Vec<Jump>,
}

impl FilmJumps {
    /// Discontinuities of a pixel at which the field may have a residual; empty if they are not sampled.
    pub(super) fn new(job: &Job<'_>, pixel: usize) -> Self {
        let Job { world, camera, active, edges, .. } = *job;
        let is_sampled = active.geometry && edges.is_some();
        let mut jumps = if is_sampled { jumps_on_film(world, camera) } else { vec![] };
        jumps.retain(|j| camera.film.filter_share(pixel, j.at) > 0.0 && job.may_leave_on_film(j.vertex));
        Self { pixel, jumps }
    }

    /// Emits h [(L⁻ − L₀) (u̇ − V⁻) − (L⁺ − L₀) (u̇ − V⁺)] at one of them, with L₀ the control variate.
    pub(super) fn emit(&self, sweep: &mut Sweep<'_, '_>, level: f64) {
        let Job { world, camera, construction, .. } = *sweep.job;
        let rng = &mut sweep.streams.auxiliary;
        let count = self.jumps.len();
        if count == 0 {
            return;
        }
        let jump = &self.jumps[((open01(rng) * count as f64) as usize).min(count - 1)];
        let Some((left, rays)) = left_on_film(sweep.job, jump.vertex, level, rng) else { return };
        sweep.rays += rays;
        let factor = count as f64 * camera.film.filter_share(self.pixel, jump.at);
        let weight = factor * left.iter().map(|side| side.light).sum::<f64>();
        sweep.primary_of_point(&MaterialPoint::vertex(jump.vertex), weight * jump.rate);
        let mut by_camera = CameraTangent::default();
        by_camera.add(weight, &jump.camera);
        sweep.primary_of_camera(&by_camera);
        for Left { light, seen, kappa } in left {
            let field = construction.beside_on_film(world, camera, jump.at, kappa, seen.as_ref());
            sweep.film_form(&field, -factor * light, 0.0);
        }
    }
}
