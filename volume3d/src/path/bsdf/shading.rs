//! Shading data of a point, and the results of sampling.

use flatland::calculus::{Number, Rgb, Vec3};
use glam::DVec3;

use crate::optics::Coating;
use crate::scene::{Bsdf, Principled, PrincipledThin};

/// A shading point: all inputs of the BSDF.
#[derive(Clone, Debug)]
pub(crate) struct Shading<'s, T> {
    pub(crate) bsdf: &'s Bsdf,
    /// Transmittance of the coating, if it has one.
    pub(crate) coating: Option<&'s Coating>,
    /// Normal on the viewer's side.
    pub(crate) normal: Vec3<T>,
    pub(crate) viewer: Vec3<T>,
    pub(crate) reflectance: Rgb<T>,
    /// Roughness α of microfacets along u.
    pub(crate) roughness: T,
    /// Roughness α of microfacets orthogonal to u, if they are anisotropic.
    pub(crate) across: T,
    /// Parameters of a principled BSDF at the point.
    pub(crate) numbers: Option<Box<Numbers<T>>>,
    /// Unit tangent of the anisotropy's first axis (u); `None` if isotropic.
    pub(crate) along: Option<Vec3<T>>,
    /// Whether the viewer is behind a transmissive surface.
    pub(crate) behind: bool,
    /// Opacity, if not 1.
    pub(crate) opacity: Option<T>,
    /// Whether the opaque part is black.
    pub(crate) black: bool,
    /// The geometric normal on the viewer's side, if `normal` is tilted: no light arrives from between the
    /// two horizons.
    pub(crate) beneath: Option<Vec3<T>>,
    /// The material it is mixed with, if any.
    pub(crate) blend: Option<Box<Mixed<'s, T>>>,
}

/// The second part of a mixture at a point.
#[derive(Clone, Debug)]
pub(crate) struct Mixed<'s, T> {
    pub(crate) other: Shading<'s, T>,
    /// Its weight, in [0, 1].
    pub(crate) weight: T,
}

/// Parameters of a principled BSDF at a point.
#[derive(Clone, Debug)]
pub(crate) enum Numbers<T> {
    Solid(Principled<T>),
    Thin(PrincipledThin<T>),
}

/// A direction and its density by solid angle.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Sampled {
    pub(crate) direction: DVec3,
    pub(crate) density: f64,
}

/// The single direction of an ideal boundary, and its factor on radiance, divided by the probability of its
/// choice.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Ideal<T> {
    pub(crate) branch: Branch,
    pub(crate) direction: Vec3<T>,
    pub(crate) factor: Rgb<T>,
}

/// One of the ideal directions of a material.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Branch {
    /// Whether it belongs to the second part of a mixture.
    pub(crate) is_of_other: bool,
    pub(crate) passage: Passage,
}

/// What happens to a ray at an ideal boundary.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Passage {
    /// It is mirrored.
    Mirrored,
    /// It is refracted, or passes a thin plate.
    Refracted,
    /// It passes straight through the opacity mask.
    Unhindered,
}

impl Passage {
    /// The branch of a material that is not a mixture, or of the first part of one.
    pub(super) const fn alone(self) -> Branch {
        Branch { is_of_other: false, passage: self }
    }
}

/// A sampled continuation of a path.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Bounce<T> {
    Smooth(Sampled),
    Ideal(Ideal<T>),
}

impl<T: Number> Mixed<'_, T> {
    /// Probability of sampling the second part: about its weight, but bounded away from 0 and 1, as a weight
    /// of 0 may have a derivative.
    pub(super) fn part(&self) -> f64 {
        const LEAST: f64 = 0.05;
        LEAST + (1.0 - 2.0 * LEAST) * self.weight.value().clamp(0.0, 1.0)
    }
}
