//! Monte Carlo edge sampling along paths (Li, Aittala, Durand and Lehtinen 2018). In one dimension the
//! edges are points, the vertices of the world.

use super::driver::{self, LinearMethod, Streams, View};
use super::jumps::{EdgeChoice, jump_radiance};
use super::kernels::Kernels;
use super::sweep::{EdgePicker, Sweep, first_ray};
use super::{Gradient, GradientImage, Method, PathError};
use crate::random::{Stream, open01};
use crate::transport::fields::{Construction, Jump, jumps_on_film};
use crate::transport::{Camera, Covector, Origin, Paths, Tangent, Terms, World};

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

    fn samples(&self) -> usize {
        self.samples
    }

    fn seed(&self) -> u64 {
        self.seed
    }

    fn check(&self) -> Result<(), PathError> {
        Ok(())
    }

    fn pixel(&self, view: &View<'_>, pixel: usize) -> Pixel {
        let mut jumps = if view.active.geometry { jumps_on_film(view.world, view.camera) } else { vec![] };
        let film = view.camera.film;
        jumps.retain(|j| film.filter_value(pixel, j.at) > 0.0);
        Pixel { index: pixel, jumps }
    }

    fn sample(
        &self,
        view: &View<'_>,
        pixel: &Pixel,
        streams: &mut Streams,
        covectors: &mut Vec<Covector>,
    ) -> u64 {
        let View { world, camera, active } = *view;
        let sample = camera.film.sample(pixel.index, &mut streams.path);
        let origin = Origin::free(camera.position);
        let path = self.paths.trace(world, origin, camera.direction(sample.u), active, &mut streams.path);
        let mut sweep = Sweep {
            world,
            construction: &Construction::Still,
            kernels: &Kernels::default(),
            edges: Some(EdgePicker { paths: self.paths, choice: self.choice }),
            fault: None,
            geometry: active.geometry,
            rng: &mut streams.auxiliary,
            covectors,
            rays: path.rays,
        };
        let arrival = sweep.path(&path, sample.value);
        if active.geometry {
            if let Some(first) = path.vertices.first() {
                first_ray(&mut sweep, camera, sample.u, first, arrival);
            }
            let rays = self.primary(view, pixel, sweep.rng, sweep.covectors);
            sweep.rays += rays;
        }
        sweep.rays
    }
}

impl EdgeSampling {
    /// h(u) (L⁻ − L⁺) u̇ at one of the jumps under the pixel's filter.
    fn primary(
        &self,
        view: &View<'_>,
        pixel: &Pixel,
        rng: &mut Stream,
        covectors: &mut Vec<Covector>,
    ) -> u64 {
        let count = pixel.jumps.len();
        if count == 0 {
            return 0;
        }
        let jump = &pixel.jumps[((open01(rng) * count as f64) as usize).min(count - 1)];
        let origin = Origin::free(view.camera.position);
        let Some((difference, rays)) = jump_radiance(view.world, &self.paths, origin, jump.vertex, rng)
        else {
            return 0;
        };
        let weight = count as f64 * view.camera.film.filter_value(pixel.index, jump.at) * difference;
        let point = crate::plane::MaterialPoint::vertex(jump.vertex);
        covectors.push(Covector::Point(point, Terms { primary: weight * jump.rate, ..Terms::default() }));
        let mut primary = crate::transport::CameraTangent::default();
        primary.add(weight, &jump.camera);
        covectors.push(Covector::Camera(Terms { primary, ..Terms::default() }));
        rays
    }
}
