//! Path tracer over numbers that may carry derivatives: emitter sampling and scattering-function sampling at
//! every surface, combined by the balance heuristic (Veach and Guibas 1995).

use glam::DVec2;
use rayon::prelude::*;

use super::calculus::{Bounce, Calculus, Plain, Warped};
use super::emitters::Emitters;
use super::{Camera, CameraError, Hit, Origin, World};
use crate::calculus::{Number, Vec2};
use crate::moments::Moments;
use crate::random::{Stream, open01, stream};

/// Termination of paths.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Paths {
    /// Largest number of scattering events: 0 for directly visible emitters, 1 for direct light, and so on.
    pub bounces: usize,
    /// Number of bounces from which a path survives each with the probability ρ + s of its surface, at least
    /// [`LEAST_SURVIVAL`].
    pub roulette_after: usize,
}

/// Least survival probability of Russian roulette.
pub const LEAST_SURVIVAL: f64 = 0.25;

impl Default for Paths {
    fn default() -> Self {
        Self { bounces: 1, roulette_after: 4 }
    }
}

/// Reason why an image cannot be traced.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ImageError {
    /// The camera cannot be used.
    #[error(transparent)]
    Camera(#[from] CameraError),
    /// No samples were requested.
    #[error("at least one sample per pixel is needed")]
    NoSamples,
}

/// Quantities whose derivatives are computed along a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct ActiveParameters {
    /// Whether any geometry moves.
    pub(crate) geometry: bool,
    /// Whether materials change. A black surface then must be followed.
    pub(crate) materials: bool,
}

/// Continuation of a path: a ray (o, ω), and its hit.
struct Onwards<T> {
    ray: [Vec2<T>; 2],
    seen: Option<Hit>,
    /// Throughput: factor on the incoming radiance.
    throughput: T,
}

/// A direction in which a possibly emitting surface is seen.
struct Light {
    direction: DVec2,
    segment: usize,
    /// Density with which emitter sampling draws the direction.
    density: f64,
    /// Survival probability with which the path reached this direction.
    survival: f64,
}

impl Paths {
    /// One sample of the radiance along a ray (o, ω) with the known hit `seen`, over numbers that may carry
    /// derivatives, and the number of rays.
    pub(crate) fn radiance<C: Calculus>(
        &self,
        world: &World,
        calculus: &mut C,
        ray: [Vec2<C::Number>; 2],
        seen: Option<Hit>,
        rng: &mut Stream,
    ) -> (C::Number, u64) {
        let mut rays = 1;
        let mut total = match seen {
            Some(hit) => calculus.material(hit.segment).emission,
            None => calculus.environment(),
        };
        let mut path = Onwards { ray, seen, throughput: C::Number::constant(1.0) };
        for depth in 0..self.bounces {
            let Some(hit) = path.seen else { break };
            if !(world.material(hit.segment).scatters() || calculus.wants_black()) {
                break;
            }
            let point = Bounce::new(world, calculus, path.ray, &hit, depth);
            let emitters = Emitters::new(world, point.origin, point.still.normal.value());
            let chosen = emitters.sample([open01(rng), open01(rng)]).filter(|light| {
                rays += 1;
                let seen = world.trace(point.origin, light.direction);
                seen.is_some_and(|h| h.segment == light.segment)
            });
            let light = |direction, segment, survival| Light {
                direction,
                segment,
                density: emitters.density(segment),
                survival,
            };
            let mut next = None;
            if let Some((direction, survival)) = self.continuation(&point, rng) {
                let seen = world.trace(point.origin, direction);
                rays += 1;
                if seen.is_none() || depth + 1 < self.bounces {
                    next = Some(path.onwards(calculus, &point, direction, survival, seen));
                }
                if let Some(hit) = seen {
                    let light = light(direction, hit.segment, survival);
                    total = total + path.throughput * light.scattered(calculus, &point);
                }
            }
            if let Some(chosen) = chosen {
                let light = light(chosen.direction, chosen.segment, 1.0);
                total = total + path.throughput * light.scattered(calculus, &point);
            }
            total = total + path.throughput * calculus.jumps(&point);
            let Some(next) = next else { break };
            path = next;
            if path.seen.is_none() {
                total = total + path.throughput * calculus.environment();
            }
        }
        (total, rays)
    }

    /// [`radiance`](Self::radiance) without derivatives.
    pub(crate) fn still_radiance(
        &self,
        world: &World,
        origin: Origin,
        direction: DVec2,
        seen: Option<Hit>,
        rng: &mut Stream,
    ) -> (f64, u64) {
        let ray = [origin.point, direction].map(Vec2::constant);
        self.radiance(world, &mut Plain { world }, ray, seen, rng)
    }

    /// Radiance at the film coordinate u, without derivatives.
    pub(crate) fn film_radiance(
        &self,
        world: &World,
        camera: &Camera,
        u: f64,
        rng: &mut Stream,
    ) -> (f64, u64) {
        let (origin, direction) = (Origin::free(camera.position), camera.direction(u));
        self.still_radiance(world, origin, direction, world.trace(origin, direction), rng)
    }

    /// A direction sampled from the scattering function, and its Russian roulette survival probability.
    fn continuation<T>(&self, point: &Bounce<T>, rng: &mut Stream) -> Option<(DVec2, f64)> {
        let direction = point.still.sample([open01(rng), open01(rng)]);
        let albedo = point.still.material.albedo();
        let survival = if point.depth < self.roulette_after { 1.0 } else { albedo.max(LEAST_SURVIVAL) };
        let goes_on = open01(rng) < survival && point.still.normal.value().dot(direction) > 0.0;
        goes_on.then_some((direction, survival))
    }

    /// The image, from `samples` paths per pixel: mean and standard error of every pixel. The error of a
    /// single sample is NaN.
    ///
    /// # Errors
    /// An [`ImageError`] if the camera is invalid or no samples were requested.
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
        let pixels = (0..camera.film.pixels)
            .into_par_iter()
            .map(|pixel| {
                let mut moments = Moments::default();
                for sample in 0..samples {
                    let mut rng = path_stream(seed, pixel, sample);
                    let at = camera.film.sample(pixel, &mut rng);
                    moments.push(at.value * self.film_radiance(world, camera, at.u, &mut rng).0);
                }
                [moments.mean(), moments.standard_error()]
            })
            .collect();
        Ok(pixels)
    }
}

/// The stream of one path of one pixel, used by the primal and by gradients.
pub(crate) fn path_stream(seed: u64, pixel: usize, sample: usize) -> Stream {
    stream(seed, &[pixel as u64, sample as u64])
}

impl<T: Number> Onwards<T> {
    /// The path's next ray, sampled from the scattering function: f cos φ J/p.
    fn onwards<C: Calculus<Number = T>>(
        &self,
        calculus: &mut C,
        point: &Bounce<T>,
        direction: DVec2,
        survival: f64,
        seen: Option<Hit>,
    ) -> Self {
        let warped = calculus.warp(point, direction, None);
        let density = point.still.density(Vec2::constant(direction)) * survival;
        let weight = calculus.weight(density, || point.scattering.density(warped.direction) * survival);
        let throughput = self.throughput * (reflected(point, &warped) * weight);
        Self { ray: [point.position, warped.direction], seen, throughput }
    }
}

impl Light {
    /// Its light scattered by a surface: f cos φ L J/p, with p the density of both strategies together.
    fn scattered<C: Calculus>(&self, calculus: &mut C, point: &Bounce<C::Number>) -> C::Number {
        let emission = calculus.material(self.segment).emission;
        if emission.value() == 0.0 && emission.is_still() {
            return emission;
        }
        let warped = calculus.warp(point, self.direction, Some(self.segment));
        let density = point.still.density(Vec2::constant(self.direction)) + self.density;
        let weight = calculus.weight(density * self.survival, || {
            // Emitter sampling is uniform in the angle that the segment subtends.
            let [a, b] = calculus.ends(self.segment).map(|end| end - point.position);
            let subtended = a.angle_to(b);
            let density = C::Number::constant(self.density * subtended.value()) / subtended;
            (point.scattering.density(warped.direction) + density) * self.survival
        });
        reflected(point, &warped) * emission * weight
    }
}

/// f cos φ of a warped direction, times the Jacobian.
fn reflected<T: Number>(point: &Bounce<T>, warped: &Warped<T>) -> T {
    point.scattering.value(warped.direction) * warped.jacobian
}
