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
}

impl Light {
    /// Its name in messages and requests.
    #[must_use]
    pub fn id(&self) -> &String {
        match self {
            Self::Directional { id, .. } | Self::Point { id, .. } => id,
        }
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
