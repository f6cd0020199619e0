//! Path tracer with next-event estimation and multiple importance sampling, over numbers that may carry
//! derivatives.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use super::bsdf::{Bounce, Ideal, Sampled, Shading};
use super::calculus::{Calculus, Kernel, VisibilityDomain, Warped};
use super::chain::{Departure, Parts, Passed, Trail};
use super::emission::{emitted, radiance_at};
use super::environment::distant;
use super::kernels::Kernels;
use super::lights::{LightId, LightSample, Lights};
use super::plain::Plain;
use super::scattered::Scattered;
use super::sequence::Draws;
use super::surface::SurfacePoint;
use crate::scene::{Environment, Hit, Light, Scene, Surface};

/// Largest survival probability of Russian roulette.
pub(super) const SURVIVAL: f64 = 0.95;

/// Survival probability of a path with zero throughput but a derivative.
const SURVIVAL_IN_THE_DARK: f64 = 0.5;

/// Pairs of random numbers per bounce: for a light and a direction, and one for Russian roulette.
const PAIRS_OF_BOUNCE: usize = 5;

/// Number of bounces for which random numbers are prepared; few paths have more.
const LONGEST_PREPARED: usize = 3;

/// Path tracing in a scene.
#[derive(Clone, Debug)]
pub(crate) struct Paths<'s> {
    pub(crate) scene: &'s Scene,
    pub(crate) lights: Lights,
    pub(crate) kernels: Kernels,
    /// Lights that a ray leaving the scene may reach, and that next-event estimation samples.
    pub(super) distant: Vec<LightId>,
}

/// A shading point of a path; by reference, as both parts are large.
#[derive(Clone, Copy)]
pub(super) struct Vertex<'v, 's, T> {
    pub(super) point: &'v SurfacePoint<T>,
    pub(super) shading: &'v Shading<'s, T>,
}

impl<'s> Paths<'s> {
    pub(crate) fn new(scene: &'s Scene, kernels: Kernels) -> Self {
        let lights = scene.lights().iter().enumerate();
        let finite = |l: &Light| matches!(l, Light::Directional { kappa, .. } if kappa.is_finite());
        let mut distant: Vec<LightId> =
            lights.filter(|(_, l)| finite(l)).map(|(i, _)| LightId::Light(i as u32)).collect();
        if matches!(scene.description.environment, Some(Environment::Map { .. })) {
            distant.push(LightId::Environment);
        }
        Self { scene, lights: Lights::new(scene), kernels, distant }
    }

    /// Largest number of prepared pairs of random numbers that a path draws.
    pub(crate) fn pairs(&self) -> usize {
        PAIRS_OF_BOUNCE * self.limit().saturating_sub(1).min(LONGEST_PREPARED)
    }

    /// One sample of the radiance from `hit` along the `depth`-th segment of a path; camera rays are the
    /// first segment.
    pub(crate) fn radiance<C: Calculus>(
        &self,
        calculus: &mut C,
        origin: Vec3<C::Number>,
        direction: Vec3<C::Number>,
        hit: Option<Hit>,
        depth: usize,
        samples: &mut Draws<'_>,
    ) -> Rgb<C::Number> {
        let mut total = Rgb::constant(DVec3::ZERO);
        self.radiance_in_parts(calculus, &mut total, (origin, direction), hit, depth, samples);
        total
    }

    /// [`radiance`](Self::radiance), with a sum for every warp.
    pub(crate) fn radiance_in_parts<C: Calculus>(
        &self,
        calculus: &mut C,
        parts: &mut impl Parts<C>,
        (origin, direction): (Vec3<C::Number>, Vec3<C::Number>),
        hit: Option<Hit>,
        depth: usize,
        samples: &mut Draws<'_>,
    ) {
        let path = Scattered::new(origin, direction, hit);
        *parts.total() = self.seen_first(calculus, &path, depth);
        self.follow(calculus, path, depth, &mut Trail::new(), parts, samples);
    }

    /// Emission at the end of the `depth`-th segment of a path.
    #[inline]
    pub(super) fn seen_first<C: Calculus>(
        &self,
        calculus: &C,
        path: &Scattered<C::Number>,
        depth: usize,
    ) -> Rgb<C::Number> {
        let hides = depth == 1 && self.scene.description.hide_emitters;
        if hides { Rgb::constant(DVec3::ZERO) } else { self.seen(calculus, path) }
    }

    /// Adds the light reflected at all remaining vertices of a path, from the `depth`-th segment on.
    #[inline]
    pub(super) fn follow<C: Calculus>(
        &self,
        calculus: &mut C,
        mut path: Scattered<C::Number>,
        mut depth: usize,
        trail: &mut Trail<C::Number>,
        parts: &mut impl Parts<C>,
        samples: &mut Draws<'_>,
    ) {
        while let Some(point) = self.arrive(calculus, &path, depth)
            && let Some(shading) = &point.shading(self.scene, calculus)
            && let Some(next) = self.reflect_at(
                calculus,
                Vertex { point: &point, shading },
                &path,
                depth,
                (&mut *trail, &mut *parts),
                samples,
            )
        {
            path = next;
            depth += 1;
        }
    }

    /// The surface at the end of the `depth`-th segment, if it contributes.
    #[inline]
    pub(super) fn arrive<C: Calculus>(
        &self,
        calculus: &C,
        path: &Scattered<C::Number>,
        depth: usize,
    ) -> Option<SurfacePoint<C::Number>> {
        let hit = path.hit.filter(|_| depth < self.limit())?;
        let (origin, direction) = (path.origin, path.direction);
        Some(SurfacePoint::new(self.scene, calculus, origin, direction, hit.surface, hit.distance))
    }

    /// Adds the light reflected at a vertex, and returns the continuation of the path.
    #[inline]
    pub(super) fn reflect_at<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        path: &Scattered<C::Number>,
        depth: usize,
        (trail, parts): (&mut Trail<C::Number>, &mut impl Parts<C>),
        samples: &mut Draws<'_>,
    ) -> Option<Scattered<C::Number>> {
        let (light, delta) = self.next_event(calculus, vertex, samples);
        let total = parts.total();
        *total = *total + path.throughput * light;
        if let Some(towards) = delta {
            self.add_delta_light(calculus, vertex, path, &towards, trail, parts);
        }
        let survival = self.roulette(path, depth, samples)?;
        let goes_on = depth + 1 < self.limit();
        self.scatter(calculus, vertex, path, (survival, goes_on), (trail, parts), samples)
    }

    /// Adds the reflected light of a point or a single direction, which has a warp of its own.
    fn add_delta_light<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        path: &Scattered<C::Number>,
        towards: &LightSample,
        trail: &Trail<C::Number>,
        parts: &mut impl Parts<C>,
    ) {
        let LightId::Light(index) = towards.id else { return };
        if parts.is_first_alone() && matches!(trail.departure, Departure::Film) {
            return;
        }
        let Some(again) = self.again(calculus, parts, trail, path.hit, Some(index as usize)) else {
            let light = path.throughput * self.delta_light(calculus, vertex, towards);
            let total = parts.total();
            *total = *total + light;
            return;
        };
        let point = again.hit.map(|hit| self.point_at(calculus, &again, &hit));
        if let Some(point) = &point
            && let Some(shading) = &point.shading(self.scene, calculus)
        {
            let light = self.delta_light(calculus, Vertex { point, shading }, towards);
            let total = parts.total();
            *total = *total + again.throughput * light;
        }
        if matches!(trail.departure, Departure::Film) {
            parts.resume();
        }
    }

    /// Largest number of segments of a path.
    pub(super) fn limit(&self) -> usize {
        self.scene.description.integrator.max_depth.unwrap_or(usize::MAX)
    }

    /// Emission at the end of a camera ray.
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

    /// Radiance that a light of next-event estimation sends against a ray with this hit.
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

    /// Radiance that all of them send.
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

    /// Russian roulette: the survivor's weight, or `None`.
    #[inline]
    fn roulette<T: Number>(&self, path: &Scattered<T>, depth: usize, samples: &mut Draws<'_>) -> Option<f64> {
        if depth < self.scene.description.integrator.rr_depth {
            return Some(1.0);
        }
        let throughput = &path.throughput;
        let survival = (throughput.value().max_element() * path.compression).clamp(0.0, SURVIVAL);
        // Behind a black surface that may become lighter a path has no value, but a derivative.
        let dark = survival == 0.0 && throughput.0.iter().any(|x| !x.is_still());
        let survival = if dark { SURVIVAL_IN_THE_DARK } else { survival };
        (samples.one() < survival).then(|| 1.0 / survival)
    }

    /// Continues a path in a sampled direction: adds the emission found there, and returns the continuation,
    /// if the path may have one.
    #[inline]
    fn scatter<C: Calculus>(
        &self,
        calculus: &mut C,
        vertex: Vertex<'_, '_, C::Number>,
        path: &Scattered<C::Number>,
        (survival, goes_on): (f64, bool),
        (trail, parts): (&mut Trail<C::Number>, &mut impl Parts<C>),
        samples: &mut Draws<'_>,
    ) -> Option<Scattered<C::Number>> {
        let Vertex { point, shading } = vertex;
        let throughput = path.throughput * C::Number::constant(survival);
        let path = &Scattered { throughput, ..*path };
        let (x, origin) = (point.position.value(), point.position);
        let (c, [a, b]) = (samples.one(), samples.pair());
        let numbers = [a, b, c];
        let sampled = match shading.sample(numbers)? {
            Bounce::Smooth(sampled) => sampled,
            Bounce::Ideal(Ideal { branch, direction, factor }) => {
                if parts.is_first_alone() && matches!(trail.departure, Departure::Film) {
                    return None;
                }
                let hit = self.scene.closest(x, direction.value(), Some(point.surface));
                if let Some(hit) = path.hit.filter(|_| calculus.follows_chains()) {
                    trail.pass(branch, Passed { hit, numbers, survival });
                }
                let next = self.again(calculus, parts, trail, hit, None).unwrap_or_else(|| {
                    let compression = path.compression * shading.compression(direction.value());
                    Scattered { origin, direction, throughput: throughput * factor, compression, hit }
                });
                // Next-event estimation never samples an ideal direction: the weight is 1.
                let seen = next.throughput * self.seen(calculus, &next);
                let total = parts.total();
                *total = *total + seen;
                return (goes_on && hit.is_some()).then_some(next);
            }
        };
        let notes = calculus.follows_chains() || parts.is_first_alone();
        let total = parts.total();
        if let Some(hit) = path.hit.filter(|_| notes) {
            let Sampled { direction, density } = sampled;
            trail.depart(Departure::Bounce { arriving: *path, hit, direction, density });
        }
        let Sampled { direction, density } = sampled;
        let hit = if goes_on || self.lights.may_be_hit(x, direction) {
            calculus.next_hit(self.scene, x, point.surface, direction)
        } else if self.escapes_last(x, point.surface, direction) {
            None
        } else {
            return None;
        };
        self.emission(calculus, vertex, throughput, sampled, hit, total);
        let environment = matches!(self.scene.description.environment, Some(Environment::Constant { .. }));
        if if hit.is_some() { !goes_on } else { !environment } {
            return None;
        }
        // No control variate at the last bounce: it would increase cost and variance there, as the field
        // would be needed for dark directions and the silhouettes behind them.
        let level = self.level(calculus).filter(|_| goes_on);
        let still = Warped::still(direction);
        let warped = if hit.is_none() && level.is_some() {
            still
        } else {
            let sees = if goes_on { VisibilityDomain::Radiance } else { VisibilityDomain::Distant };
            let kernel = || self.kernels.of_bounce(shading, sees, hit.map(|h| h.surface));
            // Curves that a field leaves are not sampled behind ideal boundaries.
            let has_curves = trail.has_passed && !self.scene.normals.is_empty();
            if has_curves && calculus.follows_chains() {
                calculus.chain_warp(point.position, point.surface, direction, kernel(), &[], None)
            } else {
                warp(calculus, vertex, direction, kernel)
            }
        };
        let reflected = throughput * reflect(shading, &warped, 1.0 / density);
        if hit.is_none() {
            *total = *total + reflected * self.constant_environment(calculus);
            return None;
        }
        if let Some(level) = level.filter(|_| !warped.is_still()) {
            let unwarped = throughput * reflect(shading, &still, 1.0 / density);
            *total = *total + (unwarped - reflected) * Rgb::constant(level);
        }
        let compression = path.compression * shading.compression(direction);
        Some(Scattered { origin, direction: warped.direction, throughput: reflected, compression, hit })
    }

    /// Control variate at bounces: the radiance E of a constant environment, so that ∇·(V f) is weighted by
    /// L − E. The integral of ∇·(V f) over all directions is 0, as V is continuous where f is nonzero.
    /// Escaping rays then need no field, and where light arrives from almost everywhere there is little
    /// noise.
    ///
    /// > ∂ ∫ f L dω = ∫ ∂f L + f ∂L + (L − E) ∇·(V f) dω
    #[inline]
    fn level<C: Calculus>(&self, calculus: &C) -> Option<DVec3> {
        match self.scene.description.environment {
            Some(Environment::Constant { radiance, .. }) if calculus.levels_bounces() => Some(radiance),
            _ => None,
        }
    }

    /// Whether the last ray of a path, which meets no emitter, reaches light from beyond the scene; its other
    /// hits do not matter.
    #[inline]
    fn escapes_last(&self, x: DVec3, from: Surface, direction: DVec3) -> bool {
        let environment = matches!(self.scene.description.environment, Some(Environment::Constant { .. }));
        (environment || !self.distant.is_empty()) && !self.scene.shadowed(x, from, direction, f64::INFINITY)
    }

    /// Emission found in a sampled direction, with its multiple importance sampling weight against next-event
    /// estimation.
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

/// The warp at a vertex. At transmissive surfaces it is that of chains, the only field that follows
/// discontinuities on both sides.
#[inline]
pub(super) fn warp<C: Calculus>(
    calculus: &mut C,
    Vertex { point, shading }: Vertex<'_, '_, C::Number>,
    direction: DVec3,
    kernel: impl FnOnce() -> Kernel,
) -> Warped<C::Number> {
    if !C::WARPS {
        return Warped::still(direction);
    }
    if shading.transmits() {
        if !calculus.follows_chains() {
            return Warped::still(direction);
        }
        return calculus.chain_warp(point.position, point.surface, direction, kernel(), &[], None);
    }
    calculus.warp(point.position, point.surface, direction, kernel())
}

/// f cos θ of a warped direction, times the Jacobian and a weight.
#[inline]
pub(super) fn reflect<T: Number>(shading: &Shading<'_, T>, warped: &Warped<T>, weight: f64) -> Rgb<T> {
    shading.evaluate(warped.direction) * (warped.jacobian * weight)
}
