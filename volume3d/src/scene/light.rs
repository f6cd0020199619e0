//! Lights without a surface. Emitting surfaces are shapes with a radiance.

use glam::{DMat3, DVec3};

/// A light without a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A distant light with a von Mises–Fisher lobe: radiance E κ e^{−κ(1 − ω·ω₀)}/(2π(1 − e^{−2κ})) from
    /// direction ω. As κ → ∞ it becomes parallel light, which no warp can differentiate and which is refused
    /// with geometric parameters; with finite κ it has soft shadows, which a warp supports.
    Directional {
        /// Name in messages and queries.
        id: String,
        /// Direction in which the light travels, unit length: −ω₀.
        direction: DVec3,
        /// E, the irradiance on a surface orthogonal to it.
        irradiance: DVec3,
        /// κ; infinite for parallel light.
        kappa: f64,
    },
    /// An isotropic point light.
    Point {
        /// Name in messages and queries.
        id: String,
        /// Position.
        position: DVec3,
        /// Power per solid angle.
        intensity: DVec3,
    },
    /// A spot light.
    Spot {
        /// Name in messages and queries.
        id: String,
        /// Position.
        position: DVec3,
        /// A rotation; its z axis is the axis of the cone.
        to_world: DMat3,
        /// Power per solid angle on the axis.
        intensity: DVec3,
        /// Half angle beyond which the intensity is 0, in radians below π/2.
        cutoff: f64,
        /// Half angle up to which the intensity is full, in radians; between the two it falls linearly with
        /// the angle.
        beam: f64,
        /// Index of a texture that multiplies the intensity by direction: (u, v) = ½ + (x, y)/(2 z tan
        /// cutoff).
        texture: Option<usize>,
    },
    /// A projector: a point light through a slide. The intensity π E/cos³θ illuminates a screen orthogonal to
    /// the axis uniformly with E = 1/π at distance 1, apart from the screen's own cosine.
    Projector {
        /// Name in messages and queries.
        id: String,
        /// Position.
        position: DVec3,
        /// A rotation; its z axis is the beam's axis, its x axis points to the left of the slide.
        to_world: DMat3,
        /// E, or a factor on the slide.
        intensity: DVec3,
        /// Angle of view over the width of the slide, in radians.
        field_of_view: f64,
        /// Width of the slide divided by its height.
        aspect: f64,
        /// Index of the slide's texture; `None` for a clear one.
        texture: Option<usize>,
    },
}

impl Light {
    /// Name in messages and queries.
    #[must_use]
    pub fn id(&self) -> &String {
        match self {
            Self::Directional { id, .. }
            | Self::Point { id, .. }
            | Self::Spot { id, .. }
            | Self::Projector { id, .. } => id,
        }
    }

    /// The light translated.
    pub(super) fn moved(&self, by: DVec3) -> Self {
        let mut light = self.clone();
        match &mut light {
            Self::Directional { .. } => {}
            Self::Point { position, .. } | Self::Spot { position, .. } | Self::Projector { position, .. } => {
                *position += by;
            }
        }
        light
    }

    /// Its irradiance or intensity.
    #[must_use]
    pub fn power(&self) -> DVec3 {
        match self {
            Self::Directional { irradiance: power, .. }
            | Self::Point { intensity: power, .. }
            | Self::Spot { intensity: power, .. }
            | Self::Projector { intensity: power, .. } => *power,
        }
    }

    /// Mutable [`power`](Self::power).
    pub(crate) fn power_mut(&mut self) -> &mut DVec3 {
        match self {
            Self::Directional { irradiance: power, .. }
            | Self::Point { intensity: power, .. }
            | Self::Spot { intensity: power, .. }
            | Self::Projector { intensity: power, .. } => power,
        }
    }

    /// Index of its texture.
    pub(crate) fn texture(&self) -> Option<usize> {
        match self {
            Self::Spot { texture, .. } | Self::Projector { texture, .. } => *texture,
            Self::Directional { .. } | Self::Point { .. } => None,
        }
    }

    /// Whether it is a single point or direction, whose shadows have no penumbra.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        !matches!(self, Self::Directional { kappa, .. } if kappa.is_finite())
    }
}

/// Radiance of rays that leave the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// Uniform radiance from every direction.
    Constant {
        /// Name in messages and queries.
        id: String,
        /// The radiance.
        radiance: DVec3,
    },
    /// A longitude–latitude map: u = atan2(x, −z)/2π, v = acos(y)/π from the top, in the map's own frame.
    /// Bilinear between texels: column i is at u = (i + ½)/width, periodically, and row j at
    /// v = j/(height − 1), the first and the last at the poles.
    Map {
        /// Name in messages and queries.
        id: String,
        /// Index of the texture.
        texture: usize,
        /// Factor on the whole map.
        scale: f64,
        /// Rotation from the map's frame to the world's.
        to_world: DMat3,
    },
}
