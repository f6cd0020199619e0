//! Material parameters that may be textured.

use glam::DVec3;

/// A surface's reflectance, linear RGB.
#[derive(Clone, Debug, PartialEq)]
pub enum Reflectance {
    /// Constant colour.
    Constant(DVec3),
    /// A texture, by its index in the scene.
    Texture(usize),
}

/// A scalar parameter of a material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Value {
    /// Constant number.
    Constant(f64),
    /// The luminance of a texture, by its index in the scene.
    Texture(usize),
}

impl From<f64> for Value {
    fn from(value: f64) -> Self {
        Self::Constant(value)
    }
}

impl Value {
    /// The value, if it is constant.
    #[must_use]
    pub fn constant(&self) -> Option<f64> {
        match *self {
            Self::Constant(value) => Some(value),
            Self::Texture(_) => None,
        }
    }

    pub(crate) fn constant_mut(&mut self) -> Option<&mut f64> {
        match self {
            Self::Constant(value) => Some(value),
            Self::Texture(_) => None,
        }
    }

    /// Whether it may differ from a value somewhere.
    pub(crate) fn may_differ_from(&self, value: f64) -> bool {
        *self != Self::Constant(value)
    }
}
