//! Light sampling: a light, a direction to it, and its radiance.

use std::f64::consts::{PI, TAU};

use glam::DVec3;

use super::bsdf::Sampled;
use super::calculus::VisibilityDomain;
use super::emitter::{Area, BorderPoint, Spot};
use super::map::{MapSampler, luminance};
use crate::scene::{Environment, Hit, Light, Scene, Surface};

/// A light of next-event estimation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum LightId {
    /// The front of a shape.
    Shape(u32),
    /// A light without surface.
    Light(u32),
    /// An environment map.
    Environment,
}

/// A light, with its sampling probability.
#[derive(Clone, Debug)]
struct Entry {
    id: LightId,
    probability: f64,
}

/// All lights of next-event estimation: half of the samples by power, half uniformly. A constant environment
/// is not included, as BSDF sampling finds it as well.
#[derive(Clone, Debug, Default)]
pub(crate) struct Lights {
    entries: Vec<Entry>,
    /// Index in `entries` of each shape, if it emits.
    of_shape: Vec<Option<u32>>,
    /// The entries that are shapes.
    areas: Vec<Area>,
    /// Bounding spheres of all emitting shapes.
    around: Vec<Around>,
    /// Sampler of the environment map, if there is one.
    map: Option<MapSampler>,
}

/// A slightly enlarged bounding sphere of an emitting shape.
#[derive(Clone, Copy, Debug)]
struct Around {
    centre: DVec3,
    squared_radius: f64,
}

impl Around {
    fn new(area: &Area) -> Self {
        Self { centre: area.centre, squared_radius: area.radius * area.radius * (1.0 + ROUNDING) }
    }

    /// Whether a ray may meet it.
    #[inline]
    fn may_be_hit(&self, x: DVec3, direction: DVec3) -> bool {
        let way = self.centre - x;
        let (squared, along) = (way.length_squared(), way.dot(direction));
        let within = self.squared_radius + ROUNDING * squared;
        squared <= within || (along > 0.0 && squared - along * along <= within)
    }
}

/// Relative enlargement of squared lengths in bounding spheres, for rounding of 10⁻¹⁴.
const ROUNDING: f64 = 1e-9;

/// A point of an emitting shape.
pub(super) struct Place {
    pub(super) spot: Spot,
    /// Probability of the shape, and its total area.
    pub(super) probability: f64,
    pub(super) area: f64,
}

/// A light sample: a direction towards it with its density, and its distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct LightSample {
    pub(crate) id: LightId,
    pub(crate) sampled: Sampled,
    /// Length of the shadow ray, and the surface at its end.
    pub(crate) distance: f64,
    pub(crate) surface: Option<Surface>,
    /// Whether the light is a single direction or point: then `density` is the probability of its choice, and
    /// nothing is warped.
    pub(crate) delta: bool,
}

impl Lights {
    pub(crate) fn new(scene: &Scene) -> Self {
        let mut lights = Self { of_shape: vec![None; scene.description.shapes.len()], ..Self::default() };
        let mut powers = vec![];
        for (s, shape) in scene.description.shapes.iter().enumerate() {
            let Some(radiance) = shape.radiance else { continue };
            let area = Area::new(scene, s);
            lights.around.push(Around::new(&area));
            let whole = area.whole();
            if whole > 0.0 {
                lights.of_shape[s] = Some(lights.entries.len() as u32);
                lights.push(LightId::Shape(s as u32));
                powers.push(PI * whole * luminance(radiance * mean(scene, shape.radiance_texture)));
                lights.areas.push(area);
            }
        }
        let reach = scene.bounds().map_or(1.0, |(low, high)| 0.5 * (high - low).length());
        for (i, light) in scene.lights().iter().enumerate() {
            lights.push(LightId::Light(i as u32));
            powers.push(match light {
                Light::Directional { irradiance, .. } => PI * reach * reach * luminance(*irradiance),
                Light::Point { intensity, .. } => 4.0 * PI * luminance(*intensity),
                // An upper bound, if it is textured.
                Light::Spot { intensity, cutoff, .. } => TAU * (1.0 - cutoff.cos()) * luminance(*intensity),
                Light::Projector { intensity, field_of_view, aspect, .. } => {
                    4.0 * PI * (0.5 * field_of_view).tan().powi(2) / aspect * luminance(*intensity)
                }
            });
        }
        if let Some(Environment::Map { texture, scale, .. }) = &scene.description.environment {
            let sampler = MapSampler::new(scene, *texture);
            lights.push(LightId::Environment);
            powers.push(4.0 * PI * PI * reach * reach * scale * sampler.mean());
            lights.map = Some(sampler);
        }
        lights.share(&powers);
        lights
    }

    fn push(&mut self, id: LightId) {
        self.entries.push(Entry { id, probability: 0.0 });
    }

    /// Half by power, half uniformly: a weak light may be the only one that illuminates a place.
    fn share(&mut self, powers: &[f64]) {
        let (sum, n) = (powers.iter().sum::<f64>(), powers.len() as f64);
        for (entry, power) in self.entries.iter_mut().zip(powers) {
            let by_power = if sum > 0.0 { power / sum } else { 1.0 / n };
            entry.probability = 0.5 * by_power + 0.5 / n;
        }
    }

    /// Whether a ray may meet an emitting shape.
    #[inline]
    pub(super) fn may_be_hit(&self, x: DVec3, direction: DVec3) -> bool {
        self.around.iter().any(|around| around.may_be_hit(x, direction))
    }

    #[inline]
    fn area(&self, shape: u32) -> Option<&Area> {
        self.areas.iter().find(|a| a.shape == shape)
    }

    /// Samples a light, and returns a number for its points.
    #[inline]
    fn choose(&self, choice: f64) -> Option<(&Entry, f64)> {
        let mut rest = choice;
        let last = self.entries.len().checked_sub(1)?;
        let mut chosen = last;
        for (i, entry) in self.entries.iter().enumerate() {
            if rest < entry.probability || i == last {
                chosen = i;
                break;
            }
            rest -= entry.probability;
        }
        let entry = &self.entries[chosen];
        // The remainder of the random number is uniform again.
        Some((entry, (rest / entry.probability).clamp(0.0, 1.0 - f64::EPSILON)))
    }

    /// The point of an emitting shape that [`sample`](Self::sample) chooses, independent of the viewpoint;
    /// `None` if there is none, or another kind of light is chosen.
    pub(super) fn place(&self, [choice, a, b]: [f64; 3]) -> Option<Place> {
        let (&Entry { id, probability }, again) = self.choose(choice)?;
        let LightId::Shape(shape) = id else { return None };
        let area = self.area(shape)?;
        Some(Place { spot: area.sample([again, a, b]), probability, area: area.whole() })
    }

    /// Samples a direction from x towards a light; `None` if there is no light, or it faces away from x.
    #[inline]
    pub(crate) fn sample(&self, scene: &Scene, x: DVec3, [choice, a, b]: [f64; 3]) -> Option<LightSample> {
        let (&Entry { id, probability }, again) = self.choose(choice)?;
        let towards = |direction, density: f64, distance, delta| LightSample {
            id,
            sampled: Sampled { direction, density: density * probability },
            distance,
            surface: None,
            delta,
        };
        match id {
            LightId::Shape(shape) => {
                let area = self.area(shape)?;
                let y = area.sample([again, a, b]);
                let way = y.point - x;
                let squared = way.length_squared();
                let distance = squared.sqrt();
                let direction = way / distance;
                let cosine = -direction.dot(y.normal);
                if cosine.is_nan() || cosine <= 0.0 {
                    return None;
                }
                let density = squared / (cosine * area.whole());
                let towards =
                    LightSample { surface: Some(y.surface), ..towards(direction, density, distance, false) };
                Some(towards).filter(|_| density.is_finite())
            }
            LightId::Light(light) => match &scene.lights()[light as usize] {
                Light::Point { position, .. }
                | Light::Spot { position, .. }
                | Light::Projector { position, .. } => {
                    let way = *position - x;
                    let direction = way.try_normalize()?;
                    Some(towards(direction, 1.0, way.length(), true))
                }
                Light::Directional { direction, kappa, .. } if kappa.is_infinite() => {
                    Some(towards(-*direction, 1.0, f64::INFINITY, true))
                }
                Light::Directional { direction, kappa, .. } => {
                    let (way, density) = von_mises_fisher(-*direction, *kappa, [a, b]);
                    Some(towards(way, density, f64::INFINITY, false))
                }
            },
            LightId::Environment => {
                let Some(Environment::Map { to_world, texture, .. }) = &scene.description.environment else {
                    return None;
                };
                let image = &scene.description.textures[*texture];
                let (way, density) = self.map.as_ref()?.sample(image, [again, a, b]);
                Some(towards(*to_world * way, density, f64::INFINITY, false))
            }
        }
    }

    /// Density of [`sample`](Self::sample) for a direction along which an emitting shape is hit.
    pub(crate) fn density_of_hit(&self, scene: &Scene, shape: u32, hit: &Hit, direction: DVec3) -> f64 {
        let Some(entry) = self.of_shape[shape as usize] else { return 0.0 };
        let Some(area) = self.area(shape) else { return 0.0 };
        let Surface::Triangle(triangle) = hit.surface else { return 0.0 };
        let cosine = -direction.dot(scene.face_normal(triangle));
        self.entries[entry as usize].probability * hit.distance * hit.distance / (cosine.abs() * area.whole())
    }

    /// Density of [`sample`](Self::sample) for a direction that leaves the scene, for one light.
    pub(crate) fn density_of_escape(&self, scene: &Scene, id: LightId, direction: DVec3) -> f64 {
        let Some(entry) = self.entries.iter().find(|e| e.id == id) else { return 0.0 };
        entry.probability
            * match id {
                LightId::Shape(_) => 0.0,
                LightId::Light(light) => match &scene.lights()[light as usize] {
                    Light::Directional { direction: along, kappa, .. } if kappa.is_finite() => {
                        lobe(-*along, *kappa, direction)
                    }
                    _ => 0.0,
                },
                LightId::Environment => match (&scene.description.environment, &self.map) {
                    (Some(Environment::Map { to_world, texture, .. }), Some(map)) => {
                        map.density(&scene.description.textures[*texture], to_world.transpose() * direction)
                    }
                    _ => 0.0,
                },
            }
    }

    /// Occlusion domain of an emitter: the half space in front of its plane if it is flat, else everything.
    pub(crate) fn domain(&self, shape: u32) -> VisibilityDomain {
        match self.area(shape).and_then(|a| a.border.as_ref()) {
            Some(border) => {
                VisibilityDomain::BeforePlane { normal: border.normal, offset: border.offset, shape }
            }
            None => VisibilityDomain::Radiance,
        }
    }

    /// Whether an emitter is flat, so that its border is a separate integral.
    pub(crate) fn is_flat(&self, shape: u32) -> bool {
        self.area(shape).is_some_and(|area| area.border.is_some())
    }

    /// Whether a shape is the only light.
    pub(crate) fn is_the_only(&self, shape: u32) -> bool {
        matches!(self.entries.as_slice(), [Entry { id: LightId::Shape(only), .. }] if *only == shape)
    }

    /// Ends of the edge that contains [`border_point`](Self::border_point).
    pub(crate) fn border_ends(&self, scene: &Scene, shape: u32, xi: f64) -> Option<[u32; 2]> {
        self.area(shape)?.border.as_ref()?.ends(scene, xi)
    }

    /// A point on the border of a flat emitter, uniform by length; `None` for others.
    pub(crate) fn border_point(&self, scene: &Scene, shape: u32, xi: f64) -> Option<BorderPoint> {
        self.area(shape)?.border.as_ref()?.point(scene, xi)
    }

    /// Probability with which next-event estimation chooses a light.
    pub(crate) fn probability(&self, id: LightId) -> f64 {
        self.entries.iter().find(|e| e.id == id).map_or(0.0, |e| e.probability)
    }

    /// Bounding spheres of all lights; `None` if some are infinitely far away.
    pub(crate) fn spheres(&self) -> Option<Vec<(DVec3, f64)>> {
        let near = |e: &Entry| matches!(e.id, LightId::Shape(_));
        self.entries.iter().all(near).then(|| self.areas.iter().map(|a| (a.centre, a.radius)).collect())
    }

    /// Emitting shapes, each with the centre and radius of its bounding sphere.
    pub(crate) fn shapes(&self) -> impl Iterator<Item = (u32, DVec3, f64)> {
        self.areas.iter().map(|area| (area.shape, area.centre, area.radius))
    }

    /// Half angle of the cone in which a shape is seen from x; π inside its bounding sphere.
    pub(crate) fn half_angle(&self, shape: u32, x: DVec3) -> f64 {
        let Some(area) = self.area(shape) else { return PI };
        let distance = area.centre.distance(x);
        if distance <= area.radius { PI } else { (area.radius / distance).asin() }
    }
}

/// Mean of a texture's texels, or 1 without a texture.
fn mean(scene: &Scene, texture: Option<usize>) -> DVec3 {
    let texels = texture.map(|index| &scene.description.textures[index].texels);
    texels.map_or(DVec3::ONE, |texels| texels.iter().sum::<DVec3>() / texels.len() as f64)
}

/// κ e^{−κ(1 − ω·ω₀)}/(2π(1 − e^{−2κ})).
pub(crate) fn lobe(axis: DVec3, kappa: f64, direction: DVec3) -> f64 {
    let versine = 0.5 * (direction - axis).length_squared();
    kappa * (-kappa * versine).exp() / (-TAU * (-2.0 * kappa).exp_m1())
}

fn von_mises_fisher(axis: DVec3, kappa: f64, [a, b]: [f64; 2]) -> (DVec3, f64) {
    let versine = (-(a * (-2.0 * kappa).exp_m1()).ln_1p() / kappa).min(2.0);
    let (s, t) = axis.any_orthonormal_pair();
    let (sin, cos) = (TAU * b).sin_cos();
    let direction = axis - versine * axis + (versine * (2.0 - versine)).sqrt() * (cos * s + sin * t);
    (direction, lobe(axis, kappa, direction))
}
