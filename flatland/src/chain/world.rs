//! Worlds of curves with mirrors, glass and openings, under lights without extent.

use glam::DVec2;

use super::curve::Curve;
use super::error::ChainError;
use crate::calculus::{Number, Vec2};

/// The optical properties of a curve.
#[derive(Clone, Copy, Debug)]
pub enum Optics<T = f64> {
    /// A diffuse surface that emits, the same on both sides; paths of ideal reflections and refractions end
    /// here.
    Diffuse {
        /// ρ, the reflectance, in [0, 1].
        reflectance: T,
        /// The radiance at s = 0 and at s = 1, and linear between them.
        emission: [T; 2],
        /// The part of the light that meets the surface, in [0, 1]; the rest passes straight on. Below 1 the
        /// curve is an opening. A derivative by it is that of an opening: 0 at an opacity of 1.
        opacity: T,
    },
    /// An ideal mirror on both sides.
    Mirror {
        /// The reflected part of the light, in [0, 1].
        reflectance: T,
    },
    /// A smooth interface of two media. It reflects the part F of the light that Fresnel's equations give
    /// for unpolarised light, and refracts the rest.
    Glass {
        /// The refractive index of the right side divided by that of the left side.
        index: T,
    },
}

/// A curve with its optics.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// The curve.
    pub curve: Curve,
    /// Its optical properties.
    pub optics: Optics,
}

/// A light without extent: it shines on surfaces, and is not seen. Mirrors and glass cast shadows.
#[derive(Clone, Copy, Debug)]
pub enum Light<T = f64> {
    /// A point, with the irradiance I/r at the distance r.
    Point {
        /// The point.
        position: Vec2<T>,
        /// I, power per radian.
        intensity: T,
    },
    /// Parallel light.
    Directional {
        /// Direction towards the light, in radians from +x towards +y.
        angle: T,
        /// Irradiance of a surface that faces the light.
        irradiance: T,
    },
}

/// Curves and lights in an environment of constant radiance.
#[derive(Clone, Debug)]
pub struct World {
    environment: f64,
    surfaces: Vec<Surface>,
    lights: Vec<Light>,
    /// Index of the first number of each surface, then of each light, then of the environment.
    first: Vec<usize>,
}

/// Most numbers of a curve or of its optics.
const MOST: usize = 5;

impl Optics {
    /// An opaque diffuse surface that does not emit.
    #[must_use]
    pub fn diffuse(reflectance: f64) -> Self {
        Self::Diffuse { reflectance, emission: [0.0; 2], opacity: 1.0 }
    }

    /// An opaque black surface that emits.
    #[must_use]
    pub fn emitter(emission: [f64; 2]) -> Self {
        Self::Diffuse { reflectance: 0.0, emission, opacity: 1.0 }
    }

    /// The numbers: ρ, both radiances and the opacity; the reflectance; or the index.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        match *self {
            Self::Diffuse { reflectance, emission: [a, b], opacity } => vec![reflectance, a, b, opacity],
            Self::Mirror { reflectance } => vec![reflectance],
            Self::Glass { index } => vec![index],
        }
    }

    fn with(&self, numbers: &[f64]) -> Self {
        match (self, numbers) {
            (Self::Diffuse { .. }, &[reflectance, a, b, opacity, ..]) => {
                Self::Diffuse { reflectance, emission: [a, b], opacity }
            }
            (Self::Mirror { .. }, &[reflectance, ..]) => Self::Mirror { reflectance },
            (Self::Glass { .. }, &[index, ..]) => Self::Glass { index },
            _ => *self,
        }
    }

    fn fault(&self) -> Option<&'static str> {
        let is_part = |x: f64| (0.0..=1.0).contains(&x);
        match *self {
            Self::Diffuse { reflectance, .. } | Self::Mirror { reflectance } if !is_part(reflectance) => {
                Some("its reflectance is not in [0, 1]")
            }
            Self::Diffuse { opacity, .. } if !is_part(opacity) => Some("its opacity is not in [0, 1]"),
            Self::Diffuse { emission, .. } if !emission.iter().all(|&e| e >= 0.0 && e.is_finite()) => {
                Some("its emission is negative or not finite")
            }
            Self::Glass { index } if !(index > 0.0 && index.is_finite()) => {
                Some("its index is not positive and finite")
            }
            _ => None,
        }
    }
}

impl Light {
    /// A light in a point.
    #[must_use]
    pub fn point(position: DVec2, intensity: f64) -> Self {
        Self::Point { position: Vec2::constant(position), intensity }
    }

    /// The numbers: the position and I, or the angle and the irradiance.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        match *self {
            Self::Point { position, intensity } => vec![position.x, position.y, intensity],
            Self::Directional { angle, irradiance } => vec![angle, irradiance],
        }
    }

    fn with(&self, numbers: &[f64]) -> Self {
        match (self, numbers) {
            (Self::Point { .. }, &[x, y, intensity, ..]) => {
                Self::Point { position: Vec2::new(x, y), intensity }
            }
            (Self::Directional { .. }, &[angle, irradiance, ..]) => Self::Directional { angle, irradiance },
            _ => *self,
        }
    }
}

impl World {
    /// Builds a world.
    ///
    /// # Errors
    /// A [`ChainError`] that names the surface or the light.
    pub fn new(environment: f64, surfaces: Vec<Surface>, lights: Vec<Light>) -> Result<Self, ChainError> {
        if !(environment >= 0.0 && environment.is_finite()) {
            return Err(ChainError::Environment { environment });
        }
        for (surface, Surface { curve, optics }) in surfaces.iter().enumerate() {
            if curve.numbers().iter().any(|x| !x.is_finite()) {
                return Err(ChainError::Surface { surface, what: "its curve is not finite" });
            }
            if let Curve::Arc { radius, extent, .. } = *curve {
                if radius <= 0.0 {
                    return Err(ChainError::Surface { surface, what: "its radius is not positive" });
                }
                if extent.abs() > std::f64::consts::TAU {
                    return Err(ChainError::Surface { surface, what: "its extent is more than a turn" });
                }
            }
            if curve.length() == 0.0 {
                return Err(ChainError::Surface { surface, what: "its curve has no length" });
            }
            if let Some(what) = optics.fault() {
                return Err(ChainError::Surface { surface, what });
            }
        }
        for (second, b) in surfaces.iter().enumerate() {
            if let Some(first) = surfaces[..second].iter().position(|a| a.curve.meets(&b.curve)) {
                return Err(ChainError::Meet { first, second });
            }
        }
        for (light, content) in lights.iter().enumerate() {
            let (Light::Point { intensity: power, .. } | Light::Directional { irradiance: power, .. }) =
                *content;
            if content.numbers().iter().any(|x| !x.is_finite()) || power < 0.0 {
                return Err(ChainError::Light { light });
            }
        }
        let counts = surfaces.iter().map(|s| s.curve.numbers().len() + s.optics.numbers().len());
        let counts = counts.chain(lights.iter().map(|l| l.numbers().len()));
        let mut first = vec![0];
        for count in counts {
            first.push(first[first.len() - 1] + count);
        }
        Ok(Self { environment, surfaces, lights, first })
    }

    /// The environment's radiance.
    #[must_use]
    pub fn environment(&self) -> f64 {
        self.environment
    }

    /// The surfaces.
    #[must_use]
    pub fn surfaces(&self) -> &[Surface] {
        &self.surfaces
    }

    /// The lights.
    #[must_use]
    pub fn lights(&self) -> &[Light] {
        &self.lights
    }

    /// All numbers: of every surface its curve's and its optics', of every light, and the environment's.
    #[must_use]
    pub fn numbers(&self) -> Vec<f64> {
        let surfaces = self.surfaces.iter().flat_map(|s| [s.curve.numbers(), s.optics.numbers()]);
        let lights = self.lights.iter().map(Light::numbers);
        surfaces.chain(lights).flatten().chain([self.environment]).collect()
    }

    /// Index of the first number of a surface among all [`numbers`](Self::numbers).
    ///
    /// # Panics
    /// If there is no such surface.
    #[must_use]
    pub fn first_of_surface(&self, surface: usize) -> usize {
        assert!(surface < self.surfaces.len(), "no surface {surface}");
        self.first[surface]
    }

    /// Index of the first number of a light among all [`numbers`](Self::numbers).
    ///
    /// # Panics
    /// If there is no such light.
    #[must_use]
    pub fn first_of_light(&self, light: usize) -> usize {
        self.first[self.surfaces.len()..][light]
    }

    /// The world with other [`numbers`](Self::numbers).
    ///
    /// # Errors
    /// A [`ChainError`] if their number is another one, or the world that results is invalid.
    pub fn with(&self, numbers: &[f64]) -> Result<Self, ChainError> {
        let expected = self.first[self.first.len() - 1] + 1;
        if numbers.len() != expected {
            return Err(ChainError::Numbers { expected, found: numbers.len() });
        }
        let of = |i: usize| &numbers[self.first[i]..self.first[i + 1]];
        let surface = |(i, s): (usize, &Surface)| Surface {
            curve: s.curve.with(of(i)),
            optics: s.optics.with(&of(i)[s.curve.numbers().len()..]),
        };
        let surfaces: Vec<Surface> = self.surfaces.iter().enumerate().map(surface).collect();
        let lights = self.lights.iter().enumerate().map(|(i, l)| l.with(of(surfaces.len() + i)));
        Self::new(numbers[expected - 1], surfaces.clone(), lights.collect())
    }
}

/// A conversion of the numbers of a world and its camera to constants, or to numbers with derivatives.
pub(crate) trait Source {
    /// Their type.
    type Number: Number;

    /// Numbers with consecutive indices, given their values. The camera's follow the world's.
    fn numbers<const K: usize>(&self, first: usize, values: [f64; K]) -> [Self::Number; K];
}

/// Constants.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constants;

impl Source for Constants {
    type Number = f64;

    fn numbers<const K: usize>(&self, _: usize, values: [f64; K]) -> [f64; K] {
        values
    }
}

impl World {
    pub(super) fn curve<S: Source>(&self, source: &S, surface: usize) -> Curve<S::Number> {
        let first = self.first[surface];
        match self.surfaces[surface].curve {
            Curve::Segment([a, b]) => {
                let [ax, ay, bx, by] = source.numbers(first, [a.x, a.y, b.x, b.y]);
                Curve::Segment([Vec2::new(ax, ay), Vec2::new(bx, by)])
            }
            Curve::Arc { centre, radius, start, extent } => {
                let numbers: [f64; MOST] = [centre.x, centre.y, radius, start, extent];
                let [x, y, radius, start, extent] = source.numbers(first, numbers);
                Curve::Arc { centre: Vec2::new(x, y), radius, start, extent }
            }
        }
    }

    pub(super) fn optics<S: Source>(&self, source: &S, surface: usize) -> Optics<S::Number> {
        let Surface { curve, optics } = &self.surfaces[surface];
        let first = self.first[surface] + if matches!(curve, Curve::Segment(_)) { 4 } else { MOST };
        match *optics {
            Optics::Diffuse { reflectance, emission: [a, b], opacity } => {
                let [reflectance, a, b, opacity] = source.numbers(first, [reflectance, a, b, opacity]);
                Optics::Diffuse { reflectance, emission: [a, b], opacity }
            }
            Optics::Mirror { reflectance } => {
                let [reflectance] = source.numbers(first, [reflectance]);
                Optics::Mirror { reflectance }
            }
            Optics::Glass { index } => {
                let [index] = source.numbers(first, [index]);
                Optics::Glass { index }
            }
        }
    }

    pub(super) fn light<S: Source>(&self, source: &S, light: usize) -> Light<S::Number> {
        let first = self.first[self.surfaces.len() + light];
        match self.lights[light] {
            Light::Point { position, intensity } => {
                let [x, y, intensity] = source.numbers(first, [position.x, position.y, intensity]);
                Light::Point { position: Vec2::new(x, y), intensity }
            }
            Light::Directional { angle, irradiance } => {
                let [angle, irradiance] = source.numbers(first, [angle, irradiance]);
                Light::Directional { angle, irradiance }
            }
        }
    }

    pub(super) fn sky<S: Source>(&self, source: &S) -> S::Number {
        let [environment] = source.numbers(self.first[self.first.len() - 1], [self.environment]);
        environment
    }

    /// Number of the world's own numbers.
    pub(crate) fn count(&self) -> usize {
        self.first[self.first.len() - 1] + 1
    }
}
