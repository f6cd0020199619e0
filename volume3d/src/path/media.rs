//! Path tracer for scenes with participating media, in plain numbers: it has no derivatives.
//!
//! A path estimates the equation of transfer ([`Medium`](crate::scene::Medium)) and surface scattering. A
//! segment continues straight through clear boundaries until it scatters in a medium or hits a surface that
//! is not clear. All emission along a sampled direction is added with its exact transmittance, whether or not
//! the path scatters before it, and so is the light found by next-event estimation through clear boundaries:
//! both are integrals over directions of the same integrand, combined by the balance heuristic (Veach 1997,
//! section 9.2).

use std::f64::consts::TAU;

use flatland::calculus::Vec3;
use glam::DVec3;

use super::bsdf::{Bounce, Sampled, Shading};
use super::emission::{emitted, radiance_at};
use super::environment::distant;
use super::free_flight::free_flight;
use super::integrator::{Paths, SURVIVAL};
use super::lights::{LightId, LightSample};
use super::plain::Plain;
use super::sequence::Draws;
use super::spot::profile;
use super::surface::SurfacePoint;
use crate::optics::phase;
use crate::scene::{Hit, Light, Scene, Surface};

/// A straight segment of a path whose end is not yet known.
struct Leg {
    origin: DVec3,
    direction: DVec3,
    /// First surface on the way.
    hit: Option<Hit>,
    medium: Option<usize>,
    throughput: DVec3,
    /// Accumulated compression of radiance, η²: Russian roulette must not treat it as loss.
    compression: f64,
    /// Density of the direction, if next-event estimation could have sampled it too.
    density: Option<f64>,
    /// Whether it starts at a camera that does not see emitters.
    hides: bool,
}

/// Result of a straight segment: emission along it, and its end.
struct Flight<'s> {
    seen: DVec3,
    throughput: DVec3,
    end: Option<Vertex<'s>>,
}

/// A scattering point.
enum Vertex<'s> {
    Particle { position: DVec3, direction: DVec3, medium: usize, asymmetry: f64 },
    Surface { point: SurfacePoint<f64>, shading: Box<Shading<'s, f64>>, medium: Option<usize> },
}

impl Vertex<'_> {
    fn position(&self) -> DVec3 {
        match self {
            Self::Particle { position, .. } => *position,
            Self::Surface { point, .. } => point.position.value(),
        }
    }

    fn surface(&self) -> Option<Surface> {
        match self {
            Self::Particle { .. } => None,
            Self::Surface { point, .. } => Some(point.surface),
        }
    }

    /// f |cos θ|, or the phase function; absorption is part of the throughput.
    fn evaluate(&self, towards: DVec3) -> DVec3 {
        match self {
            Self::Particle { direction, asymmetry, .. } => {
                DVec3::splat(phase::henyey_greenstein(*asymmetry, direction.dot(towards)))
            }
            Self::Surface { shading, .. } => shading.evaluate(Vec3::constant(towards)).value(),
        }
    }

    fn density(&self, towards: DVec3) -> f64 {
        match self {
            Self::Particle { .. } => self.evaluate(towards).x,
            Self::Surface { shading, .. } => shading.density(towards),
        }
    }

    /// The medium into which a direction leads.
    fn medium_towards(&self, scene: &Scene, towards: DVec3) -> Option<usize> {
        match self {
            Self::Particle { medium, .. } => Some(*medium),
            Self::Surface { point, medium, .. } => scene.medium_towards(point.surface, towards, *medium),
        }
    }
}

impl<'s> Paths<'s> {
    /// One sample of the radiance that arrives at the camera from `hit`.
    pub(super) fn radiance_through_media(
        &self,
        origin: DVec3,
        direction: DVec3,
        hit: Option<Hit>,
        samples: &mut Draws<'_>,
    ) -> DVec3 {
        let description = &self.scene.description;
        let mut leg = Leg {
            origin,
            direction,
            hit,
            medium: description.camera_medium,
            throughput: DVec3::ONE,
            compression: 1.0,
            density: None,
            hides: description.hide_emitters,
        };
        let mut total = DVec3::ZERO;
        let limit = description.integrator.max_depth.unwrap_or(usize::MAX);
        for depth in 1.. {
            let Flight { seen, throughput, end } = self.fly(&leg, samples);
            total += seen;
            let Some(vertex) = end.filter(|_| depth < limit && throughput != DVec3::ZERO) else { break };
            total += throughput * self.next_event_through_media(&vertex, samples);
            let mut survival = 1.0;
            if depth >= description.integrator.rr_depth {
                survival = (throughput.max_element() * leg.compression).min(SURVIVAL);
                if samples.one() >= survival {
                    break;
                }
            }
            match self.scattered(&vertex, throughput / survival, leg.compression, samples) {
                Some(next) => leg = next,
                None => break,
            }
        }
        total
    }

    /// Follows a segment to its scattering point, and adds all emission along its direction.
    fn fly(&self, leg: &Leg, samples: &mut Draws<'_>) -> Flight<'s> {
        let (scene, direction) = (self.scene, leg.direction);
        let mut flight = Flight { seen: DVec3::ZERO, throughput: leg.throughput, end: None };
        // Throughput without any scattering.
        let mut clear = leg.throughput;
        let (mut origin, mut hit, mut medium, mut travelled) = (leg.origin, leg.hit, leg.medium, 0.0);
        loop {
            let length = hit.map_or(f64::INFINITY, |hit| hit.distance);
            if let Some(index) = medium {
                let medium = &scene.description.media[index];
                clear *= medium.transmittance(length);
                if flight.end.is_none() && flight.throughput != DVec3::ZERO {
                    let (event, carried) = free_flight(medium, length, flight.throughput, samples);
                    flight.throughput = carried;
                    flight.end = event.map(|distance| {
                        let (position, asymmetry) = (origin + distance * direction, medium.asymmetry);
                        Vertex::Particle { position, direction, medium: index, asymmetry }
                    });
                }
            }
            let Some(at) = hit else {
                flight.seen += clear * self.seen_beyond(leg);
                return flight;
            };
            travelled += at.distance;
            flight.seen += clear * self.seen_at(leg, &Hit { distance: travelled, ..at });
            if !(scene.is_clear(at.surface) || leg.hides && scene.is_emitter(at.surface)) {
                if flight.end.is_none() {
                    flight.end = self.vertex((origin, direction), &at, medium);
                }
                return flight;
            }
            if clear == DVec3::ZERO && flight.end.is_some() {
                return flight;
            }
            medium = scene.medium_towards(at.surface, direction, medium);
            origin += at.distance * direction;
            hit = scene.closest(origin, direction, Some(at.surface));
        }
    }

    /// The scattering point on a surface, if it scatters.
    fn vertex(&self, (o, d): (DVec3, DVec3), hit: &Hit, medium: Option<usize>) -> Option<Vertex<'s>> {
        let (scene, plain) = (self.scene, Plain { scene: self.scene });
        let (o, d) = (Vec3::constant(o), Vec3::constant(d));
        let point = SurfacePoint::new(scene, &plain, o, d, hit.surface, hit.distance);
        let shading = Box::new(point.shading(scene, &plain)?);
        Some(Vertex::Surface { point, shading, medium })
    }

    /// Emission of a surface against the segment, with its multiple importance sampling weight against
    /// next-event estimation.
    fn seen_at(&self, leg: &Leg, hit: &Hit) -> DVec3 {
        let Some(triangle) = self.scene.emitting(hit, leg.direction).filter(|_| !leg.hides) else {
            return DVec3::ZERO;
        };
        let other =
            || self.lights.density_of_hit(self.scene, self.scene.shape_of(hit.surface), hit, leg.direction);
        radiance_at(self.scene, triangle, hit.coordinates) * weight(leg.density, other)
    }

    /// [`seen_at`](Self::seen_at) for lights at infinity.
    fn seen_beyond(&self, leg: &Leg) -> DVec3 {
        if leg.hides {
            return DVec3::ZERO;
        }
        let (plain, direction) = (Plain { scene: self.scene }, leg.direction);
        let lights = self.distant.iter().map(|&id| {
            let other = || self.lights.density_of_escape(self.scene, id, direction);
            let radiance = distant(self.scene, &plain, id, Vec3::constant(direction)).value();
            radiance * weight(leg.density, other)
        });
        lights.sum::<DVec3>() + self.constant_environment(&plain).value()
    }

    /// Direct light scattered at a point, from a sampled light.
    fn next_event_through_media(&self, vertex: &Vertex<'_>, samples: &mut Draws<'_>) -> DVec3 {
        let (choice, [a, b]) = (samples.one(), samples.pair());
        let x = vertex.position();
        let Some(towards) = self.lights.sample(self.scene, x, [choice, a, b]) else { return DVec3::ZERO };
        let Sampled { direction, density } = towards.sampled;
        let scattered = vertex.evaluate(direction);
        if scattered == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let passed = self.passed(vertex, direction, towards.distance);
        if passed == DVec3::ZERO {
            return DVec3::ZERO;
        }
        let other = if towards.delta { 0.0 } else { vertex.density(direction) };
        scattered * passed * self.sent(x, &towards) / (density + other)
    }

    /// Transmittance between a point and a position at a distance in a direction; 0 if a surface that is not
    /// clear is in between.
    fn passed(&self, vertex: &Vertex<'_>, direction: DVec3, distance: f64) -> DVec3 {
        let scene = self.scene;
        let (mut x, mut from) = (vertex.position(), vertex.surface());
        let mut medium = vertex.medium_towards(scene, direction);
        let (mut left, mut part) = (distance, DVec3::ONE);
        loop {
            let hit = self.nearest(x, direction, from).filter(|hit| hit.distance < scene.short_of(left));
            let length = hit.map_or(left, |hit| hit.distance);
            if let Some(medium) = medium {
                part *= scene.description.media[medium].transmittance(length);
            }
            let Some(hit) = hit else { return part };
            if !scene.is_clear(hit.surface) || part == DVec3::ZERO {
                return DVec3::ZERO;
            }
            medium = scene.medium_towards(hit.surface, direction, medium);
            (x, from, left) = (x + length * direction, Some(hit.surface), left - length);
        }
    }

    /// Nearest hit from a point, which may be on a surface but is not the camera.
    fn nearest(&self, x: DVec3, direction: DVec3, from: Option<Surface>) -> Option<Hit> {
        match from {
            Some(_) => self.scene.closest(x, direction, from),
            None => self.scene.beyond(x, direction, 0.0),
        }
    }

    /// Unoccluded light of a sampled light at a point: radiance, or irradiance for a light without extent.
    fn sent(&self, x: DVec3, towards: &LightSample) -> DVec3 {
        let (scene, plain, direction) = (self.scene, Plain { scene: self.scene }, towards.sampled.direction);
        match (towards.id, towards.surface) {
            (LightId::Light(light), _) if towards.delta => match &scene.lights()[light as usize] {
                Light::Directional { irradiance, .. } => *irradiance,
                own => {
                    let way = Vec3::constant(-direction);
                    let profile = profile(scene, &plain, (light as usize, own), way).value();
                    profile * own.power() / (towards.distance * towards.distance)
                }
            },
            (LightId::Shape(_), Some(Surface::Triangle(triangle))) => {
                let ray = (Vec3::constant(x), Vec3::constant(direction));
                emitted(scene, &plain, ray, triangle).value()
            }
            (id, _) => distant(scene, &plain, id, Vec3::constant(direction)).value(),
        }
    }

    /// Continuation of a path from a scattering point.
    fn scattered(
        &self,
        vertex: &Vertex<'_>,
        throughput: DVec3,
        compression: f64,
        samples: &mut Draws<'_>,
    ) -> Option<Leg> {
        let x = vertex.position();
        let (direction, factor, density, compression) = match vertex {
            Vertex::Particle { direction, asymmetry, .. } => {
                let [a, b] = samples.pair();
                let cosine = phase::sample_cosine(*asymmetry, a);
                let (s, t) = direction.any_orthonormal_pair();
                let (sin, cos) = (TAU * b).sin_cos();
                let across = (1.0 - cosine * cosine).sqrt() * (cos * s + sin * t);
                let way = (cosine * direction + across).normalize();
                (way, DVec3::ONE, Some(vertex.density(way)), compression)
            }
            Vertex::Surface { shading, .. } => {
                let (c, [a, b]) = (samples.one(), samples.pair());
                let (way, factor, density) = match shading.sample([a, b, c])? {
                    Bounce::Smooth(Sampled { direction, density }) => {
                        (direction, vertex.evaluate(direction) / density, Some(density))
                    }
                    // Next-event estimation never samples an ideal direction.
                    Bounce::Ideal(ideal) => (ideal.direction.value(), ideal.factor.value(), None),
                };
                (way, factor, density, compression * shading.compression(way))
            }
        };
        let throughput = throughput * factor;
        let hit = self.nearest(x, direction, vertex.surface());
        let medium = vertex.medium_towards(self.scene, direction);
        Some(Leg { origin: x, direction, hit, medium, throughput, compression, density, hides: false })
    }
}

/// Balance heuristic for a direction with a density, given the density of the other strategy.
fn weight(density: Option<f64>, other: impl FnOnce() -> f64) -> f64 {
    density.map_or(1.0, |density| density / (density + other()))
}
