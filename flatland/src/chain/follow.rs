//! Chains: the points of ideal reflections, refractions and openings from the camera to the first diffuse
//! surface, with the light that they carry.

use glam::DVec2;

use super::curve::Contact;
use super::world::{Light, Optics, Source, World};
use crate::calculus::{Number, Vec2};
use crate::transport::Camera;

/// A point of a chain, or of a shadow.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Vertex<T> {
    pub(crate) surface: usize,
    pub(crate) is_far: bool,
    /// Whether the ray arrives on the curve's left side.
    pub(crate) is_left: bool,
    /// Whether it is a total reflection.
    pub(crate) is_total: bool,
    /// The material coordinate.
    pub(crate) s: T,
    /// See [`Contact::depth`].
    pub(crate) depth: Option<T>,
    /// Displacement across the ray per unit of s.
    pub(crate) across: f64,
}

/// The end of a chain.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum End {
    /// In the environment.
    Environment,
    /// On a diffuse surface.
    Diffuse,
    /// At a total reflection, if the chain was to be refracted.
    Dark,
    /// After the most points allowed.
    TooLong,
}

/// A summand of the integrand: emitted light, or the light of one light without extent.
#[derive(Clone, Debug)]
pub(crate) struct Part<T> {
    pub(crate) value: T,
    /// Points between the last point and the light, from the last point on, up to the first opaque one.
    pub(crate) shadows: Vec<Vertex<T>>,
    /// Whether the light is above the last point's horizon.
    pub(crate) is_above: bool,
}

/// A chain, from the camera on.
#[derive(Clone, Debug)]
pub(crate) struct Chain<T> {
    pub(crate) vertices: Vec<Vertex<T>>,
    pub(crate) end: End,
    /// Emitted light, then the lights in order. Every decision of the chain counts twice: the mean over fair
    /// decisions is the radiance.
    pub(crate) parts: Vec<Part<T>>,
    pub(crate) rays: u64,
}

/// The point whose ray is evaluated in the limit of a tangent to its arc.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Touching {
    /// The k-th point of the chain.
    Chain(usize),
    /// The k-th point of each light's shadow.
    Shadow(usize),
}

/// A hit, without derivatives.
struct Hit {
    surface: usize,
    distance: f64,
    is_far: bool,
}

impl World {
    /// The nearest hit; `from` is the surface on which the ray starts.
    fn trace(&self, origin: DVec2, direction: DVec2, from: Option<usize>) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        for (surface, s) in self.surfaces().iter().enumerate() {
            if let Some(meeting) = s.curve.meet(origin, direction, from == Some(surface))
                && best.as_ref().is_none_or(|b| meeting.distance < b.distance)
            {
                best = Some(Hit { surface, distance: meeting.distance, is_far: meeting.is_far });
            }
        }
        best
    }

    fn vertex<S: Source>(
        &self,
        source: &S,
        ray: [Vec2<S::Number>; 2],
        hit: &Hit,
        touches: bool,
    ) -> (Vertex<S::Number>, Contact<S::Number>) {
        let curve = self.curve(source, hit.surface);
        let contact = curve.contact(ray, hit.is_far, touches);
        let cosine = contact.normal.value().dot(ray[1].value());
        let vertex = Vertex {
            surface: hit.surface,
            is_far: hit.is_far,
            is_left: cosine < 0.0,
            is_total: false,
            s: contact.s,
            depth: contact.depth,
            across: cosine.abs() * curve.length(),
        };
        (vertex, contact)
    }

    /// The chain at the film coordinate u, of at most `longest` points. `decide` chooses between the two
    /// continuations of the k-th point that has two, given the probability that a sample should give to
    /// the first.
    pub(crate) fn follow<S: Source>(
        &self,
        source: &S,
        camera: &Camera,
        u: S::Number,
        longest: usize,
        touching: Option<Touching>,
        mut decide: impl FnMut(usize, f64) -> bool,
    ) -> Chain<S::Number> {
        let place = [camera.position.x, camera.position.y, camera.angle, camera.field_of_view];
        let [x, y, angle, field_of_view] = source.numbers(self.count(), place);
        let mut ray = [Vec2::new(x, y), camera.film.direction(u, angle, field_of_view)];
        let constant = S::Number::constant;
        let mut throughput = constant(1.0);
        let mut chain = Chain { vertices: vec![], end: End::TooLong, parts: vec![], rays: 0 };
        let (mut from, mut decisions) = (None, 0);
        let mut decide = |probability: f64| {
            decisions += 1;
            decide(decisions - 1, probability)
        };
        let mut emitted = constant(0.0);
        let mut last = None;
        while chain.vertices.len() < longest {
            chain.rays += 1;
            let Some(hit) = self.trace(ray[0].value(), ray[1].value(), from) else {
                chain.end = End::Environment;
                emitted = self.sky(source);
                break;
            };
            let touches = touching == Some(Touching::Chain(chain.vertices.len()));
            let (vertex, contact) = self.vertex(source, ray, &hit, touches);
            chain.vertices.push(vertex);
            from = Some(hit.surface);
            // The normal on the side of the ray.
            let normal = if vertex.is_left { contact.normal } else { -contact.normal };
            let direction = ray[1];
            let cosine = -normal.dot(direction);
            let reflected = direction + normal * (cosine * 2.0);
            ray[0] = contact.point;
            match self.optics(source, hit.surface) {
                Optics::Mirror { reflectance } => {
                    throughput = throughput * reflectance;
                    ray[1] = reflected;
                }
                Optics::Glass { index } => {
                    // Index of the medium behind the surface divided by that before it.
                    let ratio = if vertex.is_left { index } else { constant(1.0) / index };
                    let sine = (constant(1.0) - cosine.squared()) / ratio.squared();
                    let is_total = sine.value() >= 1.0;
                    chain.vertices.iter_mut().last().into_iter().for_each(|v| v.is_total = is_total);
                    let inside = (constant(1.0) - sine).positive().sqrt();
                    let part = if is_total { constant(1.0) } else { fresnel(cosine, inside, ratio) };
                    let probability = if is_total { 1.0 } else { defensive(part.value()) };
                    if decide(probability) {
                        throughput = throughput * part * 2.0;
                        ray[1] = reflected;
                    } else if is_total {
                        chain.end = End::Dark;
                        break;
                    } else {
                        // Radiance divided by the index is conserved in the plane.
                        throughput = throughput * (constant(1.0) - part) / ratio * 2.0;
                        let bent = (direction + normal * cosine) * (constant(1.0) / ratio);
                        ray[1] = bent - normal * inside;
                    }
                }
                Optics::Diffuse { reflectance, emission: [a, b], opacity } => {
                    let is_open = opacity.value() < 1.0;
                    if is_open && !decide(defensive(opacity.value())) {
                        throughput = throughput * (constant(1.0) - opacity) * 2.0;
                        continue;
                    }
                    if is_open {
                        throughput = throughput * opacity * 2.0;
                    }
                    chain.end = End::Diffuse;
                    emitted = a + (b - a) * vertex.s;
                    last = Some((contact.point, normal, throughput * reflectance * 0.5, hit.surface));
                    break;
                }
            }
        }
        let is_above = false;
        chain.parts.push(Part { value: throughput * emitted, shadows: vec![], is_above });
        for light in 0..self.lights().len() {
            chain.parts.push(match last {
                Some((point, normal, reflected, surface)) => {
                    chain.rays += 1;
                    self.lit(source, light, [point, normal], surface, reflected, touching)
                }
                None => Part { value: constant(0.0), shadows: vec![], is_above },
            });
        }
        chain
    }

    /// Light of one light, reflected at a point: f cos φ E times the part of it that openings let pass.
    fn lit<S: Source>(
        &self,
        source: &S,
        light: usize,
        [point, normal]: [Vec2<S::Number>; 2],
        surface: usize,
        reflected: S::Number,
        touching: Option<Touching>,
    ) -> Part<S::Number> {
        let constant = S::Number::constant;
        let (towards, irradiance, mut reach) = match self.light(source, light) {
            Light::Point { position, intensity } => {
                let to_light = position - point;
                let distance = to_light.dot(to_light).sqrt();
                (to_light * (constant(1.0) / distance), intensity / distance, distance.value())
            }
            Light::Directional { angle, irradiance } => {
                (Vec2::new(angle.cos(), angle.sin()), irradiance, f64::INFINITY)
            }
        };
        let cosine = normal.dot(towards);
        let is_above = cosine.value() > 0.0;
        let mut value = reflected * irradiance * cosine.positive();
        let mut shadows: Vec<Vertex<S::Number>> = vec![];
        if is_above {
            let ray = [point, towards];
            let (mut origin, mut from) = (point.value(), Some(surface));
            while let Some(hit) = self.trace(origin, towards.value(), from).filter(|hit| hit.distance < reach)
            {
                let opacity = match self.optics(source, hit.surface) {
                    Optics::Diffuse { opacity, .. } => opacity,
                    Optics::Mirror { .. } | Optics::Glass { .. } => constant(1.0),
                };
                let touches = touching == Some(Touching::Shadow(shadows.len()));
                shadows.push(self.vertex(source, ray, &hit, touches).0);
                if opacity.value() == 1.0 {
                    value = constant(0.0);
                    break;
                }
                value = value * (constant(1.0) - opacity);
                origin += hit.distance * towards.value();
                reach -= hit.distance;
                from = Some(hit.surface);
            }
        }
        Part { value, shadows, is_above }
    }
}

/// Probability of a continuation that carries this part of the light: bounded away from 0, as derivatives of
/// a part do not vanish with it.
fn defensive(part: f64) -> f64 {
    0.25 + 0.5 * part
}

/// The reflected part of unpolarised light, given the cosines of incidence and refraction and the ratio of
/// the refractive indices behind and before the interface.
fn fresnel<T: Number>(cosine: T, inside: T, ratio: T) -> T {
    let across = (cosine - ratio * inside) / (cosine + ratio * inside);
    let along = (ratio * cosine - inside) / (ratio * cosine + inside);
    (across.squared() + along.squared()) * 0.5
}

impl<T: Number> Vertex<T> {
    /// Whether two points are on the same side of the same curve and at the same of its intersections.
    pub(crate) fn is_like(&self, other: &Self) -> bool {
        (self.surface, self.is_far, self.is_left) == (other.surface, other.is_far, other.is_left)
    }
}
