//! Monte Carlo edge sampling along paths (Li, Aittala, Durand and Lehtinen 2018). In one dimension the edges
//! are points, the vertices of the world.

use super::Method;
use super::driver::{self, Gradient, GradientImage, LinearMethod};
use super::film_jumps::FilmJumps;
use super::jumps::EdgeChoice;
use super::kernels::Kernels;
use super::record::{Job, Scratch};
use super::streams::Streams;
use super::sweep::Sweep;
use crate::estimator::error::EstimatorError;
use crate::transport::fields::Construction;
use crate::transport::{ActiveParameters, Camera, Paths, Tangent, World};

/// Interior term by path tracing; boundary terms by sampling one vertex for the film and one at every
/// surface, with the radiance on both sides of it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EdgeSampling {
    /// Paths per pixel.
    pub samples: usize,
    /// Termination of paths.
    pub paths: Paths,
    /// Selection of a vertex at a surface.
    pub choice: EdgeChoice,
    /// Random seed.
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

    fn forward(
        &self,
        world: &World,
        camera: &Camera,
        change: &Tangent,
    ) -> Result<GradientImage, EstimatorError> {
        driver::forward(self, world, camera, change)
    }

    fn reverse(&self, world: &World, camera: &Camera, adjoint: &[f64]) -> Result<Gradient, EstimatorError> {
        driver::reverse(self, world, camera, adjoint)
    }
}

/// A pixel with the discontinuities under its filter.
pub(super) struct Pixel {
    index: usize,
    jumps: FilmJumps,
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
        Pixel { index: pixel, jumps: FilmJumps::new(job, pixel) }
    }

    fn sample(&self, job: &Job<'_>, pixel: &Pixel, streams: &mut Streams, scratch: &mut Scratch) -> u64 {
        let mut sweep = Sweep::sample(job, pixel.index, 0.0, streams, scratch);
        pixel.jumps.emit(&mut sweep, 0.0);
        sweep.rays
    }
}
