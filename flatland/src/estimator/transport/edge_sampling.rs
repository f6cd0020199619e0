//! Monte Carlo edge sampling along paths (Li, Aittala, Durand and Lehtinen 2018). In one dimension the
//! edges are points, the vertices of the world.

use super::driver::{self, LinearMethod};
use super::jumps::{EdgeChoice, jump_radiance};
use super::kernels::Kernels;
use super::record::{Job, Scratch};
use super::streams::Streams;
use super::sweep::Sweep;
use super::{Gradient, GradientImage, Method, PathError};
use crate::plane::MaterialPoint;
use crate::random::open01;
use crate::transport::fields::{Construction, Jump, jumps_on_film};
use crate::transport::{ActiveParameters, Camera, CameraTangent, Origin, Paths, Tangent, World};

/// Interior by path tracing, jumps by sampling one vertex for the film and one at every surface, with
/// what is seen on both sides of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSampling {
    /// Paths a pixel.
    pub samples: usize,
    /// How paths end.
    pub paths: Paths,
    /// How a vertex is picked at a surface.
    pub choice: EdgeChoice,
    /// Seed.
    pub seed: u64,
}

impl Default for EdgeSampling {
    fn default() -> Self {
        Self { samples: 64, paths: Paths::default(), choice: EdgeChoice::default(), seed: 0 }
    }
}

impl Method for EdgeSampling {
    fn name(&self) -> &'static str {
        "edge sampling"
    }

    fn forward(&self, world: &World, camera: &Camera, change: &Tangent) -> Result<GradientImage, PathError> {
        driver::forward(self, world, camera, change)
    }

    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, PathError> {
        driver::reverse(self, world, camera, adjoint)
    }
}

/// A pixel with the jumps under its filter.
pub(super) struct Pixel {
    index: usize,
    jumps: Vec<Jump>,
}

impl LinearMethod for EdgeSampling {
    type Pixel = Pixel;

    fn job<'a>(&self, world: &'a World, camera: &'a Camera, active: ActiveParameters) -> Job<'a> {
        let Self { samples, paths, choice, seed } = *self;
        let (construction, kernels) = (Construction::Still, Kernels::default());
        Job {
            world,
            camera,
            active,
            samples,
            seed,
            paths,
            construction,
            kernels,
            edges: Some(choice),
            fault: None,
        }
    }

    fn pixel(&self, job: &Job<'_>, pixel: usize) -> Pixel {
        let mut jumps = if job.active.geometry { jumps_on_film(job.world, job.camera) } else { vec![] };
        let film = job.camera.film;
        jumps.retain(|j| film.filter_value(pixel, j.at) > 0.0);
        Pixel { index: pixel, jumps }
    }

    fn sample(&self, job: &Job<'_>, pixel: &Pixel, streams: &mut Streams, scratch: &mut Scratch) -> u64 {
        let mut sweep = Sweep::sample(job, pixel.index, 0.0, streams, scratch);
        primary(&mut sweep, pixel);
        sweep.rays
    }
}

/// h(u) (L⁻ − L⁺) u̇ at one of the jumps under the pixel's filter.
fn primary(sweep: &mut Sweep<'_, '_>, pixel: &Pixel) {
    let Job { world, camera, paths, .. } = *sweep.job;
    let rng = &mut sweep.streams.auxiliary;
    let count = pixel.jumps.len();
    if count == 0 {
        return;
    }
    let jump = &pixel.jumps[((open01(rng) * count as f64) as usize).min(count - 1)];
    let seen = jump_radiance(world, &paths, Origin::free(camera.position), jump.vertex, rng);
    let Some((difference, rays)) = seen else { return };
    sweep.rays += rays;
    let weight = count as f64 * camera.film.filter_value(pixel.index, jump.at) * difference;
    sweep.primary_of_point(&MaterialPoint::vertex(jump.vertex), weight * jump.rate);
    let mut by_camera = CameraTangent::default();
    by_camera.add(weight, &jump.camera);
    sweep.primary_of_camera(&by_camera);
}
