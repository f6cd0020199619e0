//! The path tracer: emitter sampling and scattering-function sampling at every surface, combined by
//! the balance heuristic (Veach and Guibas 1995).

use glam::DVec2;
use rayon::prelude::*;

use super::emitters::{Emitters, angle};
use super::scattering::Scattering;
use super::{Camera, CameraError, Film, Hit, Origin, World};
use crate::moments::Moments;
use crate::random::{Stream, open01, stream};

/// How paths end.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Paths {
    /// The largest number of times that light is scattered: 0 for emitters seen directly, 1 for
    /// direct light, and so on.
    pub bounces: usize,
    /// From this many bounces on, a path survives each with the probability ρ + s of its surface, at
    /// least [`LEAST_SURVIVAL`].
    pub roulette_after: usize,
}

/// The least probability with which Russian roulette lets a path go on.
pub const LEAST_SURVIVAL: f64 = 0.25;

impl Default for Paths {
    fn default() -> Self {
        Self { bounces: 1, roulette_after: 4 }
    }
}

/// An image that cannot be traced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// No samples were asked for.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
}

/// What else than the value a path is traced for.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ActiveParameters {
    /// Whether anything moves.
    pub(crate) geometry: bool,
    /// Whether materials change. A black surface then scatters nothing, but might.
    pub(crate) materials: bool,
}

/// A surface on a path, with what was sampled there.
#[derive(Clone, Debug)]
pub(crate) struct Vertex<'a> {
    pub(crate) hit: Hit,
    pub(crate) origin: Origin,
    /// The direction in which the path arrived.
    pub(crate) arriving: DVec2,
    /// The surface; `None` if the path ends here without having been scattered.
    pub(crate) scattering: Option<Scattering<'a>>,
    /// Towards an emitter that is visible.
    pub(crate) emitter: Option<Light>,
    /// By the scattering function.
    pub(crate) continuation: Option<Continuation>,
}

/// Emitted light that arrives at a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Light {
    pub(crate) direction: DVec2,
    pub(crate) segment: usize,
    /// 1 over the density of both strategies together.
    pub(crate) weight: f64,
    /// The angle the emitting segment subtends.
    pub(crate) subtended: f64,
}

/// A direction drawn by the scattering function.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Continuation {
    pub(crate) direction: DVec2,
    /// The density of the direction.
    density: f64,
    /// The probability with which Russian roulette let the path go on.
    survival: f64,
    /// What the surface that is seen emits, if one is seen.
    pub(crate) light: Option<Light>,
}

impl Continuation {
    /// 1 over the density of going on in this direction.
    pub(crate) fn weight(&self) -> f64 {
        1.0 / (self.density * self.survival)
    }
}

/// A path, and the radiance it estimates at each surface, towards the one before.
#[derive(Clone, Debug)]
pub(crate) struct Path<'a> {
    pub(crate) vertices: Vec<Vertex<'a>>,
    /// L towards the previous vertex as scattered at vertex k, emission not included.
    pub(crate) scattered: Vec<f64>,
    pub(crate) rays: u64,
}

impl Paths {
    /// Traces a path from an origin.
    pub(crate) fn trace<'a>(
        &self,
        world: &'a World,
        origin: Origin,
        direction: DVec2,
        active: ActiveParameters,
        rng: &mut Stream,
    ) -> Path<'a> {
        self.follow(world, world.trace(origin, direction), direction, active, rng)
    }

    /// Traces a path whose first ray is known to see `seen`.
    pub(crate) fn follow<'a>(
        &self,
        world: &'a World,
        mut seen: Option<Hit>,
        mut direction: DVec2,
        active: ActiveParameters,
        rng: &mut Stream,
    ) -> Path<'a> {
        let mut path = Path { vertices: vec![], scattered: vec![], rays: 1 };
        while let Some(hit) = seen {
            if let Some(Vertex { continuation: Some(c), scattering: Some(s), origin, .. }) =
                path.vertices.last_mut()
            {
                let emitters = Emitters::new(world, *origin, s.normal);
                let density = (c.density + emitters.density(hit.segment)) * c.survival;
                c.light = Some(Light::new(world, *origin, direction, hit.segment, density));
            }
            let bounce = path.vertices.len();
            let mut vertex = Vertex {
                hit,
                origin: world.origin(&hit),
                arriving: direction,
                scattering: None,
                emitter: None,
                continuation: None,
            };
            if bounce < self.bounces && (world.material(hit.segment).scatters() || active.materials) {
                path.rays += self.scatter(world, &mut vertex, bounce, rng);
            }
            let next = vertex.continuation.map(|c| (vertex.origin, c.direction));
            path.vertices.push(vertex);
            let Some((origin, next)) = next else { break };
            direction = next;
            seen = world.trace(origin, direction);
            path.rays += 1;
        }
        path.sum_up(world);
        path
    }

    /// Samples both strategies at a surface; returns the number of rays.
    fn scatter<'a>(&self, world: &'a World, vertex: &mut Vertex<'a>, bounce: usize, rng: &mut Stream) -> u64 {
        let material = world.material(vertex.hit.segment);
        let normal = world.segments()[vertex.hit.segment].normal();
        let outgoing = -vertex.arriving;
        let normal = if normal.dot(outgoing) < 0.0 { -normal } else { normal };
        let scattering = Scattering { material, normal, outgoing };
        vertex.scattering = Some(scattering);
        let emitters = Emitters::new(world, vertex.origin, normal);
        let mut rays = 0;
        if let Some(sample) = emitters.sample([open01(rng), open01(rng)]) {
            rays += 1;
            let seen = world.trace(vertex.origin, sample.direction);
            if seen.is_some_and(|h| h.segment == sample.segment) {
                let density = scattering.density(sample.direction) + emitters.density(sample.segment);
                vertex.emitter =
                    Some(Light::new(world, vertex.origin, sample.direction, sample.segment, density));
            }
        }
        let direction = scattering.sample([open01(rng), open01(rng)]);
        let survival = if bounce < self.roulette_after { 1.0 } else { material.albedo().max(LEAST_SURVIVAL) };
        if open01(rng) < survival && normal.dot(direction) > 0.0 {
            let density = scattering.density(direction);
            vertex.continuation = Some(Continuation { direction, density, survival, light: None });
        }
        rays
    }

    /// The radiance along a direction: an unbiased estimate.
    pub(crate) fn radiance(
        &self,
        world: &World,
        origin: Origin,
        direction: DVec2,
        rng: &mut Stream,
    ) -> (f64, u64) {
        let path = self.trace(world, origin, direction, ActiveParameters::default(), rng);
        (path.radiance(world), path.rays)
    }

    /// The image, from `samples` paths a pixel: mean and standard error of every pixel. The error from a
    /// single sample is NaN.
    ///
    /// # Errors
    /// An [`ImageError`] if the camera cannot be used or no samples were asked for.
    pub fn image(
        &self,
        world: &World,
        camera: &Camera,
        samples: usize,
        seed: u64,
    ) -> Result<Vec<[f64; 2]>, ImageError> {
        camera.check()?;
        if samples == 0 {
            return Err(ImageError::NoSamples);
        }
        let film = camera.film;
        let pixels = (0..film.pixels)
            .into_par_iter()
            .map(|pixel| {
                let mut moments = Moments::default();
                for sample in 0..samples {
                    let mut rng = path_stream(seed, pixel, sample);
                    moments.push(self.pixel_sample(world, camera, film, pixel, &mut rng));
                }
                [moments.mean(), moments.standard_error()]
            })
            .collect();
        Ok(pixels)
    }

    fn pixel_sample(
        &self,
        world: &World,
        camera: &Camera,
        film: Film,
        pixel: usize,
        rng: &mut Stream,
    ) -> f64 {
        let sample = film.sample(pixel, rng);
        let direction = camera.direction(sample.u);
        sample.value * self.radiance(world, Origin::free(camera.position), direction, rng).0
    }
}

/// The stream of one path of one pixel: the primal's, and the gradients' for the same path.
pub(crate) fn path_stream(seed: u64, pixel: usize, sample: usize) -> Stream {
    stream(seed, &[pixel as u64, sample as u64])
}

impl Light {
    fn new(world: &World, origin: Origin, direction: DVec2, segment: usize, density: f64) -> Self {
        let [a, b] = world.segments()[segment].ends().map(|p| p - origin.point);
        Self { direction, segment, weight: 1.0 / density, subtended: angle(a, b).abs() }
    }

    /// The emitted radiance.
    pub(crate) fn emission(&self, world: &World) -> f64 {
        world.material(self.segment).emission
    }
}

impl Path<'_> {
    /// L along the first ray.
    pub(crate) fn radiance(&self, world: &World) -> f64 {
        match self.vertices.first() {
            Some(v) => world.material(v.hit.segment).emission + self.scattered[0],
            None => world.environment(),
        }
    }

    /// From the last surface to the first.
    fn sum_up(&mut self, world: &World) {
        self.scattered = vec![0.0; self.vertices.len()];
        for k in (0..self.vertices.len()).rev() {
            let vertex = &self.vertices[k];
            let Some(scattering) = &vertex.scattering else { continue };
            let mut sum = 0.0;
            if let Some(light) = &vertex.emitter {
                sum += scattering.value(light.direction) * light.weight * light.emission(world);
            }
            if let Some(c) = &vertex.continuation {
                let value = scattering.value(c.direction);
                if let Some(light) = &c.light {
                    sum += value * light.weight * light.emission(world);
                }
                sum += value * c.weight() * self.arriving(world, k);
            }
            self.scattered[k] = sum;
        }
    }

    /// The radiance that arrives at vertex k by its continuation, but for what the next surface emits.
    pub(crate) fn arriving(&self, world: &World, k: usize) -> f64 {
        self.scattered.get(k + 1).copied().unwrap_or_else(|| world.environment())
    }
}
