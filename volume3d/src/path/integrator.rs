//! A path tracer with next-event estimation and multiple importance sampling, in numbers that may carry
//! derivatives.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::beam::profile;
use super::bsdf::{Bounce, Ideal, Sampled, Shading};
use super::calculus::{Calculus, Kernel, VisibilityDomain, Warped};
use super::emission::{emitted, radiance_at};
use super::escape::distant;
use super::kernels::Kernels;
use super::lights::{LightId, LightSample, Lights};
use super::plain::Plain;
use super::sequence::Draws;
use super::surface::SurfacePoint;
use crate::scene::{Environment, Hit, Light, Scene, Surface};

/// Russian roulette never ends a path with a probability below 1 − this.
pub(super) const SURVIVAL: f64 = 0.95;

/// The probability with which it lets a path go on that has only a derivative.
const SURVIVAL_IN_THE_DARK: f64 = 0.5;

/// A bounce draws numbers for a light and a direction, and one for roulette.
const PAIRS_OF_BOUNCE: usize = 5;

/// Few paths have more bounces than this.
const LONGEST_PREPARED: usize = 3;

/// Paths through a scene.
#[derive(Clone, Debug)]
pub(crate) struct Paths<'s> {
    pub(crate) scene: &'s Scene,
    pub(crate) lights: Lights,
    pub(crate) kernels: Kernels,
    /// Lights that a ray which leaves the scene may reach, and which next-event estimation chooses from.
    pub(super) distant: Vec<LightId>,
}

/// A shading point of a path, and what reflection depends on there: by reference, as both are large.
#[derive(Clone, Copy)]
struct Vertex<'v, 's, T> {
    point: &'v SurfacePoint<T>,
    shading: &'v Shading<'s, T>,
}

/// Where a path goes on.
struct Scattered<T> {
    origin: Vec3<T>,
    direction: Vec3<T>,
    throughput: Rgb<T>,
    /// By how much radiance has been compressed on the way, η²: roulette must not take it for loss.
    compression: f64,
    hit: Option<Hit>,
}

impl<'s> Paths<'s> {
    pub(crate) fn new(scene: &'s Scene, kernels: Kernels) -> Self {
        let lights = scene.description.lights.iter().enumerate();
        let finite = |l: &Light| matches!(l, Light::Directional { kappa, .. } if kappa.is_finite());
        let mut distant: Vec<LightId> =
            lights.filter(|(_, l)| finite(l)).map(|(i, _)| LightId::Light(i as u32)).collect();
        if matches!(scene.description.environment, Some(Environment::Map { .. })) {
            distant.push(LightId::Environment);
        }
        Self { scene, lights: Lights::new(scene), kernels, distant }
    }

    /// How many pairs of random numbers a path draws at most; of one without a limit, the first of them.
    pub(crate) fn pairs(&self) -> usize {
        let vertices = self.scene.description.integrator.max_depth.unwrap_or(usize::MAX).saturating_sub(1);
        PAIRS_OF_BOUNCE * vertices.min(LONGEST_PREPARED)
    }

    /// One sample of the radiance that arrives from `hit` along the `depth`-th segment of a path; those of the camera are
    /// the first.
    pub(crate) fn radiance<C: Calculus>(
        &self,
        calculus: &mut C,
        origin: Vec3<C::Number>,
        direction: Vec3<C::Number>,
        hit: Option<Hit>,
        mut depth: usize,
        samples: &mut Draws<'_>,
    ) -> Rgb<C::Number> {
        let one = Rgb::constant(DVec3::ONE);
        let mut path = Scattered { origin, direction, throughput: one, compression: 1.0, hit };
        let hides = depth == 1 && self.scene.description.hide_emitters;
        let mut total = if hides { Rgb::constant(DVec3::ZERO) } else { self.seen(calculus, &path) };
        let limit = self.scene.description.integrator.max_depth.unwrap_or(usize::MAX);
        while let Some(hit) = path.hit
            && depth < limit
        {
            let point = SurfacePoint::new(
                self.scene,
                calculus,
                path.origin,
                path.direction,
                hit.surface,
                hit.distance,
            );
            let shading = point.shading(self.scene, calculus);
            let Some(shading) = &shading else { break };
            let vertex = Vertex { point: &point, shading };
            total = total + path.throughput * self.next_event(calculus, vertex, samples);
            let Some(survival) = self.roulette(&path, depth, samples) else { break };
            path.throughput = path.throughput * C::Number::constant(survival);
            depth += 1;
            let goes_on = depth < limit;
            match self.scatter(calculus, vertex, &path, goes_on, &mut total, samples) {
                Some(next) => path = next,
                None => break,
            }
        }
        total
    }

    /// What is emitted at the end of a camera ray.
    #[inline]
    fn seen<C: Calculus>(&self, calculus: &C, path: &Scattered<C::Number>) -> Rgb<C::Number> {
        match path.hit {
            Some(hit) => self
                .scene
                .emitting(&hit, path.direction.value())
                .map_or(Rgb::constant(DVec3::ZERO), |triangle| {
                    emitted(self.scene, calculus, (path.origin, path.direction), triangle)
                }),
            None => {
                let direction = path.direction;
                let mut sum = self.constant_environment(calculus);
                for &id in &self.distant {
                    sum = sum + distant(self.scene, calculus, id, direction);
                }
                sum
            }
        }
    }

    /// What a light that next-event estimation can choose sends against a ray with this hit.
    pub(crate) fn lit(&self, id: LightId, hit: Option<Hit>, direction: DVec3) -> DVec3 {
        match (id, hit) {
            (LightId::Shape(shape), Some(hit)) if self.scene.shape_of(hit.surface) == shape => {
                self.lit_by_all(Some(hit), direction)
            }
            (LightId::Light(_) | LightId::Environment, None) => {
                let plain = Plain { scene: self.scene };
                distant(self.scene, &plain, id, Vec3::constant(direction)).value()
            }
            _ => DVec3::ZERO,
        }
    }

    /// What all of them send.
    pub(crate) fn lit_by_all(&self, hit: Option<Hit>, direction: DVec3) -> DVec3 {
        match hit {
            Some(hit) => self
                .scene
                .emitting(&hit, direction)
                .map_or(DVec3::ZERO, |triangle| radiance_at(self.scene, triangle, hit.coordinates)),
            None => self.distant.iter().map(|&id| self.lit(id, None, direction)).sum(),
        }
    }

    pub(super) fn constant_environment<C: Calculus>(&self, calculus: &C) -> Rgb<C::Number> {
        match &self.scene.description.environment {
            Some(Environment::Constant { radiance, .. }) => calculus.environment(*radiance),
            _ => Rgb::constant(DVec3::ZERO),
        }
    }

    /// Light that is reflected at a point directly from a light chosen there.
    #[inline]
    fn next_event<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        samples: &mut Draws<'_>,
    ) -> Rgb<C::Number> {
        let zero = Rgb::constant(DVec3::ZERO);
        let Vertex { point, shading } = vertex;
        let (choice, [a, b]) = (samples.one(), samples.pair());
        let x = point.position.value();
        let Some(towards) = self.lights.sample(self.scene, x, [choice, a, b]) else { return zero };
        let LightSample { id, sampled: Sampled { direction, density }, distance, surface, delta } = towards;
        let border = match id {
            LightId::Shape(shape) if !shading.transmits() => {
                let kernel = || self.kernels.of_light(self.scene, &self.lights, id, shading, x, None);
                calculus.border(point.position, point.surface, shape, kernel)
            }
            _ => None,
        };
        let border = border.map_or(zero, |b| {
            shading.evaluate(Vec3::constant(b.direction)) * Rgb::constant(b.light) * b.speed
        });
        let hidden = || self.scene.shadowed_before(x, point.surface, direction, distance, surface);
        if !shading.receives(direction) || hidden() {
            return border + zero;
        }
        if delta {
            return border + self.delta_light(calculus, vertex, &towards);
        }
        let weight = density / (density + shading.density(direction));
        let (reflected, emitted) =
            self.light_along(calculus, vertex, (id, surface), direction, weight / density);
        border + reflected * emitted
    }

    /// What is reflected of one light along a direction that has been sampled, in which a surface of it is seen or none:
    /// f cos θ of the warped direction, with the Jacobian and a weight, and the radiance that comes from there.
    ///
    /// Light that next-event estimation can choose is an integral of its own, with its own kernel, and both strategies see
    /// one field.
    #[inline]
    fn light_along<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        (id, seen): (LightId, Option<Surface>),
        direction: DVec3,
        weight: f64,
    ) -> (Rgb<C::Number>, Rgb<C::Number>) {
        let Vertex { point, shading } = vertex;
        let x = point.position.value();
        let kernel = || self.kernels.of_light(self.scene, &self.lights, id, shading, x, seen);
        let warped = warp(calculus, vertex, direction, kernel);
        let emitted = match (id, seen) {
            (LightId::Shape(_), Some(Surface::Triangle(triangle))) => {
                emitted(self.scene, calculus, (point.position, warped.direction), triangle)
            }
            (id, _) => distant(self.scene, calculus, id, warped.direction),
        };
        (reflect(shading, &warped, weight), emitted)
    }

    /// Light from a point, or from one direction. Nothing is warped, and nothing may move that casts a shadow.
    fn delta_light<C: Calculus>(
        &self,
        calculus: &C,
        Vertex { point, shading }: Vertex<'_, '_, C::Number>,
        towards: &LightSample,
    ) -> Rgb<C::Number> {
        let LightId::Light(index) = towards.id else { return Rgb::constant(DVec3::ZERO) };
        let index = index as usize;
        let weight = C::Number::constant(1.0 / towards.sampled.density);
        match &self.scene.description.lights[index] {
            Light::Directional { direction, irradiance, .. } => {
                let direction = Vec3::turned(-*direction, calculus.pose(index));
                shading.evaluate(direction) * calculus.intensity(index, *irradiance) * weight
            }
            light @ (Light::Point { position, .. }
            | Light::Spot { position, .. }
            | Light::Projector { position, .. }) => {
                let place = Vec3::constant(*position);
                let place = calculus.pose(index).map_or(place, |shift| place + shift);
                let way = place - point.position;
                let falloff = C::Number::constant(1.0) / way.dot(way);
                let way = way.normalized();
                shading.evaluate(way)
                    * profile(self.scene, calculus, light, -way)
                    * calculus.intensity(index, light.power())
                    * (falloff * weight)
            }
        }
    }

    /// The survivor's weight, or the end.
    #[inline]
    fn roulette<T: Number>(&self, path: &Scattered<T>, depth: usize, samples: &mut Draws<'_>) -> Option<f64> {
        if depth < self.scene.description.integrator.rr_depth {
            return Some(1.0);
        }
        let throughput = &path.throughput;
        let survival = (throughput.value().max_element() * path.compression).clamp(0.0, SURVIVAL);
        // Behind what is black and may become lighter a path has no value, but a derivative.
        let dark = survival == 0.0 && throughput.0.iter().any(|x| !x.is_still());
        let survival = if dark { SURVIVAL_IN_THE_DARK } else { survival };
        (samples.one() < survival).then(|| 1.0 / survival)
    }

    /// Follows one direction sampled from reflection: adds what it finds emitted, and returns where the path
    /// goes on, if it may.
    #[inline]
    fn scatter<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        path: &Scattered<C::Number>,
        goes_on: bool,
        total: &mut Rgb<C::Number>,
        samples: &mut Draws<'_>,
    ) -> Option<Scattered<C::Number>> {
        let Vertex { point, shading } = vertex;
        let (x, origin, throughput) = (point.position.value(), point.position, path.throughput);
        let (c, [a, b]) = (samples.one(), samples.pair());
        let sampled = match shading.sample([a, b, c])? {
            Bounce::Smooth(sampled) => sampled,
            Bounce::Ideal(Ideal { direction, factor }) => {
                let hit = self.scene.closest(x, direction.value(), Some(point.surface));
                let compression = path.compression * shading.compression(direction.value());
                let next = Scattered { origin, direction, throughput: throughput * factor, compression, hit };
                // Next-event estimation never chooses an ideal direction: no weight but 1.
                *total = *total + next.throughput * self.seen(calculus, &next);
                return (goes_on && hit.is_some()).then_some(next);
            }
        };
        let hit = if goes_on || self.lights.may_be_hit(x, sampled.direction) {
            calculus.next_hit(self.scene, x, point.surface, sampled.direction)
        } else if self.escapes_last(x, point.surface, sampled.direction) {
            None
        } else {
            return None;
        };
        self.emission(calculus, vertex, throughput, sampled, hit, total);
        let environment = matches!(self.scene.description.environment, Some(Environment::Constant { .. }));
        if if hit.is_some() { !goes_on } else { !environment } {
            return None;
        }
        let sees = if goes_on { VisibilityDomain::Radiance } else { VisibilityDomain::Distant };
        let kernel = || self.kernels.of_bounce(shading, sees, hit.map(|h| h.surface));
        let warped = warp(calculus, vertex, sampled.direction, kernel);
        let throughput = throughput * reflect(shading, &warped, 1.0 / sampled.density);
        if hit.is_none() {
            *total = *total + throughput * self.constant_environment(calculus);
            return None;
        }
        let compression = path.compression * shading.compression(sampled.direction);
        Some(Scattered { origin, direction: warped.direction, throughput, compression, hit })
    }

    /// Whether light comes from beyond the scene along the last ray of a path, which meets no emitter: what else it meets
    /// counts for nothing.
    #[inline]
    fn escapes_last(&self, x: DVec3, from: Surface, direction: DVec3) -> bool {
        let environment = matches!(self.scene.description.environment, Some(Environment::Constant { .. }));
        (environment || !self.distant.is_empty()) && !self.scene.shadowed(x, from, direction, f64::INFINITY)
    }

    /// What a sampled direction finds emitted, weighted against next-event estimation.
    #[inline]
    fn emission<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        throughput: Rgb<C::Number>,
        Sampled { direction, density }: Sampled,
        hit: Option<Hit>,
        total: &mut Rgb<C::Number>,
    ) {
        let mut add = |light: (LightId, Option<Surface>), other: f64| {
            let weight = 1.0 / (density + other);
            let (reflected, emitted) = self.light_along(calculus, vertex, light, direction, weight);
            *total = *total + throughput * reflected * emitted;
        };
        if let Some(hit) = hit {
            if self.scene.emitting(&hit, direction).is_none() {
                return;
            }
            let shape = self.scene.shape_of(hit.surface);
            let other = self.lights.density_of_hit(self.scene, shape, &hit, direction);
            add((LightId::Shape(shape), Some(hit.surface)), other);
            return;
        }
        for &id in &self.distant {
            add((id, None), self.lights.density_of_escape(self.scene, id, direction));
        }
    }
}

/// The warp at a vertex. Where light passes the surface, jumps on its far side are followed by no field, and none is asked
/// for.
#[inline]
fn warp<C: Calculus>(
    calculus: &mut C,
    Vertex { point, shading }: Vertex<'_, '_, C::Number>,
    direction: DVec3,
    kernel: impl FnOnce() -> Kernel,
) -> Warped<C::Number> {
    if !C::WARPS || shading.transmits() {
        return Warped { direction: Vec3::constant(direction), jacobian: C::Number::constant(1.0) };
    }
    calculus.warp(point.position, point.surface, direction, kernel())
}

/// f cos θ of a warped direction, times the Jacobian and a weight.
#[inline]
fn reflect<T: Number>(shading: &Shading<'_, T>, warped: &Warped<T>, weight: f64) -> Rgb<T> {
    shading.evaluate(warped.direction) * (warped.jacobian * weight)
}
