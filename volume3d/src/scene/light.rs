//! Light that does not come from surfaces. Surfaces that emit are shapes with a radiance.

use glam::{DMat3, DVec3};

/// A light without a surface.
#[derive(Clone, Debug, PartialEq)]
pub enum Light {
    /// A distant light with a von Mises–Fisher lobe: radiance E κ e^{−κ(1 − ω·ω₀)}/(2π(1 − e^{−2κ})) from
    /// direction ω. As κ grows it becomes parallel light, which no warp can differentiate and which is
    /// refused with geometric parameters; with finite κ it casts soft shadows, which a warp can see.
    Directional {
        /// Its name in messages and requests.
        id: String,
        /// Where the light travels to, unit length: −ω₀.
        direction: DVec3,
        /// E, the irradiance on a surface that faces it.
        irradiance: DVec3,
        /// κ; infinite for parallel light.
        kappa: f64,
    },
    /// Light from one point, the same in all directions.
    Point {
        /// Its name in messages and requests.
        id: String,
        /// Where it is.
        position: DVec3,
        /// Power per solid angle.
        intensity: DVec3,
    },
    /// Light from one point within a cone.
    Spot {
        /// Its name in messages and requests.
        id: String,
        /// Where it is.
        position: DVec3,
        /// A rotation; its z axis is the cone's.
        to_world: DMat3,
        /// Power per solid angle in the middle.
        intensity: DVec3,
        /// The half angle beyond which there is none, in radians below π/2.
        cutoff: f64,
        /// The half angle up to which there is all, in radians; between the two, intensity falls linearly with the angle.
        beam: f64,
        /// A factor by direction, by the texture's index in the scene: (u, v) = ½ + (x, y)/(2 z tan cutoff).
        texture: Option<usize>,
    },
    /// Light from one point through a slide: the intensity π E/cos³θ lights a screen across the axis evenly with E = 1/π at
    /// distance 1, but for its own cosine.
    Projector {
        /// Its name in messages and requests.
        id: String,
        /// Where it is.
        position: DVec3,
        /// A rotation; its z axis is that of the beam, its x axis points to the left of the slide.
        to_world: DMat3,
        /// E, or a factor on the slide.
        intensity: DVec3,
        /// The angle over the width of the slide, in radians.
        field_of_view: f64,
        /// Its width over its height.
        aspect: f64,
        /// The slide, by the texture's index in the scene; nothing is clear.
        texture: Option<usize>,
    },
}

impl Light {
    /// Its name in messages and requests.
    #[must_use]
    pub fn id(&self) -> &String {
        match self {
            Self::Directional { id, .. }
            | Self::Point { id, .. }
            | Self::Spot { id, .. }
            | Self::Projector { id, .. } => id,
        }
    }

    /// The same elsewhere.
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

    /// Its irradiance or intensity: what it is scaled by.
    #[must_use]
    pub fn power(&self) -> DVec3 {
        match self {
            Self::Directional { irradiance: power, .. }
            | Self::Point { intensity: power, .. }
            | Self::Spot { intensity: power, .. }
            | Self::Projector { intensity: power, .. } => *power,
        }
    }

    /// The same, to be changed.
    pub(crate) fn power_mut(&mut self) -> &mut DVec3 {
        match self {
            Self::Directional { irradiance: power, .. }
            | Self::Point { intensity: power, .. }
            | Self::Spot { intensity: power, .. }
            | Self::Projector { intensity: power, .. } => power,
        }
    }

    /// The texture that it looks up, by its index in the scene.
    pub(crate) fn texture(&self) -> Option<usize> {
        match self {
            Self::Spot { texture, .. } | Self::Projector { texture, .. } => *texture,
            Self::Directional { .. } | Self::Point { .. } => None,
        }
    }

    /// Whether it is one point or one direction, whose shadows have no penumbra.
    #[must_use]
    pub fn is_delta(&self) -> bool {
        !matches!(self, Self::Directional { kappa, .. } if kappa.is_finite())
    }
}

/// What is seen where a ray leaves the scene.
#[derive(Clone, Debug, PartialEq)]
pub enum Environment {
    /// The same radiance in every direction.
    Constant {
        /// Its name in messages and requests.
        id: String,
        /// The radiance.
        radiance: DVec3,
    },
    /// A longitude–latitude map: u = atan2(x, −z)/2π, v = acos(y)/π from the top, in the map's own frame.
    /// Between texels it is bilinear: column i is at u = (i + ½)/width, periodically, and row j at v =
    /// j/(height − 1), the first and the last at the poles.
    Map {
        /// Its name in messages and requests.
        id: String,
        /// The texture's index in the scene.
        texture: usize,
        /// A factor on the whole.
        scale: f64,
        /// From the map's frame to the world's; a rotation.
        to_world: DMat3,
    },
}
